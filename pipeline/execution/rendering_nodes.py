"""Work items that render: one process a node, for a graphics driver keeps a GPU or all cores busy.

Local processes: this one. On a Ray cluster: one process on every node that renders with what the
driver renders with, so that the bytes are the same. Other nodes are told and get no such item.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, TypeVar

from loguru import logger

from pipeline.config.cameras import RendererName
from pipeline.errors import SoftgripError
from pipeline.execution.executors import Executor, put_meanwhile
from pipeline.execution.run_store import RunStore

Item = TypeVar("Item")
Result = TypeVar("Result")

AHEAD_PER_NODE = 2  # items that a node holds: one renders while the next is on its way


def run_on_rendering_nodes(
    job: Callable[[Item], Result],
    items: Iterable[Item],
    executor: Executor,
    renderer: RendererName,
    limit_s: float = math.inf,
    store: RunStore | None = None,
) -> Iterator[Result]:
    """Compute ``job(item)`` for every item, where there is a renderer.

    Parameters
    ----------
    job
        A module-level function of one item, which keeps its renderer from call to call.
    items
        Picklable values.
    executor
        Local processes, or a Ray cluster.
    renderer
        The renderer that the configuration asks for.
    limit_s
        How long an item may be waited for once all before it are done [s]; work in this process
        has no limit.
    store
        Where nodes find the run's files; None: in its folder, as this process does.

    Yields
    ------
    Result
        Result of each item, in the order of the items.

    Raises
    ------
    SoftgripError
        Every node that could render is lost, or an item took longer than allowed.
    """
    if executor == "local":
        yield from put_meanwhile(map(job, items), store)
        return
    from pipeline.execution.ray_cluster import (
        Node,
        cluster_nodes,
        connected,
        on_node,
        what_is_here,
    )
    from pipeline.execution.ray_executor import (  # Ray is an optional package
        Sending,
        Worker,
        job_by_name,
    )

    named = job_by_name(job)
    with connected() as ray:
        able: list[Node] = []
        modules = [named.module]
        here, seen = what_is_here(modules, renderer), store is None
        for node in cluster_nodes(here, modules, renderer, seen):
            if node.lacks:
                logger.warning("node {} renders nothing: {}", node.name, "; ".join(node.lacks))
            else:
                able.append(node)
        if not able:
            logger.warning("no node of the cluster renders as this driver does: it renders itself")
            yield from put_meanwhile(map(job, items), store)
            return
        # A renderer asks for no CPU: it shares its node's with other jobs.
        processes = [_Process(n.name, on_node(ray, n.node_id)(Worker).remote()) for n in able]
        try:
            yield from _in_order(ray, named, items, processes, limit_s, Sending(store))
        finally:
            for process in processes:
                ray.kill(process.actor)


@dataclass(eq=False)
class _Process:
    """A node's process that renders, and the number of items that it holds."""

    node: str
    actor: Any
    holds: int = 0


def _in_order(
    ray: ModuleType,
    job: Any,
    items: Iterable[Any],
    processes: Sequence[_Process],
    limit_s: float,
    sending: Any,
) -> Iterator[Any]:
    """Results in the order of the items; items of a process that is lost go to another."""
    from pipeline.execution.ray_executor import result_of

    living = list(processes)
    waiting: deque[tuple[Any, _Process, Any]] = deque()

    def sent(message: Any) -> tuple[Any, _Process, Any]:
        chosen = min(living, key=lambda process: process.holds)
        chosen.holds += 1
        return message, chosen, chosen.actor.run.remote(*message)

    def next_result() -> Any:
        while True:
            message, process, ref = waiting.popleft()
            process.holds -= 1
            try:
                return result_of(ref, sending, limit_s).results[0]
            except ray.exceptions.RayActorError as error:
                if process in living:
                    living.remove(process)
                    logger.warning("node {} renders no more: {}", process.node, _first_line(error))
                if not living:
                    raise SoftgripError(
                        "Every node of the Ray cluster that renders is lost",
                        "Run the same command again, it goes on where it stopped",
                    ) from error
                waiting.appendleft(sent(message))

    for item in items:
        waiting.append(sent(sending.message(job, [item])))
        if len(waiting) >= AHEAD_PER_NODE * len(living):
            yield next_result()
    while waiting:
        yield next_result()


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or ["no reason given"])[0]
