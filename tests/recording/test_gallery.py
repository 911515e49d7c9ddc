"""The contact sheet holds each level's picture at its place."""

import numpy as np
from PIL import ImageStat

from pipeline.recording.gallery import contact_sheet


def flat(value: int) -> np.ndarray:
    return np.full((30, 40, 3), value, dtype=np.uint8)


def test_classes_go_down_and_spreads_across() -> None:
    sheet = contact_sheet({level: flat(20 * level) for level in range(1, 10)})
    width, height = sheet.size
    pixels = np.asarray(sheet)
    for level in range(1, 10):
        row, column = divmod(level - 1, 3)
        x, y = int((column + 0.5) * width / 3), int((row + 0.75) * height / 3)
        assert (pixels[y, x] == 20 * level).all()


def test_a_level_without_a_clutter_stays_pale() -> None:
    sheet = contact_sheet({1: flat(0)})
    width, height = sheet.size
    left = ImageStat.Stat(sheet.crop((0, 0, width // 3, height // 3))).mean[0]
    right = ImageStat.Stat(sheet.crop((2 * width // 3, 0, width, height // 3))).mean[0]
    assert left < 180 < right
