"""The contact sheet of the nine levels: one rendered clutter each, classes down, spreads across."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from pipeline.clutter.levels import level_of

_LEVELS = ((1, 2, 3), (4, 5, 6), (7, 8, 9))  # classes down, distributions across, as in Table II
_TITLE_PX = 34  # room for one line above a picture
_GAP_PX = 10  # white between two pictures
# White paper, dark ink, and a level that is missing.
_PAPER, _INK, _PALE = (255, 255, 255), (25, 25, 25), (235, 235, 235)


def contact_sheet(pictures: Mapping[int, UInt8[np.ndarray, "h w 3"]]) -> Image.Image:
    """Level → picture, all of one size, laid out as Table II; a level without one stays pale."""
    height, width = next(iter(pictures.values())).shape[:2]
    tile = (width + _GAP_PX, height + _TITLE_PX + _GAP_PX)
    sheet = Image.new("RGB", (3 * tile[0] + _GAP_PX, 3 * tile[1] + _GAP_PX), _PAPER)
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=20)
    for row, levels in enumerate(_LEVELS):
        for column, level in enumerate(levels):
            x, y = _GAP_PX + column * tile[0], _GAP_PX + row * tile[1]
            shape_class, distribution = level_of(level)
            title = f"Level {level}: {shape_class}, {distribution}"
            if level in pictures:
                sheet.paste(Image.fromarray(pictures[level]), (x, y + _TITLE_PX))
            else:
                box = (x, y + _TITLE_PX, x + width, y + _TITLE_PX + height)
                draw.rectangle(box, fill=_PALE)
                title += " (not in this run)"
            draw.text((x + 2, y + 5), title, font=font, fill=_INK)
    return sheet
