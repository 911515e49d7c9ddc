"""`make holdout`: a given network on meshes that it never saw; nothing is trained.

Labels, error and closed loop are made in a run of their own, ``runs/<run>/holdout``, where every
object is of the test split; of the run, its configuration alone is read, and its network where none
is named. There: holdout.summary.json, .md, .html, .csv (a line a grasp) and .rrd, beside what the
stages leave (evaluate.rrd is the film).
"""

import json
import os
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from loguru import logger

from pipeline.artifacts import publish_bytes, read_provenance
from pipeline.config import RunConfig, load_run_config
from pipeline.config.judged import holdout_config
from pipeline.config.written import as_toml
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, generator, run_command
from pipeline.execution.running import read_summary
from pipeline.messages.grasp_samples import read_all_grasps
from pipeline.messages.training import EXPORT
from pipeline.network.by_object import (
    ObjectError,
    check_labels,
    errors_by_object,
    interval_of_mean,
    macro_error,
)
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.figures import mean_absolute_error, weighted_error
from pipeline.network.fitted_baselines import errors_without_training
from pipeline.network.given import given_network
from pipeline.network.samples import Samples
from pipeline.network.sources import RELEASED, released_baseline
from pipeline.recording.holdout import blueprint, show_holdout
from pipeline.recording.recording import OwnRecording, recording
from pipeline.reporting.agreement import as_csv
from pipeline.reporting.facts import read_catalogue
from pipeline.reporting.holdout import as_markdown
from pipeline.reporting.page import html_page
from pipeline.spread import choose_evenly
from stages.graph import GIVEN_NETWORK, RUNS_DIR

NAME = "holdout"
NOTE = "network.json"  # what the network was called when it was given


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RunName = Annotated[str, typer.Option(envvar="RUN", help="name of the run")]
RunsDir = Annotated[Path, typer.Option(help="folder of all runs")]


@app.command()
def prepare(
    run: RunName = "default",
    network: Annotated[
        str, typer.Option(envvar="NETWORK", help=f"'{RELEASED}', or a file; else the run's own")
    ] = "",
    mesh_dir: Annotated[Path | None, typer.Option(envvar="MESH_DIR")] = None,
    runs_dir: RunsDir = RUNS_DIR,
) -> None:
    """Write the run.toml of the objects that nothing is trained on, and put the network there."""
    parent, folder = RunFolder(runs_dir / run), RunFolder(runs_dir / run / NAME)
    # A run without a run.toml takes the defaults.
    config = load_run_config(parent.config) if parent.config.is_file() else RunConfig()
    own = parent.path / "train" / EXPORT
    named = network or (str(own) if own.is_file() else RELEASED)
    given = given_network(named, config.sensing.grid_cells)
    logger.info("holdout: {} on {}", given.name, mesh_dir or "the embedded objects")
    if mesh_dir is None:
        logger.warning("The released network was trained on these: name meshes with MESH_DIR")
    publish_bytes(folder.config, as_toml(holdout_config(config)).encode())
    publish_bytes(folder.path / GIVEN_NETWORK, given.exported)
    publish_bytes(folder.path / NOTE, json.dumps({"name": given.name}).encode())


@app.command()
def measure(run: RunName = "default", runs_dir: RunsDir = RUNS_DIR) -> None:
    """The network's error on the labels, beside what the closed loop came to."""
    began = time.perf_counter()
    folder = RunFolder(runs_dir / run / NAME)
    config = load_run_config(folder.config)
    names, samples = labelled(folder)
    exported = (folder.path / GIVEN_NETWORK).read_bytes()
    predict = ControlPredictor(exported, config.train.threads).predict
    single, averaged = (
        predict(samples.cloud, samples.cloud_mask, average_symmetries=averaging)
        for averaging in (False, True)
    )
    errors = errors_by_object(
        names,
        samples.object_index,
        samples.quality,
        single,
        averaged,
        samples.proposal_weight,
    )
    gripped = [one.mae for one in errors if one.graspable]
    rng = generator(config.seed, NAME)
    interval = interval_of_mean(gripped, config.holdout.resamples, rng)
    figures = {
        "network": json.loads((folder.path / NOTE).read_text())["name"],
        "grasps": len(samples),
        "objects": len(errors),
        "mae": mean_absolute_error(averaged, samples.quality),
        "mae_single": mean_absolute_error(single, samples.quality),
        "mae_as_proposed": weighted_error(single, samples.quality, samples.proposal_weight),
        "mae_macro": macro_error(errors, graspable_alone=False),
        "mae_macro_graspable": macro_error(errors, graspable_alone=True),
        "mae_macro_graspable_interval_95": interval,
        "best_constant_mae": float(np.abs(samples.quality - np.median(samples.quality)).mean()),
        "baselines": baselines(samples, config),
        **told_by_stages(folder, errors),
        "wall_time_s": time.perf_counter() - began,
    }
    columns = {
        "object": np.array(names)[samples.object_index],
        "level": samples.level,
        **{"q": samples.quality, "q-hat": single, "q-hat, eight averaged": averaged},
    }
    publish(folder, figures, as_csv(columns))
    key = read_provenance(folder.artifact("grasps")).key
    with recording(OwnRecording(NAME, folder.recording(NAME), key), blueprint()) as stream:
        shown, text = config.holdout.shown, as_markdown(figures)
        show_holdout(stream, errors, names, samples, single, shown, text)
    sys.stdout.write(text)


def labelled(folder: RunFolder) -> tuple[tuple[str, ...], Samples]:
    """All labelled grasps, and the names of their objects. Raises ArtifactError on bad labels."""
    index = folder.artifact("grasps")
    names, by_split = read_all_grasps(index)
    if "test" not in by_split:
        raise ArtifactError(f"{index} holds no grasp", "Delete it and run make holdout again")
    samples = by_split["test"]
    check_labels(names, samples.object_index, samples.quality)
    return names, samples


def baselines(samples: Samples, config: RunConfig) -> dict[str, float]:
    """Errors of baselines on some of the grasps, equally far apart."""
    some = np.array(choose_evenly(len(samples), config.holdout.baseline_grasps), dtype=np.int64)
    if not len(some):
        return {}
    return errors_without_training(samples.take(some), released_baseline(config.gripper))


def told_by_stages(folder: RunFolder, errors: list[ObjectError]) -> dict[str, Any]:
    """By object, by level, and what was left out, from what the stages left."""
    catalogue = read_catalogue(folder.artifact("objects"))
    shape_class = {one.name: one.shape_class for one in catalogue.objects}
    evaluated = read_summary(folder, "evaluate")
    if "success_by_level" not in evaluated:
        raise ArtifactError(
            f"{folder.summary('evaluate')} is missing or damaged", "Run make holdout again"
        )
    return {
        "by_object": {
            one.name: {"shape_class": shape_class[one.name], **one.figures()} for one in errors
        },
        "meshes_left_out": dict(catalogue.refused),
        "clutters_left_out": read_summary(folder, "scenes").get("left_out", {}),
        "success_by_level": evaluated["success_by_level"],
    }


def publish(folder: RunFolder, figures: dict[str, Any], table: str) -> None:
    """Write the figures for scripts, people and spreadsheets."""
    text = as_markdown(figures)
    files = {
        "summary.json": json.dumps(figures, indent=1) + "\n",
        "csv": table,
        "md": text,
        "html": html_page(text, f"{figures['network']} held out", {}),
    }
    for ending, data in files.items():
        publish_bytes(folder.path / f"{NAME}.{ending}", data.encode())


if __name__ == "__main__":
    os.environ["MESH_DIR"] = os.environ.get("MESH_DIR", "")
    if not os.environ["MESH_DIR"]:
        del os.environ["MESH_DIR"]  # empty: none
    run_command(app)
