"""A mesh labelled at given poses: analytic surfaces, frames, refusals, and README's five lines."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from pipeline.config import RunConfig
from pipeline.errors import MeshError, PoseError
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import random_rotation
from pipeline.gripper import GraspStatus, build_pad, label_reference
from pipeline.labelling import label_mesh, load_mesh
from tests.docs.pages import ROOT, blocks_of

CONFIG = RunConfig()


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(shape.vertices, dtype=np.float64), np.asarray(shape.faces))


def above(*points_m: tuple[float, float, float]) -> np.ndarray:
    """Poses with the object's own axes at some points."""
    poses = np.tile(np.eye(4), (len(points_m), 1, 1))
    poses[:, :3, 3] = points_m
    return poses


BOX = mesh_of(trimesh.creation.box((0.2, 0.2, 0.1)))


def test_a_flat_face_seals_fully_its_edge_half_and_beside_it_nothing_is() -> None:
    labels = label_mesh(BOX, above((0, 0, 0.05), (0.1, 0, 0.05), (0.5, 0, 0.05)))
    assert labels.q[0] == pytest.approx(1.0, abs=1e-6)
    assert labels.pressure[0] == pytest.approx(1.0)
    np.testing.assert_allclose(labels.wrench[0], [0, 0, 1, 0], atol=1e-6)
    assert labels.contact[0].all()
    assert 0.2 < labels.pressure[1] < 0.3  # half of the area, squared
    assert labels.status[2] == GraspStatus.NO_CONTACT
    assert labels.touch_height_m[2] == -np.inf


@pytest.mark.parametrize("height_m", [0.0, 0.03, 0.5, -0.01])
def test_touch_height_leads_from_the_pose_to_the_surface(height_m: float) -> None:
    labels = label_mesh(BOX, above((0, 0, 0.05 + height_m)))
    assert labels.touch_height_m[0] == pytest.approx(-height_m, abs=1e-9)
    assert labels.q[0] == pytest.approx(1.0, abs=1e-6)


def test_a_sphere_has_the_label_of_its_formula() -> None:
    radius = 0.06
    ball = mesh_of(trimesh.creation.icosphere(subdivisions=6, radius=radius))
    pad = build_pad(CONFIG.gripper.pad)
    heights = np.sqrt(radius**2 - (pad.vertices_xy_m**2).sum(axis=1)) - radius
    expected = label_reference(pad, CONFIG.gripper, heights, np.ones(len(heights), dtype=bool))
    assert label_mesh(ball, above((0, 0, radius))).q[0] == pytest.approx(expected.q, abs=5e-3)


def test_label_does_not_depend_on_the_frame_of_the_mesh() -> None:
    rng = np.random.default_rng(4)
    shape = mesh_of(trimesh.creation.icosphere(subdivisions=4, radius=0.05))
    bumps = 1 + 0.03 * np.sin(90 * shape.vertices_m[:, :1])
    mesh = Mesh(shape.vertices_m * bumps, shape.faces)
    poses = above(*[(0.0, 0.0, 0.05)] * 6)
    poses[:, :3, :3] = Rotation.from_euler("x", rng.uniform(-0.3, 0.3, (6, 1))).as_matrix()
    move = np.eye(4)
    move[:3, :3], move[:3, 3] = random_rotation(rng), rng.uniform(-1, 1, 3)
    here, there = label_mesh(mesh, poses), label_mesh(mesh.transformed(move), move @ poses)
    np.testing.assert_allclose(there.q, here.q, atol=1e-6)
    assert np.ptp(here.q) > 1e-3


def test_no_poses_give_no_labels() -> None:
    assert len(label_mesh(BOX, np.empty((0, 4, 4)))) == 0


def spoilt(row: int, column: int, value: float) -> np.ndarray:
    poses = above((0, 0, 0.05), (0, 0, 0.05))
    poses[1, row, column] = value
    return poses


@pytest.mark.parametrize(
    ("poses", "why"),
    [
        (np.eye(4), r"shape \(4, 4\)"),
        (np.zeros((3, 3, 4)), r"shape \(3, 3, 4\)"),
        (spoilt(0, 3, np.nan), "Pose 1 holds NaN"),
        (spoilt(2, 2, np.inf), "Pose 1 holds NaN or infinity"),
        (spoilt(0, 0, 1.01), "Pose 1 scales or shears"),
        (spoilt(0, 1, 0.1), "Pose 1 scales or shears"),
        (spoilt(0, 0, -1.0), "Pose 1 mirrors"),
        (spoilt(3, 0, 0.1), "Pose 1 has a last row"),
    ],
)
def test_poses_that_are_none_are_refused_by_number_and_reason(poses: np.ndarray, why: str) -> None:
    with pytest.raises(PoseError, match=why):
        label_mesh(BOX, poses)


def test_poses_of_text_are_refused() -> None:
    with pytest.raises(PoseError, match="no array of numbers"):
        label_mesh(BOX, [["a"]])


def test_a_mesh_with_bad_vertices_is_refused() -> None:
    vertices = BOX.vertices_m.copy()
    vertices[3, 1] = np.nan
    with pytest.raises(MeshError, match="NaN"):
        label_mesh(Mesh(vertices, BOX.faces), above((0, 0, 0.05)))


def test_a_file_that_is_not_there_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"part\.stl"):
        load_mesh(tmp_path / "part.stl")


def test_the_lines_of_readme_print_q_of_a_mesh_file_in_millimetres(tmp_path: Path) -> None:
    (block,) = blocks_of("README.md", "python")
    assert len([line for line in block.splitlines() if line]) <= 5
    trimesh.creation.box((200.0, 200.0, 100.0)).export(tmp_path / "part.stl")
    np.save(tmp_path / "poses.npy", above((0, 0, 0.05), (0.5, 0, 0.05)))
    done = subprocess.run(
        [sys.executable, "-c", block],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=True,
    )
    printed = np.array(done.stdout.strip("[] \n").split(), dtype=float)
    np.testing.assert_allclose(printed, [1.0, 0.0], atol=0.02)
