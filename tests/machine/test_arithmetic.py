"""Sums come in one order on every processor that has AVX2."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.checked_shapes import VARIABLE

CPU = Path("/proc/cpuinfo")
HAS_AVX2 = CPU.is_file() and "avx2" in CPU.read_text()
PRODUCT = """
import numpy as np
a = np.random.default_rng(0).standard_normal((3, 40, 37))
import hashlib
small = [one[:4, :4] @ one[4:8, 4:8] for one in a]  # as poses are: other kernels again
products = [a[0] @ a[1].T @ a[2], *small]
print(hashlib.sha256(b"".join(p.tobytes() for p in products)).hexdigest())
"""


def product(before: str, kernels: str | None) -> str:
    """Digest of a product of matrices in an interpreter of its own."""
    told = said(before + PRODUCT, kernels)
    assert len(told.strip()) == len(hashlib.sha256().hexdigest())
    return told


def said(script: str, kernels: str | None) -> str:
    """What a script prints in an interpreter of its own, where nothing else chose kernels."""
    hidden = ("OPENBLAS_CORETYPE", VARIABLE)  # what checks shapes imports NumPy too
    env = {name: value for name, value in os.environ.items() if name not in hidden}
    if kernels is not None:
        env["OPENBLAS_CORETYPE"] = kernels
    command = [sys.executable, "-c", script]
    return subprocess.run(command, env=env, capture_output=True, text=True, check=True).stdout


@pytest.mark.skipif(not HAS_AVX2, reason="this processor has no AVX2")
def test_products_are_those_of_one_kind_of_processor() -> None:
    pinned = product("import pipeline\n", None)
    assert pinned == product("import stages.scenes\n", None)
    assert pinned == product("", "Haswell")
    # Kernels of another kind, which every such processor can run, sum in another order.
    assert pinned != product("", "Sandybridge")


def test_a_choice_made_outside_stands() -> None:
    assert product("import pipeline\n", "Sandybridge") == product("", "Sandybridge")


@pytest.mark.parametrize("stage", ["scenes", "train"])
def test_a_stage_settles_it_before_numpy_comes(stage: str) -> None:
    """Run by hand as `python -m stages.<stage>`, nothing has imported ``pipeline`` before."""
    script = (
        "import os, sys\n"
        "class Watch:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'numpy':\n"
        "            print('pipeline' in sys.modules, os.environ.get('OPENBLAS_CORETYPE'))\n"
        "sys.meta_path.insert(0, Watch())\n"
        f"import stages.{stage}\n"
    )
    chosen = "Haswell" if HAS_AVX2 else None
    assert said(script, None).split() == ["True", str(chosen)]
