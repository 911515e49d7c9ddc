"""The Ray cluster that a run works on: the connection to it, and what each of its nodes has."""

import json
import os
import platform
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from pipeline.config.cameras import RendererName
from pipeline.errors import MachineError
from pipeline.execution.code import code_digests
from pipeline.execution.packages import ABSENT, package_versions
from pipeline.execution.renderer import identify_renderer

MOST_RETRIES = 5  # of an item whose node died: nodes that die so often are no cluster
# Ray's own setting, read from the environment when Ray is loaded; by default it never gives up.
_MEMORY_RETRIES = "RAY_task_oom_retries"
SHOWN_DIFFERENCES = 3  # of many files or packages, in one line
NODE_ANSWERS_WITHIN_S = 180.0  # a renderer is tried there, and a first start compiles shaders

_connections = 0  # how many in this process use the cluster now


@dataclass(frozen=True)
class Node:
    """A node of the cluster.

    Attributes
    ----------
    node_id
        Ray's own name of the node.
    name
        Its host's name, with its address.
    cpus
        Items that it works on at a time.
    memory_gib
        Memory that Ray gives to its workers.
    renderer
        What it renders with, as `pipeline.execution.renderer.identify_renderer` says; empty where
        it could not be told.
    lacks
        What keeps it from doing this run's work; empty where nothing does.
    """

    node_id: str
    name: str
    cpus: int
    memory_gib: float
    renderer: str
    lacks: tuple[str, ...]


@dataclass(frozen=True)
class Found:
    """What a process finds on its machine that decides results.

    Attributes
    ----------
    code
        Path → SHA-256 of our source files.
    packages
        Distribution → version, and Python's own.
    renderer
        What the machine renders with.
    """

    code: dict[str, str]
    packages: dict[str, str]
    renderer: str


@contextmanager
def connected() -> Iterator[ModuleType]:
    """Ray, connected until the last of those that asked for it is done.

    Yields
    ------
    ModuleType
        Ray, with the cluster that RAY_ADDRESS names, else the one started on this machine.

    Raises
    ------
    MachineError
        Ray is not installed, or no cluster answers.
    """
    global _connections
    os.environ.setdefault(_MEMORY_RETRIES, str(MOST_RETRIES))
    try:
        import ray
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
    _connections += 1
    try:
        yield ray
    finally:
        _connections -= 1
        if not _connections:
            ray.shutdown()


def cluster_nodes(
    here: Found, modules: Sequence[str], asked: RendererName, common_folder: bool = True
) -> list[Node]:
    """Every living node that takes work, with what it lacks for the work of this driver.

    Parameters
    ----------
    here
        What the driver has: a node must have the same.
    modules
        The programs whose jobs run there, dotted.
    asked
        The renderer that the configuration asks for.
    common_folder
        Whether nodes work in the driver's folder; else with a project of their own.

    Returns
    -------
    The nodes, in the order of their names.

    Raises
    ------
    MachineError
        Ray is not installed, or no cluster answers.
    """
    with connected() as ray:
        living = [node for node in ray.nodes() if node["Alive"] and node["Resources"].get("CPU")]
        sent = str(Path.cwd()) if common_folder else "", list(modules), asked
        looks = [
            on_node(ray, node["NodeID"], max_retries=0)(_look).remote(*sent) for node in living
        ]
        nodes = [
            _node(node, _answer(ray, look), here) for node, look in zip(living, looks, strict=True)
        ]
    return sorted(nodes, key=lambda node: (node.name, node.node_id))


def on_node(ray: ModuleType, node_id: str, **options: Any) -> Any:
    """Ray's decorator for what runs on one node and asks for none of its CPUs.

    Parameters
    ----------
    ray
        Ray, connected.
    node_id
        Ray's own name of the node.
    **options
        Further options of ``ray.remote``.

    Returns
    -------
    Makes a function, or a class, remote.
    """
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    there = NodeAffinitySchedulingStrategy(node_id, soft=False)
    return ray.remote(num_cpus=0, scheduling_strategy=there, **options)


def enter(folder: str) -> None:
    """On a node: work where the driver does, with the project that lies there."""
    os.chdir(folder)
    if folder not in sys.path:
        sys.path.insert(0, folder)


def what_is_here(modules: Sequence[str], asked: RendererName) -> Found:
    """What this machine has that decides the results of some programs.

    Parameters
    ----------
    modules
        The programs, dotted.
    asked
        The renderer that the configuration asks for.

    Returns
    -------
    Our source files, packages and the renderer.

    Raises
    ------
    MachineError
        The configuration asks for a renderer that this machine has not.
    """
    packages = {"python": platform.python_version()}
    code: dict[str, str] = {}
    for module in modules:
        code |= code_digests(module)
        packages |= package_versions(module)
    memo = Path(tempfile.gettempdir()) / f"softgrip-{os.getuid()}" / "renderer.json"
    return Found(code, packages, identify_renderer(asked, memo))


def what_is_lacking(here: Found, there: Found) -> tuple[str, ...]:
    """Why a node cannot make what this driver's keys name; empty where it can.

    Parameters
    ----------
    here
        What the driver has.
    there
        What the node has.

    Returns
    -------
    One phrase for each kind of thing that differs.
    """
    lacks = []
    files = {path for path in here.code | there.code if here.code.get(path) != there.code.get(path)}
    if files:
        lacks.append(f"other source files: {_first(sorted(files))}")
    packages = [
        f"{name} {there.packages.get(name, ABSENT)} (here {version})"
        for name, version in here.packages.items()
        if there.packages.get(name) != version
    ]
    if packages:
        lacks.append(f"other packages: {_first(packages)}")
    if here.renderer != there.renderer:
        lacks.append(f"renders with {there.renderer} (here {here.renderer}): it gets no scenes")
    return tuple(lacks)


def _first(names: Sequence[str]) -> str:
    """The first few of many, with how many are left."""
    more = len(names) - SHOWN_DIFFERENCES
    return ", ".join(names[:SHOWN_DIFFERENCES]) + (f" and {more} more" if more > 0 else "")


def _node(node: dict[str, Any], answer: Found | str, here: Found) -> Node:
    """What Ray knows of a node, with what the node says itself."""
    if isinstance(answer, Found):
        renderer, lacks = answer.renderer, what_is_lacking(here, answer)
    else:
        renderer, lacks = "", (answer,)
    return Node(
        node_id=node["NodeID"],
        name=f"{node['NodeManagerHostname']} {node['NodeManagerAddress']}",
        cpus=int(node["Resources"]["CPU"]),
        memory_gib=node["Resources"].get("memory", 0.0) / 2**30,
        renderer=renderer,
        lacks=lacks,
    )


def _answer(ray: ModuleType, look: Any) -> Found | str:
    """What a node says, or why it says nothing."""
    try:
        said = json.loads(ray.get(look, timeout=NODE_ANSWERS_WITHIN_S))
    except ray.exceptions.GetTimeoutError:
        return f"does not answer within {NODE_ANSWERS_WITHIN_S:.0f} s"
    except ray.exceptions.RayError as error:
        return f"cannot run our programs: {str(error).strip().splitlines()[-1]}"
    return Found(**said) if isinstance(said, dict) else str(said)


# Ray pickles a function of ours by its name: the node must find it before it can look.
def _look(folder: str, modules: list[str], asked: RendererName) -> str:
    """On a node: what is there, as JSON; a sentence where the driver's folder is not."""
    if folder and not (Path(folder) / "pipeline").is_dir():
        return json.dumps(f"does not see the project under {folder}")
    if folder:
        enter(folder)
    try:
        return json.dumps(asdict(what_is_here(modules, asked)))
    except MachineError as error:
        return json.dumps(error.what)
