"""Clutters of a larger gripper are those of a smaller one, enlarged: settled piles agree."""

import numpy as np
import pytest
import trimesh
from scipy.stats import ks_2samp

from pipeline.clutter.building import build_clutter
from pipeline.config import RunConfig
from pipeline.geometry.catalogue import CatalogueObject
from tests.bodies import catalogue_object

PILES = 6
SIDES = {"box": (0.08, 0.06, 0.04), "block": (0.05, 0.05, 0.05), "slab": (0.1, 0.07, 0.02)}


def scaled_pool(times: float, cache: object) -> list[CatalogueObject]:
    return [
        catalogue_object(name, trimesh.creation.box(np.multiply(sides, times)), cache)  # type: ignore[arg-type]
        for name, sides in SIDES.items()
    ]


def settled_heights_rg(radius_m: float, pool: list[CatalogueObject]) -> np.ndarray:
    """Heights of the objects' middles over the table, in r_G, over some piles."""
    config = RunConfig.model_validate(
        {"gripper": {"pad": {"radius_m": radius_m}}, "scenes": {"objects_per_clutter": 3}}
    )
    scenes = [
        build_clutter(f"pile-{seed}", 3, "train", pool, config.scenes, seed)
        for seed in range(PILES)
    ]
    return np.array(
        [p.world_from_object[2, 3] / radius_m for scene in scenes for p in scene.objects]
    )


def test_settled_piles_of_both_sizes_agree(tmp_path_factory: pytest.TempPathFactory) -> None:
    cache = tmp_path_factory.mktemp("parts")
    small = settled_heights_rg(0.025, scaled_pool(1.0, cache))
    large = settled_heights_rg(0.075, scaled_pool(3.0, cache))
    # The same seeds throw alike, but gravity is no faster on large things: only distributions can
    # agree. Piles that were not enlarged would lie at a third of the height.
    assert ks_2samp(small, large).pvalue > 0.05
    assert ks_2samp(small, large / 3.0).pvalue < 0.01
