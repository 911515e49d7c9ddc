"""Times faster than an older commit: both label the same scene and solve the same QPs, in turn."""

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
from loguru import logger

from pipeline.benchmarks import asked
from pipeline.geometry.mesh import Mesh
from pipeline.gripper.problem import QualityProblem
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.world.scene import ClutterScene

OLDER = "19217de"  # as labelling was before its steps were made faster
TURNS = 3  # each commit's; ratios are medians over them
PROBLEMS = 600  # of all kinds, in a file of some 20 MB


def against_older(
    scene: ClutterScene, meshes: Mapping[str, Mesh], problems: list[QualityProblem]
) -> dict[str, object]:
    """How many times as fast as commit 19217de labels are made and QPs are solved.

    Parameters
    ----------
    scene
        What both label, scene to shard, noise drawn once.
    meshes
        Surface of each object by its name [m].
    problems
        What both solve: some of these, evenly taken.

    Returns
    -------
    Ratios of processor time by their names in bench.json; none where the history lacks the commit,
    as in a source archive or a shallow clone.
    """
    few = problems[:: -(-len(problems) // PROBLEMS)]
    ratios = compare(plain(scene, meshes, few), ("label", "solve"))
    names = {"label": f"labelling_vs_{OLDER}", "solve": f"qp_vs_{OLDER}"}
    return {names[question]: round(ratio, 2) for question, ratio in ratios.items()}


def compare(given: asked.Plain, questions: Sequence[str]) -> dict[str, float]:
    """How many times as fast as commit 19217de each question is answered.

    Parameters
    ----------
    given
        What both sides are given.
    questions
        "label", and "solve" where problems are given.

    Returns
    -------
    Question → ratio of processor time; empty where the history lacks the commit.
    """
    if not in_history(Path(__file__).parents[2], OLDER):
        logger.warning("No comparison with commit {}: it is not in this folder's history", OLDER)
        return {}
    with tempfile.TemporaryDirectory() as scratch, ExitStack() as stack:
        sides = sides_of(given, Path(scratch), stack)
        return {question: turns(sides, question) for question in questions}


def sides_of(given: asked.Plain, scratch: Path, stack: ExitStack) -> list["subprocess.Popen[str]"]:
    """Processes that answer by the older commit and by this one, until the stack is closed."""
    root, file = Path(__file__).parents[2], scratch / "given.pickle"
    file.write_bytes(pickle.dumps(given))
    checkout = stack.enter_context(worktree(root, OLDER, scratch / "older"))
    return [
        stack.enter_context(asking(checkout, file, "older")),
        stack.enter_context(asking(root, file, "this")),
    ]


def in_history(root: Path, commit: str) -> bool:
    """Whether a folder is a checkout whose history has a commit."""
    asked_git = ["git", "-C", str(root), "cat-file", "-e", f"{commit}^{{commit}}"]
    try:
        return subprocess.run(asked_git, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:  # no git
        return False


@contextmanager
def worktree(root: Path, commit: str, path: Path) -> Iterator[Path]:
    """A checkout of a commit, taken away again."""
    git = ["git", "-C", str(root), "worktree"]
    add = [*git, "add", "--detach", str(path), commit]
    subprocess.run(add, check=True, capture_output=True)
    try:
        yield path
    finally:
        remove = [*git, "remove", "--force", str(path)]
        subprocess.run(remove, check=True, capture_output=True)


@contextmanager
def asking(checkout: Path, given: Path, side: str) -> Iterator["subprocess.Popen[str]"]:
    """A process that answers by the code of a checkout, on one core."""
    core = min(os.sched_getaffinity(0))
    process = subprocess.Popen(
        [sys.executable, asked.__file__, str(given), side],
        cwd=checkout,
        env=os.environ | {"PYTHONPATH": str(checkout)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    os.sched_setaffinity(process.pid, {core})
    with process:
        yield process
        if process.stdin is not None:
            process.stdin.close()


def turns(sides: list["subprocess.Popen[str]"], question: str) -> float:
    """Median over turns of the older side's seconds over the other's, after one to compile."""
    seconds = np.array([[ask(side, question) for side in sides] for _ in range(1 + TURNS)])[1:]
    return float(np.median(seconds[:, 0] / seconds[:, 1]))


def ask(side: "subprocess.Popen[str]", question: str) -> float:
    """Seconds that a process says it took."""
    if side.stdin is None or side.stdout is None:
        raise ValueError("the process was started without pipes")
    side.stdin.write(f"{question}\n")
    side.stdin.flush()
    return float(side.stdout.readline())


def plain(
    scene: ClutterScene, meshes: Mapping[str, Mesh], problems: list[QualityProblem]
) -> asked.Plain:
    """What both sides are given, as arrays and plain values."""
    most = max(problem.wrench_matrix.shape[1] for problem in problems)
    counts = np.array([problem.wrench_matrix.shape[1] for problem in problems])
    matrices = np.zeros((len(problems), 4, most))
    for matrix, problem, count in zip(matrices, problems, counts, strict=True):
        matrix[:, :count] = problem.wrench_matrix
    first = max(problems, key=lambda problem: problem.vacuum_force)  # the limits are its multiples
    return plain_scene(scene, meshes) | {
        "problems": {
            "matrices": matrices,
            "counts": counts,
            "forces": np.array([problem.vacuum_force for problem in problems]),
            "setting": (
                first.lower / first.vacuum_force,
                first.upper / first.vacuum_force,
                first.target,
                first.scale,
                first.weight_spread,
                first.max_iterations,
            ),
        },
    }


def read_clutter(run: Path, scene_id: str) -> tuple[ClutterScene, dict[str, Mesh]]:
    """A clutter of a run's folder, and the surface of each object of the run by its name [m]."""
    scene = next(one for one in read_scenes(run / "scenes.mcap") if one.scene_id == scene_id)
    objects = read_objects(run / "objects.mcap")
    return scene, {name: item.mesh for name, (item, _) in objects.items()}


def plain_scene(scene: ClutterScene, meshes: Mapping[str, Mesh]) -> asked.Plain:
    """A scene and the meshes of its objects, as arrays and plain values."""
    names = ("scene_id", "level", "split", "seed", "gaps_m", "contacts", "settle_time_s")
    return {
        # Training scenes may draw noise several times, others draw it once.
        "scene": {name: getattr(scene, name) for name in names} | {"split": "test"},
        "objects": [vars(item) for item in scene.objects],
        "views": [vars(view) | {"camera": vars(view.camera)} for view in scene.views],
        "meshes": {
            item.object_name: (
                np.array(meshes[item.object_name].vertices_m),
                np.array(meshes[item.object_name].faces),
            )
            for item in scene.objects
        },
    }
