"""Many runs: the list, a plan of what a make takes, sealed runs that Make leaves alone."""

import shutil
from pathlib import Path

import pytest
import typer

from pipeline.errors import ArtifactError, ConfigError
from pipeline.execution import RunFolder
from stages import freshness, runs
from stages.graph import STAGES


@pytest.fixture
def folder(run: RunFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RunFolder:
    """A finished run of its own, under runs/ of the working folder."""
    shutil.copytree(run.path, tmp_path / "runs" / "tiny")
    monkeypatch.chdir(tmp_path)
    return RunFolder(Path("runs/tiny"))


def test_the_list_names_a_fresh_run_with_its_figures(
    folder: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    runs.list_runs()
    head, line = capsys.readouterr().out.splitlines()
    assert head.split()[:3] == ["run", "disk", "stages"]
    assert line.startswith("tiny")
    assert " ".join(STAGES) in line
    assert "240" in line
    assert line.endswith("up to date  embedded objects")


def test_the_list_says_from_where_on_a_run_is_stale(
    folder: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    folder.config.write_text(folder.config.read_text().replace("count = 240", "count = 250"))
    runs.list_runs()
    assert "stale from grasps on" in capsys.readouterr().out


def test_a_run_whose_configuration_cannot_be_read_is_listed_with_the_reason(
    folder: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    folder.config.write_text("[nonsense]\na = 1\n")
    runs.list_runs()
    assert "cannot be made anew: " in capsys.readouterr().out


def test_a_plan_names_what_is_made_and_what_it_took_before(
    folder: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    freshness.plan("eval", run="tiny")
    assert capsys.readouterr().out == "nothing to make: all is up to date\n"
    folder.config.write_text(folder.config.read_text().replace("count = 240", "count = 480"))
    freshness.plan("dataset", run="tiny")
    head, grasps, shards, total = capsys.readouterr().out.splitlines()
    assert head.split() == ["stage", "why", "about", "disk", "told", "by"]
    assert grasps.startswith("grasps  configuration grasps changed")
    assert shards.startswith("shards  after grasps")
    assert "run tiny" in grasps
    assert total.startswith("in all about")
    with pytest.raises(ConfigError, match="'lint' is no goal"):
        freshness.plan("lint", run="tiny")


@pytest.mark.parametrize(
    "named", ['start = "../none/train/ga_cnn.safetensors"', 'further_runs = ["../none"]']
)
def test_what_a_training_names_must_be_there_before_the_dataset_is_made(
    folder: RunFolder, monkeypatch: pytest.MonkeyPatch, named: str
) -> None:
    folder.config.write_text(folder.config.read_text().replace("[train]", f"[train]\n{named}"))
    monkeypatch.setenv("GOALS", "dataset")
    freshness.key("objects", run="tiny")
    monkeypatch.setenv("GOALS", "train")
    with pytest.raises(ConfigError, match="is missing, and train"):
        freshness.key("objects", run="tiny")


def test_make_leaves_a_sealed_run_as_it_is_on_another_machine(
    folder: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    runs.seal("tiny")
    folder.config.write_text(folder.config.read_text().replace("seed = 4", "seed = 5"))
    shutil.rmtree(folder.state(""))  # it was moved without its bookkeeping
    for stage in STAGES:
        freshness.key(stage, run="tiny")
        key, artifact = folder.state(f"{stage}.key"), folder.artifact(stage)
        assert key.stat().st_mtime < artifact.stat().st_mtime  # Make compares these dates
    freshness.plan("eval", run="tiny")
    assert capsys.readouterr().out == "nothing to make: all is up to date\n"
    with pytest.raises(ArtifactError, match="sealed without sweep"):
        freshness.key("sweep", run="tiny")
    freshness.status(run="tiny")
    assert "is sealed: nothing in it is made anew" in capsys.readouterr().out


def test_a_sealed_run_that_changed_is_found_out(
    folder: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    runs.seal("tiny")
    runs.check("tiny")
    folder.summary("train").write_text("{}")
    with pytest.raises(typer.Exit):
        runs.check("tiny")
    assert "train.summary.json: changed: SHA-256 was" in capsys.readouterr().out


def test_pruning_shows_first_and_frees_on_demand(
    folder: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    runs.prune()
    assert "can be freed: make prune FREE=1" in capsys.readouterr().out
    assert folder.state("samples").is_dir()
    runs.prune(free_now=True)
    assert "freed" in capsys.readouterr().out
    assert not folder.state("samples").exists()
    freshness.status(run="tiny")
    assert capsys.readouterr().out.count("up to date") == len(STAGES)
    with pytest.raises(ArtifactError, match=r"missing.*make list"):
        runs.prune("nobody")
