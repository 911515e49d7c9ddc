"""Rows become the same table however many of them stand in a batch."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.asking import cache as tables
from pipeline.asking.cache import arrow_table, publish_rows
from pipeline.asking.columns import Part, Words
from pipeline.asking.rows import ROWS
from pipeline.errors import ArtifactError


def parts() -> list[Part]:
    """Rows of table samples in three parts whose words come in other orders, one without words."""
    return [
        {"q": np.array([0.5, np.nan]), "object": Words(("cup", "box"), np.array([1, 0]))},
        {"q": np.array([0.25]), "object": Words(("dice", "cup"), np.array([0]))},
        {"sample": np.array([7]), "object": Words((), np.array([-1]))},
    ]


@pytest.mark.parametrize("batch", [1, 2, 100])
def test_rows_are_the_same_however_many_stand_in_a_batch(
    batch: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "BATCH_ROWS", batch)
    artifact = tmp_path / "shards.mcap"
    artifact.touch()
    monkeypatch.setitem(ROWS, "samples", lambda _: iter(parts()))
    found = arrow_table("samples", artifact, tmp_path / "query")
    assert found.column("q").to_pylist() == [0.5, None, 0.25, None]
    assert found.column("object").to_pylist() == ["box", "cup", "dice", None]
    assert found.column("sample").to_pylist() == [None, None, None, 7]
    assert found.column("split").null_count == 4


def test_a_column_that_the_table_lacks_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match="Table samples has no"):
        publish_rows(tmp_path / "a.arrow", "samples", [{"mass": np.ones(1)}])
