"""An answer as text, CSV or Parquet."""

import io
import math
from pathlib import Path

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from pipeline.artifacts.publishing import published
from pipeline.errors import QueryError

MOST_LINES = 60  # of a table on the screen; files hold all rows
WIDEST = 48  # characters of a cell on the screen
FILE_KINDS = (".csv", ".parquet")


def write_answer(answer: pa.Table, path: Path) -> None:
    """Write an answer to a file whole, by its ending.

    Parameters
    ----------
    answer
        The answer.
    path
        A name that ends in .csv or .parquet.

    Raises
    ------
    QueryError
        It ends in something else.
    """
    kind = path.suffix.lower()
    if kind not in FILE_KINDS:
        raise QueryError(
            f"{path} is no kind of file that answers are written to",
            f"Name one that ends in {' or '.join(FILE_KINDS)}",
        )
    with published(path) as scratch:
        if kind == ".csv":
            pa.csv.write_csv(answer, str(scratch))
        else:
            pa.parquet.write_table(answer, str(scratch))


def as_text(answer: pa.Table) -> str:
    """An answer as a table for the screen; the first rows of a long one, and how many there are."""
    names = list(answer.column_names)
    rows = [
        [_cell(value) for value in row.values()] for row in answer.slice(0, MOST_LINES).to_pylist()
    ]
    numeric = [pa.types.is_floating(t) or pa.types.is_integer(t) for t in answer.schema.types]
    widths = [max(map(len, column)) for column in zip(names, *rows, strict=True)]
    out = io.StringIO()
    for line in (names, ["-" * width for width in widths], *rows):
        cells = [
            cell.rjust(width) if right else cell.ljust(width)
            for cell, width, right in zip(line, widths, numeric, strict=True)
        ]
        out.write("  ".join(cells).rstrip() + "\n")
    if answer.num_rows > MOST_LINES:
        out.write(f"... {answer.num_rows} rows in all: OUT=answer.csv holds them\n")
    return out.getvalue()


def _cell(value: object) -> str:
    """A value in few digits."""
    if value is None:
        return "NULL"
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else str(value)
    text = str(value)
    return text if len(text) <= WIDEST else f"{text[: WIDEST - 1]}…"
