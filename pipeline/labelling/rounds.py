"""Algorithm 1 on what one camera sees: propose, label, propose near rare labels, balance."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.gripper import LabelBatch
from pipeline.labelling.balancing import balance_labels, draw_rare_grasps
from pipeline.labelling.poses import label_poses
from pipeline.labelling.sampling import (
    Candidates,
    VisibleSurface,
    join_candidates,
    propose,
    propose_nearby,
)
from pipeline.world.raycasting import Surfaces


@dataclass(frozen=True)
class KeptGrasps:
    """Grasps that balancing kept; one row a grasp, n in all.

    Attributes
    ----------
    candidates
        Poses and proposals of the grasps.
    labels
        Their labels by Algorithm 1.
    keep_probability
        Share of the labels in the same tenth of [0, 1] that was kept, shape (n,).
    """

    candidates: Candidates
    labels: LabelBatch
    keep_probability: Float[np.ndarray, " n"]

    def dealt(self, most: int) -> list["KeptGrasps"]:
        """All of them in parts of about equal size, none of more than ``most``; 0: in one part."""
        count = len(self.keep_probability)
        parts = max(1, -(-count // most)) if most else 1
        rows_of = [np.arange(part, count, parts) for part in range(parts)]
        return [
            KeptGrasps(
                self.candidates.take(rows), self.labels.take(rows), self.keep_probability[rows]
            )
            for rows in rows_of
        ]


def sample_grasps(
    surface: VisibleSurface,
    surfaces: Surfaces,
    config: RunConfig,
    wanted: int,
    rng: np.random.Generator,
) -> KeptGrasps:
    """Label ``grasps.oversampling`` times as many grasps as are wanted; keep a balanced subset.

    Parameters
    ----------
    surface
        What the camera sees, with at least one of its `contacts`.
    surfaces
        The true surfaces.
    config
        Sections grasps and gripper.
    wanted
        How many to keep.
    rng
        Draws proposals and what is kept.

    Returns
    -------
    The kept grasps with their labels.
    """
    tried = int(np.ceil(wanted * config.grasps.oversampling))
    candidates, labels = label_rounds(surface, surfaces, config, tried, rng)
    kept, probability = balance_labels(labels.q, wanted, config.grasps.balance, rng)
    return KeptGrasps(candidates.take(kept), labels.take(kept), probability)


def label_rounds(
    surface: VisibleSurface,
    surfaces: Surfaces,
    config: RunConfig,
    tried: int,
    rng: np.random.Generator,
) -> tuple[Candidates, LabelBatch]:
    """Propose and label grasps in two rounds (S-1.04 - S-1.12); the second is near rare labels.

    Parameters
    ----------
    surface
        What the camera sees, with at least one of its `contacts`.
    surfaces
        The true surfaces.
    config
        Sections grasps and gripper.
    tried
        How many grasps to label in both rounds; ``grasps.nearby_share`` of them in the second.
    rng
        Draws proposals.

    Returns
    -------
    The grasps of both rounds and their labels, ``tried`` of each.
    """
    tried_on = surface.body_id[surface.contacts(config.grasps.seen_angle_max_rad)]
    bodies = np.unique(tried_on)
    parts = {int(body): surface.of_body(body) for body in bodies}
    first = tried - int(tried * config.grasps.nearby_share)
    candidates = join_candidates(
        [
            propose(parts[int(body)], count, config.grasps, rng)
            for body, count in zip(bodies, split_evenly(first, len(bodies)), strict=True)
        ]
    )
    labels = label_candidates(candidates, surfaces, config)
    origins = draw_rare_grasps(labels.q, tried - first, rng)
    near = join_candidates(
        [
            propose_nearby(
                parts[int(body)],
                candidates.take(origins[candidates.body_id[origins] == body]),
                config.grasps,
                rng,
            )
            for body in bodies
        ]
    )
    near_labels = label_candidates(near, surfaces, config)
    return join_candidates([candidates, near]), LabelBatch.join([labels, near_labels])


def label_candidates(candidates: Candidates, surfaces: Surfaces, config: RunConfig) -> LabelBatch:
    """Label every candidate (S-1.07 - S-1.12); see `label_poses`."""
    return label_poses(
        candidates.world_from_contact,
        candidates.body_id,
        surfaces,
        config.gripper,
        config.grasps.clearance_m,
    )


def split_evenly(total: int, parts: int) -> list[int]:
    """Split ``total`` into ``parts`` whole numbers that differ by at most one."""
    return [total // parts + (i < total % parts) for i in range(parts)]
