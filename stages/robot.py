"""`make robot`: attempts on a robot of one's own, each logged as a softgrip.v1 attempt.

The policy is the one of the simulated closed loop, with a network of one's choice. Every attempt is
a file of its own, runs/<run>/robot/attempt_<nnnnn>.mcap, written before the next begins.
"""

import importlib.util
from pathlib import Path
from typing import Annotated, cast, get_args

import numpy as np
import typer
from loguru import logger

from pipeline.artifacts import ArtifactWriter
from pipeline.config.evaluation import PolicyName
from pipeline.control.attempts import JudgedAttempt, failed_seals
from pipeline.control.decision import Cause, TriedContact
from pipeline.control.strategies import build_strategy
from pipeline.errors import CalibrationError
from pipeline.execution import generator, run_command
from pipeline.messages.evaluation import attempt_message
from pipeline.network.sources import ANALYTIC, RELEASED, quality_source
from pipeline.robot.arm import DrivenRobot
from pipeline.robot.calibration import read_calibration
from pipeline.robot.driver import Driver
from pipeline.robot.eyes import DrivenEyes
from pipeline.robot.trying import JUDGE, try_once
from stages.graph import RUNS_DIR
from stages.predict import predict_config, provenance

THREADS = 2  # cores of the smallest machine that is supported
OPEN = "open_driver"  # the function that a driver's file defines


def robot(
    driver: Annotated[Path, typer.Argument(help=f"Python file that defines {OPEN}()")],
    calibration: Annotated[Path, typer.Argument(help="JSON of the cell")],
    attempts: Annotated[int, typer.Option(min=1, help="how many")] = 10,
    radius_mm: Annotated[float | None, typer.Option(min=1, help="radius of the gripper")] = None,
    policy: Annotated[str, typer.Option(help="closed-loop, open-loop, geometric, ...")] = (
        "closed-loop"
    ),
    network: Annotated[
        str,
        typer.Option(
            envvar="NETWORK", help=f"'{RELEASED}', '{ANALYTIC}', or an exported network (.onnx)"
        ),
    ] = RELEASED,
    run: Annotated[str, typer.Option(envvar="RUN", help="whose run.toml configures")] = "default",
    out: Annotated[Path | None, typer.Option(help="folder; else runs/<run>/robot")] = None,
) -> None:
    """Pick with a robot until nothing is seen any more, and log every attempt."""
    if policy not in get_args(PolicyName):
        raise typer.BadParameter(f"--policy is one of {', '.join(get_args(PolicyName))}")
    config = predict_config(run, radius_mm, None, None)
    held = read_calibration(calibration)
    opened = opened_driver(driver)
    source = quality_source(network, config.gripper, THREADS)
    named = cast(PolicyName, policy)
    strategy = build_strategy(named, source.predict, config)
    made_from = provenance(config, [driver, calibration], source.digest)
    eyes = DrivenEyes(opened, held, config)
    arm = DrivenRobot(opened, held, config)
    folder = out or RUNS_DIR / run / "robot"
    first = next_number(folder)
    failed_m: list[np.ndarray] = []
    felt: list[TriedContact] = []
    for number in range(first, first + attempts):
        rng = generator(config.seed, "robot", number)
        made = try_once(eyes, arm, strategy, config, rng, failed_m, felt)
        path = folder / f"attempt_{number:05d}.mcap"
        message = attempt_message("robot", 0, 0, number, policy, JUDGE, made, config)
        with ArtifactWriter(path, made_from) as artifact:
            artifact.write("/attempts", message, log_time_ns=number)
        logger.info("robot: attempt {}: {}, {}", number, made.cause, path)
        if made.cause is Cause.EMPTY_CLOUD:
            break
        failed_m += failed_contacts_m(made)
        felt += failed_seals(made)


def opened_driver(path: Path) -> Driver:
    """The driver that a person's file opens.

    Parameters
    ----------
    path
        A Python file that defines ``open_driver()``.

    Returns
    -------
    The driver.

    Raises
    ------
    CalibrationError
        The file is not there, is no Python file, or does not define it.
    """
    spec = importlib.util.spec_from_file_location(path.stem, path) if path.is_file() else None
    if spec is None or spec.loader is None:
        raise CalibrationError(f"{path} is no Python file", "Name the file with your driver")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not hasattr(module, OPEN):
        raise CalibrationError(f"{path} defines no {OPEN}()", "Start from runs/robot/my_robot.py")
    return cast(Driver, getattr(module, OPEN)())


def next_number(folder: Path) -> int:
    """One more than the number of the last attempt in a folder; 0 where there is none."""
    numbers = [int(path.stem.rpartition("_")[2]) for path in folder.glob("attempt_*.mcap")]
    return max(numbers, default=-1) + 1


def failed_contacts_m(made: JudgedAttempt) -> list[np.ndarray]:
    """Places in WCS that the next attempt avoids while there are others [m]."""
    failed = list(made.decision.failed_contacts_m)
    if made.cause is not Cause.LIFTED:
        failed.append(made.decision.world_from_contact[:3, 3])
    return failed


if __name__ == "__main__":
    run_command(robot)
