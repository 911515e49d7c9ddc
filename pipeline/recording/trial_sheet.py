"""Real frames on one sheet: the top choices of each ranking, and what was not measured."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

from pipeline.camera.frame import Frame
from pipeline.camera.trial import FrameTrial
from pipeline.recording.overlay import depth_picture, picture_of, picture_with_pads

# A tile's width, and the room for one line above it, between tiles and for letters.
_TILE_PX, _TITLE_PX, _GAP_PX = 560, 30, 8
# White paper, dark ink, the rim of a mask.
_PAPER, _INK, _MASK = (255, 255, 255), (25, 25, 25), (255, 64, 255)


def trial_sheet(trials: Sequence[FrameTrial]) -> Image.Image:
    """A row a frame and way of using its mask: a tile for each ranking, and the depth.

    Parameters
    ----------
    trials
        In the order of the sheet; those of one frame and one use of the mask follow each other.

    Returns
    -------
    The sheet.
    """
    rows: list[list[FrameTrial]] = []
    for trial in trials:
        last = rows[-1][-1] if rows else None
        same = last is not None and last.frame is trial.frame
        if last is not None and same and last.kept_to_mask == trial.kept_to_mask:
            rows[-1].append(trial)
        else:
            rows.append([trial])
    tiles = [[*map(_choices, row), _depth(row[0].frame)] for row in rows]
    heights = [max(tile.height for tile in row) + _GAP_PX for row in tiles]
    wide = max(len(row) for row in tiles) * (_TILE_PX + _GAP_PX) + _GAP_PX
    sheet = Image.new("RGB", (wide, sum(heights) + _GAP_PX), _PAPER)
    top = _GAP_PX
    for row_of_tiles, height in zip(tiles, heights, strict=True):
        for column, tile in enumerate(row_of_tiles):
            sheet.paste(tile, (_GAP_PX + column * (_TILE_PX + _GAP_PX), top))
        top += height
    return sheet


def _choices(trial: FrameTrial) -> Image.Image:
    scale = _TILE_PX / trial.frame.camera.width_px
    within = ", within the mask" if trial.kept_to_mask else ""
    title = f"{trial.frame.name}{within}, {trial.ranking}: "
    if trial.prediction is None:
        return _titled(_with_mask(picture_of(trial.frame, scale), trial.frame), title + "refused")
    picture = _with_mask(picture_with_pads(trial.prediction, scale), trial.frame)
    return _titled(picture, title + trial.prediction.verdict)


def _depth(frame: Frame) -> Image.Image:
    scale = _TILE_PX / frame.camera.width_px
    size = (_TILE_PX, round(frame.camera.height_px * scale))
    picture = Image.fromarray(depth_picture(frame.depth_m)).resize(size, Image.Resampling.NEAREST)
    empty = float(np.mean(frame.depth_m <= 0))
    return _titled(picture, f"depth; black: not measured, {100 * empty:.0f} %")


def _with_mask(picture: Image.Image, frame: Frame) -> Image.Image:
    """The picture with the rim of the frame's mask drawn, where it has one."""
    if frame.allowed.all():
        return picture
    mask = Image.fromarray(frame.allowed).resize(picture.size, Image.Resampling.NEAREST)
    inside = np.asarray(mask)
    pixels = np.asarray(picture).copy()
    pixels[inside ^ ndimage.binary_erosion(inside, iterations=2)] = _MASK
    return Image.fromarray(pixels)


def _titled(picture: Image.Image, title: str) -> Image.Image:
    tile = Image.new("RGB", (_TILE_PX, picture.height + _TITLE_PX), _PAPER)
    tile.paste(picture, (0, _TITLE_PX))
    font = ImageFont.load_default(size=13)
    draw = ImageDraw.Draw(tile)
    shown = title
    while draw.textlength(shown, font=font) > _TILE_PX:
        shown = shown.removesuffix("...")[:-1] + "..."
    draw.text((2, 8), shown, font=font, fill=_INK)
    return tile
