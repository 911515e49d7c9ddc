"""Triangles drawn onto points against rays, and against closed forms."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from cachetools import Cache
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.geometry.mesh import Mesh
from pipeline.world import lines_down
from pipeline.world.lines_down import PosedBlocks, follow_lines
from pipeline.world.raycasting import RayScene
from pipeline.world.triangle_blocks import blocks_of, mean_area_m2

TOP_M = 0.15
ANGLES = np.linspace(0.0, 2.0 * np.pi, 45, endpoint=False)
POINTS = np.concatenate(
    [np.zeros((1, 2))]
    + [0.0019 * ring * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]) for ring in range(1, 14)]
)


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))


def frames_on(mesh: Mesh, count: int, seed: int) -> np.ndarray:
    """Frames at random points near a mesh's vertices, turned at random."""
    rng = np.random.default_rng(seed)
    frames = np.repeat(np.eye(4)[None], count, axis=0)
    frames[:, :3, :3] = Rotation.random(count, rng=rng).as_matrix()
    frames[:, :3, 3] = mesh.vertices_m[rng.integers(len(mesh.vertices_m), size=count)]
    return frames


def by_rays(scene: RayScene, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heights and bodies under the points, by a ray for each."""
    above = np.column_stack([POINTS, np.full(len(POINTS), TOP_M)])
    origins = above @ frames[:, :3, :3].transpose(0, 2, 1) + frames[:, None, :3, 3]
    down = np.repeat(-frames[:, :3, 2], len(POINTS), axis=0)
    hits = scene.cast(origins.reshape(-1, 3), down)
    shape = (len(frames), len(POINTS))
    return (TOP_M - hits.distance_m).reshape(shape), hits.body.reshape(shape)


def drawn(scene: RayScene, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heights and bodies under the points, drawn."""
    posed = [body.posed_blocks for body in scene.bodies]
    return follow_lines(posed, frames, POINTS, TOP_M)


def assert_as_rays(scene: RayScene, frames: np.ndarray, apart: float = 1e-3) -> None:
    """Heights and bodies are those of rays, but for a share of points at edges, which rays round
    to single precision."""
    expected, body = by_rays(scene, frames)
    height, number = drawn(scene, frames)
    same = np.isclose(height, expected, rtol=0.0, atol=1e-8) & (number == body)
    assert (~same).mean() <= apart


@given(st.integers(0, 2**32 - 1), st.sampled_from(["box", "ball", "cup", "soup"]))
@settings(max_examples=30, deadline=None)
def test_heights_and_bodies_are_those_of_rays(seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    shape = {
        "box": lambda: trimesh.creation.box(rng.uniform(0.01, 0.1, 3)),
        "ball": lambda: trimesh.creation.icosphere(int(rng.integers(1, 5)), rng.uniform(0.01, 0.1)),
        "cup": lambda: trimesh.creation.annulus(
            0.02, 0.03, 0.06, sections=int(rng.integers(5, 60))
        ),
        "soup": lambda: trimesh.Trimesh(rng.normal(0, 0.05, (90, 3)), np.arange(90).reshape(30, 3)),
    }[kind]()
    table = mesh_of(trimesh.creation.box((1.0, 1.0, 0.001)))
    body = mesh_of(shape)
    scene = RayScene([body, Mesh(table.vertices_m - [0.0, 0.0, 0.1], table.faces)], [3, 1])
    # Enough for the share: of eight, one in a hundred seeds has five points at edges.
    assert_as_rays(scene, frames_on(body, 32, seed))


def test_no_point_falls_between_triangles_seen_at_their_corners() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    frames = np.repeat(np.eye(4)[None], len(ball.vertices), axis=0)
    for frame, normal in zip(frames, np.asarray(ball.vertices) / 0.05, strict=True):
        frame[:3, 2] = normal
        frame[:3, 0] = np.cross(normal, [0.36, 0.48, 0.8])
        frame[:3, 0] /= np.linalg.norm(frame[:3, 0])
        frame[:3, 1] = np.cross(normal, frame[:3, 0])
        frame[:3, 3] = 0.05 * normal
    height, _ = drawn(RayScene([mesh_of(ball)]), frames)
    np.testing.assert_allclose(height[:, 0], 0.0, atol=1e-12)
    # The surface is at most a chord below the sphere, and nowhere missing under the pad.
    depth = 0.05 - np.sqrt(0.05**2 - (POINTS**2).sum(axis=1))
    np.testing.assert_allclose(
        height, np.broadcast_to(-depth, (len(frames), len(POINTS))), atol=1e-4
    )


def test_what_is_above_the_top_is_missed_and_edge_on_faces_too() -> None:
    box = mesh_of(trimesh.creation.box((0.02, 0.02, 0.4)))
    height, body = drawn(RayScene([box]), np.eye(4)[None])
    # The box's top, 0.2 m up, is above: lines begin inside and meet its floor from behind.
    inside = (np.abs(POINTS) < 0.00999).all(axis=1)
    beside = (np.abs(POINTS) > 0.01001).any(axis=1)
    np.testing.assert_allclose(height[0, inside], -0.2, atol=1e-12)
    assert np.isneginf(height[0, beside]).all()
    assert (body[0, beside] == -1).all()


def test_a_point_on_an_outline_is_covered_and_one_a_hair_beside_it_is_not() -> None:
    side = 0.03125  # sums of powers of two, so that nothing is rounded
    box = mesh_of(trimesh.creation.box((side, side, side)))
    edge, hair = side / 2, 2.0**-40
    points = np.array([[edge, 0.0], [edge, edge], [edge - hair, 0.001], [edge + hair, 0.001]])
    posed = [PosedBlocks(blocks_of(box), np.eye(4), 0)]
    height, body = follow_lines(posed, np.eye(4)[None], points, TOP_M)
    assert height[0].tolist() == [edge, edge, edge, -np.inf]
    assert body[0].tolist() == [0, 0, 0, -1]


def test_a_moved_mesh_gives_what_its_moved_vertices_give() -> None:
    ball = mesh_of(trimesh.creation.icosphere(3, 0.04))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_rotvec([0.3, -1.0, 0.5]).as_matrix(), [0.2, -0.1, 0.3]
    moved = ball.transformed(pose)
    frames = frames_on(moved, 20, 3)
    own, _ = drawn(RayScene([moved], [4], {4: (ball, pose)}), frames)
    through, _ = drawn(RayScene([moved], [4]), frames)
    # A line at the outline may pass beside one and meet the other.
    assert (~np.isclose(own, through, rtol=0.0, atol=1e-12)).mean() < 1e-4


def test_frames_that_are_not_finite_or_not_rigid_are_refused() -> None:
    scene = RayScene([mesh_of(trimesh.creation.box((0.1, 0.1, 0.1)))])
    for place, value in (((0, 3), np.nan), ((0, 0), 2.0), ((2, 2), np.inf)):
        frames = np.repeat(np.eye(4)[None], 2, axis=0)
        frames[1][place] = value
        with pytest.raises(ValueError, match="rigid"):
            drawn(scene, frames)


def test_a_grasp_alone_gives_the_bytes_that_it_gives_among_others() -> None:
    ball = mesh_of(trimesh.creation.icosphere(3, 0.05))
    frames, scene = frames_on(ball, 6, 0), RayScene([ball])
    together, alone = drawn(scene, frames), drawn(scene, frames[4:5])
    assert alone[0].tobytes() == together[0][4:5].tobytes()
    assert alone[1].tobytes() == together[1][4:5].tobytes()


def test_the_mean_area_leaves_long_triangles_out() -> None:
    sphere = trimesh.creation.icosphere(4, 0.05)
    area = mean_area_m2(mesh_of(sphere))
    assert area == pytest.approx(sphere.area / len(sphere.faces))
    assert mean_area_m2(mesh_of(trimesh.creation.box((0.1, 0.1, 0.1)))) == np.inf


def test_heights_on_scanned_meshes_are_those_of_rays() -> None:
    folder = os.environ.get("MESH_DIR")
    if not folder:
        pytest.skip("MESH_DIR is not set: no scanned meshes")
    for path in sorted(Path(folder).glob("*.ply"))[:12:4]:
        mesh = mesh_of(trimesh.load(path, force="mesh"))
        assert_as_rays(RayScene([mesh]), frames_on(mesh, 40, 7))


def decided_one_by_one(mesh: Mesh, frame: np.ndarray) -> np.ndarray:
    """Heights by the decision in double precision on every pair of point and triangle."""
    turn = lines_down._frame_from_body(frame, np.eye(4))
    x, y, z = mesh.vertices_m[mesh.faces].transpose(2, 1, 0)
    seen = [row[0] * x + row[1] * y + row[2] * z + row[3] for row in turn]
    heights = np.full(len(POINTS), -np.inf)
    for number, point in enumerate(POINTS):
        (a_x, b_x, c_x), (a_y, b_y, c_y) = seen[0] - point[0], seen[1] - point[1]
        of = np.array([b_x * c_y - b_y * c_x, c_x * a_y - c_y * a_x, a_x * b_y - a_y * b_x])
        whole = of[0] + of[1] + of[2]
        with np.errstate(invalid="ignore", divide="ignore"):
            height = (of[0] * seen[2][0] + of[1] * seen[2][1] + of[2] * seen[2][2]) / whole
        height = np.clip(height, seen[2].min(axis=0), seen[2].max(axis=0))
        inside = ((of >= 0.0).all(axis=0) | (of <= 0.0).all(axis=0)) & (whole != 0.0)
        heights[number] = height[inside & (height <= TOP_M)].max(initial=-np.inf)
    x, y, z = frame[:3, 2]
    length = np.sqrt(x * x + y * y + z * z)  # a power rounds otherwise
    return np.asarray(TOP_M - (TOP_M - heights) * length)


@given(st.integers(0, 2**32 - 1), st.floats(-4.0, 0.0), st.floats(0.0, 2.0))
@settings(max_examples=30, deadline=None)
def test_bounds_leave_no_pair_out(seed: int, thinness: float, away_m: float) -> None:
    """Slivers and specks, far from the mesh's origin too: the bytes of all pairs decided."""
    rng = np.random.default_rng(seed)
    middles = rng.uniform(-0.03, 0.03, (200, 1, 3)) + away_m
    corners = middles + rng.normal(0, 0.01, (200, 3, 3)) * 10.0 ** rng.uniform(
        thinness, 0.0, (200, 1, 3)
    )
    mesh = Mesh(corners.reshape(-1, 3), np.arange(600).reshape(200, 3))
    frames = frames_on(mesh, 2, seed)
    heights, _ = drawn(RayScene([mesh]), frames)
    for frame, height in zip(frames, heights, strict=True):
        assert height.tobytes() == decided_one_by_one(mesh, frame).tobytes()


def kept_blocks() -> Cache[Any, Any]:
    """The blocks that are kept from scene to scene, none of them left."""
    cache = blocks_of.cache
    assert isinstance(cache, Cache)
    cache.clear()
    return cache


def test_sorted_triangles_are_kept_for_the_next_scene_and_with_this_one() -> None:
    mesh = mesh_of(trimesh.creation.icosphere(2, 0.05))
    scene, next_scene = RayScene([mesh]), RayScene([mesh])
    blocks = scene.bodies[0].posed_blocks.blocks
    assert next_scene.bodies[0].posed_blocks.blocks is blocks
    kept_blocks()  # as many other meshes would leave it
    assert scene.bodies[0].posed_blocks.blocks is blocks


def test_what_is_kept_is_counted_in_triangles() -> None:
    meshes = [mesh_of(trimesh.creation.icosphere(size, 0.05)) for size in (2, 3)]
    cache = kept_blocks()
    for mesh in meshes:
        blocks_of(mesh)
    assert cache.currsize == sum(len(mesh.faces) for mesh in meshes)
    assert cache.maxsize < 1e7
