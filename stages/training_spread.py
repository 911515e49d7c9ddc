"""How far trainings of run `ci` end apart: five seeds under each instruction set.

`python -m stages.training_spread` writes `tests/regression/training_spread.json`, which gives
`make regress` its bounds. It takes about a quarter of an hour on two idle cores and goes on where
it was stopped. Labels are made anew under each instruction set, from the run's own pictures.
"""

import os
import platform
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.artifacts import open_artifact
from pipeline.errors import SoftgripError
from pipeline.execution import RunFolder, run_command
from pipeline.regression.kernels import INSTRUCTION_SETS
from pipeline.regression.spread import Training, write_spread
from schemas.softgrip.v1.evaluation_pb2 import LevelResult
from schemas.softgrip.v1.training_pb2 import Epoch, TrainingResult
from stages.graph import RUNS_DIR

SPREAD = Path("tests/regression/training_spread.json")
SEEDS = 5  # trainings an instruction set: enough to see their spread


def main(
    run: Annotated[str, typer.Option(help="a finished run")] = "ci",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
    work: Annotated[Path, typer.Option(help="folder for the trainings")] = Path("runs/spread"),
    output: Annotated[Path, typer.Option(help="where the measured spread goes")] = SPREAD,
    workers: Annotated[int, typer.Option(help="worker processes of a stage")] = 2,
) -> None:
    """Train and judge each network, those already there excepted, and write what was measured."""
    source = RunFolder(runs_dir / run)
    trainings = []
    for instructions in INSTRUCTION_SETS:
        labelled = relabelled(source, work / instructions / run, instructions, workers)
        for seed in range(1, SEEDS + 1):
            folder = trained(labelled, work / instructions / f"seed{seed}", seed, workers)
            trainings.append(measured(folder, instructions, seed))
            logger.info("{}, seed {}: {:.4f}", instructions, seed, trainings[-1].test_error)
    measured_by = {
        "command": "python -m stages.training_spread",
        "processor": processor(),
        "torch": version("torch"),
        "closed loop": "policy closed-loop alone, seed of the training",
    }
    write_spread(output, measured_by, trainings)


def relabelled(source: RunFolder, path: Path, instructions: str, workers: int) -> RunFolder:
    """The run's grasps and shards, made under an instruction set."""
    folder = RunFolder(path)
    if not folder.artifact("shards").is_file():
        path.mkdir(parents=True, exist_ok=True)
        for file in (source.config, source.artifact("objects"), source.artifact("scenes")):
            shutil.copy(file, path / file.name)
        shutil.copytree(source.shards("scenes"), folder.shards("scenes"))
        for stage in ("grasps", "shards"):
            run_under(instructions, stage, folder, workers)
    return folder


def trained(labelled: RunFolder, path: Path, seed: int, workers: int) -> RunFolder:
    """A network trained and judged with a seed of its own on the same shards."""
    folder, instructions = RunFolder(path), path.parent.name
    if not folder.artifact("train").is_file():
        shutil.copytree(labelled.path, path, ignore=shutil.ignore_patterns(".state", "grasps*"))
        folder.config.write_text(with_seed(labelled.config.read_text(), seed))
        run_under(instructions, "train", folder, workers)
    if not folder.artifact("evaluate").is_file():
        run_under(instructions, "evaluate", folder, workers)
    return folder


def with_seed(text: str, seed: int) -> str:
    """A configuration with another seed, and one policy judged."""
    lines = [line for line in text.splitlines() if not line.startswith(("seed", "policies"))]
    at = lines.index("[evaluate]") + 1
    lines.insert(at, 'policies = ["closed-loop"]')
    return "\n".join([f"seed = {seed}", *lines, ""])


def run_under(instructions: str, stage: str, folder: RunFolder, workers: int) -> None:
    """Run a stage in a process that takes an instruction set.

    Parameters
    ----------
    instructions
        Name of the instruction set.
    stage
        Stage that is run.
    folder
        The run.
    workers
        Worker processes.

    Raises
    ------
    SoftgripError
        It failed.
    """
    done = subprocess.run(
        [
            *(sys.executable, "-m", f"stages.{stage}", "--run", folder.path.name),
            *("--runs-dir", str(folder.path.parent), "--workers", str(workers)),
        ],
        env=os.environ | INSTRUCTION_SETS[instructions],
        check=False,
    )
    if done.returncode != 0:
        raise SoftgripError(
            f"stage {stage} failed in {folder.path}", "Read its log there, mend it, and run again"
        )


def measured(folder: RunFolder, instructions: str, seed: int) -> Training:
    """What a finished training and its closed loop came to."""
    with open_artifact(folder.artifact("train")) as artifact:
        epochs = [message for _, message in artifact.messages(Epoch)]
        result = artifact.one(TrainingResult)
    with open_artifact(folder.artifact("evaluate")) as artifact:
        levels = [message for _, message in artifact.messages(LevelResult, "/levels")]
    return Training(
        instructions=instructions,
        seed=seed,
        training_error=[round(epoch.train_mae, 6) for epoch in epochs],
        validation_error=[round(epoch.val_mae, 6) for epoch in epochs],
        test_error=round(result.test_mae, 6),
        objects={str(level.level): level.objects for level in levels},
        lifted={str(level.level): level.lifted for level in levels},
        attempts={str(level.level): level.attempts for level in levels},
    )


def processor() -> str:
    """The processor's name as Linux tells it."""
    text = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").is_file() else ""
    names = [line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line]
    return names[0] if names else platform.processor()


if __name__ == "__main__":
    run_command(main)
