"""Samples of a dataset as arrays, and the part of them that the network learns from."""

import hashlib
from dataclasses import dataclass, fields
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int, Integer

from pipeline.errors import ArtifactError

SPLITS = ("train", "val", "test")
_REMEDY = "Make the shards again."
# So many samples show which way the grid lies.
_ORIENTATION_SAMPLES = 64


class Rows(NamedTuple):
    """What the network learns from of some samples: clouds, masks and qualities of one length b."""

    cloud: Float[np.ndarray, "b h w 3"]
    mask: Bool[np.ndarray, "b h w"]
    quality: Float[np.ndarray, " b"]


@runtime_checkable
class SampleReader(Protocol):
    """Samples that are read by number, wherever they lie; another process gets it by paths."""

    def __len__(self) -> int:
        """How many there are."""

    def sha256(self) -> str:
        """Digest of the content, as hex."""

    def rows(self, numbers: Int[np.ndarray, " b"]) -> Rows:
        """Copies of some samples, in the order of their numbers."""


@dataclass(frozen=True)
class GraspTensors:
    """Labelled samples, held in memory or mapped from a file.

    Attributes
    ----------
    cloud
        Points in GCS in units of r_G, half or single precision; y grows with the row, x with
        the column (see ``canonical``).
    mask
        Cells that hold a measured point.
    quality
        q in [0, 1].

    Raises
    ------
    ArtifactError
        On construction, where shapes disagree, a quality is outside [0, 1], or the grid lies
        the other way.
    """

    cloud: Float[np.ndarray, "n h w 3"]
    mask: Bool[np.ndarray, "n h w"]
    quality: Float[np.ndarray, " n"]

    def __post_init__(self) -> None:
        n = len(self.quality)
        if (
            self.cloud.ndim != 4
            or self.cloud.shape[1] != self.cloud.shape[2]
            or self.cloud.shape != (*self.mask.shape, 3)
            or self.quality.shape != (self.cloud.shape[0],)
        ):
            raise ArtifactError(
                f"samples disagree in shape: cloud {self.cloud.shape}, mask {self.mask.shape}, "
                f"quality {self.quality.shape}",
                _REMEDY,
            )
        if n == 0:
            raise ArtifactError("a split holds no samples", "Ask for more grasps or objects.")
        if not bool(np.all((self.quality >= 0) & (self.quality <= 1))):
            raise ArtifactError("samples hold a quality outside [0, 1]", _REMEDY)
        _check_orientation(self.cloud[:_ORIENTATION_SAMPLES], self.mask[:_ORIENTATION_SAMPLES])

    def __len__(self) -> int:
        return len(self.quality)

    def rows(self, numbers: Int[np.ndarray, " b"]) -> Rows:
        """Copies of some samples, in the order of their numbers."""
        return Rows(self.cloud[numbers], self.mask[numbers], self.quality[numbers])

    def sha256(self) -> str:
        """Digest of the content, as hex."""
        digest = hashlib.sha256()
        for array in (self.cloud, self.mask, self.quality):
            digest.update(f"{array.dtype.str}{array.shape}".encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()


@dataclass(frozen=True)
class Samples:
    """Samples of a dataset; arrays of one length n.

    Attributes
    ----------
    cloud
        Points in GCS in units of r_G, origin at the contact, shape (n, g, g, 3).
    cloud_mask
        Cells that hold a measured point, shape (n, g, g).
    quality
        q, shape (n,).
    object_index
        Index into the catalogue's names, which are kept elsewhere, shape (n,).
    shape_class
        0 basic, 1 typical, 2 complex, shape (n,).
    level
        Level of Table II, shape (n,).
    pressure
        p, shape (n,).
    proposal_weight
        Number of grasps of the first round, drawn as S-1.04 - S-1.06 say and before labels were
        balanced, that a sample stands for, shape (n,); 0 for one proposed near a rare label. NaN
        where the shards, of an older program, do not say.
    pictures
        Number of pictures the cloud was cut from, shape (n,).
    """

    cloud: Float[np.ndarray, "n g g 3"]
    cloud_mask: Bool[np.ndarray, "n g g"]
    quality: Float[np.ndarray, " n"]
    object_index: Integer[np.ndarray, " n"]
    shape_class: Integer[np.ndarray, " n"]
    level: Integer[np.ndarray, " n"]
    pressure: Float[np.ndarray, " n"]
    proposal_weight: Float[np.ndarray, " n"]
    pictures: Integer[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.quality)

    @property
    def tensors(self) -> GraspTensors:
        """The part that the network learns from."""
        return GraspTensors(self.cloud, self.cloud_mask, self.quality)

    def take(self, chosen: Integer[np.ndarray, " k"] | slice) -> "Samples":
        """The samples at the given indices."""
        return Samples(*(getattr(self, f.name)[chosen] for f in fields(self)))


def join_samples(parts: list[Samples]) -> Samples:
    """Join several sets, in order; at least one."""
    return Samples(
        *(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Samples))
    )


def _check_orientation(
    cloud: Float[np.ndarray, "n h w 3"], mask: Bool[np.ndarray, "n h w"]
) -> None:
    """Raise ArtifactError where x falls along the columns or y along the rows."""
    side = cloud.shape[1]
    step = np.arange(side) - (side - 1) / 2
    x = np.where(mask, cloud[..., 0], 0).astype(np.float64)
    y = np.where(mask, cloud[..., 1], 0).astype(np.float64)
    along = {"x": (x * step[None, None, :]).sum(), "y": (y * step[None, :, None]).sum()}
    across = {"x": (x * step[None, :, None]).sum(), "y": (y * step[None, None, :]).sum()}
    for axis in ("x", "y"):
        if mask.any() and along[axis] <= abs(across[axis]):
            raise ArtifactError(
                f"clouds do not lie as expected: {axis} must grow with the "
                f"{'column' if axis == 'x' else 'row'}",
                _REMEDY,
            )
