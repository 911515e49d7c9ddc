"""Point clouds from files: PLY, PCD and NumPy arrays, in metres."""

from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float
from pypcd4 import PointCloud

from pipeline.camera.depth_files import LIKELY_M
from pipeline.errors import PictureError

FORMATS = (".ply", ".pcd", ".npy")
FEWEST_POINTS = 100  # fewer are no picture of anything


def read_cloud_m(path: Path, scale_m: float | None) -> Float[np.ndarray, "n 3"]:
    """Measured points in the file's own frame; what is not finite or the origin is left out.

    Parameters
    ----------
    path
        File of one of `FORMATS`.
    scale_m
        Metres that one unit of the file stands for; None: 1.

    Returns
    -------
    Points in metres, shape (n, 3).

    Raises
    ------
    PictureError
        The file cannot be read, holds too few points, or its range says that the unit is wrong.
    """
    if not path.is_file():
        raise PictureError(f"{path} is not there", "Check the path")
    raw = _READERS.get(path.suffix.lower(), _unknown)(path)
    if raw.ndim == 3 and raw.shape[2] >= 3:
        raw = raw.reshape(-1, raw.shape[2])
    if raw.ndim != 2 or raw.shape[1] < 3:
        raise PictureError(
            f"{path} holds an array of shape {raw.shape}, not points of three coordinates",
            "Give an array (n, 3), or (h, w, 3)",
        )
    points: Float[np.ndarray, "n 3"] = raw[:, :3].astype(np.float64)
    points = points * (1.0 if scale_m is None else scale_m)
    points = points[np.isfinite(points).all(axis=1)]
    points = points[(points != 0).any(axis=1)]  # drivers write unmeasured pixels as the origin
    if len(points) < FEWEST_POINTS:
        raise PictureError(
            f"{path} holds {len(points)} measured points, and a scene needs {FEWEST_POINTS}",
            "Check that the camera measured anything",
        )
    extent = float(np.linalg.norm(np.ptp(np.percentile(points, [5, 95], axis=0), axis=0)))
    smallest, largest = 0.1 * LIKELY_M[0], LIKELY_M[1]
    if not smallest <= extent <= largest:
        raise PictureError(
            f"{path} is {extent:.4g} m across, and scenes are {smallest:g} to {largest:g} m: the "
            "unit is wrong",
            "Give depth_scale_m, metres a unit of the file: 0.001 for millimetres",
        )
    return points


def _from_ply(path: Path) -> np.ndarray:
    try:
        with path.open("rb") as file:
            loaded = trimesh.load(file, file_type="ply", process=False)
        points = np.asarray(loaded.vertices, dtype=np.float64)
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, OSError) as error:
        raise PictureError(
            f"{path} cannot be read as a PLY point cloud: {error}", "Write it again"
        ) from error
    return points


def _from_pcd(path: Path) -> np.ndarray:
    try:
        points: Float[np.ndarray, "n 3"] = PointCloud.from_path(path).numpy(("x", "y", "z"))
    except (ValueError, KeyError, OSError, RuntimeError, UnicodeDecodeError) as error:
        raise PictureError(
            f"{path} cannot be read as a PCD point cloud: {error}", "Write it again"
        ) from error
    return points


def _from_numpy(path: Path) -> np.ndarray:
    try:
        return np.asarray(np.load(path, allow_pickle=False))
    except (OSError, ValueError, EOFError) as error:
        raise PictureError(
            f"{path} cannot be read as a NumPy array: {error}", "Write it with numpy.save"
        ) from error


def _unknown(path: Path) -> np.ndarray:
    raise PictureError(
        f"{path} is of no known format", f"Give a point cloud as {', '.join(FORMATS)}"
    )


_READERS = {".ply": _from_ply, ".pcd": _from_pcd, ".npy": _from_numpy}
