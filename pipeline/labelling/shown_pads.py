"""The draped pads of some labelled grasps, computed again for a recording."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, Integer

from pipeline.config import RunConfig
from pipeline.gripper import pad_of
from pipeline.gripper.draping import drape
from pipeline.gripper.quality import triangle_pressure
from pipeline.labelling.grasps import LabelledGrasps
from pipeline.labelling.heights import pad_heights
from pipeline.spread import choose_evenly
from pipeline.world.raycasting import Surfaces

# Scenes, spread over the run, whose shards hold draped pads: more make a recording slow to open.
SHOWN_SCENES = 4


@dataclass(frozen=True)
class ShownPads:
    """Draped pads of some grasps of a shard.

    Attributes
    ----------
    grasp
        Number of each grasp within its shard, shape (k,).
    height_m
        z(v) of S-1.07, in GCS [m], shape (k, v).
    pressure
        p w_j of each triangle [1], shape (k, t); 0 where it is not in contact.
    """

    grasp: Integer[np.ndarray, " k"]
    height_m: Float[np.ndarray, "k v"]
    pressure: Float[np.ndarray, "k t"]


def drape_some_again(
    batches: Sequence[LabelledGrasps], wanted: int, surfaces: Surfaces, config: RunConfig
) -> ShownPads:
    """Drape the pads of some grasps of one scene again, from its worst label to its best.

    Parameters
    ----------
    batches
        All grasps of the scene, in their order.
    wanted
        How many at most.
    surfaces
        The true surfaces of the scene.
    config
        Sections grasps and gripper.

    Returns
    -------
    Heights and pressures, by rising label.
    """
    quality = np.concatenate([batch.quality for batch in batches])
    chosen = np.argsort(quality, kind="stable")[choose_evenly(len(quality), wanted)]
    return drape_again(batches, chosen, surfaces, config)


def drape_again(
    batches: Sequence[LabelledGrasps],
    chosen: Int[np.ndarray, " k"],
    surfaces: Surfaces,
    config: RunConfig,
) -> ShownPads:
    """Drape the pads of chosen grasps of one scene again, as when they were labelled.

    Parameters
    ----------
    batches
        All grasps of the scene, in their order.
    chosen
        Numbers of k of them, counted over all batches, shape (k,).
    surfaces
        The true surfaces of the scene.
    config
        Sections grasps and gripper.

    Returns
    -------
    Heights and pressures, in the order of ``chosen``.
    """
    pad, gripper = pad_of(config.gripper.pad), config.gripper
    frames = np.concatenate([grasps.world_from_gripper for grasps in batches])[chosen]
    contact = np.concatenate([grasps.contact_mask for grasps in batches])[chosen]
    heights, _ = pad_heights(frames, surfaces, pad, config.grasps.clearance_m)
    draped = drape(pad, heights)
    pressure = [
        triangle_pressure(pad, gripper, z, touching)
        for z, touching in zip(draped, contact, strict=True)
    ]
    return ShownPads(chosen, draped, np.array(pressure))
