"""What a source file imports, and the digest of what it says; kept for the next process.

To parse the two hundred files behind a stage takes most of a second, and every command that asks
what is stale does so. What is found is kept beside the bytecode that Python keeps of this package,
and holds for a file's very bytes, this Python, and this module as it is.
"""

import ast
import hashlib
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pipeline.artifacts.kept_bytes import keep, read_kept

CONFIG = "pipeline.config"
CONFIG_READER = "pipeline.config.tree"  # its functions make values, which are digested themselves

_Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef

_ROOT = Path(__file__).resolve().parents[2]  # only of this project's own files something is kept
_FILE = Path(__file__).parent / "__pycache__" / "source_facts.json"


@dataclass(frozen=True)
class SourceFacts:
    """What a source file says.

    Attributes
    ----------
    imports
        Dotted names that it may import from, those within functions included.
    digest
        SHA-256 of its syntax tree without docstrings and comments; of a configuration module, of
        what does not show in the values of a section.
    decides
        Whether it can change a result; a configuration module of nothing but fields cannot.
    """

    imports: tuple[str, ...]
    digest: str
    decides: bool


@cache
def facts_of(path: Path, module: str) -> SourceFacts:
    """The facts of a source file, kept ones where it is as it was.

    Parameters
    ----------
    path
        The file.
    module
        Its dotted name.

    Returns
    -------
    The facts.
    """
    source = path.read_bytes()
    if not path.is_relative_to(_ROOT):
        return _made(source, module)
    of = hashlib.sha256(_salt() + module.encode() + b"\0" + source).hexdigest()
    kept = _kept().get(module)
    if kept is None or kept["of"] != of:
        facts = _made(source, module)
        kept = _kept()[module] = {"of": of, **vars(facts)}
        _new.append(module)
    return SourceFacts(tuple(kept["imports"]), kept["digest"], kept["decides"])


def keep_facts() -> None:
    """Write down what was found anew; where that cannot be, the next process finds it again."""
    if not _new:
        return
    keep(_FILE, json.dumps(_kept()).encode())
    _new.clear()


def within(module: str, packages: tuple[str, ...]) -> bool:
    """Whether a module is one of the packages, or in one."""
    return any(module == package or module.startswith(f"{package}.") for package in packages)


_new: list[str] = []  # modules whose facts are not in the file


@cache
def _kept() -> dict[str, dict[str, Any]]:
    """What the file keeps, by module; nothing where it is missing or damaged."""
    text = read_kept(_FILE)
    kept: dict[str, dict[str, Any]] = {} if text is None else json.loads(text)
    return kept


@cache
def _salt() -> bytes:
    """All that facts depend on beside a file's bytes."""
    return sys.version.encode() + Path(__file__).read_bytes()


def _made(source: bytes, module: str) -> SourceFacts:
    tree = ast.parse(source)
    imports = tuple(_imports(tree))
    of_config = within(module, (CONFIG,))
    statements = _deciding(tree, module) if of_config else tree.body
    telling = [_without_docstrings(line) for line in statements if not _is_words(line)]
    text = "\n".join(ast.dump(statement) for statement in telling)
    digest = hashlib.sha256(text.encode()).hexdigest()
    return SourceFacts(imports, digest, decides=bool(statements) or not of_config)


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


def _deciding(tree: ast.Module, module: str) -> list[ast.stmt]:
    """Statements of a configuration module that can change results and do not show in its values.

    Fields, properties derived from them, and validators show in the values of a section, which have
    their own digest (`pipeline.config.section_digest`). Left are constants, functions and methods.
    """
    found: list[ast.stmt] = []
    for statement in tree.body:
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


def _imports(tree: ast.Module) -> Iterator[str]:
    """Names of modules that a source file imports, also inside functions."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
