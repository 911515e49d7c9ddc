"""`make referee` on a tiny run: figures, calibration, every grasp, and the recording."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from pipeline.config import RunConfig, load_run_config
from pipeline.config.judged import judged_config
from pipeline.config.written import as_toml
from pipeline.execution import RunFolder
from pipeline.messages.grasp_columns import read_columns
from pipeline.recording.recording import TIMELINES
from pipeline.recording.viewer import photograph
from stages.referee import judge, predicted, prepare


@pytest.fixture(scope="module")
def made(run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """A run with the referee's scenes and grasps, which are the run's own."""
    runs = tmp_path_factory.mktemp("runs")
    shutil.copytree(run.path, runs / "tiny")
    config = load_run_config(run.config)
    few = config.agreement.model_copy(
        update={"grasps": 40, "varied": 2, "shown": 4, "resamples": 20, "fitted": 60}
    )
    (runs / "tiny" / "run.toml").write_text(as_toml(config.model_copy(update={"agreement": few})))
    prepare("tiny", runs)
    folder = RunFolder(runs / "tiny" / "referee")
    for name in ("objects", "scenes", "grasps"):
        shutil.copy(run.artifact(name), folder.artifact(name))
    for name in ("scenes", "grasps"):
        shutil.copytree(run.shards(name), folder.shards(name))
    judge("tiny", 1, runs)
    return folder


def test_the_referees_run_has_scenes_of_its_own(made: RunFolder) -> None:
    config = load_run_config(made.config)
    assert config.scenes.clutters_per_level.test == config.agreement.clutters_per_level
    assert config.grasps.count == config.agreement.labelled
    assert made.cache == made.path.parent.parent / ".cache"


def test_without_a_runs_own_toml_defaults_are_judged(tmp_path: Path) -> None:
    prepare("new", tmp_path)
    config = load_run_config(tmp_path / "new" / "referee" / "run.toml")
    assert config == judged_config(RunConfig())
    assert config.scenes.impossible == "left out"


def test_without_a_network_the_released_one_is_asked(made: RunFolder) -> None:
    config = load_run_config(made.config)
    grasps = read_columns(made.artifact("grasps"))
    found = predicted(made, grasps, np.arange(3), config)
    assert list(found) == ["q-hat, released network"]
    assert found["q-hat, released network"].shape == (3,)


def test_figures_are_of_every_score(made: RunFolder) -> None:
    figures = json.loads(made.summary("referee").read_text())
    assert figures["grasps"] == 40
    assert set(figures["scores"]) == {
        *("q", "p of Eq. (2)", "label on the measured cloud"),
        *("q-hat", "q-hat, unseen objects"),
    }
    assert figures["spearman"] == figures["scores"]["q"]["spearman"]
    assert set(figures["auroc"]) == {"0.5", "1", "2", "4", "8"}
    varied = figures["varied"]["friction x 2"]["scores"]
    assert set(varied) == set(figures["scores"])
    assert varied["q"]["grasps"] == 2
    rows = list(csv.DictReader((made.path / "referee.csv").open()))
    assert len(rows) == 40
    assert all(float(row["borne_n"]) >= 0 for row in rows)
    text = (made.path / "referee.md").read_text()
    assert "| q | 40 |" in text
    assert "| friction x 2 | " in text
    assert "<svg" in (made.path / "calibration.svg").read_text()


def test_the_recording_is_seen(made: RunFolder) -> None:
    sight = photograph(made.recording("referee"))
    assert sight.problems == ()
    assert sight.timeline == TIMELINES["referee"]


def test_nothing_of_the_run_is_remade(made: RunFolder, run: RunFolder) -> None:
    for path in sorted(Path(run.path).glob("*.mcap")):
        assert path.read_bytes() == (made.path.parent / path.name).read_bytes()
