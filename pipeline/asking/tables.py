"""The tables of a run that a question names, each from what holds its rows."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa

from pipeline.asking.cache import arrow_table
from pipeline.asking.origins import inputs_table
from schemas.tables import BY_NAME, TABLES


def mentioned(sql: str) -> list[str]:
    """Tables whose name stands in a question; no other is read."""
    words = set(re.findall(r"\w+", sql.lower()))
    return [table.name for table in TABLES if table.name in words]


def table_rows(
    name: str, artifacts: Mapping[str, Path], cache: Path, makers: Sequence[str] | None = None
) -> pa.Table | None:
    """The rows of a table.

    Parameters
    ----------
    name
        Of the table.
    artifacts
        Stage → its artifact, of the stages that are made.
    cache
        Folder of the tables' Arrow files.
    makers
        Of table inputs: the stages whose rows are asked for; None: all.

    Returns
    -------
    The table; None where its stage is not made.
    """
    stage = BY_NAME[name].stage
    if not stage:
        return inputs_table(artifacts, cache, makers)
    return arrow_table(name, artifacts[stage], cache) if stage in artifacts else None
