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


LOGARITHMS = """
import numpy as np
import hashlib
x = np.random.default_rng(0).random(4096) + 0.5
print(hashlib.sha256(np.log(x).tobytes() + np.exp(x).tobytes()).hexdigest())
"""
NO_AVX512 = "X86_V4 AVX512_ICL AVX512_SPR"  # NumPy's names
CHOICES = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")


def product(before: str, kernels: str | None) -> str:
    """Digest of a product of matrices in an interpreter of its own."""
    told = said(before + PRODUCT, kernels)
    assert len(told.strip()) == len(hashlib.sha256().hexdigest())
    return told


def said(script: str, kernels: str | None = None, **chosen: str) -> str:
    """What a script prints in an interpreter of its own, where nothing else chose kernels."""
    hidden = (*CHOICES, VARIABLE)  # what checks shapes imports NumPy too
    env = {name: value for name, value in os.environ.items() if name not in hidden} | chosen
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


@pytest.mark.skipif(not HAS_AVX2, reason="this processor has no AVX2")
def test_logarithms_are_those_of_a_processor_without_avx512() -> None:
    pinned = said("import pipeline\n" + LOGARITHMS)
    assert pinned == said(LOGARITHMS, NPY_DISABLE_CPU_FEATURES=NO_AVX512)


COMPILED_FOR = "from numba import config\nprint(repr((config.CPU_NAME, config.CPU_FEATURES)))\n"


@pytest.mark.skipif(not HAS_AVX2, reason="this processor has no AVX2")
def test_code_is_compiled_for_one_kind_of_processor_unless_told_otherwise() -> None:
    assert said("import pipeline.gripper\n" + COMPILED_FOR) == "('haswell', '')\n"
    chosen = said("import pipeline.gripper\n" + COMPILED_FOR, NUMBA_CPU_NAME="generic")
    assert chosen == "('generic', '')\n"
