"""Machine code on disk follows what it takes from other modules."""

import shutil
import subprocess
import sys
from pathlib import Path
from types import FunctionType
from typing import cast

import pytest

from pipeline import compiled_code

CALLEE = "from pipeline.compiled_code import njit\n@njit()\ndef twice(x):\n    return {} * x\n"
CONSTANT = "STEP = {}\n"
CALLER = """from pipeline.callee import twice
from pipeline.compiled_code import njit
from pipeline.constant import STEP

@njit()
def stepped(x):
    return twice(x) + STEP

if __name__ == "__main__":
    import pipeline.caller
    print(pipeline.caller.stepped(1.0), sum(pipeline.caller.stepped.stats.cache_hits.values()))
"""


def write(package: Path, factor: float, step: float) -> None:
    (package / "callee.py").write_text(CALLEE.format(factor))
    (package / "constant.py").write_text(CONSTANT.format(step))


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of the same name that holds nothing but what is compiled here."""
    package = tmp_path / "pipeline"
    package.mkdir()
    (package / "__init__.py").touch()
    shutil.copy(compiled_code.__file__, package)
    (package / "caller.py").write_text(CALLER)
    write(package, factor=2.0, step=10.0)
    return package


def result_and_hits(package: Path) -> tuple[float, int]:
    done = subprocess.run(
        [sys.executable, "-m", "pipeline.caller"],
        cwd=package.parent,
        # Python's own bytecode would miss a file that is rewritten within a second.
        env={"PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    result, hits = done.stdout.split()
    return float(result), int(hits)


def test_nothing_is_compiled_again_where_nothing_changed(package: Path) -> None:
    assert result_and_hits(package) == (12.0, 0)
    assert result_and_hits(package) == (12.0, 1)


@pytest.mark.parametrize(("factor", "step", "right"), [(3.0, 10.0, 13.0), (2.0, 20.0, 22.0)])
def test_a_changed_callee_or_constant_of_another_module_is_compiled_in(
    package: Path, factor: float, step: float, right: float
) -> None:
    assert result_and_hits(package) == (12.0, 0)
    write(package, factor, step)
    assert result_and_hits(package) == (right, 0)


def test_a_function_that_is_not_ours_is_kept_as_numba_keeps_it(tmp_path: Path) -> None:
    source = tmp_path / "other.py"
    source.touch()
    function = cast(FunctionType, result_and_hits)
    assert compiled_code.LocatorByAllSources.from_function(function, str(source)) is None
