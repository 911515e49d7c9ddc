"""Relief finer than a cell is taken off, coarser shape stays, and labels tell the difference."""

import numpy as np
import pytest
import trimesh

from pipeline.benchmarks import fine_relief
from pipeline.benchmarks.fine_relief import (
    poses_on,
    relief_in_labels,
    strays_from_quadrics_m,
    without_fine_relief,
)
from pipeline.config import RunConfig
from pipeline.geometry.mesh import Mesh

CELL_M = 0.0025
RADIUS_M = 0.06


def ball(relief_m: float) -> Mesh:
    """A ball whose vertices lie off its sphere at random, finer than a cell."""
    sphere = trimesh.creation.icosphere(subdivisions=6, radius=RADIUS_M)
    off = np.random.default_rng(0).normal(0.0, relief_m, len(sphere.vertices))
    vertices = sphere.vertices * (1 + off / RADIUS_M)[:, None]
    return Mesh(vertices, np.asarray(sphere.faces))


def test_smoothing_takes_off_fine_relief_and_keeps_the_ball() -> None:
    smooth = without_fine_relief(ball(0.0005), CELL_M)
    radii_m = np.linalg.norm(smooth.vertices_m, axis=1)
    assert radii_m.std() < 0.25 * 0.0005
    assert radii_m.mean() == pytest.approx(RADIUS_M, rel=0.01)


def test_approaches_point_out_of_the_surface() -> None:
    poses = poses_on(ball(0.0), 0.01, np.random.default_rng(0))
    outwards = poses[:, :3, 3] / np.linalg.norm(poses[:, :3, 3], axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", poses[:, :3, 2], outwards).min() > 0.99


def test_a_ball_is_no_further_from_quadrics_than_its_relief_is_high() -> None:
    smooth_m, rough_m = (
        strays_from_quadrics_m(ball(relief_m), np.random.default_rng(0)) for relief_m in (0.0, 1e-4)
    )
    assert smooth_m < 2e-6
    # Between vertices the faces are flat, so that their points stray less than vertices do.
    assert 0.4e-4 < rough_m < 1e-4


def test_a_rough_ball_seals_worse_than_it_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fine_relief, "GRASPS", 60)
    rough, smooth = (
        relief_in_labels(ball(relief_m), RunConfig(), np.random.default_rng(1))
        for relief_m in (0.0006, 0.0)
    )
    assert smooth["change"] < 0.02
    assert rough["change"] > 5 * smooth["change"] + 0.05
    assert rough["mean_q"] < rough["mean_q_smoothed"]
