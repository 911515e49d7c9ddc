"""`make real ATTEMPTS=...`: what came of tried grasps, on a robot or in simulation, against q-hat.

Beside the q-hat by which they were chosen stand those that a network and the analytic baseline
give the same clouds.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.artifacts.listing import artifacts_in
from pipeline.config import load_run_config
from pipeline.execution import RunFolder, run_command
from pipeline.messages.attempts import read_attempts, tried_contacts
from pipeline.network.outcomes import against_outcomes
from pipeline.network.sources import ANALYTIC, RELEASED, quality_source
from pipeline.reporting.page import html_page
from pipeline.reporting.plots import lifted_by_quality
from pipeline.reporting.tried import tried_page
from stages.graph import RUNS_DIR

THREADS = 2  # cores of the smallest machine that is supported
AS_TRIED, PLOT = "as it was tried", "attempts.svg"


def tried(
    attempts: Annotated[list[Path], typer.Argument(help="files or folders of logged attempts")],
    network: Annotated[
        str, typer.Option(envvar="NETWORK", help=f"'{RELEASED}' or an exported network (.onnx)")
    ] = RELEASED,
    run: Annotated[str, typer.Option(envvar="RUN", help="whose run.toml configures")] = "default",
    out: Annotated[Path | None, typer.Option(help="folder; else runs/<run>/real")] = None,
) -> None:
    """Compare q-hat with what was lifted, and write attempts.html."""
    config = load_run_config(RunFolder(RUNS_DIR / run).config)
    made = read_attempts(artifacts_in(attempts))
    contacts = tried_contacts(made)
    rankings = {AS_TRIED: against_outcomes(contacts.predicted, contacts.lifted)}
    gripper = config.gripper.model_copy(
        update={"pad": config.gripper.pad.model_copy(update={"radius_m": made[0].pad_radius_m})}
    )
    for named in (network, ANALYTIC):
        source = quality_source(named, gripper, THREADS)
        predicted = source.predict(contacts.cloud.astype(np.float32), contacts.mask)
        rankings[source.name] = against_outcomes(
            np.asarray(predicted, dtype=np.float64), contacts.lifted
        )
    ended = Counter(attempt.cause or attempt.outcome for attempt in made)
    outcomes = dict(ended.most_common())
    judges = sorted({attempt.judge for attempt in made})
    plot = lifted_by_quality({name: found["bins"] for name, found in rankings.items()}).encode()
    page = tried_page(rankings, outcomes, judges, PLOT)
    folder = out or RUNS_DIR / run / "real"
    figures = {"attempts": len(made), "judges": judges, "ended": outcomes, "rankings": rankings}
    publish_bytes(folder / PLOT, plot)
    publish_bytes(folder / "attempts.json", (json.dumps(figures, indent=1) + "\n").encode())
    publish_bytes(folder / "attempts.md", page.encode())
    html = html_page(page, "Tried grasps against q-hat", {PLOT: plot})
    publish_bytes(folder / "attempts.html", html.encode())
    logger.info("real: {}", folder / "attempts.html")


if __name__ == "__main__":
    run_command(tried)
