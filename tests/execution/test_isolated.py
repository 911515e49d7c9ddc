"""An item that ends its process is told by name, and the others are finished."""

import ctypes
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import SoftgripError
from pipeline.execution import Allowance, Isolation, Lost, isolated
from pipeline.execution.isolated import run_apart

PLENTY = Allowance(seconds=120, memory_mib=100)
SHORT = Allowance(seconds=0.5, memory_mib=100)


def fate(what: str) -> str:
    """A job that does to its process what its item says."""
    match what:
        case "abort":
            os.abort()
        case "read beyond memory":
            ctypes.string_at(0)
        case "take all memory":
            taken = []
            while True:
                taken.append(np.ones(1 << 20))
        case "never end":
            while True:
                time.sleep(0.1)
        case "leave":
            os._exit(3)
        case "complain":
            raise SoftgripError("the item is bad", "Leave it out")
    return f"{what} is done"


FATES = {
    "abort": Lost("ended its process by SIGABRT"),
    "one": "one is done",
    "read beyond memory": Lost("ended its process by SIGSEGV"),
    "take all memory": Lost("took more than 100 MiB of memory"),
    "two": "two is done",
    "leave": Lost("ended its process with exit code 3"),
    "three": "three is done",
}


@pytest.mark.parametrize("workers", [1, 2])
def test_what_ends_its_process_is_told_and_the_others_are_finished(workers: int) -> None:
    with Isolation(workers, PLENTY) as apart:
        assert list(apart.run_in_order(fate, FATES)) == list(FATES.values())
        assert list(apart.run_in_order(fate, ["four"])) == ["four is done"]
    assert not multiprocessing.active_children()


def test_what_never_ends_is_ended_and_the_others_are_finished() -> None:
    with Isolation(2, SHORT) as apart:
        found = list(apart.run_in_order(fate, ["never end", "one", "two"]))
    assert found == [Lost("took longer than 0.5 s"), "one is done", "two is done"]


def test_no_process_is_this_one_and_one_serves_many_items() -> None:
    with Isolation(1, PLENTY) as apart:
        served = {*apart.run_in_order(own_pid, range(40)), *apart.run_in_order(own_pid, range(3))}
    assert len(served) == 1
    assert os.getpid() not in served


def own_pid(_: int) -> int:
    return os.getpid()


def test_results_keep_the_order_of_items_that_take_unequal_time() -> None:
    with Isolation(2, PLENTY) as apart:
        pauses = [0.3, 0.0, 0.0, 0.1, 0.0]
        assert list(apart.run_in_order(rest, pauses)) == pauses


def rest(pause_s: float) -> float:
    time.sleep(pause_s)
    return pause_s


def test_a_job_s_own_exception_is_raised_with_where_it_arose() -> None:
    with Isolation(1, PLENTY) as apart, pytest.raises(SoftgripError, match="is bad") as raised:
        list(apart.run_in_order(fate, ["complain"]))
    assert "test_isolated.py" in raised.value.__notes__[0]


class TwoPartError(Exception):
    """Pickled by one argument, it cannot be read again."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(first + second)


def raise_of_two(item: str) -> None:
    raise TwoPartError(item, "!")


def test_an_exception_that_cannot_be_pickled_is_told_in_words() -> None:
    with Isolation(1, PLENTY) as apart, pytest.raises(RuntimeError, match="TwoPartError: no!"):
        list(apart.run_in_order(raise_of_two, ["no"]))


def test_an_exception_of_the_consumer_leaves_no_process() -> None:
    long = Allowance(seconds=1200, memory_mib=100)  # else its end would be the items' end

    def consume() -> None:
        with Isolation(2, long) as apart:
            for _ in apart.run_in_order(rest, [0.0, 600.0, 600.0]):
                raise KeyboardInterrupt

    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        consume()
    assert time.monotonic() - started < 300  # no item is waited for
    assert not multiprocessing.active_children()


def test_a_process_killed_between_two_items_is_replaced() -> None:
    def items() -> Iterator[str]:
        yield "one"
        (process,) = multiprocessing.active_children()
        process.kill()
        process.join()
        yield "two"

    with Isolation(1, PLENTY) as apart:
        pairs = apart.run_in_order(fate, items())
        assert list(pairs) == ["one is done", "two is done"]


def test_a_process_ends_with_the_one_that_started_it(tmp_path: Path) -> None:
    """Killed outright, a driver ends nothing itself: the kernel does."""
    noted = tmp_path / "pid"
    driver = multiprocessing.get_context("spawn").Process(target=drive, args=(noted,))
    driver.start()
    wait_for(noted.exists)
    pid = int(noted.read_text())
    driver.kill()
    driver.join()
    wait_for(lambda: not Path(f"/proc/{pid}/fd").exists())


def drive(noted: Path) -> None:
    with Isolation(1, PLENTY) as apart:
        list(apart.run_in_order(partial(note_and_stay, noted), [60]))


def note_and_stay(noted: Path, seconds: int) -> None:
    scratch = noted.with_suffix(".new")
    scratch.write_text(str(os.getpid()))
    scratch.replace(noted)
    time.sleep(seconds)


def wait_for(there: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60
    while not there():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_one_item_beside_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a Ray worker does, which keeps the process for its next items."""
    with Isolation(1, PLENTY) as apart:
        monkeypatch.setitem(isolated._beside, PLENTY, apart)
        assert run_apart(fate, PLENTY, "abort") == FATES["abort"]
        assert run_apart(own_pid, PLENTY, 1) == run_apart(own_pid, PLENTY, 2) != os.getpid()
