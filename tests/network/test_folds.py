"""A fold is tested by a network that saw nothing of it; figures are of all folds together."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.config import RunConfig
from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.network import folds
from pipeline.network.folds import Part, figures_of_folds, train_and_test
from pipeline.network.ga_cnn import build_network
from pipeline.network.samples import Samples
from pipeline.network.training import TrainedNetwork, train
from tests.network.planes import planes_with_holes

CONFIG = RunConfig(
    network=NetworkConfig(layers=18, channels=(8, 8, 8, 8)),
    train=TrainConfig(epochs=1, batch_size=16, threads=1),
)


def part(fold: int) -> Part:
    """Samples of two objects of the fold, and of one that is for training alone."""
    planes = planes_with_holes(24, seed=fold)
    index = np.arange(24) % 3
    samples = Samples(
        cloud=planes.cloud,
        cloud_mask=planes.mask,
        quality=planes.quality,
        object_index=index,
        shape_class=np.zeros(24, dtype=np.int64),
        level=np.ones(24, dtype=np.int64),
        pressure=planes.quality,
        proposal_weight=np.ones(24, dtype=np.float32),
        pictures=np.ones(24, dtype=np.int64),
    )
    return (f"a{fold}", f"b{fold}", f"embedded{fold}"), samples


def test_a_fold_begins_with_the_network_that_is_given(tmp_path: Path) -> None:
    parts = [part(fold) for fold in range(3)]
    still = CONFIG.model_copy(
        update={"train": CONFIG.train.model_copy(update={"learning_rate": 1e-12})}
    )
    start = build_network(CONFIG.network, 5)
    found = {
        name: train_and_test(
            still, parts, 0, {"a0", "b0"}, tmp_path / name, lambda _: None, given
        ).facts["val_mae"]
        for name, given in (("given", start), ("drawn", None))
    }
    again = train_and_test(still, parts, 0, {"a0"}, tmp_path / "again", lambda _: None, start)
    assert again.facts["val_mae"] == found["given"] != found["drawn"]


def test_every_object_is_tested_once_by_a_network_of_other_folds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[tuple[Any, Any]] = []

    def watched(*arguments: object, **options: object) -> TrainedNetwork:
        given.append((arguments[3], arguments[4]))
        return train(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(folds, "train", watched)
    parts = [part(fold) for fold in range(3)]
    tested = {name for names, _ in parts for name in names[:2]}
    done = [
        train_and_test(CONFIG, parts, fold, tested, tmp_path / str(fold), lambda _: None)
        for fold in range(3)
    ]
    for fold, (train_set, val_set) in enumerate(given):
        np.testing.assert_array_equal(val_set.quality, parts[(fold + 1) % 3][1].quality)
        np.testing.assert_array_equal(train_set.quality, parts[(fold + 2) % 3][1].quality)
    kept = [folds.TestedFold.from_json(one.to_json()) for one in done]
    for one, again in zip(done, kept, strict=True):
        assert again.errors == one.errors
        assert again.facts == one.facts
        for name in folds.ARRAYS:
            np.testing.assert_array_equal(getattr(again, name), getattr(one, name))
    families = {name: name for name in tested}
    found = figures_of_folds(done, families, 200, np.random.default_rng(0))
    assert set(found["by_object"]) == tested
    assert {one["fold"] for one in found["by_object"].values()} == {0, 1, 2}
    assert found["grasps"] == 3 * 16
    errors = [one["mae"] for one in found["by_object"].values()]
    median = found["baselines"]["median"]
    assert median == pytest.approx(np.mean([one.facts["baselines"]["median"] for one in done]))
    every = found["macro"]["all objects, labels balanced over q"]
    assert every["mae"] == pytest.approx(np.mean(errors))
    low, high = every["interval_95"]
    assert low <= every["mae"] <= high
    assert min(errors) <= low
    assert high <= max(errors)
