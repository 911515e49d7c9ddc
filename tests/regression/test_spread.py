"""Bounds let a sound next value through and no other; the committed spread gives usable ones."""

import numpy as np
import pytest

from pipeline.errors import ArtifactError
from pipeline.regression.kernels import INSTRUCTION_SETS
from pipeline.regression.spread import (
    FALSE_ALARM,
    Training,
    least_share,
    next_value_bounds,
    read_spread,
    success_reference,
    training_reference,
    write_spread,
)
from stages.regress import SPREAD
from stages.training_spread import SEEDS, with_seed


def test_the_next_value_is_outside_as_seldom_as_is_said() -> None:
    rng = np.random.default_rng(0)
    outside, trials = 0, 20_000
    for values in rng.normal(3.0, 0.2, (trials, 16)):
        low, high = next_value_bounds(values[:15].tolist())
        outside += not low <= values[15] <= high
    # Of a Poisson count with this mean, 40 is more than four deviations away.
    assert 0 < outside < 2 * FALSE_ALARM * trials


def test_few_successes_in_the_next_trials_are_as_seldom_as_is_said() -> None:
    rng, trials = np.random.default_rng(0), 20_000
    shares = rng.beta(0.5, 0.5, trials)  # the prior: whatever the true share is
    known, then = rng.binomial(60, shares), rng.binomial(8, shares)
    bounds = np.array([least_share(k, 60, 8) for k in range(61)])
    assert (then / 8 < bounds[known]).mean() < 2 * FALSE_ALARM
    assert least_share(60, 60, 8) > 0.7
    assert least_share(30, 60, 8) < 0.3


def test_what_was_measured_is_read_back(tmp_path: pytest.TempPathFactory) -> None:
    path = tmp_path / "spread.json"  # type: ignore[operator]
    with pytest.raises(ArtifactError, match=r"does not exist.*training_spread"):
        read_spread(path)
    one = Training("avx2", 1, [0.2, 0.1, 0.1], [0.3, 0.2, 0.2], 0.2, {"1": 8}, {"1": 7}, {"1": 9})
    write_spread(path, {"processor": "some"}, [one, one])
    assert read_spread(path) == [one, one]


def test_the_committed_spread_is_of_all_seeds_and_instruction_sets() -> None:
    trainings = read_spread(SPREAD)
    assert [(one.instructions, one.seed) for one in trainings] == [
        (name, seed) for name in INSTRUCTION_SETS for seed in range(1, SEEDS + 1)
    ]
    reference = training_reference(trainings) | success_reference(trainings)
    for group in ("trained", "lifted"):
        for name, value in reference[group].items():
            low, high = (reference[f"{group}_{side}"][name] for side in ("low", "high"))
            assert 0 < float(low) < float(value) <= float(high) <= 1


def test_a_seed_takes_the_place_of_the_run_s() -> None:
    text = "# a run\nseed = 1\n[train]\nepochs = 2\n[evaluate]\nattempts_per_clutter = 3\n"
    assert with_seed(text, 4).splitlines() == [
        "seed = 4",
        "# a run",
        "[train]",
        "epochs = 2",
        "[evaluate]",
        'policies = ["closed-loop"]',
        "attempts_per_clutter = 3",
    ]
