"""Random solids are closed, of one body, of every class, and follow from their stream alone."""

from collections import Counter
from functools import lru_cache
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config.objects import FIRST_KINDS, ObjectsConfig, SolidKind
from pipeline.errors import MeshError
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.random_solids import KINDS, bodies, fine_structure, random_solid, relief
from pipeline.geometry.random_solids.catalogued import solid_names
from pipeline.geometry.random_solids.skins import mark, warp
from pipeline.geometry.shape import nsvr, shape_class, volume
from pipeline.geometry.topology import components, is_closed

DRAWN = 40
FURTHER_KINDS = [kind for kind in KINDS if kind not in FIRST_KINDS]


@lru_cache
def solid(number: int) -> Mesh:
    return random_solid(np.random.default_rng([11, number]), FIRST_KINDS, 0.0)


@pytest.mark.parametrize("number", range(DRAWN))
def test_each_is_one_closed_body(number: int) -> None:
    mesh = solid(number)
    assert is_closed(mesh)
    assert len(components(mesh.faces)) == 1
    assert volume(mesh) > 0
    assert 0.08 < mesh.extents_m.max() < 0.18


def test_the_same_stream_draws_the_same_bytes_and_another_one_does_not() -> None:
    again = random_solid(np.random.default_rng([11, 0]), FIRST_KINDS, 0.0)
    assert again.vertices_m.tobytes() == solid(0).vertices_m.tobytes()
    assert again.faces.tobytes() == solid(0).faces.tobytes()
    assert again.vertices_m.tobytes() != solid(1).vertices_m.tobytes()


def test_every_class_has_its_share() -> None:
    classes = Counter(shape_class(nsvr(solid(number))) for number in range(DRAWN))
    assert len(classes) == 3
    assert min(classes.values()) >= DRAWN // 8


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_a_solid_and_a_mark_changes_it(kind: str) -> None:
    rng = np.random.default_rng(3)
    body = KINDS[kind][0](rng)
    assert body.volume() > 0
    assert mark(body, rng).volume() not in (0, body.volume())


def test_shares_of_the_first_kinds_are_all() -> None:
    assert sum(share for _, share in bodies.KINDS.values()) == pytest.approx(1)
    assert tuple(bodies.KINDS) == FIRST_KINDS
    assert tuple(KINDS) == get_args(SolidKind)


@pytest.mark.parametrize("kind", FURTHER_KINDS)
@pytest.mark.parametrize("number", range(5))
def test_further_kinds_are_one_closed_body(kind: str, number: int) -> None:
    mesh = random_solid(np.random.default_rng([12, number]), [kind], 0.0)
    assert is_closed(mesh)
    assert len(components(mesh.faces)) == 1
    assert volume(mesh) > 0


@pytest.mark.parametrize("kind", FURTHER_KINDS)
def test_further_bodies_are_drawn_in_one_piece(kind: str) -> None:
    """What falls apart would lose all pieces but the largest."""
    for seed in range(60):
        assert len(KINDS[kind][0](np.random.default_rng([1, seed])).decompose()) == 1


def test_rows_stand_on_the_ground() -> None:
    for seed in range(60):
        assert KINDS["row"][0](np.random.default_rng([1, seed])).bounding_box()[2] == 0.0


def test_a_dish_is_a_shell_around_a_hollow() -> None:
    """Its hull holds much more than it does: a pad meets the inside of a curve."""
    for seed in range(60):
        body = KINDS["dish"][0](np.random.default_rng([0, seed]))
        assert body.volume() < 0.85 * body.hull().volume()


def test_grooves_take_little_and_leave_the_outline() -> None:
    body = KINDS["grooved"][0](np.random.default_rng(0))
    assert 0.6 * body.hull().volume() < body.volume() < body.hull().volume()


def test_a_ringed_body_is_turned_about_its_axis() -> None:
    for seed in range(60):
        body = KINDS["ringed"][0](np.random.default_rng([1, seed]))
        quarter = body.rotate((0, 0, 90))
        assert (body - quarter).volume() < 1e-6 * body.volume()


def test_ringed_ends_are_no_planes() -> None:
    """What a pad meets rises and falls within its radius, on most of the ends that are drawn."""
    relief_m = [float(np.ptp(relief._end(0.03, np.random.default_rng(s))[:, 1])) for s in range(60)]
    assert np.median(relief_m) > 0.001
    assert max(relief_m) < 0.03


@given(seed=st.integers(0, 2**32 - 1), x=st.floats(0.02, 0.1), y=st.floats(0.02, 0.1))
def test_tiles_cover_their_face_and_none_lies_on_another(seed: int, x: float, y: float) -> None:
    tiles = np.array(relief._tiles(np.array([2 * x, 2 * y]), np.random.default_rng(seed)))
    low, high = tiles[:, :2], tiles[:, 2:]
    assert np.all(high > low)
    assert np.prod(high - low, axis=1).sum() == pytest.approx(4 * x * y)
    assert np.allclose(low.min(axis=0), (-x, -y))
    assert np.allclose(high.max(axis=0), (x, y))
    shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    over = np.prod(np.clip(shared, 0.0, None), axis=2)
    np.fill_diagonal(over, 0.0)
    assert over.max() < 1e-12


def test_tiles_lie_at_heights_of_their_own() -> None:
    """Above the block, more than one height is the highest of its tile: no flat face is left."""
    uneven = 0
    for seed in range(60):
        body = KINDS["tiled"][0](np.random.default_rng([1, seed]))
        height = np.array(body.to_mesh64().vert_properties)[:, 2]
        uneven += len(np.unique(np.round(height[height > 0.9 * height.max()], 5))) > 1
    assert uneven > 50


def test_wings_are_thin_and_reach_far() -> None:
    """A pad overhangs them: the hull holds much more than the body does."""
    shares = []
    for seed in range(60):
        body = KINDS["winged"][0](np.random.default_rng([1, seed]))
        shares.append(body.volume() / body.hull().volume())
    assert np.median(shares) < 0.6


def test_some_holes_go_through() -> None:
    through = 0
    for seed in range(60):
        body = KINDS["drilled"][0](np.random.default_rng([1, seed]))
        through += body.genus() > 0
    assert through > 20


@given(seed=st.integers(0, 2**32 - 1), long_m=st.floats(0.01, 0.2))
def test_a_drill_is_narrower_than_a_pad(seed: int, long_m: float) -> None:
    tool = fine_structure._drill(long_m, np.random.default_rng(seed))
    assert 0.7 * 0.0015**2 < tool.volume() / long_m < 0.007 * 0.07
    assert tool.bounding_box()[5] == pytest.approx(long_m)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), slope=st.floats(0.01, 0.6), apart=st.floats(1e-6, 0.05))
def test_a_warp_brings_no_two_points_nearer_than_its_slope_says(
    seed: int, slope: float, apart: float
) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.1, 0.1, (50, 3))
    step = rng.normal(size=points.shape)
    others = points + apart * step / np.linalg.norm(step, axis=1)[:, None]
    moved = warp(np.vstack([points, others]), (0.008, 0.05), slope, np.random.default_rng(seed))
    after = np.linalg.norm(moved[:50] - moved[50:], axis=1)
    assert np.all(after >= (1 - slope) * apart * (1 - 1e-6))
    assert np.all(after <= (1 + slope) * apart * (1 + 1e-6))


def test_more_solids_leave_the_first_their_names_and_no_mesh_may_have_one() -> None:
    three, five, two_more = (
        ObjectsConfig(random_solids=count, first_solid=first)
        for count, first in ((3, 1), (5, 1), (2, 4))
    )
    assert solid_names(five, ()) == solid_names(three, ()) + solid_names(two_more, ())
    with pytest.raises(MeshError, match="random-solid-0002"):
        solid_names(three, ["random-solid-0002"])
