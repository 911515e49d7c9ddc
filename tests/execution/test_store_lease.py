"""One driver at a time makes a run in a store; one that is dead, or silent, is followed."""

import time
from pathlib import Path

import pytest
from obstore.store import MemoryStore

from pipeline.artifacts.object_store import ObjectStore
from pipeline.artifacts.publishing import this_process
from pipeline.errors import StoreError
from pipeline.execution.store_lease import LEASE, Holder, Lease, holder_of

ELSEWHERE = Holder("process 7 on another machine (stage grasps)", "ffffffff-7-7")
PATIENCE_S = 30.0


def is_told(lease: Lease) -> bool:
    """Whether the lease is lost within some time."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        try:
            lease.check()
        except StoreError:
            return True
        time.sleep(0.02)
    return False


@pytest.fixture
def store() -> ObjectStore:
    return ObjectStore("s3://bucket/run", 1.0, MemoryStore())


def test_a_second_driver_is_refused_until_the_first_is_done(store: ObjectStore) -> None:
    with Lease(store, "grasps", 60.0) as held:
        with (
            pytest.raises(StoreError, match=r"in use by process \d+ on .* \(stage grasps\)"),
            Lease(store, "shards", 60.0),
        ):
            pass
        held.check()
    with Lease(store, "shards", 60.0):
        assert holder_of(store) is not None


def test_a_driver_elsewhere_is_followed_when_it_is_silent_for_the_lease(
    store: ObjectStore,
) -> None:
    store.put(LEASE, ELSEWHERE.to_json())
    with (
        pytest.raises(StoreError, match=r"another machine.*run the same command again in \d+ s"),
        Lease(store, "grasps", 3600.0),
    ):
        pass
    time.sleep(0.2)
    with Lease(store, "grasps", 0.1):
        found = holder_of(store)
    assert found is not None
    assert found.process == this_process()


def test_a_dead_process_of_this_machine_is_followed_at_once(store: ObjectStore) -> None:
    machine, pid, start = this_process().split("-")
    dead = Holder("process of before", f"{machine}-{pid}-{int(start) - 1}")
    store.put(LEASE, dead.to_json())
    with Lease(store, "grasps", 3600.0) as held:
        held.check()


def test_a_driver_that_slept_learns_that_another_has_gone_on(store: ObjectStore) -> None:
    with Lease(store, "grasps", 0.3) as held:
        store.put(LEASE, ELSEWHERE.to_json())
        assert is_told(held)
        with pytest.raises(StoreError, match="in use by process 7 on another machine"):
            held.check()
    assert holder_of(store) == ELSEWHERE  # and leaves it alone


def test_a_lease_that_cannot_be_read_is_taken_over_when_it_is_old(store: ObjectStore) -> None:
    store.put(LEASE, b"not JSON")
    with Lease(store, "grasps", 60.0) as held:
        held.check()


class LosingAnswers(ObjectStore):
    """Its first conditional put happens, and the answer is lost: the request is made again."""

    lost = False

    def put_if(self, key: str, content: Path | bytes, instead_of: str | None) -> str:
        """Put twice, the first time."""
        if not self.lost:
            self.lost = True
            super().put_if(key, content, instead_of)
        return super().put_if(key, content, instead_of)


def test_a_lost_answer_is_not_taken_for_another_driver() -> None:
    store = LosingAnswers("s3://bucket/run", 1.0, MemoryStore())
    with Lease(store, "grasps", 60.0) as held:
        held.check()
        store.lost = False  # and once more at the end
    found = holder_of(store)
    assert found is not None
    assert found.released
