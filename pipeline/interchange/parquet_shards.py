"""Training samples as Parquet: a file a shard, a row a sample."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.artifacts.publishing import published
from pipeline.geometry.shape import ShapeClass
from pipeline.network.samples import Samples

CLASSES = tuple(str(kind) for kind in ShapeClass)
ROW_GROUP = 1024  # samples read at once


def write_parquet(
    path: Path, samples: Samples, names: tuple[str, ...], prefix: str, first: int
) -> None:
    """Write one file: a row a sample, clouds and masks as flat lists of fixed length.

    Clouds, in units of r_G, are stored as f4, which holds every f2 exactly and which every reader
    knows.

    Parameters
    ----------
    path
        The file.
    samples
        The samples.
    names
        Names of objects that ``object_index`` points into.
    prefix
        Beginning of the keys; a number of eight digits follows.
    first
        Number of the first sample's key.
    """
    cells = samples.cloud.shape[1]
    cloud = np.ascontiguousarray(samples.cloud, dtype=np.float32).reshape(-1)
    mask = pa.array(samples.cloud_mask.reshape(-1))
    table = pa.table(
        {
            "key": [f"{prefix}{first + row:08d}" for row in range(len(samples))],
            "cloud": pa.FixedSizeListArray.from_arrays(pa.array(cloud), 3 * cells * cells),
            "mask": pa.FixedSizeListArray.from_arrays(mask, cells * cells),
            "quality": samples.quality.astype(np.float32),
            "pressure": samples.pressure.astype(np.float32),
            "level": samples.level.astype(np.uint8),
            "shape_class": _words(samples.shape_class, CLASSES),
            "object": _words(samples.object_index, names),
            "pictures": samples.pictures.astype(np.uint8),
            "proposal_weight": samples.proposal_weight.astype(np.float32),
        }
    )
    table = table.replace_schema_metadata({"softgrip.cells": str(cells)})
    with published(path) as scratch:
        pq.write_table(table, scratch, compression="zstd", row_group_size=ROW_GROUP)


def _words(index: np.ndarray, words: tuple[str, ...]) -> pa.DictionaryArray:
    return pa.DictionaryArray.from_arrays(pa.array(index.astype(np.int32)), pa.array(words))
