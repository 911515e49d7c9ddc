"""`make expect`, and what a stage tells of its own artifact."""

import json
import shutil
from pathlib import Path

import pytest
import typer

from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from stages.expect import expect
from stages.graph import STAGES


@pytest.fixture
def own(run: RunFolder, tmp_path: Path) -> RunFolder:
    shutil.copytree(run.path, tmp_path / "tiny")
    return RunFolder(tmp_path / "tiny")


def test_every_stage_told_what_it_found(run: RunFolder) -> None:
    for stage in STAGES:
        found = json.loads(run.summary(stage).read_text())["expectations"]
        assert found
        assert not [one for one in found if one["severity"] == "error" and one["problem"]]


def test_a_good_run_passes(run: RunFolder, capsys: pytest.CaptureFixture[str]) -> None:
    expect(run.path.name, run.path.parent)
    assert ": 0 errors," in capsys.readouterr().out


def test_what_does_not_hold_fails_with_its_reason(
    own: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    own.config.write_text(
        own.config.read_text()
        + "\n[[expect]]\nname = 'a million grasps'\nstage = 'grasps'\n"
        + "sql = 'SELECT count(*) FROM grasps'\nat_least = 1e6\nreason = 'it was promised'\n"
    )
    with pytest.raises(typer.Exit):
        expect(own.path.name, own.path.parent)
    assert "a million grasps | 240 | **error**: is 240" in capsys.readouterr().out


def test_parts_that_do_not_belong_together_fail(
    own: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    with own.artifact("scenes").open("ab") as file:
        file.write(b"\0")
    with pytest.raises((typer.Exit, ArtifactError)):
        expect(own.path.name, own.path.parent)


def test_a_run_that_holds_nothing_is_told(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    with pytest.raises(ArtifactError, match="holds no artifact"):
        expect("one", tmp_path)
