"""An answer reads the same from the screen, a CSV and a Parquet file."""

from pathlib import Path

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest

from pipeline.asking.answers import MOST_LINES, as_text, write_answer
from pipeline.errors import QueryError

ANSWER = pa.table({"object": ["mug", None], "q": [0.25, 1.0], "grasps": [3, 4]})


def test_files_hold_what_was_answered(tmp_path: Path) -> None:
    write_answer(ANSWER, tmp_path / "a.parquet")
    assert pa.parquet.read_table(tmp_path / "a.parquet") == ANSWER
    write_answer(ANSWER, tmp_path / "a.csv")
    back = pa.csv.read_csv(tmp_path / "a.csv")
    assert back.column("q").to_pylist() == [0.25, 1.0]
    assert back.column("object").to_pylist() == ["mug", ""]
    with pytest.raises(QueryError, match=r"\.csv or \.parquet"):
        write_answer(ANSWER, tmp_path / "a.xlsx")


def test_the_screen_shows_the_first_rows_and_how_many_there_are() -> None:
    lines = as_text(ANSWER).splitlines()
    assert [line.split() for line in lines[2:]] == [["mug", "0.25", "3"], ["NULL", "1", "4"]]
    text = as_text(pa.table({"n": list(range(MOST_LINES + 5))}))
    assert len(text.splitlines()) == MOST_LINES + 3
    assert f"{MOST_LINES + 5} rows in all" in text
    assert as_text(pa.table({"n": pa.array([], pa.int64())})) == "n\n-\n"
