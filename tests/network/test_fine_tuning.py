"""Training begins where a network ended: it gains on new samples and tells what it forgets."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import ArtifactError, ConfigError
from pipeline.network.checkpoint import save_checkpoint_bytes
from pipeline.network.fine_tuning import (
    grasps_from_bytes,
    grasps_to_bytes,
    measure_fine_tuning,
    starting_network,
)
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.input_channels import CHANNELS_0_1
from pipeline.network.samples import GraspTensors
from pipeline.network.training import TrainedNetwork, train
from pipeline.network.training_figures import EpochMetrics
from tests.network.conftest import TAUGHT as NETWORK
from tests.network.conftest import TEACHING as CONFIG
from tests.network.conftest import ignored
from tests.network.planes import planes_with_holes


@pytest.fixture
def start(taught_planes: GaCnn) -> GaCnn:
    return taught_planes


def contrary(count: int, seed: int) -> GraspTensors:
    """Samples of a world in which what was good is bad."""
    samples = planes_with_holes(count, seed)
    return replace(samples, quality=1 - samples.quality)


def test_it_gains_on_its_own_samples_and_forgets_what_it_no_longer_sees(
    start: GaCnn, known: GraspTensors, tmp_path: Path
) -> None:
    own, own_test = contrary(600, seed=3), contrary(200, seed=4)
    tuned = train(CONFIG, NETWORK, 1, own, own_test, tmp_path, ignored, start=start).network
    learnt = planes_with_holes(100, seed=2)
    told = measure_fine_tuning(start, tuned, CONFIG, own_test, known, learnt)
    assert told.own_after < told.own_before - 0.05
    assert told.released_after > told.released_before + 0.05
    assert told.learnt_before is not None
    assert told.learnt_after is not None
    assert told.learnt_after > told.learnt_before + 0.05
    assert (told.released_grasps, told.learnt_grasps) == (200, 100)


def test_a_short_training_from_a_network_is_ahead_of_one_from_the_seed(
    start: GaCnn, known: GraspTensors, tmp_path: Path
) -> None:
    few = planes_with_holes(64, seed=5)
    config = CONFIG.model_copy(update={"epochs": 1, "learning_rate": 1e-4})
    tuned = train(config, NETWORK, 1, few, known, tmp_path / "tuned", ignored, start=start)
    drawn = train(config, NETWORK, 1, few, known, tmp_path / "drawn", ignored)
    assert tuned.val_mae < drawn.val_mae


def test_a_state_that_began_otherwise_is_not_continued(
    start: GaCnn, known: GraspTensors, tmp_path: Path
) -> None:
    config = CONFIG.model_copy(update={"epochs": 1})

    def trained(begun: GaCnn | None, folder: str) -> TrainedNetwork:
        return train(config, NETWORK, 1, known, known, tmp_path / folder, ignored, start=begun)

    trained(None, "a")
    after_another = trained(start, "a")
    alone = trained(start, "b")
    assert save_checkpoint_bytes(after_another.network) == save_checkpoint_bytes(alone.network)


def test_other_shares_of_the_start_train_nothing_anew(
    start: GaCnn, known: GraspTensors, tmp_path: Path
) -> None:
    config = CONFIG.model_copy(update={"epochs": 1, "start": "released"})
    once = train(config, NETWORK, 1, known, known, tmp_path, ignored, start=start)
    epochs: list[EpochMetrics] = []
    shared = config.model_copy(update={"start_shares": (0.0, 0.5)})
    again = train(shared, NETWORK, 1, known, known, tmp_path, epochs.append, start=start)
    assert epochs == []
    assert save_checkpoint_bytes(again.network) == save_checkpoint_bytes(once.network)


def test_a_network_of_another_kind_is_refused_by_name(start: GaCnn) -> None:
    data = save_checkpoint_bytes(start)
    assert save_checkpoint_bytes(starting_network(data, "own", NETWORK)) == data
    deeper = NETWORK.model_copy(update={"layers": 20})
    with pytest.raises(ConfigError, match=r"own has 18.*20.*Set network\.layers = 18, "):
        starting_network(data, "own", deeper)
    deep = save_checkpoint_bytes(build_network(deeper, 0))
    with pytest.raises(ConfigError, match=r"deep has 20 .*18.*Set network\.layers = 20 or more, "):
        starting_network(deep, "deep", NETWORK, seed=0)
    wider = deeper.model_copy(update={"channels": (8, 16, 16, 32)})
    with pytest.raises(ConfigError, match=r"own has .*\[8, 8, 16, 32\].*\[8, 16, 16, 32\]"):
        starting_network(data, "own", wider, seed=0)
    older = save_checkpoint_bytes(build_network(NETWORK, 0, CHANNELS_0_1))
    with pytest.raises(ArtifactError, match=r"own takes the input channels.*of an older program"):
        starting_network(older, "own", NETWORK)
    with pytest.raises(ArtifactError, match="own: network checkpoint is damaged"):
        starting_network(data[:-1], "own", NETWORK)


def test_grasps_are_read_back_from_bytes_and_damaged_ones_are_refused(known: GraspTensors) -> None:
    data = grasps_to_bytes(known.cloud, known.mask, known.quality)
    assert data == grasps_to_bytes(known.cloud, known.mask, known.quality)
    back = grasps_from_bytes(data, "file")
    np.testing.assert_array_equal(back.mask, known.mask)
    np.testing.assert_allclose(back.quality, known.quality, atol=1e-7)
    np.testing.assert_allclose(back.cloud[back.mask], known.cloud[known.mask], atol=1e-3)
    broken = bytearray(data)
    broken[-1] ^= 1
    with pytest.raises(ArtifactError, match="file is damaged"):
        grasps_from_bytes(bytes(broken), "file")
    other = save_checkpoint_bytes(build_network(NETWORK, 0))
    with pytest.raises(ArtifactError, match="file holds no labelled grasps"):
        grasps_from_bytes(other, "file")
