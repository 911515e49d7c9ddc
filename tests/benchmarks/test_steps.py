"""A step's time is the sum of its functions', by whichever commit's names."""

import cProfile
import pstats
from pathlib import Path

import pytest

from pipeline.benchmarks import steps


def label() -> float:
    """Stands for the function of this name in both commits."""
    return sum(float(number) for number in range(20000))


def test_functions_are_found_by_file_and_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    profiler = cProfile.Profile()
    profiler.runcall(label)
    profiler.dump_stats(tmp_path / "profile")
    here = f"{Path(__file__).name} label"
    monkeypatch.setattr(steps, "STEPS", {"all": (here, "elsewhere.py label"), "none": ("x y",)})
    found = steps.step_ms(pstats.Stats(str(tmp_path / "profile")))
    assert found["all"] > 0.0
    assert found["none"] == 0.0


def test_the_least_of_the_turns_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(steps, "STEPS", {"QP": ()})
    assert steps.least([{"QP": 2.04}, {"QP": 1.06}]) == {"QP": 1.1}
