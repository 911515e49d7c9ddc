"""Digests of the source files that a stage's result, or its recording, depends on.

A file counts by its syntax tree without docstrings and comments. All modules reached by import
count, imports within functions included.
"""

from functools import cache
from pathlib import Path

from pipeline.execution.source_facts import SourceFacts, facts_of, keep_facts, within

ROOT = Path(__file__).resolve().parents[2]
OUR_PACKAGES = ("pipeline", "stages", "schemas")
DRAWING = ("pipeline.recording",)  # what only draws: no result may be from it
# What starts, times, orders and tells stages; no byte of an artifact is from it. Its own text
# changes with every word that a person is told.
RUNNING = (
    "pipeline.artifacts.digests",
    "pipeline.artifacts.object_store",
    "pipeline.asking",
    "pipeline.config.expectations",
    "pipeline.execution.code",
    "pipeline.execution.commands",
    "pipeline.execution.freshness",
    "pipeline.execution.packages",
    "pipeline.execution.renderer",
    "pipeline.execution.run_store",
    "pipeline.execution.running",
    "pipeline.execution.sealing",
    "pipeline.execution.source_facts",
    "pipeline.execution.staleness",
    "pipeline.execution.store_lease",
    "pipeline.execution.stored_items",
    "pipeline.interchange.foxglove_layouts",
    "pipeline.progress",
    "pipeline.stopwatch",
    "stages.graph",
)


def code_digests(module: str, without: tuple[str, ...] = DRAWING + RUNNING) -> dict[str, str]:
    """SHA-256 of each of our source files that a module reaches by import, the module included.

    Parameters
    ----------
    module
        Dotted name, such as ``stages.grasps``.
    without
        Modules and packages that are not followed, dotted.

    Returns
    -------
    Path below the project's root → digest, in order of the paths.
    """
    return {
        _source_of(name).relative_to(ROOT).as_posix(): _facts(name).digest
        for name in reached_modules(module, without)
        if _facts(name).decides
    }


def foreign_imports(module: str, without: tuple[str, ...] = DRAWING + RUNNING) -> set[str]:
    """Dotted names of modules of other projects that a module reaches by import."""
    found = set()
    for name in reached_modules(module, without):
        imports = _facts(name).imports
        found |= {other for other in imports if other.split(".")[0] not in OUR_PACKAGES}
    return found


def reached_modules(module: str, without: tuple[str, ...] = DRAWING + RUNNING) -> list[str]:
    """Our modules that a module reaches by import, itself and its packages included, sorted."""
    waiting, seen = [module], set()
    while waiting:
        name = waiting.pop()
        if name in seen or not _exists(name) or within(name, without):
            continue
        seen.add(name)
        waiting += [i for i in _facts(name).imports if i.split(".")[0] in OUR_PACKAGES]
        waiting += [name.rpartition(".")[0]] if "." in name else []
    keep_facts()
    return sorted(seen, key=lambda name: _source_of(name).relative_to(ROOT).as_posix())


def _facts(module: str) -> SourceFacts:
    return facts_of(_source_of(module), module)


@cache
def _found(root: Path, module: str) -> Path | None:
    base = root.joinpath(*module.split("."))
    for candidate in (base.with_suffix(".py"), base / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


def _exists(module: str) -> bool:
    return _found(ROOT, module) is not None


def _source_of(module: str) -> Path:
    path = _found(ROOT, module)
    assert path is not None
    return path
