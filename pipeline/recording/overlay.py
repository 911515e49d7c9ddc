"""Grasps drawn on the picture they were found on, so that a person understands them at once."""

import io

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw, ImageFont

from pipeline.camera.frame import Frame
from pipeline.camera.prediction import Prediction
from pipeline.camera.proposals import pixels_of
from pipeline.recording import colours

WIDTH_PX = 960  # of the picture on the sheet; smaller ones are enlarged
# White around the picture, room for the scale and two lines.
_MARGIN_PX, _SCALE_PX, _TITLE_PX = 14, 120, 64
_RIM = 48  # points of a pad's outline
# White paper, dark ink, and what is less important.
_PAPER, _INK, _PALE = (255, 255, 255), (25, 25, 25), (150, 150, 150)


def grasp_picture(prediction: Prediction) -> Image.Image:
    """The first frame with every pad where it would lie, coloured by q-hat, with a scale.

    Pads are discs of the gripper's radius, seen as the camera sees them; a line leaves each along
    the way the gripper comes. The best is drawn thick, with its q-hat; those under the threshold
    are thin.
    """
    frame = prediction.frames[0]
    scale = max(1.0, WIDTH_PX / frame.camera.width_px)
    picture = picture_with_pads(prediction, scale)
    size = picture.size
    sheet = Image.new(
        "RGB", (size[0] + 2 * _MARGIN_PX + _SCALE_PX, size[1] + _TITLE_PX + _MARGIN_PX), _PAPER
    )
    sheet.paste(picture, (_MARGIN_PX, _TITLE_PX))
    ink = ImageDraw.Draw(sheet)
    title, small = ImageFont.load_default(size=20), ImageFont.load_default(size=14)
    ink.text((_MARGIN_PX, 8), f"{frame.name}: {prediction.verdict}", font=title, fill=_INK)
    radius = f"pads of {1e3 * prediction.radius_m:.0f} mm radius, ranked by {prediction.ranking}"
    ink.text((_MARGIN_PX, 36), radius, font=small, fill=_INK)
    _draw_scale(ink, size[0] + 2 * _MARGIN_PX, _TITLE_PX, size[1], prediction.quality_min)
    return sheet


def picture_with_pads(prediction: Prediction, scale: float) -> Image.Image:
    """The first frame's picture, enlarged by a scale, with every pad drawn on it."""
    picture = picture_of(prediction.frames[0], scale)
    draw = ImageDraw.Draw(picture)
    for index in range(len(prediction.proposals) - 1, -1, -1):
        _draw_pad(draw, prediction, index, scale)
    return picture


def picture_of(frame: Frame, scale: float) -> Image.Image:
    """A frame's colour, or its depth where it has none, enlarged by a scale."""
    size = (round(frame.camera.width_px * scale), round(frame.camera.height_px * scale))
    return Image.fromarray(_background(frame)).resize(size, Image.Resampling.BILINEAR)


def png_bytes(picture: Image.Image) -> bytes:
    """A picture as a PNG file."""
    file = io.BytesIO()
    picture.save(file, format="PNG", optimize=True)
    return file.getvalue()


def depth_picture(depth_m: Float[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w 3"]:
    """A depth image for the eye: near is bright, what was not measured is black."""
    seen = depth_m > 0
    if not seen.any():
        return np.zeros((*depth_m.shape, 3), dtype=np.uint8)
    near, far = np.percentile(depth_m[seen], [1, 99])
    grey = 230.0 - 180.0 * np.clip((depth_m - near) / max(far - near, 1e-6), 0.0, 1.0)
    return np.repeat(np.where(seen, grey, 0.0).astype(np.uint8)[..., None], 3, axis=2)


def _background(frame: Frame) -> UInt8[np.ndarray, "h w 3"]:
    return frame.colour if frame.colour is not None else depth_picture(frame.depth_m)


def _draw_pad(draw: ImageDraw.ImageDraw, prediction: Prediction, index: int, scale: float) -> None:
    frame, pose = prediction.frames[0], prediction.proposals.world_from_contact[index]
    quality = float(prediction.proposals.quality[index])
    colour = tuple(int(c) for c in colours.by_value(np.array([quality]))[0])
    angle = np.linspace(0.0, 2.0 * np.pi, _RIM)
    r = prediction.radius_m
    rim = np.stack([r * np.cos(angle), r * np.sin(angle), 0.0 * angle], axis=1)
    axis = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.5 * r]])
    width = 6 if index == 0 else (3 if quality >= prediction.quality_min else 1)
    for line in (rim, axis):
        pixel, ahead = pixels_of(frame, line @ pose[:3, :3].T + pose[:3, 3], within=False)
        if not ahead.all():
            continue
        points = [(float(x) * scale, float(y) * scale) for x, y in pixel]
        draw.line(points, fill=_PAPER, width=width + 2, joint="curve")
        draw.line(points, fill=colour, width=width, joint="curve")
        if index == 0 and line is axis:
            font = ImageFont.load_default(size=20)
            at = (points[1][0] + 6, points[1][1] - 12)
            draw.text(
                at, f"{quality:.2f}", font=font, fill=_PAPER, stroke_width=3, stroke_fill=_INK
            )


def _draw_scale(
    ink: ImageDraw.ImageDraw, left: int, top: int, height: int, quality_min: float
) -> None:
    font = ImageFont.load_default(size=14)
    low, high = top + height - 10, top + 30

    def height_of(value: float) -> float:
        return low - value * (low - high)

    ink.text((left, top + 4), "q-hat", font=font, fill=_INK)
    for row in range(high, low):
        value = (low - row) / (low - high)
        colour = tuple(int(c) for c in colours.by_value(np.array([value]))[0])
        ink.line([(left, row), (left + 22, row)], fill=colour)
    marks = {value: height_of(value) for value in (0.0, 0.25, 0.5, 0.75, 1.0)}
    for value, y in marks.items():
        ink.line([(left + 22, y), (left + 28, y)], fill=_INK)
        ink.text((left + 32, y - 8), f"{value:.2f}", font=font, fill=_INK)
    y = height_of(quality_min)
    ink.line([(left - 4, y), (left + 28, y)], fill=_INK, width=2)
    # Above the line, or below it where a mark's number would be covered.
    beside = y - 24 if min(abs(mark - (y - 16)) for mark in marks.values()) > 16 else y + 4
    ink.text((left + 32, beside), "good from here", font=ImageFont.load_default(size=11), fill=_INK)
