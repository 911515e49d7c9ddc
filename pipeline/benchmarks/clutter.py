"""How fast piles settle: simulated over wall time, bodies added one by one as a run adds them."""

import time
from collections.abc import Iterable, Sequence

import numpy as np

from pipeline.clutter.building import draw_items
from pipeline.clutter.dropping import drop_pile
from pipeline.config.scenes import ScenesConfig
from pipeline.errors import SceneError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.shape import ShapeClass

PILES = 5  # enough for a median, in seconds


def figures(objects: Iterable[CatalogueObject], config: ScenesConfig) -> dict[str, object]:
    """Times real time at which piles of each class of these objects settle."""
    every = list(objects)
    speeds = {
        str(kind): round(
            settling_speed([o for o in every if o.shape_class == kind], config, PILES, seed=0), 1
        )
        for kind in ShapeClass
    }
    return {"settling_times_real_time": speeds}


def settling_speed(
    pool: Sequence[CatalogueObject], config: ScenesConfig, piles: int, seed: int
) -> float:
    """Times real time at which ``piles`` piles of objects from ``pool`` settle on one core.

    A pile that never comes to rest is left out, as a run draws it again.
    """
    rng = np.random.default_rng(seed)
    simulated_s = wall_s = 0.0
    for _ in range(piles):
        items = draw_items(pool, config.objects_per_clutter, rng)
        started = time.perf_counter()
        try:
            _, _, settled_s = drop_pile(items, config, rng)
        except SceneError:
            continue
        wall_s += time.perf_counter() - started
        simulated_s += settled_s
    return simulated_s / wall_s
