"""Every equation and step of the supplement can be found in the code by its number."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = "\n".join(
    path.read_text()
    for folder in (
        "pipeline/gripper",
        "pipeline/labelling",
        "pipeline/sensing",
        "pipeline/world",
        "pipeline/config",
    )
    for path in sorted((ROOT / folder).rglob("*.py"))
) + "\n".join((ROOT / "stages" / name).read_text() for name in ("grasps.py",))


@pytest.mark.parametrize("number", range(1, 15))
def test_an_equation_is_named(number: int) -> None:
    assert f"Eq. ({number})" in SOURCES


@pytest.mark.parametrize("number", range(1, 16))
def test_a_step_is_named(number: int) -> None:
    assert f"S-1.{number:02d}" in SOURCES


@pytest.mark.parametrize("name", ["A-1", "A-2", "A-3", "Table I", "Desample", "Disturb"])
def test_an_assumption_table_or_procedure_is_named(name: str) -> None:
    assert name in SOURCES
