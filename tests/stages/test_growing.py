"""A dataset grows and shrinks: what is there is taken over, and the bytes are those of one making.

Objects, scenes and grasps are made in this process, of boxes, after every addition and removal.
"""

import json
import random
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import trimesh

from pipeline.clutter.settled import CLUTTERS_FILE
from pipeline.execution import Isolation, RunFolder, StageContext
from pipeline.execution.staleness import stage_context
from pipeline.geometry.settled import SETTLED_FILE
from pipeline.housekeeping.kept import taken_over
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_placements
from stages import grasps, objects, scenes
from stages.graph import GRASPS, MADE, OBJECTS, SCENES, inputs_of

CONFIG = """
seed = 3
[objects.convex]
input_faces = 200
[scenes]
levels = [1]
objects_per_clutter = 2
[scenes.clutters_per_level]
train = {clutters}
[grasps]
per_scene = 12
portions = {portions}
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
STAGES = ((OBJECTS, objects.build), (SCENES, scenes.build), (GRASPS, grasps.build))
BOXES = range(7)


class InThisProcess(Isolation):
    """Objects are worked on without processes of their own: boxes need no bounds."""

    def run_in_order(self, job: Callable[[Any], Any], items: Any) -> Iterator[Any]:
        return map(job, items)


class Grown:
    """A run over a folder of meshes of its own."""

    def __init__(self, path: Path, settled: str = "") -> None:
        self.folder, self.meshes = RunFolder(path / "runs" / "grown"), path / "meshes"
        self.clutters, self.portions = 1, 1
        self.folder.state("").mkdir(parents=True)
        self.meshes.mkdir()
        if settled:
            self.folder.state(SETTLED_FILE).write_text(settled)

    def add(self, *boxes: int) -> None:
        for box in boxes:
            shape = trimesh.creation.box(extents=(0.1, 0.06 + 0.011 * box, 0.05))
            shape.export(self.meshes / f"box_{box}.ply")

    def remove(self, box: int) -> None:
        (self.meshes / f"box_{box}.ply").unlink()

    def make(self, stages: int = 3) -> list[tuple[int, int]]:
        """The first stages; how many items of each were taken over, and how many were made."""
        self.configure()
        told = []
        for stage, build in STAGES[:stages]:
            figures = build(self.context(stage.name))
            told.append((figures["taken_over"], figures["made"]))
            summary = figures | {"stage": stage.name, "wall_time_s": 1.0}
            self.folder.summary(stage.name).write_text(json.dumps(summary))
        return told

    def configure(self) -> None:
        config = CONFIG.format(clutters=self.clutters, portions=self.portions)
        self.folder.config.write_text(config)

    def context(self, stage: str) -> StageContext:
        return stage_context(MADE[stage], self.folder, inputs_of, self.meshes, workers=1)

    def planned(self) -> list[float]:
        """What a plan says that will be taken over of each stage."""
        self.configure()
        return [taken_over(stage.name, self.context, 1e6) for stage, _ in STAGES]

    def files(self) -> dict[str, bytes]:
        """All that is made: name → bytes."""
        found = sorted(self.folder.path.rglob("*.mcap"))
        return {path.relative_to(self.folder.path).as_posix(): path.read_bytes() for path in found}

    def files_made_at_once(self, path: Path) -> dict[str, bytes]:
        """Those of a run of the same meshes, configuration and decisions that never grew."""
        other = Grown(path)
        other.clutters, other.portions = self.clutters, self.portions
        shutil.copytree(self.meshes, other.meshes, dirs_exist_ok=True)
        for name in (SETTLED_FILE, CLUTTERS_FILE):
            shutil.copy(self.folder.state(name), other.folder.state(name))
        assert all(taken_over == 0 for taken_over, _ in other.make())
        return other.files()


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(objects, "Isolation", InThisProcess)


@pytest.fixture(scope="module")
def all_boxes(tmp_path_factory: pytest.TempPathFactory) -> Grown:
    """A run's objects, all boxes at once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(objects, "Isolation", InThisProcess)
        run = Grown(tmp_path_factory.mktemp("all"))
        run.add(*BOXES)
        run.make(stages=1)
    return run


@pytest.fixture(scope="module")
def splits(all_boxes: Grown) -> str:
    """What is settled about them: their splits are fixed before they come."""
    return all_boxes.folder.state(SETTLED_FILE).read_text()


@pytest.fixture(scope="module")
def first(all_boxes: Grown) -> list[int]:
    """Two boxes of each split, or the one there is."""
    found = read_objects(all_boxes.folder.artifact("objects"))
    of = {s: [b for b in BOXES if found[f"box_{b}"][1] == s] for s in ("train", "val", "test")}
    return [box for boxes in of.values() for box in boxes[:2]]


def test_only_what_is_new_is_made(tmp_path: Path, splits: str, first: list[int]) -> None:
    run, new = Grown(tmp_path / "grown", splits), set(BOXES) - set(first)
    run.add(*first)
    assert run.make() == [(0, len(first)), (0, 3), (0, 3)]
    run.add(*new)
    assert run.planned() == [len(first), 3, 3 * 12]
    assert run.make() == [(len(first), len(new)), (3, 0), (3, 0)]
    run.clutters = 3
    run.portions = 2
    assert run.planned() == [7, 3, 3 * 12]
    assert run.make() == [(7, 0), (3, 2), (3, 7)]
    later = read_placements(run.folder.artifact("scenes"))
    placed = {one.object_name for scene in later.values() for one in scene}
    assert placed & {f"box_{box}" for box in new}
    files = run.files()
    assert files == run.files_made_at_once(tmp_path / "once")
    # A scene of whose file one byte is damaged is made anew, whatever became of the index.
    name = "scenes/level1-train-00.mcap"
    damaged = bytearray(files[name])
    damaged[len(damaged) // 2] ^= 1
    (run.folder.path / name).write_bytes(damaged)
    run.folder.artifact("scenes").unlink()
    run.clutters = 4
    assert run.make(stages=2) == [(7, 0), (4, 2)]
    run.clutters = 3
    assert run.make(stages=2) == [(7, 0), (5, 0)]
    assert run.files() == files


def test_what_is_removed_takes_its_scenes_along_alone(tmp_path: Path, splits: str) -> None:
    run = Grown(tmp_path / "grown", splits)
    run.add(*BOXES)
    run.clutters = 3
    run.make()
    before = read_placements(run.folder.artifact("scenes"))
    members = {n: {one.object_name for one in scene} for n, scene in before.items()}
    gone = next(iter(sorted(members["level1-train-00"])))
    holding = {scene for scene, names in members.items() if gone in names}
    assert 0 < len(holding) < len(before)
    run.remove(int(gone.removeprefix("box_")))
    kept, made = len(before) - len(holding), len(holding)
    assert run.planned()[1:] == [kept, kept * 12]
    assert run.make() == [(6, 0), (kept, made), (kept, made)]
    after = read_placements(run.folder.artifact("scenes"))
    for scene in after.keys() - holding:
        for one, two in zip(before[scene], after[scene], strict=True):
            assert one.world_from_object.tobytes() == two.world_from_object.tobytes()
    assert run.files() == run.files_made_at_once(tmp_path / "once")


def test_in_whatever_order_meshes_come_the_bytes_are_the_same(
    tmp_path: Path, splits: str, first: list[int]
) -> None:
    ends = []
    for seed in range(2):
        run, new = Grown(tmp_path / str(seed), splits), sorted(set(BOXES) - set(first))
        run.add(*first)
        run.make(stages=2)
        random.Random(seed).shuffle(new)
        for box in new:
            run.add(box)
            run.make(stages=1)
        run.clutters = 2
        run.make()
        ends.append(run.files())
    assert ends[0] == ends[1] == run.files_made_at_once(tmp_path / "once")


@pytest.mark.parametrize("seed", range(2))
def test_after_any_additions_and_removals_the_bytes_are_those_of_what_is_settled(
    tmp_path: Path, splits: str, first: list[int], seed: int
) -> None:
    run, rng = Grown(tmp_path / "grown", splits), random.Random(seed)
    run.add(*first)
    steps = [partial(run.add, box) for box in set(BOXES) - set(first)]
    steps += [partial(run.remove, first[0]), partial(setattr, run, "clutters", 3)]
    steps += [partial(setattr, run, "portions", 2)]
    rng.shuffle(steps)
    for step in (*steps, partial(run.add, first[0])):
        step()
        if rng.random() < 0.5:
            run.make()
    run.make()
    assert run.files() == run.files_made_at_once(tmp_path / "once")
