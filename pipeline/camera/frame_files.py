"""Frames from files: a depth image or a point cloud, and what lies beside it.

Files that are not named are looked for beside the depth image by the names of datasets:
``NAME.depth.png`` goes with ``NAME.json`` (or ``.yaml``; else the folder's ``camera.json``),
``NAME.color.*`` (or ``.colour.*``), ``NAME.mask.png`` and ``NAME.instances.png``.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from PIL import Image, ImageDraw

from pipeline.camera import cloud_files
from pipeline.camera.camera_files import CameraFile, read_camera_file
from pipeline.camera.depth_files import read_colour, read_depth_m, read_instances, read_mask
from pipeline.camera.frame import Frame, camera_of_picture, frame_of_cloud
from pipeline.errors import PictureError
from pipeline.world.cameras import points_of_depth

CLOUD_SUFFIXES = (".ply", ".pcd")
CAMERA_SUFFIXES = (".json", ".yaml", ".yml")
SHARED_CAMERAS = ("camera", "intrinsics")  # of all frames of a folder
DEPTH_SUFFIXES = (".png", ".tif", ".tiff", ".npy", ".exr")
COLOUR_WORDS = (".color", ".colour", ".rgb")
PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")


@dataclass(frozen=True)
class FrameFiles:
    """The files of one frame; None: looked for beside ``depth``, or not there.

    Attributes
    ----------
    depth
        Depth image, or point cloud.
    camera
        Intrinsics and pose.
    colour
        Picture for the eye, aligned.
    mask
        Where grasps may be.
    instances
        Labels of objects.
    depth_scale_m
        Metres a unit of ``depth``.
    """

    depth: Path
    camera: Path | None = None
    colour: Path | None = None
    mask: Path | None = None
    instances: Path | None = None
    depth_scale_m: float | None = None


def read_frame(files: FrameFiles) -> Frame:
    """Read one frame.

    Parameters
    ----------
    files
        Where its parts lie.

    Returns
    -------
    The frame.

    Raises
    ------
    PictureError
        A file is missing, damaged, of another size, or does not fit the others.
    """
    files = with_neighbours(files)
    name = frame_name(files.depth)
    camera = read_camera_file(files.camera) if files.camera else None
    scale_m = files.depth_scale_m or (camera.depth_scale_m if camera else None)
    if is_cloud(files.depth):
        pose = camera.world_from_camera if camera else None
        return frame_of_cloud(name, cloud_files.read_cloud_m(files.depth, scale_m), pose)
    if camera is None:
        raise PictureError(
            f"{files.depth} has no camera beside it",
            f"Give the intrinsics as {files.depth.with_name(name + '.json')} or by --camera",
        )
    depth_m = read_depth_m(files.depth, scale_m)
    shape = (depth_m.shape[0], depth_m.shape[1])
    _check_size(files, camera, shape)
    pose = camera.world_from_camera
    frame = Frame(
        name=name,
        depth_m=depth_m,
        camera=camera_of_picture(
            name, shape, camera.intrinsics, np.eye(4) if pose is None else pose
        ),
        posed=pose is not None,
        allowed=read_mask(files.mask, shape) if files.mask else np.ones(shape, dtype=bool),
        colour=read_colour(files.colour, shape) if files.colour else None,
        instances=read_instances(files.instances, shape) if files.instances else None,
    )
    if not (frame.allowed & (depth_m > 0)).any():
        raise PictureError(
            f"{files.mask} allows only pixels that were not measured",
            "Check that mask and depth image belong together",
        )
    return frame


def with_neighbours(files: FrameFiles) -> FrameFiles:
    """The same with what lies beside the depth image, where nothing else was named."""
    folder, name = files.depth.parent, frame_name(files.depth)
    cameras = [
        folder / f"{stem}{end}" for stem in (name, *SHARED_CAMERAS) for end in CAMERA_SUFFIXES
    ]
    return replace(
        files,
        camera=files.camera or _first(cameras),
        colour=files.colour
        or _first(
            folder / f"{name}{word}{suffix}" for word in COLOUR_WORDS for suffix in PICTURE_SUFFIXES
        ),
        mask=files.mask or _first(folder / f"{name}.mask{end}" for end in PICTURE_SUFFIXES),
        instances=files.instances or _first([folder / f"{name}.instances.png"]),
    )


def frames_in(folder: Path) -> list[FrameFiles]:
    """All frames of a folder and of the folders in it, in the order of their paths.

    Parameters
    ----------
    folder
        Holds ``NAME.depth.*`` or point clouds (`CLOUD_SUFFIXES`), with what lies beside them.

    Returns
    -------
    The files of each frame, those beside it not yet looked for.

    Raises
    ------
    PictureError
        There is no such folder, or no frame in it.
    """
    found = [path for path in sorted(folder.rglob("*")) if path.is_file() and _is_frame(path)]
    if not found:
        raise PictureError(
            f"{folder} holds no frame" if folder.is_dir() else f"{folder} is no folder",
            "Name depth images NAME.depth.png (.tif, .npy, .exr), each with NAME.json beside it, "
            "or give point clouds (.ply, .pcd)",
        )
    return [FrameFiles(path) for path in found]


def _is_frame(path: Path) -> bool:
    suffix = path.suffix.lower()
    return suffix in CLOUD_SUFFIXES or (
        suffix in DEPTH_SUFFIXES and path.stem.lower().endswith(".depth")
    )


def frame_name(depth: Path) -> str:
    """What a frame is called: its file's name without ``.depth`` and ending."""
    return depth.stem.removesuffix(".depth")


def is_cloud(path: Path) -> bool:
    """Whether a file holds points rather than a depth image."""
    if path.suffix.lower() in CLOUD_SUFFIXES:
        return True
    if path.suffix.lower() != ".npy" or not path.is_file():
        return False
    try:
        shape = np.load(path, mmap_mode="r", allow_pickle=False).shape
    except (OSError, ValueError, EOFError):
        return False  # the depth reader says what is wrong with it
    return len(shape) in (2, 3) and shape[-1] == 3


def within_workspace(frame: Frame, workspace: Path) -> Frame:
    """The frame with grasps allowed only inside a workspace.

    The file is JSON with ``box_m`` (two opposite corners in the frame's world, which is CCS where
    the frame has no pose), ``polygon_m`` (corners in the world's x and y) or ``polygon_px``
    (corners in the picture, column and row).

    Parameters
    ----------
    frame
        The picture, in its own world.
    workspace
        The JSON file.

    Returns
    -------
    The same frame, with fewer pixels allowed.

    Raises
    ------
    PictureError
        The file is no workspace, or nothing measured lies in it.
    """
    try:
        content = json.loads(workspace.read_text())
    except (OSError, ValueError) as error:
        raise PictureError(f"{workspace} cannot be read as JSON: {error}", "Mend it") from error
    inside = _in_workspace(frame, content, workspace)
    allowed = frame.allowed & inside
    if not (allowed & (frame.depth_m > 0)).any():
        raise PictureError(
            f"{workspace}: nothing that {frame.name} measured lies in this workspace",
            "Check its corners and the frame they are meant in",
        )
    return replace(frame, allowed=allowed)


def _in_workspace(frame: Frame, content: Any, workspace: Path) -> Bool[np.ndarray, "h w"]:
    size = (frame.camera.width_px, frame.camera.height_px)
    kinds = {"box_m": (2, 3), "polygon_m": (None, 2), "polygon_px": (None, 2)}
    given = [kind for kind in kinds if isinstance(content, dict) and kind in content]
    if len(given) != 1:
        raise PictureError(
            f"{workspace} names {len(given)} of {', '.join(kinds)}", "Give one of them"
        )
    corners = _corners(content[given[0]], kinds[given[0]], f"{workspace}: '{given[0]}'")
    if given[0] == "polygon_px":
        return _filled(corners, size)
    points, rows, columns = points_of_depth(frame.depth_m, frame.camera, 1)
    inside = np.zeros(frame.depth_m.shape, dtype=bool)
    if given[0] == "box_m":
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        chosen = ((points >= lower) & (points <= upper)).all(axis=1)
    else:
        chosen = _in_polygon(points[:, :2], corners)
    inside[rows[chosen], columns[chosen]] = True
    return inside


def _corners(
    value: Any, shape: tuple[int | None, int], where: str
) -> Float[np.ndarray, "corners d"]:
    try:
        corners = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise PictureError(f"{where} is not made of numbers", "Give a list of corners") from error
    count, dimensions = shape
    fits = corners.ndim == 2 and corners.shape[1] == dimensions and np.isfinite(corners).all()
    if not fits or (len(corners) != count if count else len(corners) < 3):
        raise PictureError(
            f"{where} has the shape {corners.shape}, and {count or 'three or more'} corners of "
            f"{dimensions} numbers are needed",
            "Give a list of corners",
        )
    return corners


def _filled(
    corners: Float[np.ndarray, "corners 2"], size: tuple[int, int]
) -> Bool[np.ndarray, "h w"]:
    picture = Image.new("1", size)
    ImageDraw.Draw(picture).polygon([(float(x), float(y)) for x, y in corners], fill=1)
    return np.asarray(picture)


def _in_polygon(
    points: Float[np.ndarray, "n 2"], corners: Float[np.ndarray, "corners 2"]
) -> Bool[np.ndarray, " n"]:
    """By the number of edges that a ray along x crosses."""
    inside = np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        crosses = (y0 > points[:, 1]) != (y1 > points[:, 1])
        if y0 != y1:
            at = x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0)
            inside ^= crosses & (points[:, 0] < at)
    return inside


def _check_size(files: FrameFiles, camera: CameraFile, shape: tuple[int, int]) -> None:
    if camera.size_px is not None and camera.size_px != (shape[1], shape[0]):
        raise PictureError(
            f"{files.camera} describes pictures of {camera.size_px[0]} by {camera.size_px[1]} "
            f"pixels, and {files.depth} has {shape[1]} by {shape[0]}",
            "Give the camera of this picture: intrinsics change with its size",
        )


def _first(paths: Iterable[Path]) -> Path | None:
    return next((path for path in paths if path.is_file()), None)
