"""Labels of the fixed pads are the same bits from code just compiled and from its disk cache."""

import os
import subprocess
import sys
from pathlib import Path

from stages.regress import PADS
from tests.regression.conftest import ROOT

LABEL_THEM = """
import hashlib, sys
from pathlib import Path
from pipeline.config import GripperConfig
from pipeline.regression.pads import labelled_pads

labels = labelled_pads(Path(sys.argv[1]), GripperConfig())
digest = hashlib.sha256()
for array in (labels.q, labels.pressure, labels.wrench, labels.slacks, labels.weights):
    digest.update(array.tobytes())
print(len(labels), digest.hexdigest())
"""


def labelled(cache: Path) -> str:
    return subprocess.run(
        [sys.executable, "-c", LABEL_THEM, str(PADS)],
        cwd=ROOT,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout


def test_a_cold_cache_gives_the_bits_of_a_warm_one(tmp_path: Path) -> None:
    cold = labelled(tmp_path)
    assert list(tmp_path.rglob("*.nbc"))
    assert labelled(tmp_path) == cold
    assert int(cold.split()[0]) >= 64
