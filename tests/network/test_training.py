"""A network learns what it can, repeats itself to the bit, and survives a kill."""

import itertools
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.errors import ArtifactError
from pipeline.network import training
from pipeline.network.baselines import mean_predictor_mae
from pipeline.network.checkpoint import save_checkpoint_bytes
from pipeline.network.figures import mean_absolute_error
from pipeline.network.inference import predict
from pipeline.network.resuming import STATE_FILE, save_training_state
from pipeline.network.samples import GraspTensors
from pipeline.network.training import TrainedNetwork, learning_rate_at, train
from pipeline.network.training_figures import EpochMetrics
from tests.checked_shapes import VARIABLE as CHECKS
from tests.network.planes import planes_with_holes

ROOT = Path(__file__).resolve().parents[2]
NETWORK = NetworkConfig(layers=18, channels=(16, 16, 32, 32))
SHORT = TrainConfig(epochs=3, batch_size=32, threads=1, device="cpu")


@pytest.fixture(scope="module")
def few() -> GraspTensors:
    return planes_with_holes(100, seed=0)


@pytest.fixture(scope="module")
def held_out() -> GraspTensors:
    return planes_with_holes(200, seed=1)


class KilledError(Exception):
    """Stands for a process that ends between two epochs."""


def short_training(
    few: GraspTensors, state_dir: Path, seed: int, kill_after: int | None
) -> TrainedNetwork:
    def on_epoch(metrics: EpochMetrics) -> None:
        if metrics.epoch == kill_after:
            raise KilledError

    return train(SHORT, NETWORK, seed, few, few, state_dir, on_epoch)


def test_learns_planes_with_holes_far_better_than_the_mean(
    tmp_path: Path, held_out: GraspTensors
) -> None:
    learned = planes_with_holes(1500, seed=2)
    config = TrainConfig(epochs=8, batch_size=64, learning_rate=4e-3, threads=1, device="cpu")
    seen: list[int] = []
    trained = train(
        config, NETWORK, 1, learned, held_out, tmp_path, lambda metrics: seen.append(metrics.epoch)
    )
    predicted = predict(trained.network, held_out.cloud, held_out.mask, 64, 1, False)
    mae = mean_absolute_error(predicted, held_out.quality)
    assert mae < 0.4 * mean_predictor_mae(learned.quality, held_out.quality)
    assert mae == pytest.approx(trained.val_mae, abs=1e-6)
    assert seen == list(range(8))
    averaged = predict(trained.network, held_out.cloud, held_out.mask, 64, 1, True)
    assert mean_absolute_error(averaged, held_out.quality) < 1.1 * mae


def test_equal_runs_give_equal_bytes_and_another_seed_does_not(
    tmp_path: Path, few: GraspTensors
) -> None:
    first = short_training(few, tmp_path / "a", seed=1, kill_after=None)
    second = short_training(few, tmp_path / "b", seed=1, kill_after=None)
    other = short_training(few, tmp_path / "c", seed=2, kill_after=None)
    assert save_checkpoint_bytes(first.network) == save_checkpoint_bytes(second.network)
    assert save_checkpoint_bytes(first.network) != save_checkpoint_bytes(other.network)
    assert first.history == second.history
    states = [(tmp_path / run / STATE_FILE).read_bytes() for run in "ab"]
    assert states[0] == states[1]


@pytest.mark.parametrize("kill_after", [0, 1])
def test_killed_run_resumes_to_the_same_bytes(
    tmp_path: Path, few: GraspTensors, kill_after: int
) -> None:
    whole = short_training(few, tmp_path / "whole", seed=1, kill_after=None)
    with pytest.raises(KilledError):
        short_training(few, tmp_path / "killed", seed=1, kill_after=kill_after)
    resumed = short_training(few, tmp_path / "killed", seed=1, kill_after=None)
    assert resumed.history == whole.history
    assert save_checkpoint_bytes(resumed.network) == save_checkpoint_bytes(whole.network)


@pytest.mark.parametrize("kill_after", [1, 5])
def test_run_killed_within_an_epoch_resumes_to_the_same_bytes(
    tmp_path: Path, few: GraspTensors, kill_after: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = short_training(few, tmp_path / "whole", seed=1, kill_after=None)
    saved = 0

    def save_then_die(*arguments: Any) -> None:
        nonlocal saved
        save_training_state(*arguments)
        saved += 1
        if saved == kill_after:
            raise KilledError

    # Four batches an epoch, each followed by a state: these kills fall inside one.
    with monkeypatch.context() as patch:
        patch.setattr(training, "save_training_state", save_then_die)
        with pytest.raises(KilledError):
            train(SHORT, NETWORK, 1, few, few, tmp_path / "killed", print, save_every_s=0.0)
    resumed = short_training(few, tmp_path / "killed", seed=1, kill_after=None)
    assert resumed.history == whole.history
    assert save_checkpoint_bytes(resumed.network) == save_checkpoint_bytes(whole.network)


def test_every_sample_is_seen_once_an_epoch(tmp_path: Path, few: GraspTensors) -> None:
    trained = short_training(few, tmp_path, seed=1, kill_after=None)
    assert [metrics.samples for metrics in trained.history] == [len(few)] * 3
    assert trained.waiting_share is not None
    assert trained.preparing_share is not None
    assert 0 < trained.waiting_share < 0.5
    assert 0 < trained.preparing_share < 1 - trained.waiting_share


def test_state_of_other_arguments_is_not_continued(tmp_path: Path, few: GraspTensors) -> None:
    fresh = short_training(few, tmp_path / "fresh", seed=2, kill_after=None)
    with pytest.raises(KilledError):
        short_training(few, tmp_path / "used", seed=1, kill_after=1)
    again = short_training(few, tmp_path / "used", seed=2, kill_after=None)
    assert again.history == fresh.history


def test_damaged_state_is_named(tmp_path: Path, few: GraspTensors) -> None:
    with pytest.raises(KilledError):
        short_training(few, tmp_path, seed=1, kill_after=0)
    state = tmp_path / STATE_FILE
    state.write_bytes(state.read_bytes()[:-10])
    with pytest.raises(ArtifactError, match=STATE_FILE):
        short_training(few, tmp_path, seed=1, kill_after=None)


def test_stops_when_patience_runs_out_and_keeps_the_best(
    tmp_path: Path, few: GraspTensors, held_out: GraspTensors
) -> None:
    # Labels dealt at random hold nothing to learn that holds elsewhere.
    shuffled = np.random.default_rng(0).permutation(few.quality)
    noise = GraspTensors(cloud=few.cloud, mask=few.mask, quality=shuffled)
    config = TrainConfig(
        epochs=40,
        batch_size=32,
        learning_rate=1e-2,
        keep="best",
        patience_epochs=2,
        threads=1,
        device="cpu",
    )
    trained = train(config, NETWORK, 0, noise, held_out, tmp_path, lambda _: None)
    assert trained.stopped_early
    assert len(trained.history) == trained.kept_epoch + 1 + config.patience_epochs
    assert trained.val_mae == min(metrics.val_mae for metrics in trained.history)
    predicted = predict(trained.network, held_out.cloud, held_out.mask, 32, 1, False)
    assert mean_absolute_error(predicted, held_out.quality) == pytest.approx(
        trained.val_mae, abs=1e-6
    )


def test_keeps_the_last_epoch_whatever_its_error(
    tmp_path: Path, few: GraspTensors, held_out: GraspTensors
) -> None:
    shuffled = np.random.default_rng(0).permutation(few.quality)
    noise = GraspTensors(cloud=few.cloud, mask=few.mask, quality=shuffled)
    config = TrainConfig(
        epochs=20, batch_size=32, learning_rate=1e-2, patience_epochs=1, threads=1, device="cpu"
    )
    trained = train(config, NETWORK, 0, noise, held_out, tmp_path, lambda _: None)
    assert trained.kept_epoch == config.epochs - 1
    assert not trained.stopped_early
    assert trained.val_mae > min(metrics.val_mae for metrics in trained.history)
    predicted = predict(trained.network, held_out.cloud, held_out.mask, 32, 1, False)
    assert mean_absolute_error(predicted, held_out.quality) == pytest.approx(
        trained.val_mae, abs=1e-6
    )


def test_learning_rate_rises_then_falls_and_never_is_zero() -> None:
    config = TrainConfig(learning_rate=1.0, warmup_fraction=0.2)
    rates = [learning_rate_at(step, 100, config) for step in range(100)]
    assert rates[:20] == pytest.approx([(step + 1) / 20 for step in range(20)])
    assert max(rates) == 1.0
    assert all(late < early for early, late in itertools.pairwise(rates[20:]))
    assert rates[60] == pytest.approx(0.5 * (1 + math.cos(math.pi * 0.5)))
    assert min(rates) > 0


@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no g++ to compile with")
def test_a_compiled_network_trains_as_the_plain_one(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.network.train_compiled", str(tmp_path)],
        cwd=ROOT,
        env={name: value for name, value in os.environ.items() if name != CHECKS},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    plain, compiled = json.loads(done.stdout.splitlines()[-1])
    assert compiled["train_loss"] == pytest.approx(plain["train_loss"], rel=1e-3)
    assert compiled["val_mae"] == pytest.approx(plain["val_mae"], rel=1e-2)
    # No wrapper's names are in what is kept.
    assert compiled["weights"] == plain["weights"]
