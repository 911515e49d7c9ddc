"""Expectations: what holds, what does not, and what cannot be asked."""

from pathlib import Path

import pytest
from pydantic import ValidationError

from pipeline.asking.expectations import (
    Found,
    as_markdown,
    check,
    check_expectations,
    declared_expectations,
)
from pipeline.asking.query import open_tables
from pipeline.config import load_run_config
from pipeline.config.expectations import Expectation
from pipeline.config.written import as_toml
from pipeline.execution import RunFolder
from schemas.tables import BY_NAME
from stages.graph import STAGES


def expecting(sql: str, **bounds: float | str) -> Expectation:
    entry = {"name": "n", "stage": "objects", "sql": sql, "reason": "r", **bounds}
    return Expectation.model_validate(entry)


def checked(expected: Expectation, made: dict[str, Path], cache: Path) -> Found:
    with open_tables(made, cache, "scenes") as tables:
        return check(expected, tables)


@pytest.fixture(scope="module")
def made(run: RunFolder) -> dict[str, Path]:
    return {name: run.artifact(name) for name in STAGES}


def test_a_small_run_keeps_every_declared_expectation(
    made: dict[str, Path], tmp_path: Path
) -> None:
    for stage in STAGES:
        found = check_expectations(stage, (), made, tmp_path)
        assert found, stage
        assert not [one for one in found if one.is_error], as_markdown(found)
        assert all(one.value is not None for one in found), as_markdown(found)


@pytest.mark.parametrize(
    ("sql", "bounds", "problem"),
    [
        ("SELECT 3", {"at_most": 3}, ""),
        ("SELECT 3", {"at_least": 3}, ""),
        ("SELECT 3", {"at_most": 2}, "is 3, must be at most 2"),
        ("SELECT 0.5", {"at_least": 1}, "is 0.5, must be at least 1"),
        ("SELECT NULL", {"at_least": 1}, "there is no number"),
        ("SELECT 'nan'::DOUBLE", {"at_least": 1}, "there is no number"),
        ("SELECT object, nsvr FROM objects", {"at_least": 1}, "the answer must be one number"),
        ("SELECT nonsense FROM objects", {"at_least": 1}, "cannot be asked"),
    ],
)
def test_a_number_is_held_against_its_bounds(
    sql: str, bounds: dict[str, float], problem: str, made: dict[str, Path], tmp_path: Path
) -> None:
    found = checked(expecting(sql, **bounds), made, tmp_path)
    assert found.problem.startswith(problem)
    assert bool(found.problem) == bool(problem)


def test_a_warning_is_no_error(made: dict[str, Path], tmp_path: Path) -> None:
    warning = expecting("SELECT 3", at_most=2, severity="warning")
    found = checked(warning, made, tmp_path)
    assert found.problem
    assert not found.is_error
    assert "**warning**: is 3" in as_markdown([found])


def test_a_run_adds_its_own_and_they_are_kept_when_its_configuration_is_written(
    made: dict[str, Path], tmp_path: Path
) -> None:
    toml = tmp_path / "run.toml"
    toml.write_text(
        "[[expect]]\nname = 'mugs'\nstage = 'objects'\nsql = 'SELECT 7'\nat_least = 8\n"
        "reason = 'they are sold'\n"
    )
    config = load_run_config(toml)
    found = check_expectations("objects", config.expect, made, tmp_path)
    assert found[-1].problem == "is 7, must be at least 8"
    toml.write_text(as_toml(config))
    assert load_run_config(toml) == config


def test_an_expectation_without_a_bound_is_refused() -> None:
    with pytest.raises(ValidationError, match="give at_least, at_most or both"):
        expecting("SELECT 1")


def test_every_declared_expectation_asks_tables_that_exist_and_says_why() -> None:
    names = [one.name for one in declared_expectations()]
    assert len(set(names)) == len(names)
    for one in declared_expectations():
        assert any(f" {table}" in one.sql for table in BY_NAME), one.name
        assert len(one.reason.split()) > 2


# What breaks a run → the declared expectation that must say so.
BROKEN = {
    "no family stands in two splits": (
        "objects",
        "SELECT * REPLACE ('same' AS family) FROM objects",
    ),
    "q and p lie in [0, 1]": ("grasps", "SELECT * REPLACE (q - 2 AS q) FROM grasps"),
    "no sample was lost or made up": ("samples", "SELECT * FROM samples LIMIT 7"),
    "provenance is whole": (
        "inputs",
        "SELECT * REPLACE ('another' AS present_sha256) FROM inputs",
    ),
    "poses and wrenches of grasps are numbers": (
        "grasps",
        "SELECT * REPLACE ('nan'::DOUBLE AS tau_z) FROM grasps",
    ),
    "every scene has grasps": ("scenes", "SELECT * REPLACE ('lost' AS scene) FROM scenes"),
    "scenes hold as many objects as they count": (
        "scenes",
        "SELECT * REPLACE (objects + 1 AS objects) FROM scenes",
    ),
    "errors are numbers": ("epochs", "SELECT * REPLACE ('nan'::DOUBLE AS val_mae) FROM epochs"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_is_found(name: str, made: dict[str, Path], tmp_path: Path) -> None:
    (expected,) = (one for one in declared_expectations() if one.name == name)
    table, broken = BROKEN[name]
    assert not checked(expected, made, tmp_path).problem
    sql = expected.sql.replace(f"FROM {table}", f"FROM ({broken}) AS {table}")
    assert sql != expected.sql
    worse = expected.model_copy(update={"sql": sql})
    assert checked(worse, made, tmp_path).is_error
