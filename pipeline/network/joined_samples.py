"""Samples of several sets, read by number as if they were one."""

import hashlib
from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from pipeline.errors import ArtifactError
from pipeline.network.loading import MappedRows
from pipeline.network.samples import GraspTensors, Rows


class JoinedSamples:
    """The samples of several sets, one behind the other; another process maps the files itself."""

    def __init__(self, sets: Sequence[GraspTensors]) -> None:
        """Raise ArtifactError where the sets' grids differ."""
        cells = sorted({one.cloud.shape[1] for one in sets})
        if len(cells) > 1:
            raise ArtifactError(
                f"runs that are learnt from together have grids of {cells[0]} and {cells[-1]} "
                "cells a side",
                "Set sensing.grid_cells alike, and make the other dataset again",
            )
        self._sets = [MappedRows(one) for one in sets]
        self._starts = np.cumsum([0, *map(len, sets)])
        self._digest = hashlib.sha256("".join(one.sha256() for one in sets).encode()).hexdigest()

    def __len__(self) -> int:
        return int(self._starts[-1])

    def sha256(self) -> str:
        """Digest of the content, as hex."""
        return self._digest

    def rows(self, numbers: Int[np.ndarray, " b"]) -> Rows:
        """Copies of some samples, in the order of their numbers."""
        owner = np.searchsorted(self._starts, numbers, side="right") - 1
        back = np.argsort(np.argsort(owner, kind="stable"), kind="stable")
        parts = [
            self._sets[k].rows(numbers[owner == k] - self._starts[k]) for k in np.unique(owner)
        ]
        return Rows(*(np.concatenate(arrays)[back] for arrays in zip(*parts, strict=True)))
