"""How far equal trainings end apart: measured over seeds and instruction sets, and what it allows.

The order in which a processor's kernels sum is not the same on every machine, and a training
amplifies the last bit: from one run to another only the distribution of its errors is portable.
So a training is held against bounds that the measured ones give.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.stats import betabinom, t

from pipeline.errors import ArtifactError
from pipeline.regression.comparison import Figures, Value

# How often a sound run may be told to differ, for each quantity: rare enough for CI.
FALSE_ALARM = 1e-3
# An epoch so early that a test reaches it in seconds; its spread is the smallest.
EARLY_EPOCH = 3
# Jeffreys' prior of a share.
_PRIOR = 0.5


@dataclass(frozen=True)
class Training:
    """One training of the run's network, and what the closed loop made of it.

    Attributes
    ----------
    instructions
        Instruction set, of `kernels.INSTRUCTION_SETS`.
    seed
        Seed of the run's configuration from the training on; what it learns from is the same.
    training_error
        Mean |q̂ − q| over the training samples in each epoch.
    validation_error
        The same over the validation split after each epoch.
    test_error
        Mean |q̂ − q| over the test split with the weights of the kept epoch.
    objects, lifted, attempts
        Objects that lay in the test clutters, those that the closed loop lifted, and its
        attempts, by level; empty where the closed loop was not run.
    """

    instructions: str
    seed: int
    training_error: list[float]
    validation_error: list[float]
    test_error: float
    objects: dict[str, int]
    lifted: dict[str, int]
    attempts: dict[str, int]


def trained_figures(
    training_error: Sequence[float], validation_error: Sequence[float], test_error: float
) -> dict[str, Value]:
    """The figures of a whole training that are held against bounds, by name."""
    return early_figures(training_error) | {
        "training error in the last epoch": training_error[-1],
        "least validation error": min(validation_error),
        "test error": test_error,
    }


def early_figures(training_error: Sequence[float]) -> dict[str, Value]:
    """Those that are known after ``EARLY_EPOCH`` epochs."""
    return {f"training error in epoch {EARLY_EPOCH}": training_error[EARLY_EPOCH - 1]}


def training_reference(trainings: Sequence[Training]) -> Figures:
    """Mean, least and greatest value allowed of each trained figure."""
    figures = [
        trained_figures(one.training_error, one.validation_error, one.test_error)
        for one in trainings
    ]
    found: Figures = {"trained": {}, "trained_low": {}, "trained_high": {}}
    for name in figures[0]:
        values = [float(one[name]) for one in figures]
        found["trained"][name] = float(np.mean(values))
        found["trained_low"][name], found["trained_high"][name] = next_value_bounds(values)
    return found


def success_reference(trainings: Sequence[Training]) -> Figures:
    """Share of the objects that are lifted, with the least and the greatest allowed, by level."""
    found: Figures = {"lifted": {}, "lifted_low": {}, "lifted_high": {}}
    trainings = [one for one in trainings if one.objects]
    for level, objects in sorted(trainings[0].objects.items()):
        name = f"level {level}"
        lifted = sum(one.lifted[level] for one in trainings)
        of_all = sum(one.objects[level] for one in trainings)
        found["lifted"][name] = lifted / of_all
        found["lifted_low"][name] = least_share(lifted, of_all, objects)
        found["lifted_high"][name] = 1.0
    return found


def next_value_bounds(values: Sequence[float]) -> tuple[float, float]:
    """Where the next value of a normal distribution lies but once in ``1 / FALSE_ALARM`` times.

    The prediction interval of Student's t: mean ± t s √(1 + 1/n), from n values of mean and
    standard deviation s.
    """
    n, mean, deviation = len(values), float(np.mean(values)), float(np.std(values, ddof=1))
    reach = float(t.ppf(1 - FALSE_ALARM / 2, n - 1)) * deviation * math.sqrt(1 + 1 / n)
    return mean - reach, mean + reach


def least_share(successes: int, trials: int, next_trials: int) -> float:
    """Share that the next trials fall below but once in ``1 / FALSE_ALARM`` times.

    The beta-binomial prediction from what succeeded before.
    """
    a, b = successes + _PRIOR, trials - successes + _PRIOR
    return float(betabinom.ppf(FALSE_ALARM, next_trials, a, b)) / next_trials


def write_spread(path: Path, measured_by: dict[str, str], trainings: Sequence[Training]) -> None:
    """The measured trainings and how they were measured, as a text file to be committed."""
    content = {"measured_by": measured_by, "trainings": [asdict(one) for one in trainings]}
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def read_spread(path: Path) -> list[Training]:
    """The measured trainings.

    Parameters
    ----------
    path
        training_spread.json.

    Returns
    -------
    Every training that was measured.

    Raises
    ------
    ArtifactError
        There is no such file.
    """
    if not path.is_file():
        raise ArtifactError(
            f"{path} does not exist", "Measure it: python -m stages.training_spread"
        )
    return [Training(**one) for one in json.loads(path.read_text())["trainings"]]
