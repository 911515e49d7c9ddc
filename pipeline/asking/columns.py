"""Columns of rows as they pass from an artifact, or the stage that writes it, to a table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Integer

from pipeline.errors import ContentError
from pipeline.read_only import read_only

NONE = -1  # a word that is not there


@dataclass(frozen=True)
class Words:
    """A column of words.

    Attributes
    ----------
    names
        The words.
    index
        Which of them each row has, shape (n,); -1 where it has none.

    Raises
    ------
    ContentError
        A row has a word that is not there.
    """

    names: tuple[str, ...]
    index: Integer[np.ndarray, " n"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "index", read_only(self.index))
        if len(self.index) and int(self.index.max()) >= len(self.names):
            raise ContentError(f"A row has word {self.index.max()} of {len(self.names)}")

    def __len__(self) -> int:
        return len(self.index)


Values = Words | np.ndarray
Part = Mapping[str, Values]
"""Column → its values, all of one length."""


def words(values: Sequence[str]) -> Words:
    """A column of the words given; an empty one is none."""
    names = tuple(sorted({value for value in values if value}))
    number = {name: index for index, name in enumerate(names)} | {"": NONE}
    return Words(names, np.array([number[value] for value in values], dtype=np.int64))


def one_word(value: str, rows: int) -> Words:
    """A column that has one word in every row."""
    return Words((value,) if value else (), np.full(rows, 0 if value else NONE))
