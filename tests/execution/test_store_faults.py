"""A store that fails in the midst of a stage: one sentence, nothing lost, and the stage goes on."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from obstore.store import MemoryStore

from pipeline.artifacts.object_store import ObjectStore, store_error
from pipeline.errors import StoreError
from pipeline.execution import RunFolder, run_in_order
from pipeline.execution.run_store import Place, RunStore
from pipeline.execution.store_lease import Lease
from pipeline.execution.stored_items import NodeFolder

URL = "s3://bucket/run"
FAULTS = {
    "is full": "status code: 403 Forbidden: <Error><Code>QuotaExceeded</Code></Error>",
    "credentials have expired": "status code: 400: <Error><Code>ExpiredToken</Code></Error>",
    "does not answer": "HTTP error: error sending request",
}


class Failing(ObjectStore):
    """Takes so many objects, then fails, until it is mended."""

    says = ""
    takes = 0

    def put(self, key: str, content: Path | bytes) -> str:
        """Put, or fail."""
        self._count()
        return super().put(key, content)

    def put_if(self, key: str, content: Path | bytes, instead_of: str | None) -> str:
        """Put, or fail."""
        self._count()
        return super().put_if(key, content, instead_of)

    def _count(self) -> None:
        if self.takes == 0:
            raise store_error(self.url, self.says)
        self.takes -= 1


@dataclass(frozen=True)
class Item:
    number: int
    target: Path


made: list[int] = []


def make(item: Item) -> int:
    """Make a file, or keep it."""
    if not item.target.is_file():
        made.append(item.number)
        item.target.parent.mkdir(exist_ok=True)
        item.target.write_bytes(bytes([item.number]))
    return item.number


@pytest.fixture(params=FAULTS)
def fault(request: pytest.FixtureRequest) -> tuple[Failing, str]:
    store = Failing(URL, 1.0, MemoryStore())
    store.says, store.takes = FAULTS[request.param], 2
    made.clear()
    return store, request.param


def refused(work: Callable[[], object], why: str) -> None:
    with pytest.raises(StoreError, match=rf"^{URL} .*{why}") as told:
        work()
    assert "run the same command again: what is finished is kept" in str(told.value)


def test_the_driver_s_own_work_is_kept_in_its_folder_and_put_when_the_store_is_mended(
    fault: tuple[Failing, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store, why = fault
    monkeypatch.setattr("pipeline.execution.run_store.PUT_EVERY_S", -1.0)  # after each item
    folder = RunFolder(tmp_path)
    items = [Item(number, folder.shards("grasps") / f"{number}.mcap") for number in range(4)]

    def work() -> list[int]:
        run = RunStore(store, folder, Place(URL, 100, 1.0), Lease(store, "grasps", 60.0))
        done = list(run_in_order(make, items, 1, store=run))
        run.put()
        return done

    refused(work, why)
    assert made == [0, 1, 2]  # the third was made, and could not be put
    assert set(store.listed()) == {"grasps/0.mcap", "grasps/1.mcap"}
    store.takes = 100
    assert work() == [0, 1, 2, 3]
    assert made == [0, 1, 2, 3]
    assert {key: store.read(key) for key in store.listed()} == {
        f"grasps/{number}.mcap": bytes([number]) for number in range(4)
    }


def test_a_node_s_item_that_could_not_be_put_is_made_again_and_no_other(
    fault: tuple[Failing, str], tmp_path: Path
) -> None:
    store, why = fault
    node = NodeFolder(Place(URL, 100, 1.0), tmp_path, store)

    def work() -> None:
        for number in range(4):
            key = f"grasps/{number}.mcap"
            node.bring([key])
            make(Item(number, node.run / key))
            node.put_back()

    refused(work, why)
    assert set(store.listed()) == {"grasps/0.mcap", "grasps/1.mcap"}
    store.takes = 100
    work()
    assert made == [0, 1, 2, 2, 3]
    assert {key: store.read(key) for key in store.listed()} == {
        f"grasps/{number}.mcap": bytes([number]) for number in range(4)
    }
