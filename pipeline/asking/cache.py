"""Tables as Arrow files in a run's state, each in a folder by the digest of its artifact.

An artifact is read once, or not at all where those who wrote it wrote its rows too; from then on a
question maps the files and touches only the columns that it names. While a stage is made anew its
artifact, the index last of all, stays as it was, and so does the table: what is asked meanwhile is
the last whole state. `make prune` frees the files.
"""

import hashlib
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Self

import numpy as np
import pyarrow as pa
from filelock import FileLock

from pipeline.artifacts.digests import content_digests
from pipeline.artifacts.publishing import published, published_folder
from pipeline.asking.columns import NONE, Part, Values, Words
from pipeline.errors import ArtifactError
from schemas.tables import BY_NAME, TEXT, Column, Table

QUERY_CACHE = "query"  # in the run's state
CACHE_VERSION = 3  # rises whenever rows are made in another way
BATCH_ROWS = 1 << 16  # beside so many rows, what a batch costs by itself does not count
DIGITS = 16  # of a digest: enough to tell the artifacts of one run apart


def arrow_table(name: str, artifact: Path, cache: Path) -> pa.Table:
    """A table of a run, mapped from its files; read from the artifact first where there are none.

    Parameters
    ----------
    name
        Of the table.
    artifact
        The artifact that holds its rows.
    cache
        Folder of the tables; those of former artifacts are removed.

    Returns
    -------
    The table; what is not used of it is not in memory.

    Raises
    ------
    ArtifactError
        The artifact is damaged, of another version, or its shards are being made anew.
    """
    with _held(name, cache):
        folder = _folder_of(name, artifact, cache)
        if not folder.is_dir():
            # What reads messages takes seconds to load, and most questions find their tables made.
            from pipeline.asking.rows import ROWS

            with published_folder(folder) as scratch:
                publish_rows(_part(scratch, 0), name, ROWS[name](artifact))
            _remove_former(folder, name)
        parts = sorted(folder.iterdir())
    return pa.concat_tables([pa.ipc.open_file(pa.memory_map(str(p))).read_all() for p in parts])


def keep_rows(name: str, artifact: Path, cache: Path, files: Sequence[Path]) -> None:
    """Take over the rows of an artifact from those who wrote it, so that nobody reads it for them.

    Parameters
    ----------
    name
        Of the table.
    artifact
        The finished artifact.
    cache
        Folder of the tables, on the same disk as the files; tables of former artifacts are removed.
    files
        Arrow files of its rows in order, by `publish_rows`; they are moved.
    """
    with _held(name, cache):
        folder = _folder_of(name, artifact, cache)
        if not folder.is_dir():
            with published_folder(folder) as scratch:
                for number, file in enumerate(files):
                    file.rename(_part(scratch, number))
            _remove_former(folder, name)


@contextmanager
def _held(name: str, cache: Path) -> Iterator[None]:
    """One process at a time makes a table."""
    cache.mkdir(parents=True, exist_ok=True)
    with FileLock(cache / f"{name}.lock"):
        yield


def _remove_former(folder: Path, name: str) -> None:
    """Remove a table of former artifacts."""
    for older in folder.parent.glob(f"{name}-*"):
        if older.is_file():  # of a version that kept a table in one file
            older.unlink()
        elif older != folder:
            shutil.rmtree(older)


def _part(folder: Path, number: int) -> Path:
    return folder / f"{number:05d}.arrow"


def _folder_of(name: str, artifact: Path, cache: Path) -> Path:
    """The folder of a table, by the artifact's content and the columns as they are now."""
    digest = content_digests({name: artifact}, cache / f"{name}.digest.json")[name]
    described = repr((CACHE_VERSION, BY_NAME[name])).encode()
    version = hashlib.sha256(described).hexdigest()[:DIGITS]
    return cache / f"{name}-{digest[:DIGITS]}-{version}"


def publish_rows(path: Path, name: str, parts: Iterable[Part]) -> None:
    """Write the rows of a table as an Arrow file, whole or not at all, many parts at a time.

    Parameters
    ----------
    path
        The file.
    name
        Of the table.
    parts
        Their values; a column that is missing is NULL in every row.

    Raises
    ------
    ArtifactError
        A part has a column that the table lacks.
    """
    with published(path) as scratch, RowsFile(scratch, BY_NAME[name]) as rows:
        for part in parts:
            rows.add(part)


class RowsFile:
    """An Arrow file of a table that takes rows part by part; a context manager."""

    def __init__(self, path: Path, table: Table) -> None:
        self._table = table
        self._schema = arrow_schema(table)
        self._columns = {column.name: GrowingColumn(column) for column in table.columns}
        self._waiting = 0
        # Vocabularies only grow, and what is new of one is written beside the batch that needs it.
        options = pa.ipc.IpcWriteOptions(emit_dictionary_deltas=True)
        self._file = pa.OSFile(str(path), "wb")
        self._writer = pa.ipc.new_file(self._file, self._schema, options=options)

    def add(self, part: Part) -> None:
        """Take some rows; ArtifactError where the table lacks a column of theirs."""
        if strange := part.keys() - self._columns.keys():
            raise ArtifactError(f"Table {self._table.name} has no {strange}", "Report this")
        rows = max((len(values) for values in part.values()), default=0)
        for name, column in self._columns.items():
            column.add(part.get(name), rows)
        self._waiting += rows
        if self._waiting >= BATCH_ROWS:
            self._write_waiting()

    def _write_waiting(self) -> None:
        arrays = [column.taken() for column in self._columns.values()]
        self._writer.write_batch(pa.record_batch(arrays, schema=self._schema))
        self._waiting = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        if self._waiting and failure[0] is None:
            self._write_waiting()
        self._writer.close()
        self._file.close()


class GrowingColumn:
    """Values of one column that wait to be written; NaN, and a word that is not there, is NULL."""

    def __init__(self, column: Column) -> None:
        self._type = arrow_type(column)
        self._numbers: dict[str, int] | None = {} if column.kind == TEXT else None
        self._waiting: list[np.ndarray] = []
        self._missing: list[np.ndarray] = []
        self._last: tuple[tuple[str, ...], np.ndarray] = ((), np.array([NONE], np.int32))

    def add(self, values: Values | None, rows: int) -> None:
        """Let the values of a part wait; None where the file does not tell them.

        Parameters
        ----------
        values
            The values.
        rows
            How many there are.
        """
        if self._numbers is not None:
            kept = self._numbers_of(values) if isinstance(values, Words) else np.full(rows, NONE)
        elif values is None or isinstance(values, Words):
            kept = np.zeros(rows, self._type.to_pandas_dtype())
        else:
            kept = np.asarray(values, self._type.to_pandas_dtype())
        self._waiting.append(kept)
        self._missing.append(np.full(rows, values is None or isinstance(values, Words)))

    def taken(self) -> pa.Array:
        """What waits, as one array; nothing waits any longer."""
        values, missing = np.concatenate(self._waiting), np.concatenate(self._missing)
        self._waiting, self._missing = [], []
        if self._numbers is not None:
            numbers = plain_array(values, values == NONE, pa.int32())
            return pa.DictionaryArray.from_arrays(numbers, string_array(list(self._numbers)))
        if pa.types.is_floating(self._type):
            missing |= np.isnan(values)
        return plain_array(values, missing, self._type)

    def _numbers_of(self, column: Words) -> np.ndarray:
        """The column's words by their numbers, in the order in which words came."""
        assert self._numbers is not None
        names, numbers = self._last
        if names != column.names:
            known = self._numbers
            found = [known.setdefault(word, len(known)) for word in column.names]
            numbers = np.array([*found, NONE], dtype=np.int32)  # NONE as an index is the last
            self._last = (column.names, numbers)
        of_rows: np.ndarray = numbers[column.index]
        return of_rows


def arrow_type(column: Column) -> pa.DataType:
    """The Arrow type of a column."""
    if column.kind == TEXT:
        return pa.dictionary(pa.int32(), pa.string())
    return pa.from_numpy_dtype(column.kind)


def arrow_schema(table: Table) -> pa.Schema:
    """The Arrow types of a table's columns."""
    return pa.schema([(column.name, arrow_type(column)) for column in table.columns])


# Arrays are made of buffers: pyarrow.array would load pandas, half a second of a short stage.
def plain_array(values: np.ndarray, missing: np.ndarray, kind: pa.DataType) -> pa.Array:
    """Numbers as an Arrow array.

    Parameters
    ----------
    values
        Of any number type, shape (n,).
    missing
        Which of them are NULL, shape (n,).
    kind
        The array's type.

    Returns
    -------
    The array.
    """
    stored = np.ascontiguousarray(values, dtype=kind.to_pandas_dtype())
    there = np.packbits(~missing, bitorder="little") if missing.any() else None
    validity = None if there is None else pa.py_buffer(there)
    return pa.Array.from_buffers(kind, len(stored), [validity, pa.py_buffer(stored)])


def string_array(words: list[str]) -> pa.Array:
    """Words as an Arrow array."""
    encoded = [word.encode() for word in words]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(b"".join(encoded))]
    return pa.Array.from_buffers(pa.string(), len(words), buffers)
