"""An item's files travel as keys, and a node takes them from the store and puts them back."""

from pathlib import Path

import pytest
from obstore.store import MemoryStore

from pipeline.artifacts.object_store import ObjectStore
from pipeline.errors import StoreError
from pipeline.execution.run_store import Place
from pipeline.execution.stored_items import NodeFolder

URL = "s3://bucket/run"
MIB = 2**20


@pytest.fixture
def store() -> ObjectStore:
    return ObjectStore(URL, 1.0, MemoryStore())


def node(store: ObjectStore, root: Path, cache_mib: int = 100) -> NodeFolder:
    return NodeFolder(Place(URL, cache_mib, 1.0), root, store)


def test_what_a_job_writes_is_put_and_what_it_removes_is_removed(
    store: ObjectStore, tmp_path: Path
) -> None:
    store.put("a", b"read")
    store.put("scattered/0", b"gathered")
    here = node(store, tmp_path)
    here.bring(["a", "scattered/0", "grasps/0.mcap", "."])
    assert (here.run / "a").read_bytes() == b"read"
    (here.run / "scattered/0").unlink()
    (here.run / "grasps").mkdir()
    (here.run / "grasps/0.mcap").write_bytes(b"made")
    assert here.put_back() == (["grasps/0.mcap"], ["scattered/0"])
    assert set(store.listed()) == {"a", "grasps/0.mcap"}
    assert store.read("grasps/0.mcap") == b"made"
    assert not (here.run / "grasps/0.mcap").exists()


def test_what_stays_the_same_is_brought_once_and_keeps_its_inode(
    store: ObjectStore, tmp_path: Path
) -> None:
    store.put("objects.mcap", b"first")
    here, beside = node(store, tmp_path), node(store, tmp_path)
    here.bring(["objects.mcap"])
    inode = (here.run / "objects.mcap").stat().st_ino
    beside.bring(["objects.mcap"])
    here.bring(["objects.mcap", "other"])
    assert (here.run / "objects.mcap").stat().st_ino == inode
    assert (beside.run / "objects.mcap").stat().st_ino == inode  # one copy a node
    store.put("objects.mcap", b"second")
    here.bring(["objects.mcap"])
    assert (here.run / "objects.mcap").read_bytes() == b"second"
    assert (beside.run / "objects.mcap").read_bytes() == b"first"  # until its next item


def test_a_stale_file_is_replaced_and_a_finished_one_kept(
    store: ObjectStore, tmp_path: Path
) -> None:
    store.put("shard", b"stale")
    here = node(store, tmp_path)
    here.bring(["shard"])
    (here.run / "shard").unlink()
    (here.run / "shard").write_bytes(b"current")
    assert here.put_back() == (["shard"], [])
    here.bring(["shard"])
    assert here.put_back() == ([], [])  # a job that keeps it changes nothing
    assert store.read("shard") == b"current"


@pytest.mark.parametrize("before", [None, b"stale"])
def test_of_two_that_make_one_file_the_first_counts_and_another_content_is_refused(
    store: ObjectStore, tmp_path: Path, before: bytes | None
) -> None:
    if before is not None:
        store.put("shard", before)
    nodes = [node(store, tmp_path / str(number)) for number in range(3)]
    for one, made in zip(nodes, (b"same", b"same", b"other"), strict=True):
        one.bring(["shard"])
        (one.run / "shard").unlink(missing_ok=True)
        (one.run / "shard").write_bytes(made)
    assert nodes[0].put_back() == (["shard"], [])
    assert nodes[1].put_back() == (["shard"], [])  # taken for lost, and alive
    with pytest.raises(StoreError, match=f"{URL}/shard was written by another process"):
        nodes[2].put_back()
    assert store.read("shard") == b"same"


def test_what_could_not_be_put_is_made_again(store: ObjectStore, tmp_path: Path) -> None:
    store.put("shard", b"stale")
    here = node(store, tmp_path)
    here.bring(["shard"])
    (here.run / "shard").unlink()
    (here.run / "shard").write_bytes(b"half done")  # the job then failed, or the store was full
    here.bring(["shard"])
    assert (here.run / "shard").read_bytes() == b"stale"


def test_a_node_keeps_no_more_than_it_may(store: ObjectStore, tmp_path: Path) -> None:
    here = node(store, tmp_path, cache_mib=2)
    for number in range(6):
        store.put(f"source/{number}", bytes([number]) * MIB)
        here.bring([f"source/{number}"])
        assert (here.run / f"source/{number}").read_bytes() == bytes([number]) * MIB
    held = [path.stat().st_size for path in tmp_path.rglob("*") if path.is_file()]
    assert len({path.stat().st_ino for path in tmp_path.rglob("*") if path.is_file()}) <= 3
    assert sum(held) <= 4 * MIB  # two and the newest, which has a link more
