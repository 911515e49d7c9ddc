"""Every number has an owner: a field of the configuration, or a constant that says its reason.

A module's constant is of nature, of numerics, of a format or of a drawing; a comment beside it, or
on the lines above it, says in some words why it has this value. What a run should control is a
field of `pipeline.config`, and never hides in a function's signature.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODULES = sorted(
    path
    for folder in ("pipeline", "stages")
    for path in (ROOT / folder).rglob("*.py")
    if "config" not in path.relative_to(ROOT).parts[:2]
)
FEWEST_WORDS = 3
# A default that means none, all or one of something controls nothing.
NEUTRAL = (0, 1, -1)


def numbers_of(node: ast.AST) -> Iterator[float]:
    """Numeric literals under a node; which item of a sequence is taken is none."""
    if isinstance(node, ast.Subscript):
        yield from numbers_of(node.value)
        return
    value = node.value if isinstance(node, ast.Constant) else None
    if isinstance(value, int | float) and not isinstance(value, bool):
        yield value
    for part in ast.iter_child_nodes(node):
        yield from numbers_of(part)


def reason_of(lines: list[str], node: ast.stmt) -> str:
    """The comment at a statement's end, or the comment lines right above its block.

    Constants that follow each other without an empty line share what stands above them.
    """
    end = lines[(node.end_lineno or node.lineno) - 1]
    if "#" in end:
        return end.rpartition("#")[2].strip()
    above = node.lineno - 2
    while above >= 0 and lines[above].strip() and not lines[above].startswith("#"):
        if lines[above].startswith(("import ", "from ", "def ", "class ", "@", '"""')):
            return ""
        above -= 1
    words = []
    while above >= 0 and lines[above].startswith("#"):
        words.append(lines[above].lstrip("# "))
        above -= 1
    return " ".join(words)


def unexplained(source: str) -> list[str]:
    """Module constants that hold numbers and give no reason."""
    lines = source.splitlines()
    found = []
    for node in ast.parse(source).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        if isinstance(node.value, ast.Dict | ast.ListComp | ast.DictComp):
            continue  # a table of a format, whose entries are its content
        if not any(True for _ in numbers_of(node.value)):
            continue
        if len(reason_of(lines, node).split()) < FEWEST_WORDS:
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            found.append(f"line {node.lineno}: {ast.unparse(target)}")
    return found


def hidden_defaults(source: str) -> list[str]:
    """Parameters whose default is a number that controls something."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef):
            continue
        if "typer." in ast.unparse(node.args):
            continue  # a command's own options, which --help shows
        defaults = [*node.args.defaults, *(d for d in node.args.kw_defaults if d is not None)]
        found += [
            f"line {node.lineno}: {node.name}({ast.unparse(default)})"
            for default in defaults
            if any(abs(number) not in NEUTRAL for number in numbers_of(default))
        ]
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_modules_numbers_say_why(path: Path) -> None:
    source = path.read_text()
    assert not unexplained(source), "give the reason in a comment, or make it a field"
    assert not hidden_defaults(source), "take it from the configuration"


def test_a_number_without_a_reason_is_found() -> None:
    assert unexplained("LEVER_M = 0.2\n") == ["line 1: LEVER_M"]
    assert unexplained("LEVER_M = 0.2  # metres\n") == ["line 1: LEVER_M"]
    assert unexplained("LEVER_M = 0.2  # from base to load\n") == []
    assert unexplained("# Of PhysX's own solver.\nSTEPS = 4\nROUNDS = 2\n") == []
    assert unexplained("# Of PhysX's own solver.\n\nSTEPS = 4\n") == ["line 3: STEPS"]
    assert hidden_defaults("def f(x, y=0.5, z=1):\n    pass\n") == ["line 1: f(0.5)"]
