"""The nine complexity levels of Table II: shape class by distribution."""

from enum import StrEnum

from pipeline.geometry.shape import ShapeClass


class Distribution(StrEnum):
    """How objects lie; Supplement V, Fig. 3 (d)-(f)."""

    ISOLATED = "isolated"
    MULTIPLE = "multiple"
    STACKED = "stacked"


LEVELS = range(1, 10)  # Table II numbers them so


def level_of(level: int) -> tuple[ShapeClass, Distribution]:
    """Shape class and distribution of a level; Table II reads row by row.

    Parameters
    ----------
    level
        1 to 9.

    Returns
    -------
    Its row and its column in the table.

    Raises
    ------
    ValueError
        Not a level.
    """
    if level not in LEVELS:
        raise ValueError(f"levels go from 1 to 9 (Table II), got {level}")
    row, column = divmod(level - 1, 3)
    return list(ShapeClass)[row], list(Distribution)[column]


def clutter_ids(level: int, split: str, count: int) -> list[str]:
    """Names of the first clutters of a level that are built of a split's objects."""
    return [f"level{level}-{split}-{number:02d}" for number in range(count)]


def clutter_number(clutter_id: str) -> int:
    """Number of a clutter among those of its level and split, from 0; the inverse of its name."""
    return int(clutter_id.rsplit("-", 1)[1])
