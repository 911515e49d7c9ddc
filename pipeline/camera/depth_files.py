"""Depth images from files: 16-bit PNG and TIFF, NumPy arrays, OpenEXR; always metres.

What a camera did not measure is 0 in the arrays that these functions return, whatever mark the
file uses for it (0, NaN, infinity or the largest integer).
"""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from PIL import Image, UnidentifiedImageError

from pipeline.errors import PictureError

EXR_CHANNELS = ("Z", "depth", "D", "Y", "V", "R")  # names under which writers keep a depth
LIKELY_M = (0.1, 12.0)  # what depth cameras of tables and bins measure
FORMATS = "16-bit PNG or TIFF, floating-point TIFF, npy, exr"


def read_depth_m(path: Path, scale_m: float | None) -> Float[np.ndarray, "h w"]:
    """A depth image in metres, 0 where nothing was measured.

    Parameters
    ----------
    path
        File of one of `FORMATS`.
    scale_m
        Metres that one unit of the file stands for; None: 0.001 for integers (millimetres, as
        most drivers write), 1 for floating-point numbers.

    Returns
    -------
    Depth along the optical axis [m], shape (h, w).

    Raises
    ------
    PictureError
        The file cannot be read, holds no depth image, or its range says that the unit is wrong.
    """
    raw = _READERS.get(path.suffix.lower(), _unknown)(path)
    if raw.ndim == 3 and raw.shape[2] == 1:
        raw = raw[..., 0]
    if raw.ndim != 2 or raw.size == 0:
        raise PictureError(
            f"{path} holds an array of shape {raw.shape}, not a depth image of height by width",
            "Give the depth image itself, one number a pixel",
        )
    if raw.dtype.kind not in "uif" or raw.dtype == np.uint8:
        raise PictureError(
            f"{path} holds numbers of type {raw.dtype}, too coarse for depth",
            "Give 16-bit integers or floating-point numbers: this may be the picture for the eye",
        )
    unit = scale_m if scale_m is not None else (1.0 if raw.dtype.kind == "f" else 1e-3)
    values = raw.astype(np.float64)
    if raw.dtype.kind in "ui":
        values[raw == np.iinfo(raw.dtype).max] = 0.0
    depth_m = np.where(np.isfinite(values) & (values > 0), values, 0.0) * unit
    check_range(path, depth_m, unit)
    return depth_m


def check_range(path: Path, depth_m: Float[np.ndarray, "h w"], scale_m: float) -> None:
    """Raise PictureError where no pixel is measured, or depths are far from what cameras see.

    Parameters
    ----------
    path
        Named in the error.
    depth_m
        Depth [m], 0 where nothing was measured.
    scale_m
        The scale that was used; the error says which would fit.
    """
    measured = depth_m[depth_m > 0]
    if measured.size == 0:
        raise PictureError(
            f"{path} holds no measured pixel: all are empty", "Take the picture again"
        )
    middle = float(np.median(measured))
    nearest, farthest = LIKELY_M
    if nearest <= middle <= farthest:
        return
    fitting = [unit for unit in (1.0, 1e-3, 1e-4) if nearest <= middle / scale_m * unit <= farthest]
    guess = " or ".join(f"{unit:g}" for unit in fitting)
    raise PictureError(
        f"{path} has a median depth of {middle:.4g} m at {scale_m:g} m a unit, and depth cameras "
        f"of tables and bins measure {nearest:g} to {farthest:g} m: the unit is wrong",
        f"Give depth_scale_m = {guess}" if fitting else "Give the right depth_scale_m",
    )


def read_colour(path: Path, shape: tuple[int, int]) -> UInt8[np.ndarray, "h w 3"]:
    """The colour picture that belongs to a depth image, aligned with it pixel by pixel.

    Parameters
    ----------
    path
        Any format that Pillow reads.
    shape
        Height and width of the depth image.

    Returns
    -------
    Red, green and blue, shape (h, w, 3).

    Raises
    ------
    PictureError
        The file cannot be read, or its size differs from the depth image's.
    """
    return np.asarray(_sized(path, "colour picture", shape).convert("RGB"))


def read_mask(path: Path, shape: tuple[int, int]) -> Bool[np.ndarray, "h w"]:
    """Where grasps may be: pixels of a mask's picture that are not black.

    Parameters
    ----------
    path
        Any format that Pillow reads.
    shape
        Height and width of the depth image.

    Returns
    -------
    True where grasps may be, shape (h, w).

    Raises
    ------
    PictureError
        The file cannot be read, its size differs from the depth image's, or nothing is chosen.
    """
    mask = np.asarray(_sized(path, "mask", shape).convert("L")) > 0
    if not mask.any():
        raise PictureError(f"{path} is black: it allows no pixel", "Paint what may be grasped")
    return mask


def read_instances(path: Path, shape: tuple[int, int]) -> Int[np.ndarray, "h w"]:
    """Instance labels of the pixels, 0 for the background.

    Parameters
    ----------
    path
        A picture of grey levels, 8 or 16 bits.
    shape
        Height and width of the depth image.

    Returns
    -------
    A label a pixel, 0 for the background, shape (h, w).

    Raises
    ------
    PictureError
        The file cannot be read, its size differs from the depth image's, or it has colours.
    """
    picture = _sized(path, "instance picture", shape)
    if picture.mode not in ("L", "P", "I", "I;16", "1"):
        raise PictureError(
            f"{path} is a picture of mode {picture.mode}, and instance labels are one whole "
            "number a pixel",
            "Save the labels as 8- or 16-bit grey levels",
        )
    return np.asarray(picture).astype(np.int64)


def _sized(path: Path, what: str, shape: tuple[int, int]) -> Image.Image:
    picture = _opened(path)
    if (picture.height, picture.width) != shape:
        raise PictureError(
            f"{path}: the {what} is {picture.width} by {picture.height} pixels, and the depth "
            f"image {shape[1]} by {shape[0]}",
            "Give pictures that are aligned with the depth image, pixel by pixel",
        )
    return picture


def _opened(path: Path) -> Image.Image:
    try:
        picture = Image.open(path)
        picture.load()
    except FileNotFoundError as error:
        raise PictureError(f"{path} is not there", "Check the path") from error
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise PictureError(
            f"{path} cannot be read as a picture: {error}", "Save it again, or give another file"
        ) from error
    return picture


def _from_picture(path: Path) -> np.ndarray:
    return np.asarray(_opened(path))


def _from_numpy(path: Path) -> np.ndarray:
    try:
        return np.asarray(np.load(path, allow_pickle=False))
    except FileNotFoundError as error:
        raise PictureError(f"{path} is not there", "Check the path") from error
    except (OSError, ValueError, EOFError) as error:
        raise PictureError(
            f"{path} cannot be read as a NumPy array: {error}", "Write it with numpy.save"
        ) from error


def _from_exr(path: Path) -> np.ndarray:
    import OpenEXR

    if not path.is_file():
        raise PictureError(f"{path} is not there", "Check the path")
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = {name: channel.pixels for name, channel in file.channels().items()}
    except (RuntimeError, ValueError, TypeError) as error:
        raise PictureError(
            f"{path} cannot be read as OpenEXR: {error}", "Save it again, or give another file"
        ) from error
    for name in EXR_CHANNELS:
        if name in channels:
            return np.asarray(channels[name])
    raise PictureError(
        f"{path} has the channels {', '.join(sorted(channels))}, and none of them is a depth",
        f"Name the channel one of {', '.join(EXR_CHANNELS)}",
    )


def _unknown(path: Path) -> np.ndarray:
    raise PictureError(f"{path} is of no known format", f"Give a depth image as {FORMATS}")


_READERS = {
    ".png": _from_picture,
    ".tif": _from_picture,
    ".tiff": _from_picture,
    ".npy": _from_numpy,
    ".exr": _from_exr,
}
