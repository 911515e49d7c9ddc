"""The baselines of every report of error, fitted to training samples: what a network has to beat.

- mean, median: one number for every grasp. The median is the best constant for a mean absolute
  error.
- seal_ratio: a rising function of the share of measured cells that lie near one plane.
- analytic: the label of Algorithm 1 on the measured cloud (`pipeline.network.analytic`).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.grasps import GripperConfig, PadConfig
from pipeline.network.analytic import AnalyticBaseline, fit_analytic
from pipeline.network.baselines import MonotoneRegressor, fit_monotone, seal_ratio
from pipeline.network.figures import mean_absolute_error, weighted_error
from pipeline.network.samples import Samples
from pipeline.spread import choose_evenly

MEAN, MEDIAN, SEAL_RATIO, ANALYTIC = "mean", "median", "seal_ratio", "analytic"
# As a person reads them, the one hardest to beat first, and as summaries name their errors.
TITLES = {
    ANALYTIC: "analytic label on the measured cloud",
    SEAL_RATIO: "seal ratio alone",
    MEDIAN: "median predictor",
    MEAN: "mean predictor",
}
SUMMARY_NAMES = {
    MEAN: "mean_predictor_mae",
    MEDIAN: "median_predictor_mae",
    SEAL_RATIO: "seal_ratio_mae",
    ANALYTIC: "analytic_mae",
}


@dataclass(frozen=True)
class SealBaseline:
    """A rising function of the seal ratio, with the same `predict` as a network.

    Attributes
    ----------
    pad
        Its r_v and r_G bound the region; within Delta_d of the plane a cell is near it.
    scale
        From the ratio to q.
    """

    pad: PadConfig
    scale: MonotoneRegressor

    def predict(
        self, cloud: Float[np.ndarray, "n g g 3"], mask: Bool[np.ndarray, "n g g"]
    ) -> Float[np.ndarray, " n"]:
        """Quality in [0, 1] of clouds.

        Parameters
        ----------
        cloud
            Points in GCS in units of r_G, shape (n, g, g, 3).
        mask
            Cells that hold a measured point, shape (n, g, g).

        Returns
        -------
        q-hat, shape (n,).
        """
        return self.scale.predict(pad_seal_ratio(cloud, mask, self.pad))


@dataclass(frozen=True)
class FittedBaselines:
    """All baselines, fitted to the same training samples.

    Attributes
    ----------
    mean
        Mean q of the training samples.
    median
        Their median q.
    mean_as_proposed
        Mean q over grasps as the first round draws them; None where that is unknown.
    median_as_proposed
        Median q over the same; None where that is unknown.
    seal
        By the seal ratio.
    analytic
        By the label on the measured cloud.
    """

    mean: float
    median: float
    mean_as_proposed: float | None
    median_as_proposed: float | None
    seal: SealBaseline
    analytic: AnalyticBaseline


@dataclass(frozen=True)
class BaselineErrors:
    """Mean |q̂ − q| of each baseline on other samples, by its name.

    Attributes
    ----------
    balanced
        Over all samples.
    as_proposed
        Over grasps as the first round draws them; a baseline is left out where that is unknown.
    """

    balanced: dict[str, float]
    as_proposed: dict[str, float]

    def summary(self) -> dict[str, float | None]:
        """All errors by the names that summaries use; None where one is not known."""
        return {
            **{name: self.balanced.get(kind) for kind, name in SUMMARY_NAMES.items()},
            **{
                f"{name}_as_proposed": self.as_proposed.get(kind)
                for kind, name in SUMMARY_NAMES.items()
            },
        }


def pad_seal_ratio(
    cloud: Float[np.ndarray, "n g g 3"], mask: Bool[np.ndarray, "n g g"], pad: PadConfig
) -> Float[np.ndarray, " n"]:
    """`seal_ratio` of a pad: within r_v, and within Delta_d of the plane.

    Parameters
    ----------
    cloud
        Points in GCS in units of r_G, shape (n, g, g, 3).
    mask
        Cells that hold a measured point, shape (n, g, g).
    pad
        The pad.

    Returns
    -------
    Ratio in [0, 1], shape (n,).
    """
    return seal_ratio(cloud, mask, pad.seal_radius_rg, pad.distance_step_rg)


def fit_baselines(
    samples: Samples, gripper: GripperConfig, analytic_samples: int
) -> FittedBaselines:
    """Fit every baseline to training samples.

    Parameters
    ----------
    samples
        Training samples.
    gripper
        Pad and physics of their labels.
    analytic_samples
        Samples that the analytic baseline is fitted to, equally far apart: it is slow to fit.

    Returns
    -------
    The baselines.
    """
    quality = np.asarray(samples.quality, dtype=np.float64)
    weight = np.asarray(samples.proposal_weight, dtype=np.float64)
    known = bool(weight.sum() > 0)  # false of NaN, which stands for unknown
    ratio = pad_seal_ratio(samples.cloud, samples.cloud_mask, gripper.pad)
    some = samples.take(np.array(choose_evenly(len(samples), analytic_samples), dtype=np.int64))
    return FittedBaselines(
        mean=float(quality.mean()),
        median=float(np.median(quality)),
        mean_as_proposed=float(np.average(quality, weights=weight)) if known else None,
        median_as_proposed=weighted_median(quality, weight) if known else None,
        seal=SealBaseline(gripper.pad, fit_monotone(ratio, quality)),
        analytic=fit_analytic(
            np.asarray(some.cloud),
            np.asarray(some.cloud_mask),
            np.asarray(some.quality, dtype=np.float64),
            gripper,
        ),
    )


def baseline_errors(fitted: FittedBaselines, samples: Samples) -> BaselineErrors:
    """Error of each baseline on samples that it was not fitted to.

    Parameters
    ----------
    fitted
        The baselines.
    samples
        The n samples.

    Returns
    -------
    The errors, balanced and as proposed.
    """
    cloud, mask = np.asarray(samples.cloud), np.asarray(samples.cloud_mask)
    quality = np.asarray(samples.quality, dtype=np.float64)
    weight = np.asarray(samples.proposal_weight, dtype=np.float64)
    shape = quality.shape
    measured = {
        SEAL_RATIO: fitted.seal.predict(cloud, mask),
        ANALYTIC: fitted.analytic.predict(cloud, mask),
    }
    balanced = {MEAN: np.full(shape, fitted.mean), MEDIAN: np.full(shape, fitted.median)} | measured
    proposed = dict(measured)
    for name, value in ((MEAN, fitted.mean_as_proposed), (MEDIAN, fitted.median_as_proposed)):
        if value is not None:
            proposed[name] = np.full(shape, value)
    weighted = {name: weighted_error(each, quality, weight) for name, each in proposed.items()}
    return BaselineErrors(
        balanced={name: mean_absolute_error(each, quality) for name, each in balanced.items()},
        as_proposed={name: error for name, error in weighted.items() if error is not None},
    )


def errors_without_training(samples: Samples, analytic: AnalyticBaseline) -> dict[str, float]:
    """Errors of baselines where there are no training samples of the same kind.

    Parameters
    ----------
    samples
        The n samples.
    analytic
        Fitted elsewhere.

    Returns
    -------
    Mean |q̂ − q| of the analytic baseline, and of the rising function of the seal ratio that fits
    these very samples best, which flatters it.
    """
    cloud, mask = np.asarray(samples.cloud), np.asarray(samples.cloud_mask)
    quality = np.asarray(samples.quality, dtype=np.float64)
    ratio = pad_seal_ratio(cloud, mask, analytic.gripper.pad)
    return {
        "label on the measured cloud": mean_absolute_error(analytic.predict(cloud, mask), quality),
        "seal ratio, fitted to these grasps": mean_absolute_error(
            fit_monotone(ratio, quality).predict(ratio), quality
        ),
    }


def weighted_median(values: Float[np.ndarray, " n"], weight: Float[np.ndarray, " n"]) -> float:
    """The least value that at least half of the weight does not exceed.

    Parameters
    ----------
    values
        The values, shape (n,).
    weight
        Weight of each, at least one over 0, shape (n,).

    Returns
    -------
    The median.
    """
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(below, below[-1] / 2)])
