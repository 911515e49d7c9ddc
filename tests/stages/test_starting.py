"""Stages start without what they do not need: PyTorch takes seconds and much memory to import.

Neither do workers, which import the module of the stage that started them.
"""

import subprocess
import sys

import pytest

from tests.stages.conftest import ROOT

# They predict with the export, or read what a training told; only a training needs PyTorch.
WITHOUT_PYTORCH = (
    *("attempts", "calibrate", "evaluate", "export", "holdout", "live", "predict", "publish"),
    *("real", "referee", "report", "robot", "scenarios", "sensors", "tried"),
)
# What their workers import; drawing is their parent's.
WITHOUT_RERUN = ("attempts", "evaluate", "grasps", "objects", "scenes", "shards")


@pytest.mark.parametrize(
    ("package", "stages"), [("torch", WITHOUT_PYTORCH), ("rerun", WITHOUT_RERUN)]
)
def test_what_is_not_needed_is_not_imported(package: str, stages: tuple[str, ...]) -> None:
    imports = ", ".join(f"stages.{name}" for name in stages)
    script = f"import sys, {imports}\nassert {package!r} not in sys.modules\n"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
