"""What the artifacts of a run were made from, as a table: no row of it lies in a message."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa

from pipeline.artifacts.digests import MEMO, content_digests
from pipeline.artifacts.reading import read_provenance
from pipeline.asking.cache import GrowingColumn, arrow_schema
from pipeline.asking.columns import words
from schemas.tables import INPUTS


def inputs_table(
    artifacts: Mapping[str, Path], cache: Path, makers: Sequence[str] | None = None
) -> pa.Table:
    """Every file that a stage read, and what lies there now where it is an artifact of the run.

    Parameters
    ----------
    artifacts
        Stage → its artifact, of the stages that are made.
    cache
        Folder of the tables' Arrow files, in the run's state: digests are remembered beside it.
    makers
        The stages whose rows are asked for; None: all.

    Returns
    -------
    Table inputs.

    Raises
    ------
    ArtifactError
        A record of provenance is damaged: it does not match its own digest.
    """
    read = [
        (stage, record, used)
        for stage, record in (
            (s, read_provenance(path))
            for s, path in artifacts.items()
            if makers is None or s in makers
        )
        for used in record.inputs
    ]
    named = {used.path for _, _, used in read}
    there = {path.name: path for path in artifacts.values() if path.name in named}
    now = content_digests(there, cache.parent / MEMO)
    values = {
        "stage": [stage for stage, _, _ in read],
        "input": [used.path for _, _, used in read],
        "sha256": [used.sha256 for _, _, used in read],
        "present_sha256": [now.get(used.path, "") for _, _, used in read],
        "schema_version": [record.schema_version for _, record, _ in read],
        "package_version": [record.package_version for _, record, _ in read],
    }
    arrays = []
    for column in INPUTS.columns:
        growing = GrowingColumn(column)
        growing.add(words(values[column.name]), len(read))
        arrays.append(growing.taken())
    return pa.Table.from_arrays(arrays, schema=arrow_schema(INPUTS))
