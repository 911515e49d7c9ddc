"""A fold is tested by a network that saw nothing of it; figures are of all folds together."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from pipeline.config import RunConfig
from pipeline.config.folds import FoldsConfig
from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.network import folds
from pipeline.network.folds import Part, figures_of_folds, train_and_test
from pipeline.network.ga_cnn import build_network
from pipeline.network.inference import predict
from pipeline.network.samples import Samples
from pipeline.network.training import TrainedNetwork, train
from pipeline.reporting.folds import as_markdown
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
    begun, drawn = (
        train_and_test(still, parts, 0, {"a0", "b0"}, tmp_path / name, lambda _: None, given)
        for name, given in (("given", start), ("drawn", None))
    )
    assert begun.facts["val_mae"] != drawn.facts["val_mae"]
    names, samples = parts[0]
    of_a = samples.take(np.flatnonzero(samples.object_index == names.index("a0")))
    predicted = predict(start, of_a.cloud, of_a.cloud_mask, 16, 1, False)
    error = float(np.abs(predicted - of_a.quality).mean())
    assert begun.facts["begun"]["a0"] == pytest.approx(error, abs=1e-6)
    # Weights that hardly move end near where they began; the norms' statistics follow the samples.
    assert begun.errors[0].mae == pytest.approx(error, abs=0.02)
    assert drawn.facts["begun"] == {}
    families = {"a0": "a", "b0": "b"}
    figures = figures_of_folds([begun], families, 100, np.random.default_rng(0))
    gripped = [begun.facts["begun"][one.name] for one in begun.errors if one.graspable]
    assert figures["macro"][folds.BEGUN]["mae"] == pytest.approx(np.mean(gripped))
    assert figures["by_object"]["a0"]["mae_begun"] == begun.facts["begun"]["a0"]
    without = figures_of_folds([drawn], families, 100, np.random.default_rng(0))
    assert folds.BEGUN not in without["macro"]


def test_a_network_that_is_not_trained_predicts_every_fold_as_it_is(tmp_path: Path) -> None:
    as_it_is = FoldsConfig(start="solids", trained=False)
    config = CONFIG.model_copy(update={"folds": as_it_is})
    start = build_network(CONFIG.network, 5)
    names, samples = part(0)
    parts = [(names, samples), part(1), part(2)]
    found = train_and_test(config, parts, 0, {"a0"}, tmp_path, lambda _: None, start)
    of_a = samples.take(np.flatnonzero(samples.object_index == names.index("a0")))
    predicted = predict(start, of_a.cloud, of_a.cloud_mask, 16, 1, False)
    np.testing.assert_array_equal(found.single, predicted)
    assert found.facts["train"] == 0
    assert found.facts["val_mae"] is None
    assert not list(tmp_path.iterdir())
    figures = figures_of_folds([found], {"a0": "a"}, 100, np.random.default_rng(0))
    assert folds.BEGUN not in figures["macro"]
    text = as_markdown(figures | {"layers": 18, "start": "solids", "trained": False})
    assert "each tested once by the network of run solids, 18 layers, which held out" in text
    with pytest.raises(ValidationError, match="the run that start names"):
        FoldsConfig(trained=False)


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
