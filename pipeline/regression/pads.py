"""A small fixed file of pads over surfaces; their labels depend on no renderer and no physics."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from pipeline.artifacts import ArtifactWriter, Provenance, from_tensor, open_artifact, to_tensor
from pipeline.config import GripperConfig
from pipeline.gripper import LabelBatch, label_batch, pad_of
from schemas.softgrip.v1.tensor_pb2 import Tensor

HEIGHTS, ON_TARGET = "/heights_m", "/on_target"


def write_pads(
    path: Path,
    provenance: Provenance,
    heights_m: Float[np.ndarray, "n v"],
    on_target: Bool[np.ndarray, "n v"],
) -> None:
    """Write the heights under each pad's vertices to a file.

    Single precision is exact to 1e-9 m for such heights.

    Parameters
    ----------
    path
        The file.
    provenance
        What the file is made from.
    heights_m
        Height of the surface under each vertex, z in GCS [m], shape (n, v).
    on_target
        Vertices over the target object, shape (n, v).
    """
    with ArtifactWriter(path, provenance) as artifact:
        artifact.write(HEIGHTS, to_tensor(heights_m.astype(np.float32)), log_time_ns=0)
        artifact.write(ON_TARGET, to_tensor(on_target.astype(np.uint8)), log_time_ns=0)


def labelled_pads(path: Path, config: GripperConfig) -> LabelBatch:
    """Label every pad of the file (S-1.07 - S-1.12) with the configuration given."""
    with open_artifact(path) as artifact:
        (heights,) = (from_tensor(m) for _, m in artifact.messages(Tensor, HEIGHTS))
        (target,) = (from_tensor(m) for _, m in artifact.messages(Tensor, ON_TARGET))
    return label_batch(pad_of(config.pad), config, heights.astype(np.float64), target == 1)
