"""Training samples ↔ softgrip.v1.SampleBatch."""

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
}
SHAPES = {
    "cloud": "n g g 3",
    "cloud_mask": "n g g",
    **dict.fromkeys(("quality", "object_index", "shape_class", "level", "pressure"), "n"),
}


@dataclass(frozen=True)
class Samples:
    """What training reads; arrays of one length n.

    cloud, cloud_mask : (n, g, g, 3) and (n, g, g), units of r_G, origin at the contact.
    quality, pressure : (n,) q and p. shape_class : (n,) 0 basic, 1 typical, 2 complex.
    object_index : (n,) into the catalogue's names, kept beside.
    """

    cloud: Float[np.ndarray, "n g g 3"]
    cloud_mask: Bool[np.ndarray, "n g g"]
    quality: Float[np.ndarray, " n"]
    object_index: Int[np.ndarray, " n"]
    shape_class: Int[np.ndarray, " n"]
    level: Int[np.ndarray, " n"]
    pressure: Float[np.ndarray, " n"]

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
    arrays = tensors_of(message, STORED_AS, SHAPES)
    arrays["cloud_mask"] = arrays["cloud_mask"].view(bool)
    return Samples(**arrays)
