"""Order of the tests: what takes minutes begins first, so that cores end together."""

from pathlib import Path

import pytest

HERE = Path(__file__).parent
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
