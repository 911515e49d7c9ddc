"""Rays at moving bodies give what a scene built anew in the world's frame gives."""

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.geometry.compiled_poses import pose_of, quaternion_of, turn_between, turned
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import position_quaternion
from pipeline.world.posed_bodies import PosedBodies
from pipeline.world.raycasting import RayScene
from pipeline.world.table import table_mesh

SEEDS = st.integers(0, 2**32 - 1)


def some_pose(rng: np.random.Generator) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(rng=rng).as_matrix()
    pose[:3, 3] = rng.uniform(-0.2, 0.2, 3) + np.array([0, 0, 0.2])
    return pose


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_hits_are_those_of_a_scene_built_anew(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes = [trimesh.creation.icosphere(2, 0.08), trimesh.creation.box((0.1, 0.2, 0.05))]
    meshes = [Mesh(np.asarray(s.vertices), np.asarray(s.faces)) for s in shapes]
    poses = {i + 1: some_pose(rng) for i in range(2)}
    posed = PosedBodies({1: meshes[0], 2: meshes[1]}, 1.2).at(poses)
    anew = RayScene([m.transformed(poses[i + 1]) for i, m in enumerate(meshes)] + [table_mesh(1.2)])
    origins = rng.uniform(-0.4, 0.4, (500, 3)) + np.array([0, 0, 0.8])
    rays = rng.normal(size=(500, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    found, expected = posed.cast(origins, rays), anew.cast(origins, rays)
    ids = np.array([1, 2, 0, -1])
    same = found.body == ids[expected.body]
    # A ray along a silhouette may fall on either side in single precision.
    assert same.mean() > 0.99
    hit = same & (found.body >= 0)
    np.testing.assert_allclose(found.distance_m[hit], expected.distance_m[hit], atol=1e-6)
    normals, expected_normals = posed.normals_at(found), anew.normals_at(expected)
    np.testing.assert_allclose(normals[hit], expected_normals[hit], atol=1e-3)
    np.testing.assert_array_equal(np.isnan(normals).all(axis=1), found.body < 0)


def test_a_body_without_a_pose_is_gone() -> None:
    mesh = table_mesh(0.1)
    lifted = np.eye(4)
    lifted[2, 3] = 0.3
    bodies = PosedBodies({1: mesh}, 1.2)
    down = np.array([[0.0, 0.01, 1.0]]), np.array([[0.0, 0.0, -1.0]])
    assert bodies.at({1: lifted}).cast(*down).body.tolist() == [1]
    assert bodies.at({}).cast(*down).body.tolist() == [0]


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_compiled_turns_are_scipys(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = some_pose(rng), some_pose(rng)
    _, quaternion = position_quaternion(a)
    np.testing.assert_allclose(quaternion_of(a[:3, :3]), quaternion, atol=1e-12)
    np.testing.assert_allclose(pose_of(a[:3, 3], quaternion), a, atol=1e-12)
    turn = turn_between(a, b)
    expected = Rotation.from_matrix(b[:3, :3] @ a[:3, :3].T)
    np.testing.assert_allclose(
        Rotation.from_rotvec(turn).as_matrix(), expected.as_matrix(), atol=1e-9
    )
    np.testing.assert_allclose(turned(a, turn)[:3, :3], b[:3, :3], atol=1e-9)
    np.testing.assert_allclose(turned(a, turn)[:3, 3], a[:3, 3])
