"""What came of grasps that were tried, against q-hat, and as samples to train on.

An attempt says one bit: whether an object was lifted by a contact. A network that predicts q learns
from it by a reading: a contact that lifted stands for the mean q of training grasps that are good,
one that did not for the mean q of those that are not. So labels stay within what q is, and one
bit does not claim to be a perfect seal or none.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import binomtest

from pipeline.errors import ArtifactError
from pipeline.network.samples import GraspTensors
from pipeline.read_only import read_only
from pipeline.referee.agreement import auroc

BINS = 5  # of q-hat: a few dozen attempts fill no more
CONFIDENCE = 0.95  # of the intervals of shares


@dataclass(frozen=True, eq=False)
class TriedContacts:
    """Contacts at which the vacuum was switched on, in order.

    Attributes
    ----------
    cloud
        Measured points around each in GCS, in units of r_G, shape (n, g, g, 3).
    mask
        Cells that hold a measured point, shape (n, g, g).
    predicted
        q-hat by which each was chosen, shape (n,).
    lifted
        Whether an object was lifted by it to the attempt's end, shape (n,).
    """

    cloud: Float[np.ndarray, "n g g 3"]
    mask: Bool[np.ndarray, "n g g"]
    predicted: Float[np.ndarray, " n"]
    lifted: Bool[np.ndarray, " n"]

    def __post_init__(self) -> None:
        for name in ("cloud", "mask", "predicted", "lifted"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.lifted)


def against_outcomes(
    predicted: Float[np.ndarray, " n"], lifted: Bool[np.ndarray, " n"]
) -> dict[str, Any]:
    """How well q-hat tells what is lifted.

    Parameters
    ----------
    predicted
        q-hat of tried contacts, shape (n,).
    lifted
        What came of them, shape (n,).

    Returns
    -------
    ``contacts`` and ``lifted`` (counts), ``share`` with its 95 % interval (Wilson), ``auroc``
    (None without both outcomes), ``brier`` (mean squared difference of q-hat and outcome),
    ``mean_predicted``, and ``bins`` of q-hat with the share lifted in each.
    """
    edges = np.linspace(0.0, 1.0, BINS + 1)
    bin_of = np.clip(np.digitize(predicted, edges) - 1, 0, BINS - 1)
    bins = []
    for number in range(BINS):
        own = bin_of == number
        if own.any():
            share, low, high = _share(lifted[own])
            bins.append(
                {
                    "from": float(edges[number]),
                    "to": float(edges[number + 1]),
                    "contacts": int(own.sum()),
                    "mean_predicted": float(predicted[own].mean()),
                    "share": share,
                    "interval_95": [low, high],
                }
            )
    share, low, high = _share(lifted)
    return {
        "contacts": len(lifted),
        "lifted": int(lifted.sum()),
        "share": share,
        "interval_95": [low, high],
        "auroc": auroc(predicted, lifted),
        "brier": float(np.mean((predicted - lifted) ** 2)),
        "mean_predicted": float(predicted.mean()),
        "bins": bins,
    }


def outcome_samples(
    tried: TriedContacts, train_quality: Float[np.ndarray, " m"], good_quality: float
) -> GraspTensors:
    """Tried contacts as samples, labelled by the reading of this module.

    Parameters
    ----------
    tried
        At least one, with measured clouds.
    train_quality
        q of the run's training samples, shape (m,).
    good_quality
        From this q on a grasp is good.

    Returns
    -------
    A sample a contact; those around which nothing was measured are left out.

    Raises
    ------
    ArtifactError
        No contact has a measured cloud, or the training samples are all good or all bad.
    """
    seen = tried.mask.any(axis=(1, 2))
    if not seen.any():
        raise ArtifactError(
            "no tried contact has a measured cloud around it", "Name attempts that sealed"
        )
    good = train_quality >= good_quality
    if good.all() or not good.any():
        raise ArtifactError(
            f"all training samples lie on one side of q = {good_quality:g}, so an outcome has no q",
            "Change train.attempt_good_quality, or ask for more grasps",
        )
    label = np.where(tried.lifted, train_quality[good].mean(), train_quality[~good].mean())
    return GraspTensors(
        np.ascontiguousarray(tried.cloud[seen]),
        np.ascontiguousarray(tried.mask[seen]),
        label[seen].astype(train_quality.dtype),
    )


def with_outcomes(samples: GraspTensors, outcomes: GraspTensors, repeats: int) -> GraspTensors:
    """Training samples and, so many times each, those of outcomes behind them, in memory.

    Parameters
    ----------
    samples
        Labelled by Algorithm 1.
    outcomes
        Of `outcome_samples`.
    repeats
        How often each outcome counts.

    Returns
    -------
    All of them.

    Raises
    ------
    ArtifactError
        Their grids differ.
    """
    if samples.cloud.shape[1:] != outcomes.cloud.shape[1:]:
        raise ArtifactError(
            f"tried contacts have a grid of {outcomes.cloud.shape[1]} cells a side, and the run's "
            f"samples {samples.cloud.shape[1]}",
            "Set sensing.grid_cells as it was when they were tried",
        )
    several = [outcomes] * repeats
    return GraspTensors(
        np.concatenate([samples.cloud, *(one.cloud for one in several)]),
        np.concatenate([samples.mask, *(one.mask for one in several)]),
        np.concatenate([samples.quality, *(one.quality for one in several)]),
    )


def _share(lifted: Bool[np.ndarray, " n"]) -> tuple[float, float, float]:
    found = binomtest(int(lifted.sum()), len(lifted)).proportion_ci(CONFIDENCE, method="wilson")
    return float(lifted.mean()), float(found.low), float(found.high)
