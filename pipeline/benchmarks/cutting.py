"""What the convex decomposition of objects costs, most of stage objects."""

import time
from collections.abc import Iterable

import numpy as np

from pipeline.config.objects import ConvexPartsConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.convex_parts import decompose

TIMED_OBJECTS = 4  # those of most parts: they take nearly all of the stage's time


def cutting_time(
    objects: Iterable[CatalogueObject], config: ConvexPartsConfig
) -> dict[str, object]:
    """Processor time of cutting objects into convex parts, nothing kept from before.

    Parameters
    ----------
    objects
        The catalogue.
    config
        How they are cut.

    Returns
    -------
    Seconds by object, for those of most parts, and their median.
    """
    hardest = sorted(objects, key=lambda item: (-len(item.convex_parts), item.name))[:TIMED_OBJECTS]
    seconds = {}
    for item in hardest:
        started = time.process_time()
        decompose(item.mesh, config)
        seconds[item.name] = round(time.process_time() - started, 3)
    return {
        "convex_parts_cpu_s_by_object": seconds,
        "convex_parts_cpu_s": round(float(np.median(list(seconds.values()))), 3),
    }
