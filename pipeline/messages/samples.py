"""Training samples ↔ softgrip.v1.SampleBatch."""

import math
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.artifacts.tensors import set_tensors, tensors_of
from schemas.softgrip.v1.samples_pb2 import SampleBatch

STORED_AS = {
    "cloud": "f2",
    "cloud_mask": "u1",
    "quality": "f4",
    "object_index": "u2",
    "shape_class": "u1",
    "level": "u1",
    "pressure": "f4",
    "proposal_weight": "f4",
    "pictures": "u1",
}
SHAPES = {
    "cloud": "n g g 3",
    "cloud_mask": "n g g",
    **dict.fromkeys(("quality", "object_index", "shape_class", "level", "pressure"), "n"),
    **dict.fromkeys(("proposal_weight", "pictures"), "n"),
}
# What the fields hold that v1 did not have from the start.
UNLESS_THERE = {"proposal_weight": math.nan, "pictures": 1}


@dataclass(frozen=True)
class Samples:
    """What training reads; arrays of one length n.

    cloud, cloud_mask : (n, g, g, 3) and (n, g, g), units of r_G, origin at the contact.
    quality, pressure : (n,) q and p. shape_class : (n,) 0 basic, 1 typical, 2 complex.
    object_index : (n,) into the catalogue's names, kept beside.
    proposal_weight : (n,) how many grasps of the first round, drawn as S-1.04 - S-1.06 say and
    before labels were balanced, a sample stands for; 0 for one proposed near a rare label. NaN
    where the shards, of an older program, do not say.
    pictures : (n,) how many pictures the cloud was cut from.
    """

    cloud: Float[np.ndarray, "n g g 3"]
    cloud_mask: Bool[np.ndarray, "n g g"]
    quality: Float[np.ndarray, " n"]
    object_index: Int[np.ndarray, " n"]
    shape_class: Int[np.ndarray, " n"]
    level: Int[np.ndarray, " n"]
    pressure: Float[np.ndarray, " n"]
    proposal_weight: Float[np.ndarray, " n"]
    pictures: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.quality)

    def take(self, chosen: Int[np.ndarray, " k"] | slice) -> "Samples":
        """Those at the given indices."""
        return Samples(*(getattr(self, f.name)[chosen] for f in fields(self)))


def joined_samples(parts: list[Samples]) -> Samples:
    """Several sets as one, in order; at least one."""
    return Samples(
        *(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Samples))
    )


def sample_batch(samples: Samples, object_names: tuple[str, ...]) -> SampleBatch:
    """The message of some samples."""
    message = SampleBatch(object_names=object_names)
    set_tensors(message, vars(samples), STORED_AS)
    return message


def samples_of(message: SampleBatch) -> Samples:
    """The samples of a message: views of its bytes.

    Raises
    ------
    ContentError : a tensor is missing, or they do not fit together.
    """
    arrays = tensors_of(message, STORED_AS, SHAPES, UNLESS_THERE)
    arrays["cloud_mask"] = arrays["cloud_mask"].view(bool)
    return Samples(**arrays)
