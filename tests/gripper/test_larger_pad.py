"""The 150 mm pad of Supplement VII: Table I times three, on surfaces three times as large."""

import tomllib

import numpy as np
import pytest

from pipeline.config import GripperConfig, PadConfig, RunConfig
from pipeline.gripper import GraspStatus, build_pad, label_batch
from tests.docs.pages import blocks_of
from tests.gripper.surfaces import everywhere, plane, sphere, tilted

TIMES = 3.0
SMALL = GripperConfig()
SHOWN = next(
    RunConfig.model_validate(tomllib.loads(block))
    for block in blocks_of("runs/README.md", "toml")
    if "[gripper.pad]" in block
)


def test_the_page_shows_table_one_times_three() -> None:
    small, large = SMALL.pad.model_dump(), SHOWN.gripper.pad.model_dump()
    scaled = [name for name in PadConfig.model_fields if name.endswith("_m")]
    scaled.remove("contact_tolerance_m")  # of the surface, which is no rougher
    for name in scaled:
        assert large[name] == pytest.approx(TIMES * small[name]), name
    assert SHOWN.sensing.grid_side_m == pytest.approx(TIMES * RunConfig().sensing.grid_side_m)
    for name in ("grid_depth_m", "grid_height_m", "layer_m"):
        expected = TIMES * getattr(RunConfig().sensing, name)
        assert getattr(SHOWN.sensing, name) == pytest.approx(expected)
    assert SHOWN.grasps.clearance_m == pytest.approx(TIMES * RunConfig().grasps.clearance_m)
    assert SHOWN.evaluate.hand.stem_begins_m > SHOWN.gripper.pad.altitude_m


def test_it_labels_a_plane_and_spheres_as_the_small_one_does() -> None:
    small, large = build_pad(SMALL.pad), build_pad(SHOWN.gripper.pad)
    assert len(large.vertices_xy_m) == len(small.vertices_xy_m) == 586
    np.testing.assert_allclose(large.vertices_xy_m, TIMES * small.vertices_xy_m, atol=1e-12)
    radii_m = (0.03, 0.04, 0.08, 0.3)
    on_small = [plane(small), tilted(small, 0.1), *(sphere(small, r) for r in radii_m)]
    on_large = [plane(large), tilted(large, 0.1), *(sphere(large, TIMES * r) for r in radii_m)]
    labels = [
        label_batch(pad, config, np.stack(heights), np.stack([everywhere(pad)] * len(heights)))
        for pad, config, heights in ((small, SMALL, on_small), (large, SHOWN.gripper, on_large))
    ]
    np.testing.assert_allclose(labels[1].q, labels[0].q, atol=1e-6)
    np.testing.assert_allclose(labels[1].pressure, labels[0].pressure, rtol=1e-12)
    np.testing.assert_allclose(labels[1].wrench, labels[0].wrench, atol=1e-6)
    assert labels[0].q[0] == pytest.approx(1.0, abs=1e-6)
    assert np.ptp(labels[0].q) > 0.1
    assert labels[0][0].status is GraspStatus.SOLVED


def test_on_what_is_not_scaled_it_seals_less_of_a_curve() -> None:
    """A ball of 60 mm radius lies under all of the small pad, and not of the large."""
    heights = [sphere(build_pad(config.pad), 0.06) for config in (SMALL, SHOWN.gripper)]
    small, large = (
        label_batch(
            build_pad(config.pad),
            config,
            surface[None],
            everywhere(build_pad(config.pad))[None],
        ).q[0]
        for config, surface in zip((SMALL, SHOWN.gripper), heights, strict=True)
    )
    assert large < 0.5 * small
