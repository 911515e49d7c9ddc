"""Training samples as WebDataset tars: a tar a shard, three files a sample."""

import math
from pathlib import Path

import webdataset

from pipeline.artifacts.publishing import published
from pipeline.geometry.shape import ShapeClass
from pipeline.network.samples import Samples

CLASSES = tuple(str(kind) for kind in ShapeClass)


def write_webdataset(
    path: Path, samples: Samples, names: tuple[str, ...], prefix: str, first: int
) -> None:
    """Write one tar: ``<key>.cloud.npy`` (f2), ``<key>.mask.npy`` (b1) and ``<key>.json`` a sample.

    Clouds are (g, g, 3) in units of r_G. The JSON holds q, p, level, class, object, the number of
    pictures that the cloud was cut from, and the number of first proposals that the sample stands
    for (null where that is unknown).

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
    with published(path) as scratch, webdataset.TarWriter(str(scratch), mtime=0) as tar:
        for row in range(len(samples)):
            weight = float(samples.proposal_weight[row])
            tar.write(
                {
                    "__key__": f"{prefix}{first + row:08d}",
                    "cloud.npy": samples.cloud[row],
                    "mask.npy": samples.cloud_mask[row],
                    "json": {
                        "quality": float(samples.quality[row]),
                        "pressure": float(samples.pressure[row]),
                        "level": int(samples.level[row]),
                        "shape_class": CLASSES[samples.shape_class[row]],
                        "object": names[samples.object_index[row]],
                        "pictures": int(samples.pictures[row]),
                        "proposal_weight": weight if math.isfinite(weight) else None,
                    },
                }
            )
