"""Clutters meet the definition of their level, measured again here from nothing but poses."""

import itertools

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from pipeline.clutter.building import build_clutter
from pipeline.clutter.levels import Distribution, level_of
from pipeline.config import ConvexPartsConfig, ObjectsConfig, ScenesConfig
from pipeline.errors import SceneError
from pipeline.geometry.catalogue import CatalogueObject, finish_object, measure_object
from pipeline.geometry.parametric import PARAMETRIC_OBJECTS, parametric_source
from pipeline.geometry.shape import ShapeClass
from pipeline.world.scene import ClutterScene
from tests.bodies import catalogue_object

CONFIG = ScenesConfig(objects_per_clutter=4)


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> list[CatalogueObject]:
    cache = tmp_path_factory.mktemp("parts")
    shapes = {
        "box": trimesh.creation.box(extents=(0.08, 0.06, 0.04)),
        "can": trimesh.creation.cylinder(radius=0.03, height=0.08, sections=48),
        "block": trimesh.creation.box(extents=(0.05, 0.05, 0.05)),
        "slab": trimesh.creation.box(extents=(0.1, 0.07, 0.02)),
    }
    return [catalogue_object(name, shape, cache) for name, shape in shapes.items()]


def placed(scene: ClutterScene, pool: list[CatalogueObject]) -> list[trimesh.Trimesh]:
    meshes = {item.name: item.mesh for item in pool}
    moved = [meshes[p.object_name].transformed(p.world_from_object) for p in scene.objects]
    return [trimesh.Trimesh(m.vertices_m, m.faces, process=False) for m in moved]


def nearest_gaps_m(bodies: list[trimesh.Trimesh]) -> np.ndarray:
    """Oracle: points sprinkled on one body, their distance to the other's surface."""
    gaps = np.full((len(bodies), len(bodies)), np.inf)
    for i, j in itertools.permutations(range(len(bodies)), 2):
        points, _ = trimesh.sample.sample_surface(bodies[i], 6000, seed=1)
        points = np.concatenate([points, bodies[i].vertices])
        _, distance, _ = trimesh.proximity.closest_point(bodies[j], points)
        gaps[i, j] = distance.min()
    return np.asarray(np.minimum(gaps, gaps.T).min(axis=1))


@pytest.mark.parametrize("level", [1, 2, 3])
def test_a_clutter_is_what_its_level_says(level: int, pool: list[CatalogueObject]) -> None:
    scene = build_clutter("s", level, "train", pool, CONFIG, seed=3)
    assert sorted(p.object_name for p in scene.objects) == sorted(item.name for item in pool)
    assert [p.body_id for p in scene.objects] == [1, 2, 3, 4]
    bodies = placed(scene, pool)
    gaps = nearest_gaps_m(bodies)
    np.testing.assert_allclose(scene.gaps_m, gaps, atol=2e-3)
    if level == 1:
        assert gaps.min() >= 0.05 - 1e-6
        assert scene.contacts == ()
    elif level == 2:
        assert gaps.max() <= 0.01 + 2e-3
        assert scene.gaps_m.min() > 0
    else:
        assert scene.gaps_m.max() <= CONFIG.touch_gap_max_m
        assert {i for pair in scene.contacts for i in pair} == {1, 2, 3, 4}
        assert max(body.bounds[1, 2] for body in bodies) > 0.08
    lowest = np.array([body.bounds[0, 2] for body in bodies])
    assert lowest.min() >= -CONFIG.sink_max_m
    if level != 3:
        assert lowest.max() <= CONFIG.touch_gap_max_m


def test_the_same_seed_gives_the_same_bits(pool: list[CatalogueObject]) -> None:
    one, two, other = (build_clutter("s", 3, "train", pool, CONFIG, seed) for seed in (5, 5, 6))
    poses = [np.array([p.world_from_object for p in s.objects]) for s in (one, two, other)]
    assert poses[0].tobytes() == poses[1].tobytes()
    assert poses[0].tobytes() != poses[2].tobytes()


def test_a_level_that_cannot_be_met_is_an_error_not_a_scene(pool: list[CatalogueObject]) -> None:
    crowded = ScenesConfig(
        objects_per_clutter=12, workspace_side_rg=8, table_side_rg=12, placement_attempts=2
    )
    with pytest.raises(SceneError, match="no clutter of level 1 in 2 tries"):
        build_clutter("s", 1, "train", pool, crowded, seed=0)


def sprinkled_gaps_m(bodies: list[trimesh.Trimesh]) -> np.ndarray:
    """Oracle: nearest of 40 000 points on each body to those on any other."""
    points = [trimesh.sample.sample_surface(body, 40_000, seed=2)[0] for body in bodies]
    trees = [cKDTree(cloud) for cloud in points]
    gaps = np.full((len(bodies), len(bodies)), np.inf)
    for i, j in itertools.permutations(range(len(bodies)), 2):
        gaps[i, j] = trees[j].query(points[i])[0].min()
    return np.asarray(gaps.min(axis=1))


@pytest.fixture(scope="module")
def embedded(tmp_path_factory: pytest.TempPathFactory) -> dict[ShapeClass, list[CatalogueObject]]:
    """Four embedded objects of each class."""
    cache = tmp_path_factory.mktemp("embedded")
    convex = ConvexPartsConfig(input_faces=500)
    config = ObjectsConfig(target_extent_max_rg=4.8, convex=convex)
    pools: dict[ShapeClass, list[CatalogueObject]] = {kind: [] for kind in ShapeClass}
    for number, name in enumerate(sorted(PARAMETRIC_OBJECTS)):
        measured = measure_object(parametric_source(name), config)
        if len(pools[measured.shape_class]) < 4:
            rng = np.random.default_rng(number)
            pools[measured.shape_class].append(finish_object(measured, config, rng, cache))
    return pools


@pytest.mark.parametrize("level", range(1, 10))
def test_every_level_of_table_2_from_embedded_objects(
    level: int, embedded: dict[ShapeClass, list[CatalogueObject]]
) -> None:
    """Of the level's class, spread as it says, and the same bits again from the same seed."""
    kind, distribution = level_of(level)
    items = embedded[kind]
    one, two = (build_clutter("s", level, "test", items, CONFIG, seed=11) for _ in range(2))
    for first, second in zip(one.objects, two.objects, strict=True):
        assert first.world_from_object.tobytes() == second.world_from_object.tobytes()
    bodies = placed(one, items)
    # Between points sprinkled on both surfaces, never less than the gap itself.
    above = sprinkled_gaps_m(bodies)
    assert (above >= one.gaps_m - 1e-9).all()
    assert (above <= one.gaps_m + 3e-3).all()
    if distribution is Distribution.ISOLATED:
        assert one.gaps_m.min() >= CONFIG.isolated_gap_min_m
    elif distribution is Distribution.MULTIPLE:
        assert 0 < one.gaps_m.min() <= one.gaps_m.max() <= CONFIG.multiple_gap_max_m
    else:
        assert one.gaps_m.max() <= CONFIG.touch_gap_max_m
    corners = np.concatenate([body.bounds for body in bodies])
    assert corners[:, 2].min() >= -CONFIG.sink_max_m
    assert np.abs(corners[:, :2]).max() <= CONFIG.table_side_m / 2
    if distribution is not Distribution.STACKED:
        assert max(body.bounds[0, 2] for body in bodies) <= CONFIG.touch_gap_max_m
