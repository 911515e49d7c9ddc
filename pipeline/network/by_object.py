"""Errors object by object: the mean over objects, and over those that can be gripped at all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Integer

from pipeline.errors import ArtifactError
from pipeline.network.figures import mean_absolute_error

# Objects with a lower mean q have q near 0 everywhere: predicting nothing of them is no feat.
GRASPABLE_FROM = 0.1


@dataclass(frozen=True)
class ObjectError:
    """How a network errs on one object.

    Attributes
    ----------
    name
        The object.
    grasps
        Labelled grasps of it.
    mean_quality
        Mean q of these.
    mae
        Mean |q̂ − q| of one prediction a grasp.
    mae_averaged
        Mean |q̂ − q| of the mean over eight symmetries.
    """

    name: str
    grasps: int
    mean_quality: float
    mae: float
    mae_averaged: float

    @property
    def graspable(self) -> bool:
        """Whether it can be gripped at all."""
        return self.mean_quality > GRASPABLE_FROM


def errors_by_object(
    names: Sequence[str],
    object_index: Integer[np.ndarray, " n"],
    quality: Float[np.ndarray, " n"],
    single: Float[np.ndarray, " n"],
    averaged: Float[np.ndarray, " n"],
) -> list[ObjectError]:
    """The error on each object that has grasps, in the order of its name.

    Parameters
    ----------
    names
        Of all objects.
    object_index
        Index into ``names``, shape (n,).
    quality
        q, shape (n,).
    single
        q̂ of one prediction a grasp, shape (n,).
    averaged
        q̂ averaged over the symmetries, shape (n,).

    Returns
    -------
    An entry an object.
    """
    found = []
    for index in sorted(np.unique(object_index).tolist(), key=lambda index: names[index]):
        own = object_index == index
        found.append(
            ObjectError(
                name=names[index],
                grasps=int(own.sum()),
                mean_quality=float(quality[own].mean(dtype=np.float64)),
                mae=mean_absolute_error(single[own], quality[own]),
                mae_averaged=mean_absolute_error(averaged[own], quality[own]),
            )
        )
    return found


def macro_error(errors: Sequence[ObjectError], graspable_alone: bool) -> float | None:
    """Mean over objects of the error of one prediction; None where there is no such object."""
    taken = [one.mae for one in errors if one.graspable or not graspable_alone]
    return float(np.mean(taken)) if taken else None


def check_labels(
    names: Sequence[str], object_index: Integer[np.ndarray, " n"], quality: Float[np.ndarray, " n"]
) -> None:
    """Check that labels are qualities.

    Parameters
    ----------
    names
        Of all objects.
    object_index
        Index into ``names``, shape (n,).
    quality
        q, shape (n,).

    Raises
    ------
    ArtifactError
        A label is not a number in [0, 1].
    """
    wrong = np.flatnonzero(~((quality >= 0) & (quality <= 1)))  # NaN is neither
    if len(wrong):
        raise ArtifactError(
            f"{len(wrong)} of {len(quality)} labels are no number in [0, 1], the first "
            f"{quality[wrong[0]]} on {names[int(object_index[wrong[0]])]}",
            "Delete the grasps and make them again; if they come back, leave that mesh out",
        )
