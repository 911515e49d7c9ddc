"""A training by windows: the same bytes whatever is decoded at once, and after a kill too."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import Provenance
from pipeline.config import RunConfig
from pipeline.config.learning import NetworkConfig
from pipeline.errors import ConfigError
from pipeline.execution.training_samples import TrainingSet, open_training_set
from pipeline.messages.bounded_samples import DECODED, BoundedSamples
from pipeline.network.checkpoint import save_checkpoint_bytes
from pipeline.network.samples import Samples
from pipeline.network.training import TrainedNetwork, train
from pipeline.network.training_figures import EpochMetrics
from tests.messages.test_sample_cache import sharded
from tests.network.planes import planes_with_holes

PLANES = planes_with_holes(72, seed=0)
VAL = planes_with_holes(20, seed=1)
SHARD, WINDOW, BATCH = 12, 24, 18
CONFIG = RunConfig.model_validate(
    {
        "train": {
            "epochs": 2,
            "batch_size": BATCH,
            "shuffle_window": WINDOW,
            "threads": 1,
            "device": "cpu",
        }
    }
)
NETWORK = NetworkConfig(layers=18, channels=(2, 2, 4, 4))


class KilledError(Exception):
    """Stands for a process that ends between two epochs."""


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The planes in six shards."""
    ones = np.ones(len(PLANES), dtype=np.int64)
    samples = Samples(
        PLANES.cloud,
        PLANES.mask,
        PLANES.quality,
        ones * 0,
        ones,
        ones,
        ones * 1.0,
        ones * 1.0,
        ones,
    )
    parts = [samples.take(slice(at, at + SHARD)) for at in range(0, len(PLANES), SHARD)]
    provenance = Provenance("shards", "0" * 64, "1" * 64, "2" * 64, 0, (), "0.1.0")
    return sharded(tmp_path_factory.mktemp("windows"), provenance, parts)


def opened(index: Path, cache: Path, shards: int) -> TrainingSet:
    """With room for so many decoded shards."""
    found = open_training_set(CONFIG, [index], cache, ())
    assert isinstance(found.learned, BoundedSamples)
    found.learned.limit_bytes = int((shards + 0.5) * SHARD * found.learned.sample_bytes)
    return found


def trained(found: TrainingSet, state: Path, kill_after: int | None = None) -> TrainedNetwork:
    def on_epoch(metrics: EpochMetrics) -> None:
        if metrics.epoch == kill_after:
            raise KilledError

    return train(CONFIG.train, NETWORK, 1, found.learned, VAL, state, on_epoch)


def test_equal_bytes_whatever_the_cache_and_after_a_kill(index: Path, tmp_path: Path) -> None:
    """Killed with room for all, it goes on with room for little."""
    little, all_of_it = (opened(index, tmp_path / f"room{n}", n) for n in (2, 6))
    whole = trained(little, tmp_path / "little")
    with pytest.raises(KilledError):
        trained(all_of_it, tmp_path / "killed", kill_after=0)
    resumed = trained(little, tmp_path / "killed")
    assert resumed.history == whole.history
    assert [metrics.samples for metrics in whole.history] == [len(PLANES)] * 2
    assert save_checkpoint_bytes(resumed.network) == save_checkpoint_bytes(whole.network)
    assert len(list((tmp_path / "room2" / DECODED).glob("*/cloud.npy"))) == 2
    assert len(list((tmp_path / "room6").glob("train-*/cloud.npy"))) == 1


def test_baselines_are_fitted_to_a_window_of_shuffled_samples(index: Path, tmp_path: Path) -> None:
    found = opened(index, tmp_path, 6)
    assert found.count == len(PLANES)
    np.testing.assert_array_equal(found.fitted.quality, PLANES.quality[:WINDOW])


def test_a_cache_too_small_for_the_window_is_told_before_anything_is_decoded(
    index: Path, tmp_path: Path
) -> None:
    small = CONFIG.model_copy(
        update={"loading": CONFIG.loading.model_copy(update={"cache_mib": 0})}
    )
    with pytest.raises(ConfigError, match=r"of loading\.cache_mib are left"):
        open_training_set(small, [index], tmp_path, ())
    assert not list(tmp_path.iterdir())


def test_all_runs_samples_must_fit_the_cache_together(index: Path, tmp_path: Path) -> None:
    """A mebibyte holds three times the planes, and not four times."""
    config = CONFIG.model_copy(
        update={
            "train": CONFIG.train.model_copy(update={"shuffle_window": 0}),
            "loading": CONFIG.loading.model_copy(update={"cache_mib": 1}),
        }
    )
    with pytest.raises(ConfigError, match=r"samples of 4 runs take 2 MiB .*cache_mib is 1"):
        open_training_set(config, [index] * 4, tmp_path, ())
    assert not list(tmp_path.iterdir())
    found = open_training_set(config, [index] * 3, tmp_path, ())
    assert found.count == len(found.learned) == 3 * len(PLANES)
