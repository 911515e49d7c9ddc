"""A wrong shape is an error in the tests' process, in workers, and in programs that tests start."""

import ast
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from pathlib import Path

import numpy as np
import pytest
from beartype.roar import BeartypeCallHintParamViolation, BeartypeCallHintViolation

from pipeline.errors import ArtifactError
from pipeline.execution import run_in_order
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert
from pipeline.network.figures import mean_absolute_error
from pipeline.network.loading import epoch_batches
from tests.checked_shapes import BYTECODE, CheckingLoader, unchecked, with_checks

ROOT = Path(__file__).parents[1]


def inverted(side: int) -> str:
    """A worker's job: what came of inverting a transform of ``side`` rows."""
    try:
        return str(invert(np.eye(side)).shape)
    except BeartypeCallHintParamViolation as violation:
        return type(violation).__name__


def test_a_wrong_shape_raises_here() -> None:
    with pytest.raises(BeartypeCallHintParamViolation, match="4"):
        invert(np.eye(3))


def test_lengths_that_disagree_raise_though_each_is_right() -> None:
    with pytest.raises(BeartypeCallHintViolation, match="dimension"):
        mean_absolute_error(np.zeros(3), np.zeros(4))


def test_a_dataclass_checks_its_fields() -> None:
    with pytest.raises(BeartypeCallHintParamViolation, match="vertices_m"):
        Mesh(np.zeros((3, 2)), np.zeros((1, 3), dtype=np.int64))


def test_arrays_of_a_list_may_differ_in_length() -> None:
    assert {len(batch) for batch in epoch_batches(10, 4, np.random.default_rng(0))} == {3, 4}


def test_a_wrong_shape_raises_in_spawned_workers() -> None:
    found = list(run_in_order(inverted, [3, 4], workers=2))
    assert found == ["BeartypeCallHintParamViolation", "(4, 4)"]


def test_a_wrong_shape_raises_in_a_program_and_in_a_stage_that_is_one() -> None:
    program = (
        "import runpy, sys\n"
        "import numpy as np\n"
        "stage = runpy.run_module('stages.shards', run_name='__mp_main__')\n"
        "for wrong in (lambda: stage['gather'](3),\n"
        "              lambda: sys.modules['pipeline.labelling.balancing']\n"
        "              .quality_histogram(np.zeros((2, 2)))):\n"
        "    try:\n"
        "        wrong()\n"
        "    except Exception as error:\n"
        "        print(type(error).__name__)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["BeartypeCallHintParamViolation"] * 2


def test_unchecked_lets_wrong_shapes_reach_the_code() -> None:
    with unchecked(), pytest.raises(ArtifactError, match="3 predictions of 4"):
        mean_absolute_error(np.zeros(3), np.zeros(4))


def test_compiled_functions_and_inner_ones_stay_as_they_are() -> None:
    source = (
        '"""Words."""\n'
        "import numba\n"
        "@numba.njit(cache=True)\n"
        "def fast(x: int) -> int: ...\n"
        "@compiled\n"
        "def faster(x: int) -> int: ...\n"
        "@lru_cache\n"
        "def plain(x: int) -> int:\n"
        "    def inner(y: int) -> int: ...\n"
    )
    text = ast.unparse(with_checks(ast.parse(source)))
    assert text.count(".checked\n") == 1
    assert "@lru_cache\n@tests.checked_shapes.checked\ndef plain" in text


def test_the_ordinary_bytecode_is_not_touched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As ``python -m`` asks a loader for code: what it keeps must not end up in other runs."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.setattr(sys, "pycache_prefix", None)
    source = tmp_path / "module.py"
    source.write_text("def plain(x: int) -> int:\n    return x\n")
    with_them = CheckingLoader("module", str(source))
    for _ in range(2):  # from the source, then from bytecode
        code = with_them.get_code("module")
        assert code is not None
        assert "checked" in code.co_names
    (kept,) = (tmp_path / "__pycache__").iterdir()
    assert kept.name.endswith(BYTECODE)
    ordinary = SourceFileLoader("module", str(source)).get_code("module")
    assert ordinary is not None
    assert "checked" not in ordinary.co_names
