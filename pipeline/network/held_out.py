"""Errors of a trained network on held-out objects, beside those of the baselines; Supplement IV."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from pipeline.config.learning import TrainConfig
from pipeline.geometry.shape import ShapeClass
from pipeline.network.figures import (
    calibration,
    error_by_group,
    error_by_quality_bin,
    mean_absolute_error,
    weighted_error,
)
from pipeline.network.fitted_baselines import (
    BaselineErrors,
    FittedBaselines,
    baseline_errors,
)
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.inference import predict
from pipeline.network.samples import Samples

# The names that ``Samples.shape_class`` points into.
CLASSES = np.array([str(shape_class) for shape_class in ShapeClass])


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
        Samples that the best epoch was chosen by.
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


def measure_held_out(
    network: GaCnn,
    config: TrainConfig,
    fitted: FittedBaselines,
    train_count: int,
    val_set: Samples,
    test_set: Samples,
) -> TestFigures:
    """Errors of the network and of the baselines on the test split.

    Parameters
    ----------
    network
        Trained on the training samples, best epoch chosen by ``val_set``.
    config
        Batch size and threads to predict with; whether symmetries are averaged over.
    fitted
        The baselines, fitted to training samples.
    train_count
        Number of training samples.
    val_set
        Validation samples, of other objects.
    test_set
        Test samples, of other objects.

    Returns
    -------
    The figures.
    """
    quality, shape_class = np.asarray(test_set.quality), CLASSES[test_set.shape_class]
    single, averaged = (
        predict(
            network,
            test_set.cloud,
            test_set.cloud_mask,
            config.batch_size,
            config.threads,
            average_symmetries=averaging,
        )
        for averaging in (False, True)
    )
    predicted = averaged if config.augment else single
    return TestFigures(
        quality=quality,
        predicted=predicted,
        mae=mean_absolute_error(predicted, quality),
        mae_single=mean_absolute_error(single, quality),
        mae_as_proposed=weighted_error(predicted, quality, test_set.proposal_weight),
        baselines=baseline_errors(fitted, test_set),
        by_class=error_by_group(predicted, quality, shape_class),
        by_pictures=error_by_pictures(predicted, test_set),
        first_proposals=int((np.asarray(test_set.proposal_weight) > 0).sum()),
        count_by_class=dict(Counter(shape_class.tolist())),
        by_tenth=[found.mae for found in error_by_quality_bin(predicted, quality)],
        calibration=[
            (found.mean_predicted, found.mean_quality, found.count)
            for found in calibration(predicted, quality)
        ],
        train_count=train_count,
        val_count=len(val_set),
    )


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
