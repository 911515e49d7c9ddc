"""Tables as Arrow files in a run's state, each by the digest of the artifact that it was read from.

An artifact is read once; from then on a question maps the file and touches only the columns that
it names. While a stage is made anew its artifact, the index last of all, stays as it was, and so
does the table: what is asked meanwhile is the last whole state. `make prune` frees the files.
"""

import hashlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
from filelock import FileLock

from pipeline.artifacts.digests import content_digests
from pipeline.artifacts.publishing import published
from pipeline.asking.rows import NONE, ROWS, Part, Values, Words
from pipeline.errors import ArtifactError
from schemas.tables import BY_NAME, TEXT, Table

QUERY_CACHE = "query"  # in the run's state
CACHE_VERSION = 1  # rises whenever rows are made in another way
DIGITS = 16  # of a digest: enough to tell the artifacts of one run apart


def arrow_table(name: str, artifact: Path, cache: Path) -> pa.Table:
    """A table of a run, mapped from its file; read from the artifact first where there is none.

    Parameters
    ----------
    name
        Of the table.
    artifact
        The artifact that holds its rows.
    cache
        Folder of the Arrow files; files of former artifacts are removed.

    Returns
    -------
    The table; what is not used of it is not in memory.

    Raises
    ------
    ArtifactError
        The artifact is damaged, of another version, or its shards are being made anew.
    """
    table = BY_NAME[name]
    cache.mkdir(parents=True, exist_ok=True)
    with FileLock(cache / f"{name}.lock"):
        digest = content_digests({name: artifact}, cache / f"{name}.digest.json")[name]
        described = repr((CACHE_VERSION, table)).encode()
        version = hashlib.sha256(described).hexdigest()[:DIGITS]
        path = cache / f"{name}-{digest[:DIGITS]}-{version}.arrow"
        if not path.is_file():
            with published(path) as scratch:
                write_rows(scratch, table, ROWS[name](artifact))
            for older in cache.glob(f"{name}-*.arrow"):
                if older != path:
                    older.unlink()
    return pa.ipc.open_file(pa.memory_map(str(path))).read_all()


def write_rows(path: Path, table: Table, parts: Iterator[Part]) -> None:
    """Write the rows of a table as an Arrow file, part by part.

    Parameters
    ----------
    path
        The file.
    table
        Its columns.
    parts
        Their values; a column that is missing is NULL in every row.

    Raises
    ------
    ArtifactError
        A part has a column that the table lacks.
    """
    known = {column.name: Vocabulary() for column in table.columns if column.kind == TEXT}
    schema = arrow_schema(table)
    # Vocabularies only grow, and what is new of them is written beside the part that needs it.
    options = pa.ipc.IpcWriteOptions(emit_dictionary_deltas=True)
    with pa.OSFile(str(path), "wb") as file, pa.ipc.new_file(file, schema, options=options) as out:
        for part in parts:
            if strange := set(part) - set(schema.names):
                raise ArtifactError(f"Table {table.name} has no {strange}", "Report this")
            rows = max((len(values) for values in part.values()), default=0)
            arrays = [
                arrow_array(part.get(field.name), rows, field.type, known.get(field.name))
                for field in schema
            ]
            if rows:
                out.write_batch(pa.record_batch(arrays, schema=schema))


class Vocabulary:
    """The words of one column so far, in the order they came."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self._words = pa.array([], pa.string())

    def encode(self, column: Words) -> pa.DictionaryArray:
        """The column over all words so far and its own."""
        numbers = [self._numbers.setdefault(word, len(self._numbers)) for word in column.names]
        if len(self._numbers) > len(self._words):
            self._words = pa.array(list(self._numbers), pa.string())
        none = np.asarray(column.index) == NONE
        index = np.array([*numbers, 0], dtype=np.int32)[np.asarray(column.index, dtype=np.int64)]
        return pa.DictionaryArray.from_arrays(pa.array(index, mask=none), self._words)


def arrow_schema(table: Table) -> pa.Schema:
    """The Arrow types of a table's columns."""
    text = pa.dictionary(pa.int32(), pa.string())
    return pa.schema(
        [
            (column.name, text if column.kind == TEXT else pa.from_numpy_dtype(column.kind))
            for column in table.columns
        ]
    )


def arrow_array(
    values: Values | None, rows: int, kind: pa.DataType, vocabulary: Vocabulary | None
) -> pa.Array:
    """One column of a part; NaN, and a word that is not there, is NULL.

    Parameters
    ----------
    values
        Its values; None where the file does not tell.
    rows
        How many there are.
    kind
        The column's type.
    vocabulary
        Of a column of words.

    Returns
    -------
    The column.
    """
    if vocabulary is not None:
        if not isinstance(values, Words):
            values = Words((), np.full(rows, NONE))
        return vocabulary.encode(values)
    if values is None or isinstance(values, Words):
        return pa.nulls(rows, kind)
    array = np.asarray(values, dtype=kind.to_pandas_dtype())
    return pa.array(array, kind, from_pandas=True)
