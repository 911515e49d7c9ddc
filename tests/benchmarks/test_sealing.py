"""Seals are timed where a pad would be placed: on an object, along its normal."""

import numpy as np
import trimesh

from pipeline.benchmarks.sealing import pose_on
from pipeline.geometry.mesh import Mesh


def test_a_pose_lies_on_the_surface_and_points_out_of_it() -> None:
    half = np.array([0.03, 0.02, 0.05])
    box = trimesh.creation.box(extents=2 * half)
    mesh = Mesh(np.array(box.vertices), np.array(box.faces))
    rng = np.random.default_rng(0)
    for pose in (pose_on(mesh, rng) for _ in range(50)):
        outwards, point = pose[:3, 2], pose[:3, 3]
        side = int(np.argmax(np.abs(outwards)))
        np.testing.assert_allclose(np.abs(outwards[side]), 1.0)
        np.testing.assert_allclose(point[side], np.sign(outwards[side]) * half[side])
        assert (np.abs(point) <= half + 1e-12).all()
