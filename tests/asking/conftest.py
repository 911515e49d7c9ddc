"""A small run to ask, of an older schema version, and its tables' folder."""

from pathlib import Path

import pytest

from schemas.tables import OF_STAGES
from tests.artifacts.conftest import provenance

__all__ = ["provenance"]

RUN = Path(__file__).parents[1] / "artifacts" / "released" / "v1-0.1.0"


@pytest.fixture
def made() -> dict[str, Path]:
    """Stage → artifact of a run of softgrip 0.1.0."""
    return {table.stage: RUN / f"{table.stage}.mcap" for table in OF_STAGES}


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the run's tables lie, read once for all tests."""
    return tmp_path_factory.mktemp("tables")
