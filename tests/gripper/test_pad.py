"""The pad is Table I's polar grid."""

import math

import numpy as np
import pytest

from pipeline.config import PadConfig
from pipeline.gripper import build_pad


def regular_polygon_area(sides: int, radius: float) -> float:
    return 0.5 * sides * radius**2 * math.sin(2 * math.pi / sides)


def test_table_one_gives_586_vertices_and_1125_triangles() -> None:
    pad = build_pad(PadConfig())
    assert pad.vertices_xy_m.shape == (586, 2)
    assert pad.triangles.shape == (1125, 3)
    assert (pad.rings, pad.sectors) == (13, 45)
    np.testing.assert_allclose(pad.ring_radii_m[[0, 9, 12]], [0.002, 0.020, 0.025])
    # Euler's formula for a disk: V - E + T = 1.
    assert 586 - len(pad.edges) + 1125 == 1


def test_areas_are_those_of_regular_polygons() -> None:
    pad = build_pad(PadConfig())
    assert (pad.areas_m2 > 0).all()
    assert pad.area_m2 == pytest.approx(regular_polygon_area(45, 0.025), rel=1e-12)
    assert pad.seal_area_m2 == pytest.approx(regular_polygon_area(45, 0.020), rel=1e-12)
    assert pad.in_seal_region.sum() == 45 * (1 + 2 * 9)


@pytest.mark.parametrize(
    "config",
    [
        PadConfig(),
        PadConfig(radius_step_rg=0.068, rotation_step_rad=0.2),
        PadConfig(seal_radius_rg=1),
        PadConfig(radius_step_rg=2, rotation_step_rad=math.pi / 2),
    ],
)
def test_steps_stay_within_their_bounds_and_edges_are_those_of_the_triangles(
    config: PadConfig,
) -> None:
    pad = build_pad(config)
    steps = np.diff(np.concatenate([[0.0], pad.ring_radii_m]))
    assert steps.max() <= config.radius_step_m * (1 + 1e-12)
    assert 2 * math.pi / pad.sectors <= config.rotation_step_rad * (1 + 1e-12)
    assert pad.ring_radii_m[-1] == pytest.approx(config.radius_m, rel=1e-12)
    assert np.isclose(pad.ring_radii_m, config.seal_radius_m, rtol=1e-12).any()
    sides = np.concatenate([pad.triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
    expected = {tuple(sorted(side)) for side in sides.tolist()}
    found = [tuple(sorted(edge)) for edge in pad.edges.tolist()]
    assert len(found) == len(set(found))
    assert set(found) == expected
