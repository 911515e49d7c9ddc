"""Convex parts cover the body, stay within PhysX's limits, and are kept by content."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.config import ObjectsConfig
from pipeline.geometry import convex_parts as convex_module
from pipeline.geometry.convex_parts import (
    TooIntricateError,
    cache_key,
    convex_parts,
    decimate,
    decompose,
)
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import volume
from tests.bodies import mesh_of

CONFIG = ObjectsConfig().convex


def cross() -> Mesh:
    """Two bars through each other."""
    bars = [trimesh.creation.box(extents=e) for e in ((0.1, 0.02, 0.02), (0.02, 0.1, 0.02))]
    return mesh_of(trimesh.boolean.union(bars, engine="manifold"))


@pytest.fixture(scope="module")
def cross_parts(tmp_path_factory: pytest.TempPathFactory) -> tuple[Mesh, ...]:
    return convex_parts(cross(), CONFIG, tmp_path_factory.mktemp("cache"))


def outside_m(part: Mesh, points: np.ndarray) -> np.ndarray:
    a, b, c = (part.vertices_m[part.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    solid = lengths > 0  # slivers of the hull have no plane
    normals = normals[solid] / lengths[solid, None]
    return np.asarray((points @ normals.T - np.einsum("ij,ij->i", normals, a[solid])).max(axis=1))


def test_a_convex_body_is_its_own_hull(tmp_path: Path) -> None:
    (part,) = convex_parts(mesh_of(trimesh.creation.box()), CONFIG, tmp_path)
    assert volume(part) == pytest.approx(1.0)


def test_a_hull_keeps_within_the_engine_s_limit(tmp_path: Path) -> None:
    ball = mesh_of(trimesh.creation.icosphere(subdivisions=5))
    (part,) = convex_parts(ball, CONFIG, tmp_path)
    assert len(part.vertices_m) <= 127
    # 127 points laid out perfectly leave 1.0 % of the radius on either side.
    assert abs(outside_m(part, ball.vertices_m)).max() < 0.015
    assert volume(part) == pytest.approx(volume(ball), rel=0.05)


def test_a_rounded_box_keeps_its_flat_sides(tmp_path: Path) -> None:
    """As a scanned carton: flat sides, edges of many small faces. Half a millimetre is allowed."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.005).vertices
    points = (corners * [0.04, 0.02, 0.07])[:, None] + ball
    rounded = mesh_of(trimesh.convex.convex_hull(points.reshape(-1, 3)))
    (part,) = convex_parts(rounded, CONFIG, tmp_path)
    assert len(part.vertices_m) <= 127
    np.testing.assert_allclose(part.extents_m, rounded.extents_m, atol=1e-3)
    assert outside_m(part, rounded.vertices_m).max() < 5e-4


def test_parts_of_a_cross_are_bars_and_cover_it(cross_parts: tuple[Mesh, ...]) -> None:
    mesh = cross()
    assert 2 <= len(cross_parts) <= CONFIG.max_parts
    outside = np.min([outside_m(part, mesh.vertices_m) for part in cross_parts], axis=0)
    assert outside.max() < 1e-6
    hull = mesh_of(trimesh.Trimesh(mesh.vertices_m, mesh.faces).convex_hull)
    total = sum(volume(part) for part in cross_parts)
    assert total < 0.6 * volume(hull)
    assert total == pytest.approx(volume(mesh), rel=0.2)


def test_parts_are_kept_and_a_damaged_entry_is_made_again(tmp_path: Path) -> None:
    mesh = cross()
    first = convex_parts(mesh, CONFIG, tmp_path)
    (entry,) = tmp_path.glob("*.parts")
    assert entry.stem == cache_key(mesh, CONFIG)
    kept = convex_parts(mesh, CONFIG, tmp_path)
    assert [p.vertices_m.tobytes() for p in kept] == [p.vertices_m.tobytes() for p in first]
    entry.write_bytes(entry.read_bytes()[:100])
    again = convex_parts(mesh, CONFIG, tmp_path)
    assert [p.vertices_m.tobytes() for p in again] == [p.vertices_m.tobytes() for p in first]


def test_the_key_knows_mesh_and_settings() -> None:
    mesh = cross()
    moved = Mesh(mesh.vertices_m + 1e-12, mesh.faces)
    coarser = CONFIG.model_copy(update={"concavity": 0.2})
    assert len({cache_key(mesh, CONFIG), cache_key(moved, CONFIG), cache_key(mesh, coarser)}) == 3


def sheet(size_m: float, thickness_m: float, bend_m: float) -> Mesh:
    """A wavy sheet of two closed sides, finely meshed, as of a scanned plate."""
    plate = trimesh.creation.box(extents=(size_m, size_m, thickness_m))
    for _ in range(5):
        plate = plate.subdivide()
    waves = bend_m * np.sin(20 * plate.vertices[:, 0]) * np.sin(20 * plate.vertices[:, 1])
    return mesh_of(trimesh.Trimesh(plate.vertices + [[0, 0, 1]] * waves[:, None], plate.faces))


def test_a_thin_body_is_not_simplified_until_it_turns_inside_out() -> None:
    plate = sheet(0.3, 0.002, 0.02)
    coarse = decimate(plate, 50)
    assert len(coarse.faces) < 0.5 * len(plate.faces)
    assert volume(coarse) == pytest.approx(volume(plate), rel=0.1)


def test_a_body_that_is_not_thin_is_simplified_to_the_count() -> None:
    ball = mesh_of(trimesh.creation.icosphere(subdivisions=5))
    assert len(decimate(ball, 1000).faces) <= 1000


def test_a_mesh_of_too_many_details_is_refused_before_it_is_cut(tmp_path: Path) -> None:
    few = CONFIG.model_copy(update={"max_cut_faces": 20, "input_faces": 20})
    with pytest.raises(TooIntricateError, match=r"keeps \d+ faces .* more than the 20 that are"):
        convex_parts(cross(), few, tmp_path)


def test_distances_of_many_points_are_taken_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    (part,) = decompose(mesh_of(trimesh.creation.icosphere(subdivisions=2)), CONFIG)
    points = np.random.default_rng(0).normal(size=(1000, 3))
    whole = convex_module._outside_of(part, points)
    monkeypatch.setattr(convex_module, "_MOST_DISTANCES", 7 * len(part.faces))
    np.testing.assert_allclose(convex_module._outside_of(part, points), whole, atol=1e-12)
    np.testing.assert_allclose(whole, outside_m(part, points), atol=1e-12)
