"""SQL over the tables of one run, by DuckDB; what is wrong is told with the columns that exist."""

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import duckdb
import pyarrow as pa

from pipeline.asking.tables import mentioned, table_rows
from pipeline.errors import QueryError
from schemas.tables import BY_NAME


def ask(sql: str, artifacts: Mapping[str, Path], cache: Path) -> pa.Table:
    """Answer a question.

    Parameters
    ----------
    sql
        One or more statements of DuckDB's SQL; the answer is the last one's.
    artifacts
        Stage → its artifact, of the stages that are made.
    cache
        Folder of the tables' Arrow files.

    Returns
    -------
    The answer.

    Raises
    ------
    QueryError
        DuckDB cannot answer it, or it asks for a table whose stage is not made.
    """
    with open_tables(artifacts, cache) as tables:
        return tables.ask(sql)


class OpenTables:
    """The tables of a run, of which those that a question names are opened, once."""

    def __init__(
        self,
        connection: duckdb.DuckDBPyConnection,
        artifacts: Mapping[str, Path],
        cache: Path,
        makers: Sequence[str] | None,
    ) -> None:
        self._connection = connection
        self._artifacts = artifacts
        self._cache = cache
        self._makers = makers
        self._opened: set[str] = set()

    def ask(self, sql: str) -> pa.Table:
        """Answer a question; as `ask`."""
        for name in mentioned(sql):
            if name in self._opened:
                continue
            rows = table_rows(name, self._artifacts, self._cache, self._makers)
            if rows is not None:
                self._connection.register(name, rows)
                self._opened.add(name)
        try:
            relation = self._connection.sql(sql)
            if relation is None:
                raise QueryError("The last statement answers nothing", "End with a SELECT")
            return relation.to_arrow_table()
        except duckdb.Error as error:
            raise QueryError(str(error), remedy_of(sql, str(error), self._artifacts)) from error


@contextmanager
def open_tables(
    artifacts: Mapping[str, Path],
    cache: Path,
    stage: str = "",
    makers: Sequence[str] | None = None,
) -> Iterator[OpenTables]:
    """The tables of a run for several questions.

    Parameters
    ----------
    artifacts
        Stage → its artifact, of the stages that are made.
    cache
        Folder of the tables' Arrow files.
    stage
        What ``getvariable('stage')`` is in a question: the stage that has ended, if one has.
    makers
        Of table inputs: the stages whose rows are asked for; None: all.

    Yields
    ------
    OpenTables
        What answers them.
    """
    # A name in SQL is a table or a file, never a variable of this program. And the order in which
    # several threads add up shows in the last digits of a mean.
    with duckdb.connect(config={"python_enable_replacements": False, "threads": 1}) as connection:
        connection.execute("SET VARIABLE stage = $stage", {"stage": stage})
        yield OpenTables(connection, artifacts, cache, makers)


def remedy_of(sql: str, reason: str, artifacts: Mapping[str, Path]) -> str:
    """What a person may do about a question that failed: the columns, or the tables, that exist.

    Parameters
    ----------
    sql
        The question.
    reason
        DuckDB's message.
    artifacts
        Stage → its artifact, of the stages that are made.

    Returns
    -------
    A sentence.
    """
    asked = mentioned(sql)
    missing = [name for name in asked if BY_NAME[name].stage not in {"", *artifacts}]
    if missing:
        stages = dict.fromkeys(BY_NAME[name].stage for name in missing)
        return f"Make them first, or leave out {', '.join(missing)}: {', '.join(stages)} not made"
    if not asked:
        unknown = re.search(r"Table with name (\w+)", reason)
        return f"{_nearest(unknown, list(BY_NAME))}Tables are {', '.join(BY_NAME)}"
    columns = {name: [column.name for column in BY_NAME[name].columns] for name in asked}
    every = [column for names in columns.values() for column in names]
    unknown = re.search(r'column "([^"]+)"', reason)
    told = "; ".join(f"{name}: {', '.join(names)}" for name, names in columns.items())
    return f"{_nearest(unknown, every)}Columns are {told}"


def _nearest(unknown: re.Match[str] | None, names: list[str]) -> str:
    near = difflib.get_close_matches(unknown[1], names, n=1) if unknown else []
    return f"Did you mean {near[0]}? " if near else ""
