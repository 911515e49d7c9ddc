"""Results come in the order of the items, whoever computes them."""

import multiprocessing
import multiprocessing.util
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from pipeline.errors import SoftgripError
from pipeline.execution import derive_seed, generator, run_in_order


def square(x: int) -> int:
    return x * x


def kill_yourself(x: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return x


def never_end(x: int) -> int:
    time.sleep(600)
    return x


def complain(x: int) -> int:
    raise SoftgripError(f"item {x} is bad", "Leave it out")


@pytest.mark.parametrize("workers", [1, 2])
def test_order_is_that_of_the_items(workers: int) -> None:
    assert list(run_in_order(square, range(20), workers)) == [x * x for x in range(20)]


def test_a_killed_worker_is_a_sentence_not_a_hang() -> None:
    with pytest.raises(SoftgripError, match=r"worker process died.*WORKERS=1"):
        list(run_in_order(kill_yourself, range(4), 2))


def test_a_worker_that_hangs_is_a_sentence() -> None:
    with pytest.raises(SoftgripError, match=r"longer than 1 s: its worker hangs.*ITEM_LIMIT_S"):
        list(run_in_order(never_end, range(2), 2, limit_s=1.0))
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("pause_s", [0.0, 0.001, 0.003, 0.01, 0.03, 0.1])
def test_a_worker_killed_while_the_next_one_starts(pause_s: float) -> None:
    def items() -> Iterator[int]:
        yield 1
        for process in multiprocessing.active_children():
            process.kill()
        time.sleep(pause_s)
        yield from range(8)

    with pytest.raises(SoftgripError, match=r"worker process died.*WORKERS=1"):
        list(run_in_order(square, items(), 2))
    assert not multiprocessing.active_children()


@pytest.fixture
def hears_interrupts() -> Iterator[None]:
    """As from a terminal; what a shell starts in the background is born deaf to SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("hears_interrupts")
def test_workers_are_deaf_to_interrupts_from_their_first_moment() -> None:
    """A terminal sends SIGINT to all; a worker whose interpreter starts would die of it."""

    def items() -> Iterator[int]:
        for item in range(6):
            yield item
            for process in multiprocessing.active_children():
                assert process.pid is not None
                os.kill(process.pid, signal.SIGINT)

    assert list(run_in_order(square, items(), 2)) == [x * x for x in range(6)]


@pytest.mark.usefixtures("hears_interrupts")
def test_the_driver_hears_an_interrupt_that_came_while_a_worker_started() -> None:
    def items() -> Iterator[int]:
        yield 1
        os.kill(os.getpid(), signal.SIGINT)
        yield from range(1000)

    with pytest.raises(KeyboardInterrupt):
        list(run_in_order(square, items(), 2))
    assert not multiprocessing.active_children()
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


@pytest.mark.usefixtures("hears_interrupts")
def test_an_interrupt_that_another_thread_takes_leaves_no_half_started_worker(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Python interrupts the main thread, blocked or not: between a worker's start and its job."""
    start: Callable[..., int] = multiprocessing.util.spawnv_passfds

    def interrupted_start(*given: object) -> int:
        pid = start(*given)
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.1)
        return pid

    monkeypatch.setattr(multiprocessing.util, "spawnv_passfds", interrupted_start)
    done = threading.Event()
    other = threading.Thread(target=done.wait)
    other.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            list(run_in_order(square, range(8), 2))
    finally:
        done.set()
        other.join()
    assert not multiprocessing.active_children()
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("workers", [1, 2])
def test_a_readable_failure_stays_readable_across_processes(workers: int) -> None:
    with pytest.raises(SoftgripError, match=r"item 0 is bad\. Leave it out"):
        list(run_in_order(complain, range(4), workers))


def test_streams_differ_by_name_and_repeat() -> None:
    assert derive_seed(1, "scene", "a") != derive_seed(1, "scene", "b")
    assert derive_seed(1, "scene", "a") != derive_seed(2, "scene", "a")
    assert derive_seed(1, "x", 12) == derive_seed(1, "x", "12")
    assert generator(3, "x").random() == generator(3, "x").random()
