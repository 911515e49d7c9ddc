"""Work items in, results out, in order, whichever processes compute them.

A work item is a picklable value, a job a module-level function of one item.
Results arrive in the order of the items, so what is written never depends on
the number of workers.
"""

import math
import multiprocessing
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import resource_tracker
from types import FrameType
from typing import Any, Literal, TypeVar

from pipeline.errors import SoftgripError
from pipeline.execution.packed_items import ItemPacker, unpack_item
from pipeline.execution.run_store import RunStore

Item = TypeVar("Item")
Result = TypeVar("Result")

Executor = Literal["local", "ray"]

_Handler = Callable[[int, FrameType | None], Any]

AHEAD_PER_WORKER = 2  # items in flight, so that a slow consumer bounds memory


def run_in_order(
    job: Callable[[Item], Result],
    items: Iterable[Item],
    workers: int,
    executor: Executor = "local",
    ahead_per_worker: int = AHEAD_PER_WORKER,
    limit_s: float = math.inf,
    store: RunStore | None = None,
    bring: bool = True,
) -> Iterator[Result]:
    """Compute ``job(item)`` for every item, in worker processes or on a Ray cluster.

    One worker runs in this process. Processes are spawned, not forked: drivers
    of graphics and threads of native libraries do not survive a fork.

    Parameters
    ----------
    job
        A module-level function of one item.
    items
        Picklable values.
    workers
        Processes to work in.
    executor
        Where they run.
    ahead_per_worker
        Results of each worker that may wait for their turn; many where results are small and items
        take unequal time.
    limit_s
        How long an item may be waited for once all before it are done [s]; work in this process
        has no limit.
    store
        Where nodes find the run's files, and files made here are put meanwhile; None: the run lies
        in its folder.
    bring
        Whether files that nodes put in the store come to the run's folder here.

    Yields
    ------
    Result
        Result of each item, in the order of the items.

    Raises
    ------
    SoftgripError
        A worker process died (killed, or out of memory), or an item took longer than allowed.
    """
    if executor == "ray":
        from pipeline.execution.ray_executor import run_on_ray  # an optional package

        yield from run_on_ray(job, items, limit_s=limit_s, store=store, bring=bring)
        return
    yield from put_meanwhile(_in_processes(job, items, workers, ahead_per_worker, limit_s), store)


def put_meanwhile(results: Iterator[Result], store: RunStore | None) -> Iterator[Result]:
    """Results of this machine's processes as they come; what they write is put in the store."""
    for result in results:
        yield result
        if store is not None:
            store.put_now_and_then()


def _in_processes(
    job: Callable[[Item], Result],
    items: Iterable[Item],
    workers: int,
    ahead_per_worker: int,
    limit_s: float,
) -> Iterator[Result]:
    """Results of worker processes in the order of the items; of one worker, of this process."""
    if workers <= 1:
        yield from map(job, items)
        return
    resource_tracker.ensure_running()  # once it runs, starting a worker lifts no signal mask
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))
    packer = ItemPacker()
    waiting: deque[Future[Result]] = deque()
    try:
        for item in items:
            waiting.append(_submit(pool, job, packer.pack(item)))
            if len(waiting) >= workers * ahead_per_worker:
                yield waiting.popleft().result(wait_s(limit_s))
        while waiting:
            yield waiting.popleft().result(wait_s(limit_s))
    except TimeoutError as error:
        _kill_workers()
        raise too_long(limit_s) from error
    except BrokenProcessPool as error:
        _kill_workers()  # one just started would wait for ever
        raise SoftgripError(
            "A worker process died: it was killed or the machine ran out of memory",
            "Run the same command again, it goes on where it stopped; "
            "with less memory, set WORKERS=1",
        ) from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def too_long(limit_s: float) -> SoftgripError:
    """The error of an item that took longer than allowed."""
    return SoftgripError(
        f"A work item took longer than {limit_s:g} s: its worker hangs",
        "Run the same command again, it goes on where it stopped; where items need so long, "
        "set ITEM_LIMIT_S to more seconds",
    )


def wait_s(limit_s: float) -> float | None:
    """As `concurrent.futures` and Ray want it: None for no limit."""
    return None if math.isinf(limit_s) else limit_s


def _kill_workers() -> None:
    for process in multiprocessing.active_children():
        process.kill()


def _submit(
    pool: ProcessPoolExecutor, job: Callable[[Any], Result], packed: bytes
) -> Future[Result]:
    """Submit a packed item, and report a pool that breaks meanwhile as `BrokenProcessPool`.

    Submitting may start a process. The pool closes its pipes when a worker dies; starting another
    one then fails on the closed pipes with another error.
    """
    try:
        with defer_interrupts():
            return pool.submit(_work_on, job, packed)
    except (ValueError, OSError) as error:
        raise BrokenProcessPool(f"no further worker could be started: {error}") from error


def _work_on(job: Callable[[Any], Result], packed: bytes) -> Result:
    """In a worker: the job of a packed item."""
    return job(unpack_item(packed))


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """Start workers that never receive SIGINT, not even while their interpreter starts.

    A terminal sends SIGINT to the whole process group, and only the driver is to end the run. The
    driver receives SIGINT or SIGTERM after the block, as a worker whose start is cut short would
    print errors about its driver. Workers inherit the signal mask. The mask alone does not protect
    the driver, for a thread of a native library may take the signal, and Python then handles it in
    the main thread.
    """
    heard: list[int] = []
    handlers: dict[signal.Signals, _Handler] = {}
    if threading.current_thread() is threading.main_thread():  # the one where handlers run
        for number in (signal.SIGINT, signal.SIGTERM):
            handler = signal.getsignal(number)
            if callable(handler):
                handlers[number] = handler
                signal.signal(number, lambda number, _: heard.append(number))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for taken in heard:
            signal.raise_signal(taken)
