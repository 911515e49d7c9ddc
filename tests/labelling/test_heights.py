"""Heights under a pad: drawn where triangles are coarse, by rays where they are fine."""

import numpy as np
import pytest
import trimesh

from pipeline.config.grasps import PadConfig
from pipeline.geometry.mesh import Mesh
from pipeline.gripper import pad_of
from pipeline.labelling import heights
from pipeline.labelling.heights import pad_heights, pad_heights_by_rays, triangles_per_m2
from pipeline.labelling.sampling import contact_frames
from pipeline.world.raycasting import RayScene

CLEARANCE_M = 0.15


def ball_and_frames(subdivisions: int) -> tuple[RayScene, np.ndarray]:
    """A ball of 50 mm radius, and contacts at some of its vertices."""
    ball = trimesh.creation.icosphere(subdivisions, 0.05)
    rng = np.random.default_rng(subdivisions)
    chosen = rng.integers(len(ball.vertices), size=20)
    normals = np.asarray(ball.vertices[chosen]) / 0.05
    frames = contact_frames(
        np.asarray(ball.vertices[chosen]), normals, rng.uniform(0, 2 * np.pi, 20)
    )
    return RayScene([Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))]), frames


@pytest.mark.parametrize("subdivisions", [1, 3, 4])
def test_drawn_heights_are_those_of_rays(subdivisions: int) -> None:
    scene, frames = ball_and_frames(subdivisions)
    pad = pad_of(PadConfig())
    drawn, body = pad_heights(frames, scene, pad, CLEARANCE_M)
    cast, hit = pad_heights_by_rays(frames, scene, pad, CLEARANCE_M)
    assert drawn.tobytes() != cast.tobytes()  # two ways, which differ by rounding
    np.testing.assert_allclose(drawn, cast, rtol=0.0, atol=1e-8)
    assert (body == hit).all()


@pytest.mark.parametrize(
    ("limit", "bodies"), [("_FINEST_M2", 1), ("_FINEST_OF_MANY_M2", 2)], ids=["one", "several"]
)
def test_rays_are_cast_at_fine_meshes(
    limit: str, bodies: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, frames = ball_and_frames(4)
    below = scene.bodies[0].mesh.transformed(np.diag([1.0, 1.0, -1.0, 1.0]))
    scene = RayScene([scene.bodies[0].mesh, below][:bodies])
    pad = pad_of(PadConfig())
    cast, _ = pad_heights_by_rays(frames, scene, pad, CLEARANCE_M)
    assert pad_heights(frames, scene, pad, CLEARANCE_M)[0].tobytes() != cast.tobytes()
    monkeypatch.setattr(heights, limit, 1.0)
    assert pad_heights(frames, scene, pad, CLEARANCE_M)[0].tobytes() == cast.tobytes()


def test_bodies_count_alike_and_a_table_does_not() -> None:
    balls = [trimesh.creation.icosphere(subdivisions, 0.05) for subdivisions in (3, 4)]
    table = trimesh.creation.box((1.0, 1.0, 0.01))
    meshes = [Mesh(np.asarray(m.vertices), np.asarray(m.faces)) for m in (*balls, table)]
    each = [len(ball.faces) / ball.area for ball in balls]
    assert triangles_per_m2(meshes) == pytest.approx(np.mean(each))
    assert triangles_per_m2(meshes[2:]) == 0.0
