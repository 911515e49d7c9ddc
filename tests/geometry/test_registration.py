"""Surfaces are laid on each other whatever their turn, symmetry and triangulation."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.registration import distance_laid_on, shape_of
from tests.bodies import mesh_of

NEAR = 2e-3


def union(*parts: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.boolean.union(list(parts), engine="manifold")


def moved_to(shape: trimesh.Trimesh, *place: float) -> trimesh.Trimesh:
    shape.apply_translation(place)
    return shape


HAND = union(  # no turn makes its mirror image
    trimesh.creation.box((0.02, 0.02, 0.1)),
    moved_to(trimesh.creation.box((0.06, 0.02, 0.02)), 0.02, 0, 0.04),
    moved_to(trimesh.creation.box((0.02, 0.06, 0.02)), 0, 0.02, -0.04),
)
SOLIDS = {
    "cube": trimesh.creation.box((0.05, 0.05, 0.05)),
    "square prism": trimesh.creation.box((0.05, 0.05, 0.1)),
    "flat box": trimesh.creation.box((0.1, 0.07, 0.005)),
    "ball": trimesh.creation.icosphere(subdivisions=4, radius=0.04),
    "can": trimesh.creation.cylinder(radius=0.03, height=0.1, sections=64),
    "tetrahedron": trimesh.convex.convex_hull(
        np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 0.03
    ),
    "cube with a bump": union(
        trimesh.creation.box((0.05, 0.05, 0.05)),
        moved_to(trimesh.creation.box((0.012, 0.012, 0.012)), 0.025, 0.01, 0.01),
    ),
    "hand": HAND,
}


def turned(shape: trimesh.Trimesh, seed: int, factor: float = 1.0) -> Mesh:
    rng = np.random.default_rng(seed)
    mesh = mesh_of(shape)
    place = rng.normal(size=3)
    turn = Rotation.random(rng=rng).as_matrix()
    return Mesh(factor * (mesh.vertices_m @ turn.T + place), mesh.faces)


@pytest.mark.parametrize("name", SOLIDS)
def test_a_surface_is_found_again_turned_in_another_unit_and_cut_otherwise(name: str) -> None:
    solid = SOLIDS[name]
    solid.merge_vertices()
    other = shape_of(mesh_of(solid))
    for seed in range(3):
        finer = solid.subdivide_to_size(solid.extents.max() / 12) if seed else solid
        one = shape_of(turned(finer, seed, 1000.0))
        assert distance_laid_on(one, other, 1e-3, NEAR) < 5e-4


def test_a_mirror_image_is_another_surface_unless_a_turn_makes_it() -> None:
    for name, near in (("hand", False), ("flat box", True)):
        mesh = mesh_of(SOLIDS[name])
        mirrored = Mesh(mesh.vertices_m * [1, 1, -1], mesh.faces[:, ::-1])
        distance = distance_laid_on(shape_of(mirrored), shape_of(mesh), 1.0, NEAR)
        assert (distance < NEAR) is near


def test_a_size_is_no_motion() -> None:
    """A ball larger by 1 % is 1 % of its radius away: sqrt(A) is sqrt(4 pi) radii."""
    ball = mesh_of(SOLIDS["ball"])
    larger = Mesh(1.01 * ball.vertices_m, ball.faces)
    distance = distance_laid_on(shape_of(larger), shape_of(ball), 1.0, 1e-6)
    assert distance == pytest.approx(0.01 / np.sqrt(4 * np.pi), rel=0.05)


def test_a_bump_elsewhere_is_another_surface() -> None:
    plate = trimesh.creation.box((0.1, 0.1, 0.01))
    bump = (0.02, 0.02, 0.02)
    one = union(plate, moved_to(trimesh.creation.box(bump), 0.02, 0.0, 0.01))
    other = union(plate, moved_to(trimesh.creation.box(bump), 0.03, 0.0, 0.01))
    distance = distance_laid_on(shape_of(mesh_of(one)), shape_of(mesh_of(other)), 1.0, NEAR)
    assert distance > 4 * NEAR
