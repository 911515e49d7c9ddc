"""`make calibrate`: from which q-hat on a network's grasps are good, by a run's val samples.

Writes runs/<run>/calibration.json, and says what to put into run.toml as predict.quality_min.
The threshold is chosen on the val split and checked on the test split.
"""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from jaxtyping import Float
from loguru import logger

from pipeline.artifacts import publish_bytes
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, run_command
from pipeline.messages.sample_cache import read_parts
from pipeline.messages.training import EXPORT
from pipeline.network.calibration import fit_calibration, kept_by
from pipeline.network.samples import Samples
from pipeline.network.sources import QualitySource, quality_source
from stages.graph import RUNS_DIR

THREADS = 2  # cores of the smallest machine that is supported
SHOWN = tuple(tenth / 10 for tenth in range(1, 10))  # q-hat whose probability is written


@dataclass(frozen=True)
class Answers:
    """What a network answers for samples, and what they are.

    Attributes
    ----------
    predicted
        q-hat, shape (n,).
    quality
        q, shape (n,).
    proposed
        How many grasps of Algorithm 1 each stands for, shape (n,).
    """

    predicted: Float[np.ndarray, " n"]
    quality: Float[np.ndarray, " n"]
    proposed: Float[np.ndarray, " n"]


def calibrate(
    network: Annotated[
        str | None, typer.Option(envvar="NETWORK", help="'released' or .onnx; else the run's own")
    ] = None,
    run: Annotated[str, typer.Option(envvar="RUN", help="whose samples calibrate")] = "default",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Choose predict.quality_min on a run's val samples, and check it on its test samples."""
    folder = RunFolder(runs_dir / run)
    config = load_run_config(folder.config)
    if not folder.artifact("shards").is_file():
        raise ArtifactError(
            f"{folder.artifact('shards')} is missing", f"Make it first: make dataset RUN={run}"
        )
    source = quality_source(network or str(folder.path / "train" / EXPORT), config.gripper, THREADS)
    answers = {
        name: answered(source, read_parts(folder.artifact("shards"), name))
        for name in ("val", "test")
    }
    settings = config.predict
    fitted = fit_calibration(
        answers["val"].predicted,
        answers["val"].quality,
        answers["val"].proposed,
        settings.good_quality,
    )
    threshold = fitted.threshold(settings.good_probability)
    figures = {
        "network": source.name,
        "samples": {name: int((one.proposed > 0).sum()) for name, one in answers.items()},
        "good_quality": settings.good_quality,
        "good_probability": settings.good_probability,
        "quality_min": threshold,
        "probability_at": {f"{value:.1f}": round(fitted.at(value), 4) for value in SHOWN},
        "quality_min_in_use": settings.quality_min,
        "of_test": None
        if threshold is None
        else asdict(
            kept_by(
                threshold,
                answers["test"].predicted,
                answers["test"].quality,
                answers["test"].proposed,
                settings.good_quality,
            )
        ),
    }
    path = folder.path / "calibration.json"
    publish_bytes(path, (json.dumps(figures, indent=1) + "\n").encode())
    if threshold is None:
        logger.warning(
            "calibrate: no q-hat promises q >= {:g} with a probability of {:g}",
            settings.good_quality,
            settings.good_probability,
        )
    else:
        logger.info(
            "calibrate: from q-hat {:.2f} on, q >= {:g} with a probability of {:g} or more; put "
            "quality_min = {:.2f} under [predict]",
            threshold,
            settings.good_quality,
            settings.good_probability,
            threshold,
        )
    logger.info("calibrate: {}", path)


def answered(source: QualitySource, parts: Iterable[Samples]) -> Answers:
    """Ask about samples, a part of them in memory at a time."""
    found = [
        (source.predict(part.cloud, part.cloud_mask), np.asarray(part.quality), proposed(part))
        for part in parts
    ]
    if not found:
        raise ArtifactError("a split holds no samples", "Ask for more grasps or objects.")
    predicted, quality, weight = (np.concatenate(column) for column in zip(*found, strict=True))
    return Answers(predicted.astype(np.float64), quality, weight)


def proposed(samples: Samples) -> Float[np.ndarray, " n"]:
    """How many grasps of Algorithm 1 each sample stands for; 1 where the shards do not say."""
    weight = np.asarray(samples.proposal_weight, dtype=np.float64)
    return np.where(np.isnan(weight), 1.0, weight)


if __name__ == "__main__":
    run_command(calibrate)
