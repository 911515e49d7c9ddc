"""NSVR, mass and inertia against closed forms and against trimesh."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.rescaling import rescale
from pipeline.geometry.shape import (
    ShapeClass,
    mass_properties,
    nsvr,
    shape_class,
    surface_area,
    volume,
)
from tests.bodies import mesh_of

TORUS = mesh_of(trimesh.creation.torus(0.05, 0.012))


def test_sphere_and_cube_have_their_known_nsvr() -> None:
    # sqrt(4 pi) / cbrt(4 pi / 3) and sqrt(6).
    ball = mesh_of(trimesh.creation.icosphere(subdivisions=6))
    assert nsvr(ball) == pytest.approx(2.19909, abs=1e-3)
    assert nsvr(mesh_of(trimesh.creation.box())) == pytest.approx(np.sqrt(6), abs=1e-12)


@given(st.floats(1e-3, 1e3), st.floats(0.01, 10.0))
def test_rescaling_leaves_nsvr_alone(size: float, target_m: float) -> None:
    mesh = Mesh(TORUS.vertices_m * size, TORUS.faces)
    scaled, scale = rescale(mesh, target_m)
    assert scaled.extents_m.max() == pytest.approx(target_m)
    assert scale == pytest.approx(target_m / mesh.extents_m.max())
    assert nsvr(scaled) == pytest.approx(nsvr(TORUS), rel=1e-9)


@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(0, 2 * np.pi))
def test_moving_a_mesh_leaves_nsvr_alone(x_m: float, y_m: float, turn_rad: float) -> None:
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    turned = TORUS.vertices_m @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [x_m, y_m, 0]
    assert nsvr(Mesh(turned, TORUS.faces)) == pytest.approx(nsvr(TORUS), rel=1e-9)


def test_an_inverted_mesh_has_no_nsvr() -> None:
    with pytest.raises(ValueError, match="positive volume"):
        nsvr(Mesh(TORUS.vertices_m, TORUS.faces[:, ::-1]))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (2.2, ShapeClass.BASIC),
        (2.5999, ShapeClass.BASIC),
        (2.6, ShapeClass.TYPICAL),
        (3.4999, ShapeClass.TYPICAL),
        (3.5, ShapeClass.COMPLEX),
        (9.0, ShapeClass.COMPLEX),
    ],
)
def test_thresholds_belong_to_the_class_above(value: float, expected: ShapeClass) -> None:
    assert shape_class(value) is expected


def test_a_box_has_its_textbook_inertia() -> None:
    a, b, c = 0.1, 0.06, 0.03
    mesh = mesh_of(trimesh.creation.box(extents=(a, b, c)))
    found = mass_properties(Mesh(mesh.vertices_m + np.array([5.0, -3.0, 2.0]), mesh.faces), 700.0)
    mass = 700.0 * a * b * c
    expected = mass / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert found.mass_kg == pytest.approx(mass)
    np.testing.assert_allclose(found.centre_of_mass_m, [5.0, -3.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(found.inertia_kg_m2, expected, rtol=1e-9, atol=1e-15)


def test_an_odd_body_agrees_with_trimesh() -> None:
    shape = trimesh.creation.annulus(0.02, 0.05, 0.03)
    shape.apply_transform(trimesh.transformations.euler_matrix(0.3, 0.6, 0.9))
    found = mass_properties(mesh_of(shape), 300.0)
    shape.density = 300.0
    assert volume(mesh_of(shape)) == pytest.approx(shape.volume)
    assert surface_area(mesh_of(shape)) == pytest.approx(shape.area)
    np.testing.assert_allclose(found.centre_of_mass_m, shape.center_mass, atol=1e-12)
    np.testing.assert_allclose(found.inertia_kg_m2, shape.moment_inertia, rtol=1e-8, atol=1e-14)
