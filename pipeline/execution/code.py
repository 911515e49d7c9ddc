"""Digests of the source files that a stage's result, or its recording, depends on.

A file counts by its syntax tree without docstrings and comments. All modules reached by import
count, imports within functions included.
"""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

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
    "pipeline.execution.staleness",
    "pipeline.execution.store_lease",
    "pipeline.execution.stored_items",
    "pipeline.interchange.foxglove_layouts",
    "pipeline.progress",
    "pipeline.stopwatch",
    "stages.graph",
)
CONFIG = "pipeline.config"
CONFIG_READER = "pipeline.config.tree"  # its functions make values, which are digested themselves

_Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


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
        _source_of(name).relative_to(ROOT).as_posix(): _digest_of(_source_of(name), name)
        for name in reached_modules(module, without)
        if not _is_config(name) or _decides(name)
    }


def foreign_imports(module: str, without: tuple[str, ...] = DRAWING + RUNNING) -> set[str]:
    """Dotted names of modules of other projects that a module reaches by import."""
    found = set()
    for name in reached_modules(module, without):
        imports = _parsed(_source_of(name)).imports
        found |= {other for other in imports if other.split(".")[0] not in OUR_PACKAGES}
    return found


def reached_modules(module: str, without: tuple[str, ...] = DRAWING + RUNNING) -> list[str]:
    """Our modules that a module reaches by import, itself and its packages included, sorted."""
    waiting, seen = [module], set()
    while waiting:
        name = waiting.pop()
        if name in seen or not _exists(name) or _within(name, without):
            continue
        seen.add(name)
        waiting += [i for i in _parsed(_source_of(name)).imports if i.split(".")[0] in OUR_PACKAGES]
        waiting += [name.rpartition(".")[0]] if "." in name else []
    return sorted(seen, key=lambda name: _source_of(name).relative_to(ROOT).as_posix())


class _Source:
    """A source file as Python sees it."""

    def __init__(self, path: Path) -> None:
        self.tree = ast.parse(path.read_bytes())
        self.imports = list(_imports(self.tree))


@cache
def _parsed(path: Path) -> _Source:
    return _Source(path)


@cache
def _digest_of(path: Path, module: str) -> str:
    statements = _deciding(module) if _is_config(module) else _parsed(path).tree.body
    telling = [_without_docstrings(line) for line in statements if not _is_words(line)]
    text = "\n".join(ast.dump(statement) for statement in telling)
    return hashlib.sha256(text.encode()).hexdigest()


def _without_docstrings(node: ast.stmt) -> ast.stmt:
    """The statement without the strings that stand as statements of their own in it."""
    for inner in ast.walk(node):
        if isinstance(inner, _Definition):
            inner.body = [line for line in inner.body if not _is_words(line)]
    return node


def _is_words(node: ast.stmt) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _deciding(module: str) -> list[ast.stmt]:
    """Statements of a configuration module that can change results and do not show in its values.

    Fields, properties derived from them, and validators show in the values of a section, which have
    their own digest (`pipeline.config.section_digest`). Left are constants, functions and methods.
    """
    found: list[ast.stmt] = []
    for statement in _parsed(_source_of(module)).tree.body:
        if isinstance(statement, ast.ClassDef):
            methods = [line for line in statement.body if _is_plain_method(line)]
            if methods:
                found.append(ast.ClassDef(statement.name, [], [], methods, []))
        elif isinstance(statement, ast.FunctionDef):
            if module != CONFIG_READER:
                found.append(statement)
        elif isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            if any(isinstance(target, ast.Name) and target.id.isupper() for target in targets):
                found += [statement] if module != CONFIG_READER else []
    return found


def _is_plain_method(line: ast.stmt) -> bool:
    """A method that takes arguments, or else returns what no digest of values holds."""
    if not isinstance(line, ast.FunctionDef):
        return False
    seen_in_values = ("property", "cached_property", "computed_field", "validator")
    decorators = [ast.unparse(decorator) for decorator in line.decorator_list]
    return not any(word in decorator for decorator in decorators for word in seen_in_values)


def _decides(module: str) -> bool:
    return bool(_deciding(module))


def _is_config(module: str) -> bool:
    return _within(module, (CONFIG,))


def _within(module: str, packages: tuple[str, ...]) -> bool:
    return any(module == package or module.startswith(f"{package}.") for package in packages)


def _imports(tree: ast.Module) -> Iterator[str]:
    """Names of modules that a source file imports, also inside functions."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


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
