"""Work items that may end the process which holds them, each blamed for its own process alone.

A foreign mesh can make a native library abort, read beyond its memory, take all of it, or never
come back. So a process holds one item at a time. When it dies, or must be ended because its item
took more than its allowance, that item is lost, a new process goes on with the others, and what is
handed out is the same for any number of processes.

The allowance is a safety net: it depends on the machine, and so does a death. Whoever loses an item
must not take what is left for the final result.
"""

import ctypes
import multiprocessing
import os
import pickle
import resource
import signal
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import connection, resource_tracker
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, Self, TypeVar

import numpy as np

from pipeline.errors import SoftgripError
from pipeline.execution.executors import Executor, defer_interrupts
from pipeline.execution.run_store import RunStore

Item = TypeVar("Item")
Result = TypeVar("Result")

# Results that may wait for their turn, a process: they are few and small, items take unequal time.
AHEAD_PER_WORKER = 16
MIB = 1 << 20
_BLAS_BEGINS_AT = 256  # rows of a matrix too large for loops that need no buffer
_KILLED_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)


@dataclass(frozen=True)
class Allowance:
    """What one item may take before its process is ended.

    Attributes
    ----------
    seconds
        On the wall's clock [s].
    memory_mib
        Beside what the process has once its modules are loaded [MiB].
    """

    seconds: float
    memory_mib: int


@dataclass(frozen=True)
class Lost:
    """An item without a result.

    Attributes
    ----------
    how
        What became of it, to be read behind its name.
    """

    how: str


@dataclass(frozen=True)
class _Raised:
    """What a job raised, and where."""

    error: Exception
    trace: str


class Isolation:
    """Processes for items that may end them; a context, at whose end no process is left.

    Parameters
    ----------
    workers
        Processes to work in; they are started when they are needed.
    allowance
        What one item may take.
    executor
        Where they run. On Ray each node has processes of its own, beside Ray's.
    store
        Where nodes find the run's files; None: in its folder, as this process does.
    """

    def __init__(
        self,
        workers: int,
        allowance: Allowance,
        executor: Executor = "local",
        store: RunStore | None = None,
    ) -> None:
        self._most = max(1, workers)
        self._allowance = allowance
        self._executor, self._store = executor, store
        self._workers: list[_Worker] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for worker in self._workers:
            worker.end()
        self._workers.clear()

    def run_in_order(
        self, job: Callable[[Item], Result], items: Iterable[Item]
    ) -> Iterator[Result | Lost]:
        """Compute ``job(item)`` for every item.

        Parameters
        ----------
        job
            A module-level function of one item, or a `functools.partial` of one.
        items
            Picklable values.

        Yields
        ------
        Result | Lost
            Result of each item, in the order of the items, or what became of it.

        Raises
        ------
        SoftgripError
            A process could not begin with its item.
        """
        if self._executor == "ray":
            from pipeline.execution.ray_executor import job_by_name, run_on_ray

            apart = partial(run_apart, job_by_name(job), self._allowance)
            yield from run_on_ray(apart, items, Lost, store=self._store)
            return
        waiting, ended = enumerate(items), False
        outcomes: dict[int, Any] = {}
        turn = given = 0
        while True:
            while not ended and self._free() and given - turn < self._most * AHEAD_PER_WORKER:
                following = next(waiting, None)
                ended = following is None
                if following is not None:
                    given += 1
                    self._idle().give(job, *following)
            if turn in outcomes:
                yield _result(outcomes.pop(turn))
                turn += 1
            elif ended and turn == given:
                return
            else:
                self._collect(outcomes)

    def _free(self) -> bool:
        """Whether a process holds no item, or one more may be started."""
        busy = sum(worker.number is not None for worker in self._workers)
        return busy < self._most

    def _idle(self) -> "_Worker":
        """A process that holds no item, started where there is none."""
        for worker in list(self._workers):
            if worker.number is None and worker.is_running:
                return worker
            if worker.number is None:
                worker.end()
                self._workers.remove(worker)
        self._workers.append(_Worker(self._allowance))
        return self._workers[-1]

    def _collect(self, outcomes: dict[int, Any]) -> None:
        """Wait until something becomes of an item, and note it."""
        busy = [worker for worker in self._workers if worker.number is not None]
        soonest = min(worker.deadline for worker in busy)
        patience = None if soonest == float("inf") else max(0.0, soonest - time.monotonic())
        ready = connection.wait([worker.connection for worker in busy], patience)
        for worker in busy:
            number = worker.number
            outcome = worker.outcome(worker.connection in ready)
            if outcome is not None and number is not None:
                outcomes[number] = outcome
            if not worker.alive:
                self._workers.remove(worker)


def run_apart(job: Callable[[Item], Result], allowance: Allowance, item: Item) -> Result | Lost:
    """One item in a process beside this one, which stays for the next item.

    Parameters
    ----------
    job
        A function that another process can import.
    allowance
        What the item may take.
    item
        A picklable value.

    Returns
    -------
    The job's result, or what became of the item.
    """
    beside = _beside.get(allowance)
    if beside is None:
        beside = _beside[allowance] = Isolation(1, allowance)
    (result,) = beside.run_in_order(job, [item])
    return result


_beside: dict[Allowance, Isolation] = {}  # of this process, a Ray worker; they end with it


class _Worker(Generic[Item]):
    """A process, and the number of the item that it holds."""

    def __init__(self, allowance: Allowance) -> None:
        spawn = multiprocessing.get_context("spawn")
        self.connection, there = spawn.Pipe()
        self._allowance = allowance
        self._process = spawn.Process(
            target=_serve, args=(there, allowance, os.getpid()), daemon=True
        )
        resource_tracker.ensure_running()  # once it runs, starting a process lifts no signal mask
        with defer_interrupts():
            self._process.start()
        there.close()
        self.number: int | None = None
        self.deadline = float("inf")
        self.alive = True

    @property
    def is_running(self) -> bool:
        """Whether it can be given an item: the kernel may have killed it between two."""
        return self._process.is_alive()

    def give(self, job: Callable[[Item], Any], number: int, item: Item) -> None:
        """Hand it an item; its clock starts when it begins with it."""
        self.number = number
        with suppress(BrokenPipeError):  # it is dead: `outcome` finds that out
            self.connection.send((job, item))

    def outcome(self, ready: bool) -> Any:
        """What became of its item; None while it works on it.

        Parameters
        ----------
        ready
            Whether it has said something, or has died.

        Returns
        -------
        The job's result, `_Raised`, `Lost` or None.
        """
        if ready:
            try:
                said = self.connection.recv()
            except (EOFError, OSError):
                return self._died()
            done, outcome = said
            if not done:  # it has read its item and begins with it
                self.deadline = time.monotonic() + self._allowance.seconds
                return None
            self.number, self.deadline = None, float("inf")
            return outcome
        if time.monotonic() < self.deadline:
            return None
        self.end()
        return Lost(f"took longer than {self._allowance.seconds:g} s")

    def _died(self) -> Lost:
        """What became of the item whose process is dead."""
        begun = self.deadline < float("inf")
        self._process.join()
        code = self._process.exitcode or 0
        self.end()
        if not begun:
            raise SoftgripError(
                f"A worker process could not start ({_ending(code)})",
                "Run the same command again; with less memory, set WORKERS=1",
            )
        return Lost(_ending(code))

    def end(self) -> None:
        """Kill it; what it holds is lost."""
        if not self.alive:
            return
        self.alive = False
        self.connection.close()
        self._process.kill()
        self._process.join()
        self._process.close()


def _serve(requests: connection.Connection, allowance: Allowance, parent: int) -> None:
    """Work on items as they come until the other end is closed; the whole life of a process."""
    ctypes.CDLL(None).prctl(_KILLED_WITH_PARENT, signal.SIGKILL)
    if os.getppid() != parent:  # it had died before
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    unbounded = resource.getrlimit(resource.RLIMIT_DATA)
    bounded = unbounded
    while True:
        try:
            job, item = requests.recv()
        except EOFError:
            return
        if bounded is unbounded:  # not before: reading the first item has loaded the modules
            # OpenBLAS ends the process where it finds no memory for its buffers: have them now.
            np.linalg.inv(np.eye(_BLAS_BEGINS_AT))
            bounded = _memory_bound(allowance.memory_mib)
        requests.send((False, None))
        resource.setrlimit(resource.RLIMIT_DATA, bounded)
        try:
            try:
                outcome = job(item)
            finally:  # before words are found: what the job holds is still there
                resource.setrlimit(resource.RLIMIT_DATA, unbounded)
        except MemoryError:
            outcome = Lost(f"took more than {allowance.memory_mib} MiB of memory")
        except Exception as error:  # noqa: BLE001 - raised again where its turn comes
            outcome = _Raised(_sendable(error), traceback.format_exc())
        requests.send((True, outcome))


def _sendable(error: Exception) -> Exception:
    """The error, or its words where it cannot be pickled and read again."""
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - our own bytes
    except Exception:  # noqa: BLE001 - whatever its class does wrong
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


def _memory_bound(memory_mib: int) -> tuple[int, int]:
    """The limit of private memory that leaves this process so much more than it has now."""
    pages = int(Path("/proc/self/statm").read_text().split()[5])
    most = pages * resource.getpagesize() + memory_mib * MIB
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    return (most if hard == resource.RLIM_INFINITY else min(most, hard)), hard


def _result(outcome: Any) -> Any:
    """A result as it is; an exception is raised with a note of where it arose."""
    if isinstance(outcome, _Raised):
        outcome.error.add_note(outcome.trace)
        raise outcome.error
    return outcome


def _ending(code: int) -> str:
    """How a process ended, from its exit code: below 0 the number of a signal."""
    if code == -signal.SIGKILL:
        return "had its process killed, as the kernel does when memory runs out"
    if code < 0:
        return f"ended its process by {signal.Signals(-code).name}"
    return f"ended its process with exit code {code}"
