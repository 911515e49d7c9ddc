"""What a training tells: its curve, its errors on held-out objects, what fine-tuning changed.

Types and what is counted of samples; who reads them back needs no PyTorch.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from pipeline.geometry.shape import ShapeClass
from pipeline.network.figures import error_by_group
from pipeline.network.fitted_baselines import BaselineErrors
from pipeline.network.samples import Samples

# The names that ``Samples.shape_class`` points into.
CLASSES = np.array([str(shape_class) for shape_class in ShapeClass])


@dataclass(frozen=True)
class EpochMetrics:
    """Figures of one epoch.

    Attributes
    ----------
    epoch
        Counted from 0.
    learning_rate
        At the epoch's last step.
    train_loss
        Mean loss over the epoch's samples, turned and mirrored as in training.
    train_mae
        Mean |q̂ − q| over the same.
    val_mae
        Mean |q̂ − q| over the validation samples after the epoch.
    samples
        Samples seen in the epoch, by all processes together.
    """

    epoch: int
    learning_rate: float
    train_loss: float
    train_mae: float
    val_mae: float
    samples: int


@dataclass(frozen=True)
class TestFigures:
    """The network on held-out objects; errors are mean |q̂ − q| of Supplement IV.

    Attributes
    ----------
    quality
        q of the n test samples, shape (n,).
    predicted
        q̂ of the n test samples, shape (n,).
    mae
        The error, averaged over the symmetries where the network was trained with them.
    mae_single
        The error of one prediction a grasp.
    mae_as_proposed
        The error over grasps as the first round draws them (``Samples.proposal_weight``), where
        labels are not balanced; None where that is unknown.
    baselines
        The errors of what a network has to beat, fitted to the training samples.
    by_class
        Name of a shape class → error.
    by_pictures
        "1 picture", "3 pictures", ... that clouds were cut from → error and samples.
    first_proposals
        Samples of the first round, those that ``mae_as_proposed`` is over.
    count_by_class
        Name of a shape class → samples.
    by_tenth
        Error by tenth of q, None where empty.
    calibration
        By tenth of q̂: mean q̂ and mean q (None where empty), count.
    train_count
        Samples that the network was trained on.
    val_count
        Samples that each epoch was measured on.
    """

    __test__ = False  # not a test case, whatever its name

    quality: Float[np.ndarray, " n"]
    predicted: Float[np.ndarray, " n"]
    mae: float
    mae_single: float
    mae_as_proposed: float | None
    baselines: BaselineErrors
    by_class: dict[str, float]
    by_pictures: dict[str, tuple[float, int]]
    first_proposals: int
    count_by_class: dict[str, int]
    by_tenth: Sequence[float | None]
    calibration: Sequence[tuple[float | None, float | None, int]]
    train_count: int
    val_count: int

    def headline(self) -> dict[str, Any]:
        """The errors by the names that a stage's summary gives them."""
        return {
            "test_mae": self.mae,
            "test_mae_single": self.mae_single,
            "test_mae_as_proposed": self.mae_as_proposed,
            **self.baselines.summary(),
            "test_mae_by_class": self.by_class,
            "test_mae_by_pictures": {name: error for name, (error, _) in self.by_pictures.items()},
            "test_mae_by_tenth_of_q": self.by_tenth,
        }


@dataclass(frozen=True)
class FineTuning:
    """Errors before and after, of one prediction a grasp: mean |q-hat - q|.

    Attributes
    ----------
    own_before
        Of the network that training began with, on the run's test split.
    own_after
        Of the trained one, on the same.
    released_before
        Of the first, on the released network's test grasps.
    released_after
        Of the trained one, on the same.
    released_grasps
        How many these are.
    learnt_before
        Of the first, on grasps that the released network was trained on; None in older files.
    learnt_after
        Of the trained one, on the same; None in older files.
    learnt_grasps
        How many these are.
    """

    own_before: float
    own_after: float
    released_before: float
    released_after: float
    released_grasps: int
    learnt_before: float | None = None
    learnt_after: float | None = None
    learnt_grasps: int = 0

    def headline(self) -> dict[str, Any]:
        """The figures by the names that a stage's summary gives them."""
        return {"fine_tuning": dict(vars(self))}


def error_by_pictures(
    predicted: Float[np.ndarray, " n"], test_set: Samples
) -> dict[str, tuple[float, int]]:
    """Mean |q̂ − q| and number of the samples whose clouds were cut from 1, 2, ... pictures."""
    counts = Counter(np.asarray(test_set.pictures).tolist())
    errors = error_by_group(predicted, np.asarray(test_set.quality), np.asarray(test_set.pictures))
    return {
        f"{pictures} picture{'s' if pictures > 1 else ''}": (errors[str(pictures)], count)
        for pictures, count in sorted(counts.items())
    }
