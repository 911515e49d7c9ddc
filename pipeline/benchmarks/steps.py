"""What each step of labelling takes in this commit and in an older one, side by side.

`python -m pipeline.benchmarks.steps runs/bench level1-test-00` profiles both on one clutter.
"""

import json
import pstats
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

from pipeline.benchmarks.commits import OLDER, TURNS, ask, plain_scene, read_clutter, sides_of
from pipeline.geometry.mesh import Mesh
from pipeline.world.scene import ClutterScene

# Functions that a step consists of, in either commit; what one calls counts as its own.
STEPS: Mapping[str, tuple[str, ...]] = {
    "everything": ("asked.py label",),
    "surfaces and Embree's tree": (
        "grasps.py ray_scene",
        "scene.py scene_surfaces",
        "raycasting.py _embree",
    ),
    "points and normals of pictures": ("grasps.py visible_surface", "scene.py visible_surface"),
    "proposals": ("sampling.py propose", "sampling.py propose_nearby"),
    "normals, of proposals": ("sampling.py mean_normals",),
    "heights": ("heights.py pad_heights",),
    "draping": ("draping.py drape_into",),
    "wrench": ("labelling.py assemble_into", "batch.py assemble_into"),
    "QP": ("structured.py solve_into",),
    "noise": ("depth_noise.py disturb",),
    "sub clouds": ("grasps.py with_clouds", "scene.py add_clouds"),
    "balancing": ("balancing.py balance_labels", "balancing.py proposal_weights"),
    "all but surfaces and writing": ("grasps.py synthesize", "scene.py label_scene"),
}


def steps_of_both(
    scene: ClutterScene, meshes: Mapping[str, Mesh], turns: int
) -> dict[str, dict[str, float]]:
    """Commit → step → processor time of labelling a clutter [ms], the least of some turns.

    Parameters
    ----------
    scene
        What both label, scene to shard.
    meshes
        Surface of each object by its name [m].
    turns
        How often each labels it, in turn, after once to compile.

    Returns
    -------
    A profiler's times: calls of Python are dearer in it, compiled code is not.

    Raises
    ------
    subprocess.CalledProcessError
        The history lacks the older commit.
    """
    found: dict[str, list[dict[str, float]]] = {OLDER: [], "this": []}
    with tempfile.TemporaryDirectory() as scratch, ExitStack() as stack:
        sides = sides_of(plain_scene(scene, meshes), Path(scratch), stack)
        file = Path(scratch) / "profile"
        for _ in range(1 + turns):
            for name, side in zip(found, sides, strict=True):
                ask(side, f"profile {file}")
                found[name].append(step_ms(pstats.Stats(str(file))))
    return {name: least(each[1:]) for name, each in found.items()}


def step_ms(stats: pstats.Stats) -> dict[str, float]:
    """Step → processor time [ms] by a profile of `label`."""
    spent: dict[str, float] = {}
    for (file, _, function), (*_, seconds, _) in stats.stats.items():  # type: ignore[attr-defined]
        named = f"{Path(file).name} {function}"
        spent[named] = spent.get(named, 0.0) + seconds
    return {
        step: 1e3 * sum(spent.get(name, 0.0) for name in names) for step, names in STEPS.items()
    }


def least(turns: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """The least time of each step [ms]."""
    return {step: round(min(turn[step] for turn in turns), 1) for step in STEPS}


if __name__ == "__main__":
    clutter, surfaces = read_clutter(Path(sys.argv[1]), sys.argv[2])
    sys.stdout.write(json.dumps(steps_of_both(clutter, surfaces, TURNS), indent=1) + "\n")
