"""`make query`: answers on the screen and in files, and a run that is being worked in."""

import shutil
from pathlib import Path

import pyarrow.csv
import pyarrow.parquet
import pytest
from filelock import FileLock
from loguru import logger

from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from stages.query import query

RELEASED = Path(__file__).parents[1] / "artifacts" / "released" / "v1-0.1.0"


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """A run of softgrip 0.1.0, of an older schema version."""
    runs = tmp_path_factory.mktemp("runs")
    shutil.copytree(RELEASED, runs / "old")
    return RunFolder(runs / "old")


def test_an_answer_is_a_table_or_a_file(
    asked: RunFolder, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sql = "SELECT object, nsvr FROM objects ORDER BY object"
    query(sql, asked.path.name, asked.path.parent)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["object", "nsvr"]
    for kind, read in (("csv", pyarrow.csv.read_csv), ("parquet", pyarrow.parquet.read_table)):
        file = tmp_path / f"answer.{kind}"
        query(sql, asked.path.name, asked.path.parent, out=file)
        assert read(file).column("object").to_pylist() == [line.split()[0] for line in lines[2:]]


def test_without_a_question_the_tables_are_told(
    asked: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    query("", asked.path.name, asked.path.parent)
    told = capsys.readouterr().out
    assert "grasps: scene, grasp, viewpoint" in told
    assert "inputs: stage, input, sha256" in told


def test_what_a_run_was_made_from_is_told(
    asked: RunFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    sql = "SELECT stage, input, schema_version FROM inputs WHERE stage = 'scenes'"
    query(sql, asked.path.name, asked.path.parent)
    assert capsys.readouterr().out.splitlines()[2].split() == [
        "scenes",
        "objects.mcap",
        "softgrip.v1",
    ]


def test_a_run_that_is_worked_in_says_so(asked: RunFolder) -> None:
    told: list[str] = []
    sink = logger.add(told.append, level="WARNING")
    with FileLock(asked.state("lock")):
        query("SELECT count(*) FROM objects", asked.path.name, asked.path.parent)
    logger.remove(sink)
    assert "is being worked in: this is its last whole state" in "".join(told)


def test_a_run_that_holds_nothing_is_told(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match=r"holds nothing to ask.*make dataset RUN=none"):
        query("SELECT 1", "none", tmp_path)
