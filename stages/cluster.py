"""The nodes of the Ray cluster: cores, memory, renderer, and what each lacks for a run's work.

`make status EXECUTOR=ray` and, where RAY_ADDRESS names a cluster, `make doctor` print it.
"""

import sys
from pathlib import Path
from typing import Annotated

import typer

from pipeline.config import load_run_config
from pipeline.execution.commands import EXIT_FAILURE, run_command
from pipeline.execution.ray_cluster import Node, cluster_nodes, what_is_here
from pipeline.execution.run_store import place_of
from pipeline.execution.stage import RunFolder
from stages.graph import RUNS_DIR, STAGES


def cluster(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Print every node of the cluster; non-zero where one lacks something."""
    folder = RunFolder(runs_dir / run)
    config = load_run_config(folder.config)
    asked, common = config.cameras.renderer, place_of(folder, config.store) is None
    modules = [stage.module for stage in STAGES.values()]
    nodes = cluster_nodes(what_is_here(modules, asked), modules, asked, common)
    sys.stdout.write("\n".join(as_lines(nodes)) + "\n")
    if any(node.lacks for node in nodes):
        sys.exit(EXIT_FAILURE)


def as_lines(nodes: list[Node]) -> list[str]:
    """The cluster in one line, then a line for each node."""
    able = [node for node in nodes if not node.lacks]
    cores = sum(node.cpus for node in able)
    lines = [f"cluster: {len(able)} of {len(nodes)} nodes can do this run's work, on {cores} cores"]
    for node in nodes:
        has = f"{node.cpus} cores, {node.memory_gib:.0f} GiB, renders with {node.renderer}"
        lines.append(f"  {node.name}: {has if not node.lacks else '; '.join(node.lacks)}")
    return lines


if __name__ == "__main__":
    run_command(cluster)
