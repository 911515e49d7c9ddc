"""Errors of a trained network on held-out objects, beside those of the baselines; Supplement IV."""

from collections import Counter

import numpy as np

from pipeline.config.learning import TrainConfig
from pipeline.network.figures import (
    calibration,
    error_by_group,
    error_by_quality_bin,
    mean_absolute_error,
    weighted_error,
)
from pipeline.network.fitted_baselines import (
    FittedBaselines,
    baseline_errors,
)
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.inference import predict
from pipeline.network.samples import Samples
from pipeline.network.training_figures import CLASSES, TestFigures, error_by_pictures


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
        Trained on the training samples, each epoch measured on ``val_set``.
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
