"""Work items as bytes: nothing is lost, and what items share is packed and read once."""

import pickle
from dataclasses import dataclass
from pathlib import Path

import pytest

from pipeline.config import RunConfig, load_run_config
from pipeline.errors import StoreError
from pipeline.execution.packed_items import ItemPacker, unpack_item
from pipeline.execution.run_roots import LENT, RunRoots, is_in_store

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


def test_paths_travel_as_keys_from_folder_to_folder(tmp_path: Path) -> None:
    here = RunRoots(tmp_path / "runs" / "ci", tmp_path / "meshes", tmp_path / "runs" / ".cache")
    there = RunRoots(tmp_path / "node", tmp_path / "node" / LENT, tmp_path / "kept")
    named = {
        "run": (here.run, there.run),
        "shard": (here.run / "grasps" / "a.mcap", there.run / "grasps" / "a.mcap"),
        "mesh": (tmp_path / "meshes" / "b.ply", there.run / LENT / "b.ply"),
        "meshes": (tmp_path / "meshes", there.run / LENT),
        "convex parts": (here.cache / "c.npz", tmp_path / "kept" / "c.npz"),
    }
    given = {name: path for name, (path, _) in named.items()}
    sent = ItemPacker(here.key_of).pack(given)
    assert str(tmp_path).encode() not in sent
    found = unpack_item(sent, path_of=there.path_of)
    assert found == {name: path for name, (_, path) in named.items()}
    back = ItemPacker(there.key_of).pack(found)
    assert unpack_item(back, path_of=here.path_of) == given


def test_a_file_of_no_folder_of_the_run_is_refused(tmp_path: Path) -> None:
    roots = RunRoots(tmp_path / "runs", None, tmp_path / ".cache")
    with pytest.raises(StoreError, match="is no file of the run"):
        ItemPacker(roots.key_of).pack(tmp_path / "mesh.ply")


def test_the_store_has_all_but_caches(tmp_path: Path) -> None:
    roots = RunRoots(tmp_path / "run", tmp_path / "meshes", tmp_path / "cache")
    paths = [roots.run / "a", tmp_path / "meshes" / "b", roots.cache / "c"]
    assert [is_in_store(roots.key_of(path)) for path in paths] == [True, True, False]
