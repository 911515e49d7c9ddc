"""A stage is a story of a page or two: short, and without the tools of science."""

import ast
from pathlib import Path

import pytest

STAGES = sorted((Path(__file__).parents[2] / "stages").glob("*.py"))
MOST_LINES = 200
# What computes, compiles, learns, simulates or draws. NumPy may stay: a stage picks rows of arrays
# and joins them, to hand them on.
OF_SCIENCE = {"numba", "scipy", "torch", "trimesh", "sapien", "openvino", "rerun", "matplotlib"}


def imported(path: Path) -> set[str]:
    """The top-level packages that a file imports, inside functions too."""
    nodes = list(ast.walk(ast.parse(path.read_text())))
    whole = {a.name for node in nodes if isinstance(node, ast.Import) for a in node.names}
    parts = {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    return {name.partition(".")[0] for name in whole | parts}


@pytest.mark.parametrize("stage", STAGES, ids=lambda path: path.stem)
def test_a_stage_is_short(stage: Path) -> None:
    assert len(stage.read_text().splitlines()) <= MOST_LINES


@pytest.mark.parametrize("stage", STAGES, ids=lambda path: path.stem)
def test_a_stage_holds_none_of_the_tools_of_science(stage: Path) -> None:
    assert not imported(stage) & OF_SCIENCE
