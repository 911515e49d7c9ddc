"""`make calibrate` on the tiny run: the threshold comes from its val samples."""

import json
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.messages.samples import read_split
from stages.calibrate import calibrate, proposed


def test_the_figures_are_of_the_runs_samples(run: RunFolder) -> None:
    calibrate(run=run.path.name, runs_dir=run.path.parent)
    figures = json.loads((run.path / "calibration.json").read_text())
    samples = read_split(run.artifact("shards"), "val")
    assert figures["samples"]["val"] == int((proposed(samples) > 0).sum())
    rising = list(figures["probability_at"].values())
    assert rising == sorted(rising)
    assert figures["network"] == "ga_cnn.onnx"
    (run.path / "calibration.json").unlink()


def test_weights_that_shards_do_not_say_are_one(run: RunFolder) -> None:
    samples = read_split(run.artifact("shards"), "val")
    samples.proposal_weight[:] = np.nan
    assert (proposed(samples) == 1.0).all()


def test_a_run_without_samples_is_told(tmp_path: Path) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    (folder / "run.toml").write_text("")
    with pytest.raises(ArtifactError, match=r"shards\.mcap is missing.*make dataset RUN=empty"):
        calibrate(run="empty", runs_dir=tmp_path)
