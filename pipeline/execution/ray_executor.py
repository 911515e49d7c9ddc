"""Work items on an existing Ray cluster, results in order, as from local processes.

Every node must see the run's folder under the path it has here, and hold the same packages.
A job that dies with its node is made again on another: jobs keep what is already whole.
"""

import importlib
import os
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from pipeline.errors import MachineError, SoftgripError

Item = TypeVar("Item")
Result = TypeVar("Result")

MOST_RETRIES = 5  # of an item whose node died: nodes that die so often are no cluster
AHEAD_PER_CPU = 2  # items in flight, so that a slow driver bounds memory


def run_on_ray(job: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Compute ``job(item)`` for every item on a Ray cluster, one CPU each.

    The cluster is the one RAY_ADDRESS names, else the one started on this machine.

    Parameters
    ----------
    job
        A module-level function of one item.
    items
        Picklable values.

    Yields
    ------
    Result
        Result of each item, in the order of the items.

    Raises
    ------
    MachineError
        Ray is not installed, or no cluster answers.
    SoftgripError
        The node of a job died more often than the job is tried again.
    """
    try:
        import ray
        from ray.exceptions import RayTaskError, WorkerCrashedError
    except ImportError as error:
        raise MachineError("Ray is not installed", "pip install 'softgrip[ray]'") from error
    try:
        ray.init(
            address=os.environ.get("RAY_ADDRESS", "auto"),
            ignore_reinit_error=True,
            log_to_driver=False,
        )
    except ConnectionError as error:
        raise MachineError(
            f"no Ray cluster answers ({error})", "Start one with 'ray start --head'"
        ) from error
    remote = ray.remote(num_cpus=1, max_retries=MOST_RETRIES)(_run_there)
    name, there = _importable(job), str(Path.cwd())
    ahead = AHEAD_PER_CPU * max(1, int(ray.cluster_resources().get("CPU", 1)))
    waiting: deque[Any] = deque()
    try:
        for item in items:
            waiting.append(remote.remote(name, there, item))
            if len(waiting) >= ahead:
                yield ray.get(waiting.popleft())
        while waiting:
            yield ray.get(waiting.popleft())
    except RayTaskError as error:
        raise error.cause from error
    except WorkerCrashedError as error:
        raise SoftgripError(
            "A Ray worker died again and again: it was killed or its node ran out of memory",
            "Run the same command again, it goes on where it stopped",
        ) from error
    finally:
        ray.shutdown()


def _run_there(job: tuple[str, str], folder: str, item: Any) -> Any:
    """On a node: the job by its name, in the folder that relative paths start from."""
    os.chdir(folder)
    if folder not in sys.path:
        sys.path.insert(0, folder)
    module, name = job
    return getattr(importlib.import_module(module), name)(item)


def _importable(job: Callable[..., Any]) -> tuple[str, str]:
    """Module and name of a job; a stage run as a program is __main__ here and not there."""
    module = job.__module__
    if module == "__main__":
        spec = sys.modules["__main__"].__spec__
        if spec is None:
            raise MachineError(
                "a script's own function cannot run on a cluster", "Run it with python -m"
            )
        module = spec.name
    return module, job.__name__
