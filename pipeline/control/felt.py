"""What the vacuum felt at some seals tells of contacts near them.

Where the network expects next to nothing anywhere, as on studs and edges, its order says little. A
seal that fails still tells how well it closed: the vacuum felt, against what was promised there.
Contacts near a place that closed better than promised are worth more, those near a worse one less:
a Gaussian process over place and approach, on ln(worth), with q-hat as its prior mean. Other
places keep their q-hat, so that the search goes on far away where it was bad, and near where it was
nearly good.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.policy import PolicyConfig
from pipeline.control.decision import TriedContact

_LEAST_QUALITY = 2e-3  # the network tells no two promises under this apart
_LEAST_VACUUM = 0.02  # over the noise of a sensor; less is no seal at all


def led_by_feeling(
    poses: Float[np.ndarray, "k 4 4"],
    quality: Float[np.ndarray, " k"],
    felt: Sequence[TriedContact],
    config: PolicyConfig,
) -> Float[np.ndarray, " k"]:
    """Worth of contacts after what was felt at some seals.

    Parameters
    ----------
    poses
        world_from_contact of each, shape (k, 4, 4).
    quality
        q-hat of each, shape (k,).
    felt
        Seals whose vacuum was measured.
    config
        How far a seal tells of others, and how exactly.

    Returns
    -------
    q-hat, scaled by what was felt near each, shape (k,).
    """
    if not felt:
        return quality
    sealed = np.array([seal.world_from_contact for seal in felt])
    promised = np.log(np.maximum([seal.quality for seal in felt], _LEAST_QUALITY))
    # A seal that closes on a share of the pad pulls on that share with that share of the vacuum.
    found = 2 * np.log(np.maximum([seal.vacuum for seal in felt], _LEAST_VACUUM))
    among = _alike(sealed, sealed, config) + config.felt_error**2 * np.eye(len(felt))
    shift = _alike(poses, sealed, config) @ np.linalg.solve(among, found - promised)
    return np.asarray(np.maximum(quality, _LEAST_QUALITY) * np.exp(shift))


def tried_already(
    poses: Float[np.ndarray, "k 4 4"], felt: Sequence[TriedContact], config: PolicyConfig
) -> Bool[np.ndarray, " k"]:
    """Whether a seal was tried so near, from so alike a side, that another tells nothing new.

    Parameters
    ----------
    poses
        world_from_contact of each, shape (k, 4, 4).
    felt
        Seals that failed.
    config
        How near and how alike.

    Returns
    -------
    One for each pose, shape (k,).
    """
    if not felt:
        return np.zeros(len(poses), dtype=bool)
    apart_m, turned_rad = _apart(poses, np.array([seal.world_from_contact for seal in felt]))
    near = (apart_m < config.again_m) & (turned_rad < config.again_rad)
    return np.asarray(near.any(axis=1))


def _alike(
    poses: Float[np.ndarray, "k 4 4"], others: Float[np.ndarray, "n 4 4"], config: PolicyConfig
) -> Float[np.ndarray, "k n"]:
    """Covariance of ln(worth) between contacts, 1 of a contact with itself."""
    apart_m, turned_rad = _apart(poses, others)
    far = (apart_m / config.felt_reach_m) ** 2 + (turned_rad / config.felt_reach_rad) ** 2
    return np.asarray(np.exp(-far / 2))


def _apart(
    poses: Float[np.ndarray, "k 4 4"], others: Float[np.ndarray, "n 4 4"]
) -> tuple[Float[np.ndarray, "k n"], Float[np.ndarray, "k n"]]:
    """Distance [m] and angle between the approaches [rad] of each pair."""
    apart_m = np.linalg.norm(poses[:, None, :3, 3] - others[None, :, :3, 3], axis=2)
    cosine = poses[:, :3, 2] @ others[:, :3, 2].T
    return apart_m, np.arccos(np.clip(cosine, -1.0, 1.0))
