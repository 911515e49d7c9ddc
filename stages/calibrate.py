"""`make calibrate`: from which q-hat on a network's grasps are good, by a run's val samples.

Writes runs/<run>/calibration.json, and says what to put into run.toml as predict.quality_min.
The threshold is chosen on the val split and checked on the test split.
"""

import json
from dataclasses import asdict
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
from pipeline.messages.sample_cache import cached_split
from pipeline.messages.training import EXPORT
from pipeline.network.calibration import fit_calibration, kept_by
from pipeline.network.samples import Samples
from pipeline.network.sources import quality_source
from stages.graph import RUNS_DIR
from stages.train import SAMPLES

THREADS = 2  # cores of the smallest machine that is supported
SHOWN = tuple(tenth / 10 for tenth in range(1, 10))  # q-hat whose probability is written


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
    splits = {
        name: cached_split(folder.artifact("shards"), name, folder.state(SAMPLES))
        for name in ("val", "test")
    }
    predicted = {
        name: np.asarray(source.predict(samples.cloud, samples.cloud_mask), dtype=np.float64)
        for name, samples in splits.items()
    }
    settings = config.predict
    fitted = fit_calibration(
        predicted["val"],
        np.asarray(splits["val"].quality),
        proposed(splits["val"]),
        settings.good_quality,
    )
    threshold = fitted.threshold(settings.good_probability)
    figures = {
        "network": source.name,
        "samples": {name: int((proposed(one) > 0).sum()) for name, one in splits.items()},
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
                predicted["test"],
                np.asarray(splits["test"].quality),
                proposed(splits["test"]),
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


def proposed(samples: Samples) -> Float[np.ndarray, " n"]:
    """How many grasps of Algorithm 1 each sample stands for; 1 where the shards do not say."""
    weight = np.asarray(samples.proposal_weight, dtype=np.float64)
    return np.where(np.isnan(weight), 1.0, weight)


if __name__ == "__main__":
    run_command(calibrate)
