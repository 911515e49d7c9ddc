"""What is expected of a run's artifacts, and what is found of it."""

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import pyarrow as pa
from pydantic import ValidationError

from pipeline.asking.few_rows import few_rows
from pipeline.config.expectations import EVERY, Expectation
from pipeline.errors import ConfigError, SoftgripError

DECLARED = Path(__file__).resolve().parents[2] / "schemas" / "expectations.toml"


@dataclass(frozen=True)
class Found:
    """One expectation, and what was found.

    Attributes
    ----------
    expected
        What must hold.
    value
        The answer; None where there was none.
    problem
        What does not hold, in words; empty where it holds.
    """

    expected: Expectation
    value: float | None
    problem: str

    @property
    def is_error(self) -> bool:
        """Whether something does not hold that must."""
        return bool(self.problem) and self.expected.severity == "error"

    def figures(self) -> dict[str, Any]:
        """By the names that summaries use."""
        return {
            "name": self.expected.name,
            "severity": self.expected.severity,
            "value": self.value,
            "problem": self.problem,
        }


@runtime_checkable
class Tables(Protocol):
    """What answers a question; see `pipeline.asking.query.OpenTables`."""

    def ask(self, sql: str) -> pa.Table:
        """The answer."""


@cache
def declared_expectations() -> tuple[Expectation, ...]:
    """Those that hold for every run, from schemas/expectations.toml.

    Returns
    -------
    The expectations, in the order of the file.

    Raises
    ------
    ConfigError
        The file is damaged.
    """
    try:
        entries = tomllib.loads(DECLARED.read_text())["expect"]
        return tuple(Expectation.model_validate(entry) for entry in entries)
    except (KeyError, ValueError, ValidationError) as error:
        raise ConfigError(
            f"{DECLARED} cannot be read ({error})", "Install softgrip anew"
        ) from error


def check_expectations(
    stage: str, own: Sequence[Expectation], artifacts: Mapping[str, Path], cache_folder: Path
) -> list[Found]:
    """Check what is expected at the end of a stage.

    What is declared for every run SQLite answers where rows are few; DuckDB answers all where they
    are many, or where run.toml asks too.

    Parameters
    ----------
    stage
        Name of the stage.
    own
        What run.toml expects beside what is declared for every run.
    artifacts
        Stage → artifact, of those that are there.
    cache_folder
        Keeps the rows of artifacts that did not change.

    Returns
    -------
    One finding for each expectation of that stage.
    """
    declared, asked = (
        [one.model_copy(update={"stage": stage}) for one in some if one.stage in {stage, EVERY}]
        for some in (declared_expectations(), own)
    )
    if not asked:
        questions = [one.sql for one in declared]
        with few_rows(questions, stage, artifacts, cache_folder) as few:
            if few is not None:
                return [held(one, few.number(one.sql)) for one in declared]
    from pipeline.asking.query import open_tables  # loads DuckDB, most of a check

    makers = None if asked else [stage]  # to read an index takes 2 ms, and a run has six
    with open_tables(artifacts, cache_folder, stage, makers) as tables:
        return [check(one, tables) for one in (*declared, *asked)]


def check(expected: Expectation, tables: Tables) -> Found:
    """Ask one number and hold it against its bounds; what cannot be asked does not hold."""
    try:
        answer = tables.ask(expected.sql)
    except SoftgripError as error:
        return Found(expected, None, f"cannot be asked: {error.what}")
    if answer.num_rows != 1 or answer.num_columns != 1:
        shape = f"{answer.num_rows} rows of {answer.num_columns} columns"
        return Found(expected, None, f"the answer must be one number, and is {shape}")
    return held(expected, answer.column(0)[0].as_py())


def held(expected: Expectation, answer: float | Decimal | None) -> Found:
    """A number held against its bounds."""
    if answer is None or not math.isfinite(float(answer)):
        return Found(expected, None, "there is no number")
    return Found(expected, float(answer), outside(float(answer), expected))


def outside(value: float, expected: Expectation) -> str:
    """How a value leaves its bounds, in words; empty within them."""
    if expected.at_least is not None and value < expected.at_least:
        return f"is {value:g}, must be at least {expected.at_least:g}"
    if expected.at_most is not None and value > expected.at_most:
        return f"is {value:g}, must be at most {expected.at_most:g}"
    return ""


def as_markdown(found: Sequence[Found]) -> str:
    """A table of what was found, what does not hold first."""
    rows = sorted(found, key=lambda one: (not one.is_error, not one.problem))
    lines = ["| stage | expected | found | |", "|-|-|-|-|"]
    for one in rows:
        value = "none" if one.value is None else f"{one.value:g}"
        verdict = f"**{one.expected.severity}**: {one.problem}" if one.problem else "holds"
        name = one.expected.name.replace("|", "\\|")
        told = verdict.replace("|", "\\|")
        lines.append(f"| {one.expected.stage} | {name} | {value} | {told} |")
    return "\n".join(lines) + "\n"
