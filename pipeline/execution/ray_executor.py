"""Work items on an existing Ray cluster, results in order, as from local processes.

Every node must hold the same packages, and see the run's folder under the path it has here; where
the run lies in an object store, nodes take its files from there and see no folder of the driver.
A job that dies with its node is made again on another: jobs keep what is already whole. So is one
that Ray ends because its node runs out of memory, as often.
"""

import importlib
import math
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from loguru import logger

from pipeline.errors import MachineError, SoftgripError
from pipeline.execution.executors import too_long
from pipeline.execution.packed_items import ItemPacker, unpack_item
from pipeline.execution.ray_cluster import MOST_RETRIES, connected, enter
from pipeline.execution.run_store import Place, RunStore
from pipeline.execution.stored_items import Done, run_from_store, timed

Item = TypeVar("Item")
Result = TypeVar("Result")

AHEAD_PER_CPU = 2  # tasks in flight, so that a slow driver bounds memory
TASK_S = 1.0  # long beside what a task costs the driver, short beside what a killed node loses
MOST_ITEMS = 64  # of a task: results come together, and progress is shown by them
NODE_BACK_WITHIN_S = 120.0  # a node that starts anew takes a minute or so


@dataclass(frozen=True)
class JobByName:
    """A job as a node finds it: a function by its name, and what is passed beside the item.

    Attributes
    ----------
    module, name
        Where the function is defined and how it is called there.
    before
        Positional arguments that stand before the item.
    keywords
        Arguments by keyword.
    """

    module: str
    name: str
    before: tuple[Any, ...] = ()
    keywords: dict[str, Any] = field(default_factory=dict)

    def __call__(self, item: Any) -> Any:
        """What the function makes of an item, on the machine where this is called."""
        function = getattr(importlib.import_module(self.module), self.name)
        return function(*self.before, item, **self.keywords)


def run_on_ray(
    job: Callable[[Item], Result],
    items: Iterable[Item],
    lost: Callable[[str], Result] | None = None,
    limit_s: float = math.inf,
    store: RunStore | None = None,
    bring: bool = True,
) -> Iterator[Result]:
    """Compute ``job(item)`` for every item on a Ray cluster, one CPU each.

    The cluster is the one RAY_ADDRESS names, else the one started on this machine.

    Parameters
    ----------
    job
        A module-level function of one item.
    items
        Picklable values.
    lost
        Makes the result of an item that cost every worker its life, from what became of it.
    limit_s
        How long an item may be waited for once all before it are done [s].
    store
        Where nodes find the run's files; None: in its folder, as this process does.
    bring
        Whether the files that nodes put in the store come to the run's folder here.

    Yields
    ------
    Result
        Result of each item, in the order of the items.

    Raises
    ------
    MachineError
        Ray is not installed, no cluster answers, or no node could find the job.
    SoftgripError
        The worker of a job died more often than the job is tried again, and ``lost`` is not given;
        or an item took longer than allowed.
    """
    named = job_by_name(job)
    with connected() as ray:
        yield from _in_order(ray, named, items, lost, limit_s, Sending(store, bring))


def _in_order(
    ray: ModuleType,
    named: JobByName,
    items: Iterable[Item],
    lost: Callable[[str], Result] | None,
    limit_s: float,
    sending: "Sending",
) -> Iterator[Result]:
    """Results in the order of the items, of a bounded number of items in flight."""
    remote = ray.remote(num_cpus=1, max_retries=MOST_RETRIES)(_run_there)
    ahead = AHEAD_PER_CPU * max(1, int(ray.cluster_resources().get("CPU", 1)))
    size, following = TaskSize(), iter(items)
    waiting: deque[tuple[list[Item], Any]] = deque()

    def send(some: list[Item]) -> Any:
        return remote.remote(*sending.message(named, some))

    def made_of(some: list[Item], sent: Any) -> Iterator[Made]:
        """What came of a task; the items of one that failed are made one by one."""
        if len(some) == 1:
            yield _result(sent, sending, lost, limit_s)
            return
        try:
            made = result_of(sent, sending, limit_s * len(some))
        except Exception as error:  # noqa: BLE001 - raised again by the item that it is of
            logger.debug("{} items are made one by one: {}", len(some), error)
            ray.cancel(sent, force=True)  # where it took too long it still runs
            for one in some:
                yield _result(send([one]), sending, lost, limit_s)
        else:
            yield made

    while True:
        while len(waiting) < ahead and (some := list(islice(following, size.items))):
            waiting.append((some, send(some)))
        if not waiting:
            return
        for made in made_of(*waiting.popleft()):
            size.learn(made.seconds, len(made.results))
            yield from made.results


class TaskSize:
    """How many items a task holds: as many as take a second, and no fewer than one.

    A task costs the driver about a millisecond, whatever it holds, so short items share one. How
    long an item takes is learned from the tasks that came back.
    """

    def __init__(self) -> None:
        self.items = 1

    def learn(self, seconds: float, items: int) -> None:
        """Note what a task took; the next ones are at most twice as large."""
        fitting = int(TASK_S * items / max(seconds, 1e-9))
        self.items = max(1, min(fitting, 2 * items, MOST_ITEMS))


@dataclass(frozen=True)
class Made:
    """What came back of a task.

    Attributes
    ----------
    seconds
        That its items took on the node [s].
    results
        Of its items, in order.
    """

    seconds: float
    results: list[Any]


@dataclass(frozen=True)
class Sending:
    """How items reach nodes, and results come back.

    Attributes
    ----------
    store
        Where nodes find the run's files; None: in the folder that this process works in.
    bring
        Whether the files that nodes put in the store come to the run's folder here.
    """

    store: RunStore | None = None
    bring: bool = True

    @cached_property
    def packer(self) -> ItemPacker:
        """Packs all items; with a store their paths travel as keys."""
        return ItemPacker(self.store.roots.key_of if self.store else None)

    def message(self, job: JobByName, items: list[Any]) -> tuple[bytes, str | Place, str]:
        """What `_run_there` is given."""
        place = self.store.place if self.store else str(Path.cwd())
        return self.packer.pack((job, items)), place, program_name()

    def result(self, answer: bytes) -> Made:
        """What the job made of the items; files that their node put in the store are here."""
        names = {program_name(): "__main__"}
        if self.store is None:
            return Made(*unpack_item(answer, names))
        done: Done = unpack_item(answer, names, self.store.roots.path_of)
        if self.bring:
            self.store.bring(done.put, done.removed)
        return Made(*done.result)


def _result(sent: Any, sending: Sending, lost: Callable[[str], Any] | None, limit_s: float) -> Made:
    """The result of one item; a worker's death after all retries is told or ``lost``."""
    import ray
    from ray.exceptions import GetTimeoutError, OutOfMemoryError, WorkerCrashedError

    try:
        return result_of(sent, sending, limit_s)
    except SoftgripError as error:
        if isinstance(error.__cause__, GetTimeoutError):
            ray.cancel(sent, force=True)
        raise
    except (OutOfMemoryError, WorkerCrashedError) as error:
        memory = isinstance(error, OutOfMemoryError)
        if lost is not None:
            how = "took the memory of its node" if memory else "ended its Ray worker"
            return Made(math.inf, [lost(how)])
        raise SoftgripError(
            "A node of the Ray cluster ran out of memory again and again"
            if memory
            else "A Ray worker died again and again: it was killed or its node ran out of memory",
            "Run the same command again, it goes on where it stopped"
            + ("; give the nodes more memory, or fewer CPUs" if memory else ""),
        ) from error


def result_of(sent: Any, sending: Sending, limit_s: float) -> Made:
    """What `_run_there` made of some items, waited for.

    Parameters
    ----------
    sent
        Ray's reference to the result.
    sending
        How it was sent.
    limit_s
        How long it may be waited for [s].

    Returns
    -------
    The results.

    Raises
    ------
    SoftgripError
        It took longer, or no node is left; what an item raises itself arrives as it was raised.
    """
    import ray
    from ray.exceptions import GetTimeoutError, RayTaskError

    waited_s, without_nodes = 0.0, 0
    while True:
        patience_s = min(NODE_BACK_WITHIN_S, limit_s - waited_s)
        try:
            return sending.result(ray.get(sent, timeout=patience_s))
        except GetTimeoutError as error:
            waited_s += patience_s
            without_nodes = 0 if any(map(_works, ray.nodes())) else without_nodes + 1
            if without_nodes > 1:  # at two looks: one that starts anew is missing at one
                raise SoftgripError(
                    f"No node of the Ray cluster is left to work, for {NODE_BACK_WITHIN_S:g} s now",
                    "Start nodes, then run the same command again, it goes on where it stopped",
                ) from error
            if waited_s >= limit_s:
                raise too_long(limit_s) from error
        except RayTaskError as error:
            raise error.cause from error


def _works(node: dict[str, Any]) -> bool:
    """Whether a node, as Ray tells it, lives and takes items."""
    return bool(node["Alive"] and node["Resources"].get("CPU"))


def job_by_name(job: Callable[[Item], Result]) -> JobByName:
    """The job as any node can find it.

    Parameters
    ----------
    job
        A function defined at a module's top level, or a `functools.partial` of one.

    Returns
    -------
    Where the function is found, with its arguments.

    Raises
    ------
    MachineError
        The job is neither, or belongs to a script that was not started by ``python -m``.
    """
    function = job.func if isinstance(job, partial) else job
    before = job.args if isinstance(job, partial) else ()
    keywords = job.keywords if isinstance(job, partial) else {}
    module, name = getattr(function, "__module__", ""), getattr(function, "__qualname__", "")
    if getattr(sys.modules.get(module), name, None) is not function:
        raise MachineError(
            f"{function!r} cannot run on a cluster: a node finds a job by its name",
            "Define it at the top level of a module",
        )
    if module == "__main__":
        module = program_name()
        if module == "__main__":
            raise MachineError(
                "a script's own function cannot run on a cluster", "Run it with python -m"
            )
    return JobByName(module, name, before, keywords)


def program_name() -> str:
    """Name of the module that ``python -m`` runs as ``__main__``; it has that name on a node."""
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    return "__main__" if spec is None else str(spec.name)


class Worker:
    """A process on a node that works on one item after the other."""

    def run(self, sent: bytes, place: str | Place, program: str) -> bytes:
        """On the node: as `_run_there`."""
        return _run_there(sent, place, program)


def _run_there(sent: bytes, place: str | Place, program: str) -> bytes:
    """On a node: a packed job and items in; how long they took, and their results, packed out.

    Ray's own pickling would take the classes of a program along; there, they would be others than
    those of the module.

    Parameters
    ----------
    sent
        `JobByName` and the items.
    place
        Folder that relative paths start from; or the store in which the run lies.
    program
        Module that is ``__main__`` where the item comes from.

    Returns
    -------
    What `Made` is made of.
    """
    if isinstance(place, Place):
        return run_from_store(sent, place, program)
    enter(place)
    job, items = unpack_item(sent, {"__main__": program})
    return ItemPacker().pack(timed(job, items))
