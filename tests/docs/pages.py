"""The project's pages, and the commands in them."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = (
    "README.md",
    "pipeline/README.md",
    "runs/FIRST_HOUR.md",
    "runs/MILLION.md",
    "runs/ON_YOUR_ROBOT.md",
    "runs/README.md",
    "runs/SPEED.md",
    "schemas/README.md",
    "stages/README.md",
)

# Commands that the tests run in another form, and why. Every other one runs as it stands, on a
# run so small that it is already made.
REDUCED = {
    "make test": ("make -n test", "these tests are part of it"),
    "make bench": ("make -n bench", "minutes of measuring; its parts have tests of their own"),
    "make regress": (
        "make -n regress",
        "the reference is of run ci and a tiny one stands in its place; tests/regression runs it",
    ),
    "ATEN_CPU_CAPABILITY=default ONEDNN_MAX_CPU_ISA=SSE41 NUMBA_CPU_NAME=generic"
    " make regress AFRESH=embree": (
        "make -n regress AFRESH=embree",
        "CI runs it",
    ),
    "make train RUN=first MESH_DIR=meshes": (
        "make -n train RUN=first MESH_DIR=meshes",
        "the test's folder holds three meshes; README's commands train run ci from nothing",
    ),
    "make train RUN=copies-0 MESH_DIR=meshes": (
        "make -n train RUN=copies-0 MESH_DIR=meshes",
        "a training of minutes",
    ),
    "grep val_mae runs/copies-0/train.summary.json": (
        "grep 'stretched_copies = 0' runs/copies-0/run.toml",
        "the training before it is not run",
    ),
    "make real FRAMES=runs/pictures": (
        "make -n real FRAMES=runs/pictures",
        "tests/stages/test_real.py runs it on smaller frames",
    ),
    "make live BAG=drive.mcap": (
        "make -n live BAG=drive.mcap",
        "tests/stages/test_live.py runs it on a bag of its own",
    ),
    "make robot DRIVER=my_robot.py CALIBRATION=cell.json attempts=20": (
        "make -n robot DRIVER=my_robot.py CALIBRATION=cell.json attempts=20",
        "it needs a robot; tests/robot/test_robot.py runs it on a fake one",
    ),
    "make board RUN=ci POSES=board/poses.json CALIBRATION=board/cell.json square_mm=30": (
        "make -n board RUN=ci POSES=board/poses.json CALIBRATION=board/cell.json square_mm=30",
        "it needs pictures; tests/robot/test_board.py draws some",
    ),
    ".venv/bin/python -m pipeline.benchmarks.watching million watched.jsonl": (
        ".venv/bin/python -m pipeline.benchmarks.watching --help",
        "an hour; tests/benchmarks/test_watching.py watches a command of its own",
    ),
    ".venv/bin/python -m pipeline.benchmarks.watching ten_million watched.jsonl": (
        ".venv/bin/python -m pipeline.benchmarks.watching --help",
        "half an hour; tests/benchmarks/test_watching.py watches a command of its own",
    ),
    ".venv/bin/python -m pipeline.benchmarks.memory_picture watched.jsonl memory.svg": (
        ".venv/bin/python -m pipeline.benchmarks.memory_picture --help",
        "it draws what the command before it writes; tests/benchmarks/test_watching.py draws",
    ),
    ".venv/bin/python -m pipeline.benchmarks.steps runs/duel level6-test-00": (
        ".venv/bin/python -c 'import pipeline.benchmarks.steps'",
        "minutes, on a run of an hour; tests/benchmarks/test_steps.py adds up a profile",
    ),
    ".venv/bin/python -m pipeline.benchmarks.mesh_size": (
        ".venv/bin/python -c 'import pipeline.benchmarks.mesh_size'",
        "a minute of measuring; tests/benchmarks/test_mesh_size.py measures small meshes",
    ),
    ".venv/bin/python -m pipeline.benchmarks.mesh_size runs/duel level6-test-00": (
        ".venv/bin/python -c 'import pipeline.benchmarks.mesh_size'",
        "minutes, on a run of an hour; tests/benchmarks/test_mesh_size.py measures small meshes",
    ),
    ".venv/bin/python -m pipeline.benchmarks.mesh_size runs/bench level1-train-00": (
        ".venv/bin/python -c 'import pipeline.benchmarks.mesh_size'",
        "minutes, on run bench; tests/benchmarks/test_mesh_size.py measures small meshes",
    ),
    "make calibrate RUN=ci": (
        "make -n calibrate RUN=ci",
        "the tiny run has too few samples; tests/stages/test_calibrate.py runs it",
    ),
    "make status RUN=ci EXECUTOR=ray": (
        "make -n status RUN=ci EXECUTOR=ray",
        "it needs a cluster; tests/stages/test_cluster.py runs it on one",
    ),
    "make referee RUN=unseen MESH_DIR=meshes": (
        "make -n referee RUN=unseen MESH_DIR=meshes",
        "half an hour; tests/stages/test_referee.py judges a few grasps",
    ),
    "make review RUN=ci STAGE=grasps": (
        "make -n review RUN=ci STAGE=grasps",
        "it ends when its viewer is closed; tests/stages/test_review.py opens it",
    ),
}


def blocks_of(page: str, language: str = "sh") -> list[str]:
    """The fenced blocks of a page in a language."""
    text = (ROOT / page).read_text()
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


def as_run(block: str) -> str:
    """A block as the tests run it."""
    lines = (line.partition("  #")[0].rstrip() for line in block.splitlines())
    return "\n".join(REDUCED[line][0] if line in REDUCED else line for line in lines)
