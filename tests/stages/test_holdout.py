"""`make holdout` on a tiny run's labels with the kept network, and what it refuses."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import onnx
import pytest

import stages.holdout
from pipeline.config import load_run_config
from pipeline.config.judged import holdout_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.network.sources import RELEASED
from pipeline.recording.recording import TIMELINES
from pipeline.recording.viewer import photograph
from stages.graph import EVALUATE, GIVEN_NETWORK, inputs_of
from stages.holdout import measure, prepare
from tests.stages.conftest import ROOT

KEPT = str(ROOT / "tests" / "regression" / "network.safetensors")


@pytest.fixture(scope="module")
def made(run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """Measured on the tiny run's own test grasps, in the folder of a run without a run.toml."""
    runs = tmp_path_factory.mktemp("runs")
    prepare("none", KEPT, None, runs)
    folder = RunFolder(runs / "none" / "holdout")
    for name in ("objects", "scenes", "grasps"):
        shutil.copy(run.artifact(name), folder.artifact(name))
        shutil.copy(run.summary(name), folder.summary(name))
    shutil.copytree(run.shards("grasps"), folder.shards("grasps"))
    shutil.copy(run.summary("evaluate"), folder.summary("evaluate"))
    measure("none", runs)
    return folder


def test_every_object_is_for_test_and_nothing_of_the_run_is_made(made: RunFolder) -> None:
    config = load_run_config(made.config)
    assert config.split.all_in_test
    assert config.scenes.splits == ("test",)
    assert config.scenes.levels == tuple(range(1, 10))
    assert [path.name for path in made.path.parent.iterdir()] == ["holdout"]


def test_what_tells_of_policies_and_not_of_meshes_is_left_out(made: RunFolder) -> None:
    config = load_run_config(ROOT / "runs" / "paper" / "run.toml")
    assert config.evaluate.ceiling.poses > 0
    own = holdout_config(config)
    assert own.evaluate.imperfection.curve == ()
    assert own.evaluate.ceiling.poses == config.holdout.ceiling_poses == 0
    assert load_run_config(made.config).evaluate.policies == ("closed-loop",)


def test_grasps_are_labelled_in_more_clutters_than_are_emptied() -> None:
    config = load_run_config(ROOT / "runs" / "paper" / "run.toml")
    own = holdout_config(config)
    assert own.scenes.clutters_per_level.test == config.holdout.labelled_clutters_per_level == 10
    assert own.evaluate.clutters_per_level == config.holdout.clutters_per_level == 2
    # Clutters that a run passes over are of its own meshes.
    later = config.evaluate.model_copy(update={"clutters_from": 5})
    assert holdout_config(config.model_copy(update={"evaluate": later})).evaluate.clutters_from == 0
    fewer = config.holdout.model_copy(update={"clutters_per_level": 12})
    emptied = holdout_config(config.model_copy(update={"holdout": fewer}))
    assert emptied.scenes.clutters_per_level.test == emptied.evaluate.clutters_per_level == 12


def test_figures_are_of_one_prediction_and_of_eight(made: RunFolder) -> None:
    figures = json.loads(made.summary("holdout").read_text())
    rows = list(csv.DictReader((made.path / "holdout.csv").open()))
    q, single, averaged = (
        np.array([float(row[name]) for row in rows])
        for name in ("q", "q-hat", "q-hat, eight averaged")
    )
    assert len(rows) == figures["grasps"] > 20
    assert figures["mae_single"] == pytest.approx(np.abs(single - q).mean(), abs=1e-5)
    assert figures["mae"] == pytest.approx(np.abs(averaged - q).mean(), abs=1e-5)
    assert figures["mae"] != figures["mae_single"]
    errors = [one["mae"] for one in figures["by_object"].values()]
    assert figures["mae_macro"] == pytest.approx(np.mean(errors))
    own = [one["mae"] for one in figures["by_object"].values() if one["mean_q"] > 0.1]
    assert figures["mae_macro_graspable"] == (pytest.approx(np.mean(own)) if own else None)
    ends = figures["mae_macro_graspable_interval_95"]
    if len(own) < 2:
        assert ends is None
    else:
        assert min(own) <= ends[0] <= figures["mae_macro_graspable"] <= ends[1] <= max(own)
    assert set(figures["by_object"]) == {row["object"] for row in rows}
    assert set(figures["success_by_level"]) == {"1"}
    text = (made.path / "holdout.md").read_text()
    assert f"{figures['mae_single']:.4f}" in text
    assert "<table>" in (made.path / "holdout.html").read_text()


def test_the_recording_is_seen(made: RunFolder) -> None:
    sight = photograph(made.recording("holdout"))
    assert sight.problems == ()
    assert sight.timeline == TIMELINES["holdout"]


def test_the_closed_loop_asks_the_given_network(made: RunFolder, run: RunFolder) -> None:
    assert inputs_of(EVALUATE, made, None)[GIVEN_NETWORK] == made.path / GIVEN_NETWORK
    assert "train.mcap" not in inputs_of(EVALUATE, made, None)
    assert GIVEN_NETWORK not in inputs_of(EVALUATE, run, None)


def test_a_run_with_a_network_of_its_own_is_held_to_it(run: RunFolder, tmp_path: Path) -> None:
    (tmp_path / "tiny").mkdir()
    shutil.copy(run.config, tmp_path / "tiny")
    shutil.copytree(run.path / "train", tmp_path / "tiny" / "train")
    prepare("tiny", "", None, tmp_path)
    own = (run.path / "train" / "ga_cnn.onnx").read_bytes()
    assert (tmp_path / "tiny" / "holdout" / GIVEN_NETWORK).read_bytes() == own
    assert load_run_config(tmp_path / "tiny" / "holdout" / "run.toml").seed == 4


def test_a_missing_network_is_told(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match=r"nowhere\.onnx cannot be read as a network.*released"):
        prepare("none", "nowhere.onnx", None, tmp_path)


def test_a_network_of_another_grid_is_told_before_anything_is_made(tmp_path: Path) -> None:
    (tmp_path / "finer").mkdir()
    (tmp_path / "finer" / "run.toml").write_text("[sensing]\ngrid_cells = 32\ngrid_side_rg = 3.2\n")
    with pytest.raises(ArtifactError, match=r"takes clouds of 24 by 24 cells.*grid_cells.*32"):
        prepare("finer", RELEASED, None, tmp_path)
    assert not (tmp_path / "finer" / "holdout").exists()


def test_a_network_of_other_channels_is_told(tmp_path: Path) -> None:
    model = onnx.load(ROOT / "pipeline" / "network" / "released" / "ga_cnn.onnx")
    for entry in model.metadata_props:
        if entry.key == "channels":
            entry.value = '["x", "y", "z", "warmth"]'
    path = tmp_path / "other.onnx"
    onnx.save(model, path)
    with pytest.raises(ArtifactError, match=r"other\.onnx.* takes the input channels .*warmth"):
        prepare("none", str(path), None, tmp_path)


def test_labels_that_are_no_number_are_told(
    made: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    names, samples = stages.holdout.labelled(made)
    samples.quality[3] = np.nan
    monkeypatch.setattr(stages.holdout, "read_all_grasps", lambda _: (names, {"test": samples}))
    with pytest.raises(ArtifactError, match=r"1 of \d+ labels are no number in \[0, 1\]"):
        stages.holdout.labelled(made)
