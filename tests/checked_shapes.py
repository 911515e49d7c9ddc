"""Arrays are held against their annotations in the tests: jaxtyping's shapes, checked by beartype.

Importing this module makes every module of ``pipeline`` and ``stages`` that is imported later
check what its functions take and give, and what its dataclasses hold. ``pipeline/__init__.py``
imports it in every process where `VARIABLE` names it: the tests' own, their workers, and the
programs they start.

jaxtyping's own import hook does not serve here: it wraps what numba compiles, which numba refuses,
and under ``python -m`` its compiled files overwrite the ordinary ones. Compiled functions are
checked through their callers.
"""

import ast
import dataclasses
import functools
import inspect
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType, ModuleType
from typing import Any, runtime_checkable

from beartype import BeartypeConf, beartype
from jaxtyping import jaxtyped
from typing_extensions import Buffer

VARIABLE = "SOFTGRIP_IMPORT_FIRST"  # pipeline/__init__.py imports the module that it names
CHECKED = ("pipeline", "stages")
COMPILED = frozenset({"njit", "compiled", "compiled_finite"})  # decorators that hand over to numba
BYTECODE = ".shapes1.pyc"  # beside the ordinary one; another number whenever this module changes it

# As mypy does: an int where a float is asked for.
_check = beartype(conf=BeartypeConf(is_pep484_tower=True))


_off = False


@contextmanager
def unchecked() -> Iterator[None]:
    """Within it nothing is checked in this process: for code that refuses wrong shapes itself."""
    global _off
    _off = True
    try:
        yield
    finally:
        _off = False


def checked(made: Any) -> Any:
    """A function that checks what it takes and gives, or a dataclass that checks its fields."""
    if not inspect.isclass(made):
        return _guarded(made)
    if vars(made).get("_is_protocol"):
        return runtime_checkable(made)  # else an argument of its type cannot be checked
    if dataclasses.is_dataclass(made) and "__init__" in vars(made):
        setattr(made, "__init__", _guarded(vars(made)["__init__"]))  # noqa: B010  mypy knows no other way
    return made


def _guarded(function: Callable[..., Any]) -> Callable[..., Any]:
    # Made at the first call: a program imports ten times as many functions as it calls.
    made: list[Callable[..., Any]] = []

    @functools.wraps(function)
    def guarded(*args: Any, **kwargs: Any) -> Any:
        if _off:
            return function(*args, **kwargs)
        if not made:
            made.append(_guard_of(function))
        return made[0](*args, **kwargs)

    return guarded


def _guard_of(function: Callable[..., Any]) -> Callable[..., Any]:
    # With typechecker=_check jaxtyping would check every argument twice. Its other way forgets the
    # shapes that a generator's annotation shares with other functions, so there it is taken.
    if inspect.isgeneratorfunction(function):
        return jaxtyped(function, typechecker=_check)
    return jaxtyped(_check(function), typechecker=None)


class CheckingLoader(SourceFileLoader):
    """Loads a module with `checked` around its functions and classes; keeps bytecode of its own."""

    def source_to_code(  # type: ignore[override]
        self, data: bytes, path: str, *, _optimize: int = -1
    ) -> CodeType:
        """The module's code, from its source."""
        tree = with_checks(ast.parse(data, path))
        return compile(tree, path, "exec", dont_inherit=True, optimize=_optimize)

    def get_data(self, path: str) -> bytes:
        """A file's bytes; of bytecode, those with checks."""
        return super().get_data(_own(path))

    def set_data(self, path: str, data: Buffer, *, _mode: int = 0o666) -> None:
        """Keep bytecode."""
        super().set_data(_own(path), data, _mode=_mode)


def _own(path: str) -> str:
    return path.removesuffix(".pyc") + BYTECODE if path.endswith(".pyc") else path


def with_checks(tree: ast.Module) -> ast.Module:
    """A module whose functions, methods and classes are decorated by `checked`.

    What a function defines inside itself is left alone, as it would be wrapped at every call.
    """
    _decorate(tree.body)
    words = [isinstance(node, ast.Expr | ast.ImportFrom) for node in tree.body]
    head = words.index(False) if False in words else len(words)
    tree.body.insert(head, ast.parse(f"import {__name__}").body[0])
    return ast.fix_missing_locations(tree)


def _decorate(body: Sequence[ast.stmt]) -> None:
    for node in body:
        if isinstance(node, ast.ClassDef):
            # Outermost: around what @dataclass made.
            node.decorator_list.insert(0, _decorator(node))
            _decorate([_NamedSelf(node.name).visit(part) for part in node.body])
        elif isinstance(node, ast.FunctionDef) and not _is_compiled(node):
            # Innermost: other decorators hide the annotations.
            node.decorator_list.append(_decorator(node))


class _NamedSelf(ast.NodeTransformer):
    """Names the class where its methods say Self: beartype sees the methods one by one."""

    def __init__(self, name: str) -> None:
        self._name = name

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id != "Self":
            return node
        return ast.copy_location(ast.Constant(self._name), node)


def _is_compiled(node: ast.FunctionDef) -> bool:
    calls = [d.func if isinstance(d, ast.Call) else d for d in node.decorator_list]
    names = {c.attr if isinstance(c, ast.Attribute) else getattr(c, "id", "") for c in calls}
    return bool(names & COMPILED)


def _decorator(node: ast.stmt) -> ast.expr:
    named = ast.parse(f"{__name__}.checked", mode="eval").body
    for part in ast.walk(named):
        ast.copy_location(part, node)
    return named


class CheckingFinder(MetaPathFinder):
    """Finds the modules of `CHECKED`, to be loaded by `CheckingLoader`."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """The module's spec, as Python finds it, with the loader exchanged."""
        if fullname.partition(".")[0] not in CHECKED:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = CheckingLoader(spec.loader.name, spec.loader.path)
        return spec


sys.meta_path.insert(0, CheckingFinder())
