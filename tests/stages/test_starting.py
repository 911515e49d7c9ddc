"""Stages start without what they do not need: PyTorch takes seconds and much memory to import."""

import subprocess
import sys

from tests.stages.conftest import ROOT

# They predict with the export, or read what a training told; only a training needs PyTorch.
WITHOUT_PYTORCH = (
    *("attempts", "calibrate", "evaluate", "export", "holdout", "live", "predict", "publish"),
    *("real", "referee", "report", "robot", "scenarios", "sensors", "tried"),
)


def test_what_trains_nothing_starts_without_pytorch() -> None:
    imports = ", ".join(f"stages.{name}" for name in WITHOUT_PYTORCH)
    script = f"import sys, {imports}\nassert 'torch' not in sys.modules\n"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
