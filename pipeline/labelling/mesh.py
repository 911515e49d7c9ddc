"""Algorithm 1 on one mesh, at poses that the caller gives."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from pipeline.config import ObjectsConfig, RunConfig
from pipeline.errors import MeshError, PoseError
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import load_mesh_file
from pipeline.gripper import LabelBatch
from pipeline.labelling.poses import label_poses
from pipeline.world.raycasting import RayScene

_BODY = 0  # the mesh is the only body
# Poses read from text or single precision differ from rigid ones by about this much.
_RIGID_WITHIN = 1e-5


def load_mesh(path: Path | str, config: ObjectsConfig | None = None) -> Mesh:
    """The surface of a mesh file (ply, obj, stl, off, glb), in metres, as it is in the file.

    Nothing is repaired or rescaled: Algorithm 1 takes objects to be airtight (A-2).

    Parameters
    ----------
    path
        The file.
    config
        Bounds on its size, and its unit where the file does not declare one; by default the unit
        is found from the size, see `pipeline.geometry.mesh_files.length_unit`.

    Returns
    -------
    Vertices in metres and triangles.

    Raises
    ------
    MeshError
        The file is missing, too large, damaged, or of a size that no unit explains.
    """
    found = Path(path)
    if not found.is_file():
        raise MeshError(f"{found} is no file", "Give the path of a mesh file")
    return load_mesh_file(found, found.parent, found.stem, config or ObjectsConfig()).mesh


def label_mesh(
    mesh: Mesh, object_from_gripper: ArrayLike, config: RunConfig | None = None
) -> LabelBatch:
    """Label grasps of a mesh at given poses: S-1.07 - S-1.12.

    The mesh is the only body: no table and no neighbour supports the pad.

    Parameters
    ----------
    mesh
        The object's surface in its own frame [m], closed.
    object_from_gripper
        Poses of the gripper in the mesh's frame, shape (n, 4, 4) [m]: +z points out of the
        object, the gripper approaches along -z. The origin may lie anywhere on the approach
        above the object, or under its surface by less than ``grasps.clearance_m``. Rotations
        must be right-handed and rigid within 1e-5.
    config
        Sections gripper and grasps; Table I's by default.

    Returns
    -------
    One row a pose: q of S-1.12, p of Eq. (2), the wrench GW, `GraspStatus`, the pad's vertices in
    contact, and ``touch_height_m``: where along +z, from the pose's origin, the pad touches first
    (-inf where it meets nothing).

    Raises
    ------
    MeshError
        The mesh has no faces, indices out of range, or vertices that are not finite.
    PoseError
        The poses have another shape, are not finite, or are not rigid.
    """
    chosen = config or RunConfig()
    _refuse_bad_mesh(mesh)
    poses = rigid_poses(object_from_gripper)
    return label_poses(
        poses,
        np.full(len(poses), _BODY),
        RayScene([mesh]),
        chosen.gripper,
        chosen.grasps.clearance_m,
    )


def rigid_poses(poses: ArrayLike) -> Float[np.ndarray, "n 4 4"]:
    """Check that poses are rigid motions and return them as float64.

    Parameters
    ----------
    poses
        Homogeneous matrices, shape (n, 4, 4).

    Returns
    -------
    The same poses, shape (n, 4, 4).

    Raises
    ------
    PoseError
        They have another shape, are not finite, not rigid within 1e-5, or mirror.
    """
    try:
        checked = np.ascontiguousarray(poses, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise PoseError(f"The poses are no array of numbers ({error})", _REMEDY) from error
    if checked.ndim != 3 or checked.shape[1:] != (4, 4):
        raise PoseError(f"The poses have shape {checked.shape}, not (n, 4, 4)", _REMEDY)
    rotation = checked[:, :3, :3]
    finite = np.isfinite(checked).reshape(len(checked), 16).all(axis=1)
    _refuse_first(np.logical_not(finite), "holds NaN or infinity")
    bottom = np.abs(checked[:, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=1)
    _refuse_first(bottom > _RIGID_WITHIN, "has a last row that is not (0, 0, 0, 1)")
    skew = np.abs(rotation.transpose(0, 2, 1) @ rotation - np.eye(3)).max(axis=(1, 2))
    _refuse_first(skew > _RIGID_WITHIN, "scales or shears: its axes are not unit and orthogonal")
    _refuse_first(np.linalg.det(rotation) < 0.0, "mirrors: its axes are left-handed")
    return checked


def _refuse_bad_mesh(mesh: Mesh) -> None:
    """Raise MeshError where a mesh is empty, has wrong indices or is not finite."""
    if len(mesh.faces) == 0:
        raise MeshError("The mesh has no faces", "Give a surface: a point cloud must be meshed")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices_m):
        raise MeshError("The mesh has faces of vertices that it does not have", "Mend the mesh")
    bad = int((~np.isfinite(mesh.vertices_m)).any(axis=1).sum())
    if bad:
        raise MeshError(f"The mesh has {bad} vertices that are NaN or infinite", "Mend the mesh")


_REMEDY = "Give rigid object_from_gripper poses, (n, 4, 4), in metres, +z out of the object"


def _refuse_first(bad: Bool[np.ndarray, " n"], why: str) -> None:
    """Raise PoseError for the first bad pose, if there is any."""
    if bad.any():
        raise PoseError(f"Pose {int(np.argmax(bad))} {why}", _REMEDY)
