"""The renderer is told without a picture, as `auto` would choose it, and asked for once."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipeline.errors import MachineError
from pipeline.execution import renderer
from pipeline.execution.code import ROOT
from pipeline.execution.renderer import EMBREE, identify_renderer

CHOSEN = """
from pipeline.sensing.rendering import new_renderer
from pipeline.config.scenes import ScenesConfig
print(new_renderer("auto", ScenesConfig()).name)
"""


def chosen_by_auto() -> str:
    done = subprocess.run(
        [sys.executable, "-c", CHOSEN], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return done.stdout.split()[-1]


def test_what_is_told_is_what_auto_takes(tmp_path: Path) -> None:
    told = identify_renderer("auto", tmp_path / "memo.json")
    assert chosen_by_auto() == ("embree" if told == EMBREE else "sapien")
    if told != EMBREE:
        assert told.startswith("SAPIEN ")
        assert " on " in told


def test_without_a_driver_it_is_embree_and_sapien_by_name_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    none = tmp_path / "none.json"
    none.write_text(json.dumps({"ICD": {"library_path": "/no/lib.so", "api_version": "1.3.0"}}))
    monkeypatch.setenv("VK_ICD_FILENAMES", str(none))
    monkeypatch.setenv("VK_DRIVER_FILES", str(none))
    assert identify_renderer("auto", tmp_path / "memo.json") == EMBREE
    assert chosen_by_auto() == "embree"
    with pytest.raises(MachineError, match="no Vulkan driver"):
        identify_renderer("sapien", tmp_path / "memo.json")


class Trial:
    """Stands for the trial, and counts how often it is asked."""

    def __init__(self, driver: Path) -> None:
        self.asked, self._driver = 0, driver

    def __call__(self) -> dict[str, Any]:
        self.asked += 1
        return {
            "renderer": f"SAPIEN with {self._driver.read_text()}",
            "watched": [str(self._driver)],
        }


@pytest.fixture
def driver(tmp_path: Path) -> Path:
    driver = tmp_path / "lib.so"
    driver.write_text("driver 1")
    return driver


@pytest.fixture
def trial(driver: Path, monkeypatch: pytest.MonkeyPatch) -> Trial:
    trial = Trial(driver)
    monkeypatch.setattr(renderer, "try_renderer", trial)
    return trial


def test_it_is_tried_once_until_the_driver_changes(
    tmp_path: Path, driver: Path, trial: Trial
) -> None:
    memo = tmp_path / "memo.json"
    for _ in range(3):
        assert identify_renderer("auto", memo) == "SAPIEN with driver 1"
    assert trial.asked == 1
    driver.write_text("driver 10")
    assert identify_renderer("auto", memo) == "SAPIEN with driver 10"
    memo.write_text("{broken")
    assert identify_renderer("auto", memo) == "SAPIEN with driver 10"
    assert trial.asked == 3


def test_another_choice_of_the_user_is_tried_anew(
    tmp_path: Path, trial: Trial, monkeypatch: pytest.MonkeyPatch
) -> None:
    identify_renderer("auto", tmp_path / "memo.json")
    monkeypatch.setitem(os.environ, "VK_ICD_FILENAMES", "/another.json")
    identify_renderer("auto", tmp_path / "memo.json")
    assert trial.asked == 2


def test_embree_asks_nobody(tmp_path: Path, trial: Trial) -> None:
    assert identify_renderer("embree", tmp_path / "memo.json") == EMBREE
    assert trial.asked == 0
