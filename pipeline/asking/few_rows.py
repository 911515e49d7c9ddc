"""Questions over few rows, answered by SQLite.

DuckDB takes 0.08 s of processor time until it can be asked, three times as long as all else that a
short stage's check takes. SQLite, a part of Python, takes 0.002 s, and then more than DuckDB for
every value that it is given.
"""

import math
import re
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from pipeline.asking.tables import mentioned, table_rows
from pipeline.errors import QueryError, SoftgripError
from schemas.tables import BY_NAME

MOST_VALUES = 150_000  # SQLite takes what these cost, about 0.4 us each, before DuckDB is loaded


class FewRows:
    """Tables of few rows in SQLite."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def number(self, sql: str) -> float | None:
        """The one number of an answer; None where there is none.

        Parameters
        ----------
        sql
            The question, in words that DuckDB and SQLite share.

        Returns
        -------
        The number.

        Raises
        ------
        QueryError
            SQLite cannot answer it, or answers other than by one number.
        """
        try:
            ((value,),) = self._connection.execute(sql).fetchall()
        except (sqlite3.Error, ValueError) as error:
            raise QueryError(f"SQLite: {error}", "Ask one number") from error
        return None if value is None else float(value)


@contextmanager
def few_rows(
    questions: Sequence[str], stage: str, artifacts: Mapping[str, Path], cache: Path
) -> Iterator[FewRows | None]:
    """The tables that some questions name, in SQLite.

    Parameters
    ----------
    questions
        All that will be asked.
    stage
        What ``getvariable('stage')`` is; of table inputs this stage's rows alone are there.
    artifacts
        Stage → its artifact, of the stages that are made.
    cache
        Folder of the tables' Arrow files.

    Yields
    ------
    FewRows | None
        What answers them. None where a table cannot be read, its stage is not made or it holds
        too much: DuckDB is to be asked, which tells of each question what is wrong.
    """
    columns = asked_columns(questions)
    try:
        tables = {name: table_rows(name, artifacts, cache, [stage]) for name in columns}
    except SoftgripError:
        yield None
        return
    there = {name: table for name, table in tables.items() if table is not None}
    values = sum(table.num_rows * len(columns[name]) for name, table in there.items())
    if len(there) < len(tables) or values > MOST_VALUES:
        yield None
        return
    connection = sqlite3.connect(":memory:")
    try:
        _add_functions(connection, stage)
        for name, table in there.items():
            _add_table(connection, name, table.select(columns[name]))
        yield FewRows(connection)
    finally:
        connection.close()


def asked_columns(questions: Sequence[str]) -> dict[str, list[str]]:
    """Table → its columns whose names stand in a question beside its own."""
    words: dict[str, set[str]] = {}
    for question in questions:
        for name in mentioned(question):
            words.setdefault(name, set()).update(re.findall(r"\w+", question.lower()))
    return {
        name: [column.name for column in BY_NAME[name].columns if column.name in found]
        for name, found in words.items()
    }


def _add_functions(connection: sqlite3.Connection, stage: str) -> None:
    """What DuckDB has and SQLite lacks, or has only where it was built so."""
    connection.create_function("getvariable", 1, {"stage": stage}.get, deterministic=True)
    connection.create_function("greatest", -1, lambda *v: max(_there(v), default=None))
    connection.create_function("least", -1, lambda *v: min(_there(v), default=None))
    connection.create_function("floor", 1, lambda v: None if v is None else float(math.floor(v)))
    connection.create_function("isfinite", 1, lambda v: None if v is None else math.isfinite(v))


def _there(values: Sequence[Any]) -> list[Any]:
    return [value for value in values if value is not None]


def _add_table(connection: sqlite3.Connection, name: str, table: pa.Table) -> None:
    columns = [_values(column) for column in table.columns]
    # A table needs a column, and a question may count rows without naming one.
    columns = columns or [list(range(table.num_rows))]
    names = ", ".join(f'"{column}"' for column in table.column_names or ["row number"])
    places = ", ".join("?" * len(columns))
    connection.execute(f'CREATE TABLE "{name}" ({names})')
    connection.executemany(f'INSERT INTO "{name}" VALUES ({places})', zip(*columns, strict=True))


def _values(column: pa.ChunkedArray) -> list[Any]:
    """The values of a column, None where there is none."""
    values: list[Any] = []
    for chunk in column.chunks:
        if isinstance(chunk, pa.DictionaryArray):
            words = [word.as_py() for word in chunk.dictionary]
            values += [
                None if number is None else words[number] for number in _plain(chunk.indices)
            ]
        else:
            values += _plain(chunk)
    return values


def _plain(numbers: pa.Array) -> list[Any]:
    """Numbers of an array; its own to_pylist and to_numpy would load pandas, half a second."""
    validity, stored = numbers.buffers()
    first, end = numbers.offset, numbers.offset + len(numbers)
    found: list[Any] = np.frombuffer(stored, numbers.type.to_pandas_dtype())[first:end].tolist()
    if numbers.null_count:
        there = np.unpackbits(np.frombuffer(validity, np.uint8), bitorder="little")[first:end]
        found = [value if is_there else None for value, is_there in zip(found, there, strict=True)]
    return found
