"""A run's folder and its store: what comes, what goes, and what a lost folder gets back."""

import os
from pathlib import Path

import pytest
from obstore.store import MemoryStore

from pipeline.artifacts.object_store import ObjectStore
from pipeline.config.store import StoreConfig
from pipeline.errors import ConfigError
from pipeline.execution import RunFolder
from pipeline.execution.run_store import Place, RunStore, belongs_to_run, place_of
from pipeline.execution.store_lease import Lease

URL = "s3://bucket/run"


class Machine:
    """A machine's folder of the run, with the right to make it."""

    def __init__(self, store: ObjectStore, folder: Path) -> None:
        folder.mkdir(exist_ok=True)
        self.store, self.folder = store, folder
        lease = Lease(store, "grasps", 60.0)
        self.run = RunStore(store, RunFolder(folder), Place(URL, 100, 1.0), lease)

    def write(self, key: str, content: bytes) -> None:
        path = self.folder / key
        path.parent.mkdir(parents=True, exist_ok=True)
        new = path.with_name("new")  # as published files are: renamed when whole
        new.write_bytes(content)
        new.replace(path)

    def files(self) -> dict[str, bytes]:
        found = [path for path in self.folder.rglob("*") if path.is_file()]
        keys = {path.relative_to(self.folder).as_posix(): path for path in found}
        return {key: p.read_bytes() for key, p in keys.items() if key != ".state/store.json"}


@pytest.fixture
def store() -> ObjectStore:
    return ObjectStore(URL, 1.0, MemoryStore())


@pytest.fixture
def machine(store: ObjectStore, tmp_path: Path) -> Machine:
    return Machine(store, tmp_path / "one")


RESULTS = {
    "run.toml": b"seed = 1",
    "grasps.mcap": b"index",
    "grasps/00000-of-00001.mcap": b"shard",
    ".state/grasps.drawn.json": b"{}",
    ".state/scenes/one.mcap": b"scene",
}
OWN = {
    ".state/lock": b"",
    ".state/hashes.json": b"{}",
    ".state/grasps.key": b"key",
    ".state/shards/abc/00000/00000.mcap": b"scattered",
    ".state/samples/train.lock": b"",
    "logs/grasps.log": b"words",
    "grasps/.00000-of-00001.mcap.00000000-1-1-00000000.part": b"half",
}


def test_an_empty_folder_elsewhere_gets_the_results_and_nothing_of_the_machine(
    machine: Machine, store: ObjectStore, tmp_path: Path
) -> None:
    for key, content in {**RESULTS, **OWN}.items():
        machine.write(key, content)
    assert machine.run.put() == len(RESULTS)
    assert machine.run.put() == 0
    other = Machine(store, tmp_path / "two")
    assert other.run.pull() == len(RESULTS)
    assert other.files() == RESULTS
    assert other.run.pull() == 0
    assert other.run.put() == 0


def test_what_a_stage_removes_is_removed_and_what_a_person_removes_comes_again(
    machine: Machine, store: ObjectStore
) -> None:
    for key, content in RESULTS.items():
        machine.write(key, content)
    machine.run.put()
    (machine.folder / "grasps.mcap").unlink()
    machine.run.pull()  # a stage begins
    assert machine.files() == RESULTS
    (machine.folder / ".state/scenes/one.mcap").unlink()
    machine.run.put()  # it ends
    assert set(store.listed()) == set(RESULTS) - {".state/scenes/one.mcap"}


def test_what_changed_in_one_place_alone_stands(
    machine: Machine, store: ObjectStore, tmp_path: Path
) -> None:
    for key, content in RESULTS.items():
        machine.write(key, content)
    machine.run.put()
    other = Machine(store, tmp_path / "two")
    other.run.pull()
    other.write("grasps.mcap", b"newer")
    other.write("run.toml", b"seed = 2")
    other.run.put()
    machine.write("scenes.mcap", b"made, and killed before it was put")
    machine.run.pull()
    assert machine.files()["grasps.mcap"] == b"newer"
    assert machine.files()["run.toml"] == b"seed = 1"  # a person writes it, on each machine
    assert machine.run.put() == 1
    assert store.read("scenes.mcap") == b"made, and killed before it was put"


def test_what_nodes_put_comes_and_what_they_remove_goes(
    machine: Machine, store: ObjectStore
) -> None:
    store.put("grasps/00000-of-00001.mcap", b"by a node")
    store.put(".state/shards/x/0.arrow", b"on its way")
    brought = {"grasps/00000-of-00001.mcap": b"by a node", ".state/shards/x/0.arrow": b"on its way"}
    machine.run.bring(brought, [])
    assert machine.files() == brought
    assert machine.run.put() == 0
    assert set(store.listed()) == set(brought)
    store.remove("grasps/00000-of-00001.mcap")
    machine.run.bring([], brought)
    assert machine.files() == {}
    machine.run.discard(machine.folder / ".state/shards")
    assert store.listed() == {}


def test_a_new_date_alone_puts_nothing(machine: Machine) -> None:
    machine.write("grasps.mcap", b"index")
    machine.run.put()
    with machine.run.same(machine.folder / "grasps.mcap"):
        os.utime(machine.folder / "grasps.mcap", (1, 1))
    assert machine.run.put() == 0
    with machine.run.same(machine.folder / "grasps.mcap"):
        machine.write("grasps.mcap", b"other")
    machine.write("grasps.mcap", b"yet another")
    assert machine.run.put() == 1


def test_a_run_within_a_run_has_a_place_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, machine: Machine
) -> None:
    machine.write("run.toml", b"")
    machine.write("referee/run.toml", b"")
    machine.write("referee/grasps.mcap", b"its own")
    machine.run.put()
    assert set(machine.store.listed()) == {"run.toml"}
    monkeypatch.delenv("RUN_STORE", raising=False)
    named = StoreConfig(url="s3://bucket/prefix")
    within = place_of(RunFolder(machine.folder / "referee"), named)
    assert within is not None
    assert within.url == "s3://bucket/prefix/one/referee"
    assert place_of(RunFolder(machine.folder), StoreConfig()) is None
    monkeypatch.setenv("RUN_STORE", "gs://other/")
    found = place_of(RunFolder(machine.folder), named)
    assert found is not None
    assert found.url == "gs://other/one"
    monkeypatch.setenv("RUN_STORE", "/mnt/store")
    with pytest.raises(ConfigError, match="RUN_STORE = '/mnt/store' is no object store"):
        place_of(RunFolder(machine.folder), named)


def test_scratch_files_of_every_depth_stay_here() -> None:
    assert not belongs_to_run(".grasps.mcap.00000000-1-1-00000000.part")
    assert belongs_to_run("grasps.mcap")
