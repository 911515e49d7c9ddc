"""A mesh that a process is lost to, or that cannot be cut, is named; no other loses by it."""

from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import trimesh

from pipeline.artifacts import open_artifact
from pipeline.errors import MeshError
from pipeline.execution import Allowance, Isolation, Lost, RunFolder, StageContext
from pipeline.execution.left_out import LeftOut
from pipeline.execution.staleness import artifact_is_fresh, stage_context, why_stale
from pipeline.geometry.plan import plan_catalogue
from pipeline.geometry.settled import SETTLED_FILE, read_settled
from pipeline.messages.objects import read_objects
from schemas.softgrip.v1.objects_pb2 import CatalogueObject, RefusedMesh
from stages import objects
from stages.graph import OBJECTS, inputs_of

WORKERS = 1


@pytest.fixture
def mesh_dir(tmp_path: Path) -> Path:
    folder = tmp_path / "meshes"
    folder.mkdir()
    for number in range(7):
        shape = trimesh.creation.box(extents=(0.1, 0.08 + 0.01 * number, 0.05))
        shape.export(folder / f"box_{number}.ply")
    return folder


def context(tmp_path: Path, mesh_dir: Path, config: str) -> StageContext:
    folder = RunFolder(tmp_path / "runs" / "one")
    folder.path.mkdir(parents=True)
    folder.config.write_text(config)
    return stage_context(OBJECTS, folder, inputs_of, mesh_dir, WORKERS)


def too_large(mesh_dir: Path) -> None:
    """A ball whose faces take more memory than these tests allow."""
    trimesh.creation.icosphere(subdivisions=7, radius=0.05).export(mesh_dir / "ball.stl")


LITTLE_MEMORY = "[objects]\nmax_memory_mib = 64\n[objects.convex]\ninput_faces = 200\n"


def test_a_mesh_that_takes_all_memory_is_named_and_leaves_the_others_as_they_are(
    tmp_path: Path, mesh_dir: Path
) -> None:
    without = context(tmp_path / "without", mesh_dir, LITTLE_MEMORY)
    objects.build(without)
    assert artifact_is_fresh(without)
    too_large(mesh_dir)
    stage = context(tmp_path / "with", mesh_dir, LITTLE_MEMORY)
    made = objects.build(stage)
    (told,) = made["left_out"]
    assert told["source"] == "ball.stl"
    assert "ball.stl took more than 64 MiB of memory" in told["reason"]
    assert "tried again" in told["remedy"]
    assert messages(stage, CatalogueObject) == messages(without, CatalogueObject)
    assert [refused.source for refused in read_refused(stage)] == ["ball.stl"]
    assert not artifact_is_fresh(stage)
    assert why_stale(stage) == ["not finished, and tried again: ball.stl"]


def messages(stage: StageContext, kind: type[CatalogueObject]) -> list[bytes]:
    with open_artifact(stage.output) as artifact:
        return [message.SerializeToString() for _, message in artifact.messages(kind)]


def read_refused(stage: StageContext) -> list[RefusedMesh]:
    with open_artifact(stage.output) as artifact:
        return [message for _, message in artifact.messages(RefusedMesh)]


class Losing(Isolation):
    """Processes that lose the finishing of some objects, by name."""

    def __init__(self, names: set[str]) -> None:
        super().__init__(1, Allowance(60, 1024))
        self.names = names

    def run_in_order(self, job: Any, items: Iterable[Any]) -> Iterator[Any]:
        for item in items:
            name = item[0].source.name
            yield Lost("ended its process by SIGSEGV") if name in self.names else job(item)


def test_an_object_lost_while_it_is_cut_is_as_if_it_had_never_been_there(
    tmp_path: Path, mesh_dir: Path
) -> None:
    """With a limit, the next one takes its place; splits settled before stay."""
    limited = "[objects]\nlimit = 5\n[objects.convex]\ninput_faces = 200\n"
    stage = context(tmp_path / "all", mesh_dir, limited)
    objects.build(stage)
    before = {name: where for name, (_, where) in read_objects(stage.output).items()}
    lost = sorted(before)[1]
    with Isolation(1, Allowance(60, 1024)) as apart:
        measured = objects.measure(stage, objects.sources(stage)[0], apart, LeftOut())
    settled = read_settled(stage.folder.state(SETTLED_FILE), objects.settling_basis(stage))
    planned = partial(
        plan_catalogue,
        added=frozenset(),
        declared=(),
        configs=(stage.config.objects, stage.config.split),
        seed=stage.config.seed,
        settled=settled,
    )
    left_out = LeftOut()
    plan, made = objects.finish(stage, measured, planned, Losing({lost}), left_out, {})
    assert left_out.cut_short == [f"{lost}.ply"]
    assert len(made) == 5
    assert lost not in {item.name for item in made}
    same = [item for item in measured if item.origin != f"{lost}.ply"]
    assert plan.split == planned(same).split
    kept = before.keys() & plan.split.keys()
    assert len(kept) == 4
    assert {name: plan.split[name] for name in kept} == {name: before[name] for name in kept}


def test_no_object_left_is_an_error(tmp_path: Path, mesh_dir: Path) -> None:
    stage = context(tmp_path, mesh_dir, LITTLE_MEMORY)
    for number in range(7):
        (mesh_dir / f"box_{number}.ply").write_text("ply")
    with pytest.raises(MeshError, match="Not one mesh could be used"):
        objects.build(stage)
