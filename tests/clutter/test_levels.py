"""Table II, read row by row."""

import pytest

from pipeline.clutter.levels import LEVELS, Distribution, clutter_ids, clutter_number, level_of
from pipeline.geometry.shape import ShapeClass


def test_nine_levels_are_all_pairs() -> None:
    assert level_of(1) == (ShapeClass.BASIC, Distribution.ISOLATED)
    assert level_of(3) == (ShapeClass.BASIC, Distribution.STACKED)
    assert level_of(8) == (ShapeClass.COMPLEX, Distribution.MULTIPLE)
    assert len({level_of(level) for level in LEVELS}) == 9


@pytest.mark.parametrize("level", [0, 10, -1])
def test_there_is_no_tenth_level(level: int) -> None:
    with pytest.raises(ValueError, match="from 1 to 9"):
        level_of(level)


def test_a_clutters_name_tells_its_number() -> None:
    assert [clutter_number(name) for name in clutter_ids(7, "test", 12)] == list(range(12))
