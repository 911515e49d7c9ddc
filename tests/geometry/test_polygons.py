"""Polygons are cut into triangles that cover them once, whatever their shape."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import MeshError
from pipeline.geometry.polygons import MOST_OFF_PLANE, Polygons, cut
from tests.geometry.corpus.polygon_cases import OUTLINES
from tests.geometry.corpus.solids import Outline, shoelace


def one(corners: np.ndarray) -> Polygons:
    count = len(corners)
    return Polygons(corners, np.arange(count), np.array([count]))


def signed_areas(corners: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    first, second = (corners[triangles[:, k]] - corners[triangles[:, 0]] for k in (1, 2))
    return np.asarray((first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2)


def upright(outline: Outline) -> np.ndarray:
    return np.column_stack([np.array(outline), np.zeros(len(outline))])


@pytest.mark.parametrize("name", OUTLINES)
def test_triangles_cover_an_outline_once_and_keep_its_edges(name: str) -> None:
    corners = upright(OUTLINES[name])
    for turn in range(len(corners)):
        turned = np.roll(corners, turn, axis=0)
        triangles, notes = cut("x", one(turned))
        areas = signed_areas(turned, triangles)
        assert len(triangles) == len(corners) - 2
        assert areas.min() >= 0
        assert areas.sum() == pytest.approx(shoelace(OUTLINES[name]))
        assert notes == ()
        directed = {
            (a, b) for t in triangles.tolist() for a, b in zip(t, t[1:] + t[:1], strict=True)
        }
        outer = {(i, (i + 1) % len(corners)) for i in range(len(corners))}
        assert {edge for edge in directed if edge[::-1] not in directed} == outer


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.1, 1.0), min_size=4, max_size=40), st.floats(-3, 3))
def test_any_star_shaped_outline(radii: list[float], phase: float) -> None:
    angles = [phase + 2 * math.pi * k / len(radii) for k in range(len(radii))]
    outline = [(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]
    corners = upright(outline)
    triangles, _ = cut("x", one(corners))
    areas = signed_areas(corners, triangles)
    assert areas.min() >= -1e-9
    assert areas.sum() == pytest.approx(shoelace(outline))


def test_triangles_pass_as_they_are_and_in_their_order() -> None:
    vertices = np.random.default_rng(0).normal(size=(5, 3))
    faces = np.array([[0, 1, 2], [2, 1, 3], [4, 4, 0]])
    triangles, notes = cut("x", Polygons(vertices, faces.reshape(-1), np.array([3, 3, 3])))
    np.testing.assert_array_equal(triangles, faces)
    assert notes == ()


def test_a_bend_is_recorded_up_to_its_bound_and_named_beyond() -> None:
    corners = upright([(0, 0), (1, 0), (1, 1), (0, 1)])
    # One corner lifted by h bends a square by h / 4 to both sides of its plane, about.
    corners[2, 2] = 3.9 * MOST_OFF_PLANE
    _, notes = cut("x", one(corners))
    assert "not flat" in notes[0]
    assert "face 1" in notes[0]
    corners[2, 2] = 4.2 * MOST_OFF_PLANE
    with pytest.raises(MeshError, match=r"x: face 1 is not flat: .* 2\.1%"):
        cut("x", one(corners))


def test_a_self_crossing_is_named_by_the_face_in_the_files_order() -> None:
    square = upright([(0, 0), (1, 0), (1, 1), (0, 1)])
    polygons = Polygons(square, np.array([0, 1, 2, 0, 1, 2, 3, 0, 2, 1, 3]), np.array([3, 4, 4]))
    with pytest.raises(MeshError, match="face 3 crosses itself"):
        cut("x", polygons)


def test_corners_in_line_and_repeated_ones_leave_no_gap() -> None:
    corners = upright([(0, 0), (0.5, 0), (1, 0), (1, 1), (0, 1)])
    doubled = Polygons(corners, np.array([0, 0, 1, 2, 2, 3, 4, 0]), np.array([8]))
    triangles, _ = cut("x", doubled)
    assert set(triangles.reshape(-1).tolist()) == {0, 1, 2, 3, 4}
    assert signed_areas(corners, triangles).sum() == pytest.approx(1.0)
