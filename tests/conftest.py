"""Arrays are checked against their annotations; what takes minutes begins first.

Property tests draw the same examples wherever they run, and have no deadline: a busy machine makes
no test fail, and a failure is one that everybody can repeat.
"""

import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

from tests.checked_shapes import VARIABLE

HERE = Path(__file__).parent
# Before anything imports pipeline; the programs that tests start, some elsewhere, inherit it.
os.environ[VARIABLE] = "tests.checked_shapes"
os.environ["PYTHONPATH"] = os.pathsep.join(
    [str(HERE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
)
# Tests start hundreds of programs, which would each compile all that they import.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
settings.register_profile("same everywhere", deadline=None, derandomize=True)
settings.load_profile("same everywhere")
LONGEST = (
    "regression/test_ci_run.py",
    "stages/test_faults.py",
    "stages/test_commands.py",
    "stages/test_cluster.py",
    "stages/test_freshness.py",
    "gripper/solvers/test_solvers.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files named above first, in that order, then other tests of whole stages, then the rest."""
    first = {HERE / name: rank for rank, name in enumerate(LONGEST)}

    def rank(item: pytest.Item) -> int:
        of_stages = item.path.parent == HERE / "stages"
        return first.get(item.path, len(first) + (not of_stages))

    items.sort(key=rank)
