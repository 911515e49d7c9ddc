"""The 150 mm pad of Supplement VII: Table I times three, on surfaces three times as large."""

import tomllib
from collections.abc import Callable

import numpy as np
import pytest

from pipeline.config import GripperConfig, RunConfig
from pipeline.config.section import Section
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


def lengths_m(section: Section, name: str = "") -> dict[str, float]:
    """Every length of a tree that is a multiple of r_G, in metres, by its dotted name."""
    found: dict[str, float] = {}
    for part, value in section:
        if isinstance(value, Section):
            found |= lengths_m(value, f"{name}{part}.")
        elif part.endswith("_rg") and part.removesuffix("_rg") + "_m" in dir(section):
            found[name + part] = getattr(section, part.removesuffix("_rg") + "_m")
    return found


def test_one_line_makes_every_length_that_grows_with_the_pad_three_times_as_long() -> None:
    large = RunConfig.model_validate({"gripper": {"pad": {"radius_m": 0.075}}})
    small_m, large_m = lengths_m(RunConfig()), lengths_m(large)
    assert len(small_m) > 25
    for name in small_m:
        assert large_m[name] == pytest.approx(TIMES * small_m[name]), name


def test_another_gripper_is_at_most_eight_lines() -> None:
    block = next(b for b in blocks_of("runs/README.md", "toml") if "[gripper.pad]" in b)
    assert len([line for line in block.splitlines() if line.strip()]) <= 8


@pytest.mark.parametrize(
    ("read", "metres"),
    [
        (lambda c: c.gripper.pad.seal_radius_m, 0.020),
        (lambda c: c.gripper.pad.contact_tolerance_m, 1e-4),
        (lambda c: c.sensing.grid_side_m, 0.06),
        (lambda c: c.grasps.clearance_m, 0.15),
        (lambda c: c.grasps.normal_radius_m, 0.010),
        (lambda c: c.evaluate.hand.camera_above_m, 0.18),
        (lambda c: c.objects.target_extent_max_m, 0.16),
    ],
)
def test_a_multiple_gives_the_very_float_of_its_metres(
    read: Callable[[RunConfig], float], metres: float
) -> None:
    assert read(RunConfig()) == metres


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
