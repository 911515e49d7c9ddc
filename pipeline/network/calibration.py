"""What a predicted quality is worth: q-hat → the probability that the true q is good.

By isotonic regression on samples that the network was not trained on, weighted as Algorithm 1
proposes grasps: training samples are balanced over q, and real grasps are not.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import isotonic_regression


@dataclass(frozen=True, eq=False)
class Calibration:
    """A step function that rises: q-hat → share of grasps whose q is good.

    Attributes
    ----------
    predicted
        q-hat of the samples, ascending, each once, shape (n,).
    probability
        Share of good grasps at each, never falling, shape (n,).
    """

    predicted: Float[np.ndarray, " n"]
    probability: Float[np.ndarray, " n"]

    def threshold(self, probability: float) -> float | None:
        """The least q-hat at which grasps are good with a probability; None where none is."""
        enough = np.flatnonzero(self.probability >= probability)
        return float(self.predicted[enough[0]]) if len(enough) else None

    def at(self, predicted: float) -> float:
        """Probability at a q-hat; that of the least sample below all of them."""
        index = int(np.searchsorted(self.predicted, predicted, side="right")) - 1
        return float(self.probability[max(index, 0)])


def fit_calibration(
    predicted: Float[np.ndarray, " n"],
    quality: Float[np.ndarray, " n"],
    weight: Float[np.ndarray, " n"],
    good_quality: float,
) -> Calibration:
    """Fit the share of good grasps to q-hat.

    Parameters
    ----------
    predicted
        q-hat of samples that the network was not trained on, shape (n,).
    quality
        Their q, shape (n,).
    weight
        How many proposed grasps each stands for, shape (n,); samples of weight 0 are left out.
    good_quality
        From this q on a grasp is good.

    Returns
    -------
    The calibration.
    """
    used = weight > 0
    # Equal predictions are one: the order among them would be no rise of the probability.
    distinct, owner = np.unique(predicted[used].astype(np.float64), return_inverse=True)
    total = np.bincount(owner, weights=weight[used])
    good = np.bincount(owner, weights=weight[used] * (quality[used] >= good_quality))
    fitted = isotonic_regression(good / total, weights=total)
    return Calibration(distinct, np.asarray(fitted.x))


@dataclass(frozen=True)
class Kept:
    """What a threshold does to grasps.

    Attributes
    ----------
    above
        Samples at or above it.
    precision
        Share of those that are good, by weight; None where there is none above.
    recall
        Of all good grasps, how many are above it, by weight; None where none is good.
    """

    above: int
    precision: float | None
    recall: float | None


def kept_by(
    threshold: float,
    predicted: Float[np.ndarray, " n"],
    quality: Float[np.ndarray, " n"],
    weight: Float[np.ndarray, " n"],
    good_quality: float,
) -> Kept:
    """What a threshold keeps of other samples than those that it was chosen on.

    Parameters
    ----------
    threshold
        Least q-hat.
    predicted
        q-hat, shape (n,).
    quality
        q, shape (n,).
    weight
        How many proposed grasps each stands for, shape (n,).
    good_quality
        From this q on a grasp is good.

    Returns
    -------
    Precision and recall.
    """
    above, good = (predicted >= threshold) & (weight > 0), quality >= good_quality
    both = float(weight[above & good].sum())
    kept, wanted = float(weight[above].sum()), float(weight[good].sum())
    return Kept(int(above.sum()), both / kept if kept else None, both / wanted if wanted else None)
