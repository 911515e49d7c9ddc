"""A dataset grows and shrinks: what is there is taken over, and the bytes are those of one making.

Objects, scenes and grasps are made in this process, of boxes, after every addition and removal.
"""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import trimesh

from pipeline.clutter.settled import CLUTTERS_FILE
from pipeline.execution import Isolation, RunFolder
from pipeline.execution.staleness import stage_context
from pipeline.geometry.settled import SETTLED_FILE
from stages import objects, scenes
from stages.graph import OBJECTS, SCENES, inputs_of

CONFIG = """
seed = 3
[objects.convex]
input_faces = 200
[scenes]
levels = [1]
objects_per_clutter = 2
[scenes.clutters_per_level]
train = {clutters}
[cameras]
renderer = "embree"
[cameras.static]
width_px = 64
height_px = 64
[cameras.wrist]
viewpoints = 1
width_px = 96
height_px = 72
"""
MADE = ("objects", "scenes")


class InThisProcess(Isolation):
    """Objects are worked on without processes of their own: boxes need no bounds."""

    def run_in_order(self, job: Callable[[Any], Any], items: Any) -> Iterator[Any]:
        return map(job, items)


class Grown:
    """A run over a folder of meshes of its own."""

    def __init__(self, path: Path) -> None:
        self.folder, self.meshes = RunFolder(path / "runs" / "grown"), path / "meshes"
        self.clutters = 1
        self.folder.path.mkdir(parents=True)
        self.meshes.mkdir()

    def add(self, box: int) -> None:
        shape = trimesh.creation.box(extents=(0.1, 0.06 + 0.011 * box, 0.05))
        shape.export(self.meshes / f"box_{box}.ply")

    def remove(self, box: int) -> None:
        (self.meshes / f"box_{box}.ply").unlink()

    def make(self) -> dict[str, dict[str, Any]]:
        """All stages; the figures of each."""
        self.folder.config.write_text(CONFIG.format(clutters=self.clutters))
        return {
            stage.name: build(stage_context(stage, self.folder, inputs_of, self.meshes, workers=1))
            for stage, build in ((OBJECTS, objects.build), (SCENES, scenes.build))
        }

    @property
    def settled(self) -> str:
        """What is written down."""
        files = (self.folder.state(name) for name in (SETTLED_FILE, CLUTTERS_FILE))
        return "".join(file.read_text() for file in files if file.is_file())

    def artifacts(self) -> dict[str, bytes]:
        """The bytes of all that is made."""
        return {name: self.folder.artifact(name).read_bytes() for name in MADE}

    def made_at_once(self, path: Path) -> "Grown":
        """The same meshes, configuration and settled decisions, made in a run of their own."""
        other = Grown(path)
        other.clutters = self.clutters
        shutil.copytree(self.meshes, other.meshes, dirs_exist_ok=True)
        other.folder.state("").mkdir()
        for name in (SETTLED_FILE, CLUTTERS_FILE):
            shutil.copy(self.folder.state(name), other.folder.state(name))
        other.make()
        return other


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(objects, "Isolation", InThisProcess)


@pytest.fixture(scope="module")
def splits(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What a run of all seven boxes settles about objects."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(objects, "Isolation", InThisProcess)
        grown = Grown(tmp_path_factory.mktemp("all"))
        for box in range(7):
            grown.add(box)
        grown.folder.config.write_text(CONFIG.format(clutters=1))
        objects.build(stage_context(OBJECTS, grown.folder, inputs_of, grown.meshes, workers=1))
    return grown.folder.state(SETTLED_FILE).read_text()


@pytest.fixture
def grown(tmp_path: Path, splits: str) -> Grown:
    """A run whose boxes have their splits, whenever they come: the first six are there."""
    run = Grown(tmp_path / "grown")
    run.folder.state("").mkdir()
    run.folder.state(SETTLED_FILE).write_text(splits)
    for box in range(6):
        run.add(box)
    return run


def told(figures: dict[str, dict[str, Any]]) -> list[tuple[int, int]]:
    """How many of each stage's items were taken over, and how many were made."""
    return [(stage["taken_over"], stage["made"]) for stage in figures.values()]


def test_only_what_is_new_is_made(grown: Grown, tmp_path: Path) -> None:
    assert told(grown.make()) == [(0, 6), (0, 3)]
    grown.add(6)
    assert told(grown.make()) == [(6, 1), (3, 0)]
    grown.clutters = 2
    assert told(grown.make()) == [(7, 0), (3, 1)]
    assert grown.artifacts() == grown.made_at_once(tmp_path / "once").artifacts()
