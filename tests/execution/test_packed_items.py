"""Work items as bytes: nothing is lost, and what items share is packed and read once."""

import pickle
from dataclasses import dataclass
from pathlib import Path

import pytest

from pipeline.config import RunConfig, load_run_config
from pipeline.execution.packed_items import ItemPacker, unpack_item

RUN = Path(__file__).parents[2] / "runs" / "ci" / "run.toml"


@dataclass(frozen=True)
class Job:
    """As a stage's: a number and the run's configuration."""

    number: int
    place: Path
    config: RunConfig


def test_an_item_comes_back_equal_and_items_share_their_configuration() -> None:
    config, packer = load_run_config(RUN), ItemPacker()
    jobs = [Job(number, Path("shards") / str(number), config) for number in range(3)]
    found = [unpack_item(packer.pack(job)) for job in jobs]
    assert found == jobs
    assert found[0].config is found[1].config is found[2].config
    assert unpack_item(packer.pack("no configuration")) == "no configuration"


def test_a_configuration_is_pickled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    config, packer = load_run_config(RUN), ItemPacker()
    dumped: list[object] = []
    dumps = pickle.dumps

    def noted(value: object) -> bytes:
        dumped.append(value)
        return dumps(value)

    monkeypatch.setattr(pickle, "dumps", noted)
    for number in range(3):
        packer.pack(Job(number, Path(), config))
    assert dumped == [config]


def test_another_configuration_is_another() -> None:
    config, packer = load_run_config(RUN), ItemPacker()
    other = config.model_copy(update={"seed": config.seed + 1})
    pairs = [unpack_item(packer.pack(Job(0, Path(), which))) for which in (config, other, config)]
    assert [job.config.seed for job in pairs] == [config.seed, other.seed, config.seed]
