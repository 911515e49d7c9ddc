"""Depth images are read in metres, and what cannot be depth is refused with its reason."""

from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from pipeline.camera.depth_files import read_colour, read_depth_m, read_instances, read_mask
from pipeline.errors import PictureError

DEPTH_MM = np.array([[500, 0, 700], [650, 65535, 800]], dtype=np.uint16)
DEPTH_M = np.array([[0.5, 0.0, 0.7], [0.65, 0.0, 0.8]])


def written(path: Path) -> Path:
    """The same depth in the format that the path's ending names."""
    if path.suffix == ".npy":
        np.save(path, np.where(DEPTH_M > 0, DEPTH_M, np.nan))
    elif path.suffix == ".exr":
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"Z": DEPTH_M.astype(np.float32)}).write(str(path))
    elif path.name.startswith("float"):
        Image.fromarray(DEPTH_M.astype(np.float32)).save(path)
    else:
        Image.fromarray(DEPTH_MM).save(path)
    return path


@pytest.mark.parametrize("name", ["d.png", "d.tif", "d.tiff", "float.tiff", "d.npy", "d.exr"])
def test_every_format_gives_the_same_metres(tmp_path: Path, name: str) -> None:
    depth_m = read_depth_m(written(tmp_path / name), None)
    assert depth_m == pytest.approx(DEPTH_M, abs=1e-6)


def test_a_scale_is_metres_a_unit(tmp_path: Path) -> None:
    path = tmp_path / "d.png"
    Image.fromarray((DEPTH_MM.astype(np.int64) % 65535 * 10).astype(np.uint16)).save(path)
    assert read_depth_m(path, 1e-4) == pytest.approx(DEPTH_M)


@pytest.mark.parametrize(
    ("values", "scale_m", "says"),
    [
        (np.full((4, 4), 650.0), None, r"median depth of 650 m .* depth_scale_m = 0.001"),
        (np.full((4, 4), 650, dtype=np.uint16), 1.0, r"unit is wrong.* depth_scale_m = 0.001"),
        (np.full((4, 4), 0.65), 1e-3, r"median depth of 0.00065 m .* depth_scale_m = 1"),
        (np.full((4, 4), 6500, dtype=np.uint16), 1e-6, r"depth_scale_m = 0.001 or 0.0001"),
        (np.zeros((4, 4)), None, "no measured pixel"),
        (np.full((4, 4), np.nan), None, "no measured pixel"),
        (np.ones((4, 4, 3)), None, r"shape \(4, 4, 3\), not a depth image"),
        (np.ones((4, 4), dtype=np.uint8), None, "type uint8, too coarse for depth"),
        (np.ones((4, 4), dtype=complex), None, "type complex128"),
    ],
)
def test_what_is_no_depth_is_refused(
    tmp_path: Path, values: np.ndarray, scale_m: float | None, says: str
) -> None:
    path = tmp_path / "d.npy"
    np.save(path, values)
    with pytest.raises(PictureError, match=says) as told:
        read_depth_m(path, scale_m)
    assert str(path) in str(told.value)


def test_a_picture_for_the_eye_is_no_depth(tmp_path: Path) -> None:
    path = tmp_path / "d.png"
    Image.new("RGB", (4, 4), (1, 2, 3)).save(path)
    with pytest.raises(PictureError, match="not a depth image"):
        read_depth_m(path, None)


@pytest.mark.parametrize("name", ["d.png", "d.tif", "d.npy", "d.exr"])
def test_a_damaged_or_missing_file_is_named(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    with pytest.raises(PictureError, match=f"{name} is not there"):
        read_depth_m(path, None)
    whole = written(path).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(PictureError, match=name):
        read_depth_m(path, None)


def test_an_unknown_ending_lists_the_formats(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match=r"exr"):
        read_depth_m(tmp_path / "d.bag", None)


def test_pictures_of_another_size_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "c.png"
    Image.new("RGB", (8, 4)).save(path)
    with pytest.raises(PictureError, match=r"8 by 4 pixels, and the depth image 3 by 2"):
        read_colour(path, (2, 3))


def test_masks_and_labels(tmp_path: Path) -> None:
    path = tmp_path / "m.png"
    Image.fromarray(np.array([[0, 3], [255, 0]], dtype=np.uint8)).save(path)
    assert read_mask(path, (2, 2)).tolist() == [[False, True], [True, False]]
    assert read_instances(path, (2, 2)).tolist() == [[0, 3], [255, 0]]
    Image.new("L", (2, 2)).save(path)
    with pytest.raises(PictureError, match="allows no pixel"):
        read_mask(path, (2, 2))
    Image.new("RGB", (2, 2)).save(path)
    with pytest.raises(PictureError, match="one whole number a pixel"):
        read_instances(path, (2, 2))
