"""`make release`: RUN's network in the place of the released one, with baseline and figures.

Writes ga_cnn.onnx, ga_cnn.safetensors, analytic.json, test and train grasps, figures.json and
digests.json of ``pipeline/network/released``; prints the figures as the tables of its card, which a
person writes.
"""

import json
import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pipeline.artifacts import open_artifact, publish_bytes, read_provenance
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, generator, run_command
from pipeline.messages.grasp_samples import read_all_grasps
from pipeline.messages.training import CHECKPOINT, EXPORT
from pipeline.network.by_object import errors_by_object, macro_error
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.figures import mean_absolute_error, weighted_error
from pipeline.network.fine_tuning import grasps_to_bytes
from pipeline.network.fitted_baselines import baseline_errors, fit_baselines
from pipeline.network.released_files import (
    BASELINE_FILE,
    DIGESTS_FILE,
    FIGURES_FILE,
    RELEASED_FOLDER,
    TEST_GRASPS_FILE,
    TRAIN_GRASPS_FILE,
)
from pipeline.network.samples import Samples
from pipeline.network.sources import baseline_to_json, sha256_of
from pipeline.spread import choose_evenly
from schemas.softgrip.v1.training_pb2 import TrainingResult
from stages.graph import RUNS_DIR

SHOWN_GRASPS = 600  # 2 MiB a file: on which a fine-tuned network shows what it forgot
FITTED = 4000  # training samples that the baselines are fitted to, as for the first release


def release(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "release",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
    into: Annotated[Path, typer.Option(help="folder of the released files")] = RELEASED_FOLDER,
) -> None:
    """Put a run's network in the place of the released one."""
    folder = RunFolder(runs_dir / run)
    config = load_run_config(folder.config)
    trained = folder.path / "train"
    for path in (trained / EXPORT, trained / CHECKPOINT, folder.artifact("grasps")):
        if not path.is_file():
            raise ArtifactError(f"{path} is missing", f"Make it first: make train RUN={run}")
    names, by_split = read_all_grasps(folder.artifact("grasps"))
    train_set, test_set = by_split["train"], by_split["test"]
    order = generator(config.seed, "release").permutation(len(train_set))[:FITTED]
    fit = train_set.take(np.sort(order))
    fitted = fit_baselines(fit, config.gripper, FITTED)
    predict = ControlPredictor((trained / EXPORT).read_bytes(), config.train.threads).predict
    cloud, mask, quality = test_set.cloud, test_set.cloud_mask, test_set.quality
    single, averaged = (predict(cloud, mask, average_symmetries=each) for each in (False, True))
    weight = test_set.proposal_weight
    with open_artifact(folder.artifact("train")) as artifact:
        learnt = artifact.one(TrainingResult).train_count
    errors = errors_by_object(names, test_set.object_index, quality, single, averaged, weight)
    figures = {
        "made_from": read_provenance(folder.artifact("train")).key,
        "seed": config.seed,
        "samples": {split: len(samples) for split, samples in by_split.items()},
        "learnt_from": learnt,  # with those of further runs
        "mae": mean_absolute_error(averaged, quality),
        "mae_single": mean_absolute_error(single, quality),
        "mae_as_proposed": weighted_error(single, quality, weight),
        "mae_macro": macro_error(errors, graspable_alone=False),
        "mae_macro_graspable": macro_error(errors, graspable_alone=True),
        **baseline_errors(fitted, test_set).summary(),
        "best_constant_mae": float(np.abs(quality - np.median(quality)).mean()),
        "by_object": {one.name: one.figures() for one in errors},
    }
    files = {
        EXPORT: (trained / EXPORT).read_bytes(),
        CHECKPOINT: (trained / CHECKPOINT).read_bytes(),
        BASELINE_FILE: baseline_to_json(fitted.analytic).encode(),
        TEST_GRASPS_FILE: some_grasps(test_set),
        TRAIN_GRASPS_FILE: some_grasps(train_set),
        FIGURES_FILE: (json.dumps(figures, indent=1) + "\n").encode(),
    }
    for name, data in files.items():
        publish_bytes(into / name, data)
    digests = {name: sha256_of(into / name) for name in sorted(files)}
    publish_bytes(into / DIGESTS_FILE, (json.dumps(digests, indent=1) + "\n").encode())
    rows = [
        f"| {one.name} | {one.grasps} | {one.mean_quality:.3f} | {one.mae:.4f} |"
        for one in sorted(errors, key=lambda one: -one.mae)
    ]
    head = "| object | grasps | mean q | mean \\|q-hat - q\\|, one prediction |\n|-|-|-|-|\n"
    sys.stdout.write(head + "\n".join(rows) + "\n")
    for name, value in figures.items():
        if isinstance(value, float):
            sys.stdout.write(f"{name}: {value:.4f}\n")


def some_grasps(samples: Samples) -> bytes:
    """A file of some of the samples, equally far apart."""
    some = samples.take(np.array(choose_evenly(len(samples), SHOWN_GRASPS)))
    return grasps_to_bytes(some.cloud, some.cloud_mask, some.quality)


if __name__ == "__main__":
    run_command(release)
