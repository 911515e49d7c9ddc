"""Which objects a catalogue takes: meshes, embedded objects, and both."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from rerun.chunk import RrdReader

from pipeline.errors import ConfigError, MeshError
from pipeline.execution import Allowance, Isolation, RunFolder, StageContext
from pipeline.execution.left_out import LeftOut
from pipeline.execution.staleness import stage_context
from pipeline.geometry import intake
from pipeline.geometry.catalogue import prepare_object
from pipeline.geometry.parametric import PARAMETRIC_OBJECTS
from pipeline.geometry.plan import plan_catalogue
from pipeline.geometry.random_solids.catalogued import solids_for_training
from pipeline.geometry.settled import Settled
from pipeline.messages.objects import read_objects
from pipeline.recording.objects import draw_objects
from stages import objects
from stages.graph import OBJECTS, inputs_of

BESIDE = """
[objects]
limit = 6
embedded_in_training = true
[objects.convex]
input_faces = 200
"""


@pytest.fixture
def mesh_dir(tmp_path: Path) -> Path:
    folder = tmp_path / "meshes"
    folder.mkdir()
    for number in range(7):
        shape = trimesh.creation.box(extents=(0.1, 0.08 + 0.01 * number, 0.05))
        shape.export(folder / f"box_{number}.ply")
    return folder


def context(tmp_path: Path, mesh_dir: Path | None, config: str) -> StageContext:
    folder = RunFolder(tmp_path / "runs" / "one")
    folder.path.mkdir(parents=True)
    folder.config.write_text(config)
    return stage_context(OBJECTS, folder, inputs_of, mesh_dir, workers=1)


def test_embedded_objects_stand_beside_meshes_in_training_alone(
    tmp_path: Path, mesh_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = dict(sorted(PARAMETRIC_OBJECTS.items())[:3])
    monkeypatch.setattr(intake, "PARAMETRIC_OBJECTS", few)
    stage = context(tmp_path, mesh_dir, BESIDE)
    made = objects.build(stage)
    split = {name: where for name, (_, where) in read_objects(stage.output).items()}
    assert {name for name in split if name in few} == set(few)
    assert {split[name] for name in few} == {"train"}
    boxes = [where for name, where in split.items() if name.startswith("box_")]
    assert len(boxes) == 6  # the limit is on meshes
    assert set(boxes) == {"train", "val", "test"}
    assert made["objects"] == 9


def test_training_objects_alone_are_stretched_into_further_shapes(
    tmp_path: Path, mesh_dir: Path
) -> None:
    config = "[objects]\nstretched_copies = 2\n[objects.convex]\ninput_faces = 200\n"
    stage = context(tmp_path, mesh_dir, config)
    made = objects.build(stage)
    found = read_objects(stage.output)
    training = [name for name, (_, where) in found.items() if where == "train"]
    copies = [name for name in training if "-stretched-" in name]
    originals = set(training) - set(copies)
    assert sorted(copies) == sorted(f"{n}-stretched-{k}" for n in originals for k in (1, 2))
    assert len(found) == 7 + len(copies) == made["objects"]
    assert not any("-stretched-" in n for n, (_, where) in found.items() if where != "train")
    assert len({tuple(found[name][0].mesh.extents_m) for name in training}) == len(training)


def test_random_solids_are_for_training_and_each_is_a_family_of_its_own(
    tmp_path: Path, mesh_dir: Path
) -> None:
    config = "[objects]\nlimit = 3\nrandom_solids = 1\nstretched_copies = 1\n"
    stage = context(tmp_path, mesh_dir, config + "[objects.convex]\ninput_faces = 200\n")
    made = objects.build(stage)
    found = read_objects(stage.output)
    solids = {name: found[name] for name in found if name.startswith("random-solid-")}
    assert set(solids) == {"random-solid-0001", "random-solid-0001-stretched-1"}
    assert made["solids_near_held_out"] == {}
    assert {where for _, where in solids.values()} == {"train"}
    assert solids["random-solid-0001-stretched-1"][0].family == "random-solid-0001"
    bounds = stage.config.objects
    for item, _ in solids.values():
        assert item.mesh.extents_m.max() >= bounds.target_extent_min_m * (1 - 1e-9)
        assert item.mesh.extents_m.max() <= bounds.target_extent_max_m * (1 + 1e-9)


def test_a_solid_like_a_held_out_object_is_left_out_and_one_like_a_training_object_joins_it(
    tmp_path: Path, mesh_dir: Path
) -> None:
    stage = context(tmp_path, mesh_dir, "[objects.convex]\ninput_faces = 200\n")
    configs = (stage.config.objects, stage.config.split)
    with Isolation(1, Allowance(60, 1024)) as apart:
        measured = objects.measure(stage, objects.sources(stage)[0], apart, LeftOut())
    plan = plan_catalogue(measured, frozenset(), (), configs, 0, Settled(""))
    shape = prepare_object(measured[0].source, configs[0], np.random.default_rng(0), tmp_path)
    of = {where: name for name, where in plan.split.items()}
    solids = [replace(shape, name=w, mesh=plan.measured[n].mesh) for w, n in of.items()]
    kept, near = solids_for_training(solids, plan, 1e-3)
    assert [item.name for item in kept] == ["train"]
    assert kept[0].family == plan.families.of[of["train"]]
    assert near == {"val": of["val"], "test": of["test"]}


def test_a_mesh_of_a_copys_name_is_an_error(tmp_path: Path, mesh_dir: Path) -> None:
    for number in range(7):
        (mesh_dir / f"box_{number}.ply").rename(mesh_dir / f"box{'-stretched-1' * number}.ply")
    config = "[objects]\nstretched_copies = 1\n[objects.convex]\ninput_faces = 200\n"
    with pytest.raises(MeshError, match=r"is named box.*-stretched-1, as a stretched copy would"):
        objects.build(context(tmp_path, mesh_dir, config))


def test_no_family_stands_in_two_splits_and_splits_stay(tmp_path: Path, mesh_dir: Path) -> None:
    """Balls of any size are one family, two boxes are declared one; then meshes are added."""
    for number in range(3):
        ball = trimesh.creation.icosphere(subdivisions=3, radius=0.03 + 0.01 * number)
        ball.export(mesh_dir / f"ball_{number}.ply")
    (mesh_dir / "families.toml").write_text('pair = ["box_0", "box_3"]\n')
    config = "[objects]\nstretched_copies = 1\n[objects.convex]\ninput_faces = 200\n"
    stage = context(tmp_path, mesh_dir, config)
    objects.build(stage)
    first = read_objects(stage.output)
    families: dict[str, set[str]] = {}
    for item, where in first.values():
        families.setdefault(item.family, set()).add(where)
    assert all(len(places) == 1 for places in families.values()), families
    assert first["box_0"][0].family == first["box_3"][0].family == "pair"
    assert len({first[f"ball_{k}"][0].family for k in range(3)}) == 1
    trimesh.creation.capsule(0.1, 0.02).export(mesh_dir / "a_capsule.ply")
    trimesh.creation.icosphere(subdivisions=2, radius=0.05).export(mesh_dir / "ball_9.ply")
    again = stage_context(OBJECTS, stage.folder, inputs_of, mesh_dir, workers=1)
    objects.build(again)
    second = read_objects(again.output)
    originals = {name for name in first if "stretched" not in name}
    assert {name: second[name][1] for name in originals} == {n: first[n][1] for n in originals}
    assert second["ball_9"][1] == second["ball_0"][1]
    for name in originals:
        assert second[name][0].mesh.vertices_m.tobytes() == first[name][0].mesh.vertices_m.tobytes()


def test_names_in_any_script_stay_through_files_recordings_and_added_meshes(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "meshes"
    folder.mkdir()
    for height, name in ((0.03, "звезда"), (0.04, "杯子"), (0.05, "カップ")):
        trimesh.creation.box((0.1, 0.05, height)).export(folder / f"{name}.ply")
    config = '[objects]\ntransparent = ["杯*"]\n[objects.convex]\ninput_faces = 200\n'
    stage = context(tmp_path, folder, config)
    figures = objects.build(stage)
    first = {name: item for name, (item, _) in read_objects(stage.output).items()}
    assert set(first) == {"звезда", "杯子", "カップ"} == set(figures["nsvr"])
    assert figures["transparent"] == ["杯子"]
    draw_objects(stage, figures)
    chunks = RrdReader(str(stage.recording)).stream()
    drawn = {str(chunk.entity_path) for chunk in chunks}
    assert {f"/world/catalogue/{name}" for name in first} <= drawn
    for width, added in enumerate(("object", "аист", "Звезда_2", "звезда 2")):
        trimesh.creation.box((0.1, 0.06 + 0.01 * width, 0.02)).export(folder / f"{added}.ply")
    again = stage_context(OBJECTS, stage.folder, inputs_of, folder, workers=1)
    objects.build(again)
    second = {name: item for name, (item, _) in read_objects(again.output).items()}
    assert len(second) == 7
    for name, item in first.items():
        assert second[name].source == item.source
        assert second[name].mesh.vertices_m.tobytes() == item.mesh.vertices_m.tobytes()


def test_objects_weigh_what_a_file_says_and_keep_their_density(
    tmp_path: Path, mesh_dir: Path
) -> None:
    (mesh_dir / "masses.toml").write_text('"box_0" = 0.5\n"box_[12]" = 9.0\n')
    stage = context(tmp_path, mesh_dir, "[objects]\n[objects.convex]\ninput_faces = 200\n")
    objects.build(stage)
    found = {name: item for name, (item, _) in read_objects(stage.output).items()}
    assert found["box_0"].mass_kg == pytest.approx(0.5 * found["box_0"].scale ** 3)
    assert found["box_1"].mass_kg == pytest.approx(9.0 * found["box_1"].scale ** 3)
    drawn = [found[f"box_{number}"].density_kg_m3 for number in range(3, 7)]
    assert len(set(drawn)) == len(drawn)
    assert all(150 <= density <= 600 for density in drawn)
    with pytest.raises(ConfigError, match=r"mine\.toml is missing, and objects\.masses names it"):
        context(tmp_path / "other", mesh_dir, '[objects]\nmasses = "mine.toml"\n')


def test_files_of_one_object_are_one_and_the_others_are_listed(tmp_path: Path) -> None:
    """As YCB is downloaded: each object in three files."""
    folder = tmp_path / "meshes"
    for number in range(3):
        solid = trimesh.creation.box((0.1, 0.05 + 0.02 * number, 0.03))
        (folder / f"obj{number}").mkdir(parents=True)
        for file in ("nontextured.ply", "nontextured.stl", "textured.obj"):
            solid.export(folder / f"obj{number}" / file)
    stage = context(tmp_path, folder, "[objects.convex]\ninput_faces = 200\n")
    figures = objects.build(stage)
    found = read_objects(stage.output)
    assert set(found) == {f"obj{number}_nontextured" for number in range(3)}
    for number in range(3):
        item, _ = found[f"obj{number}_nontextured"]
        assert item.source == f"obj{number}/nontextured.ply"
        others = [f"obj{number}/nontextured.stl", f"obj{number}/textured.obj"]
        assert list(item.copies) == figures["copies"][item.name] == others
    stage.folder.config.write_text('[objects]\ncopies = "all"\n')
    again = stage_context(OBJECTS, stage.folder, inputs_of, folder, workers=1)
    objects.build(again)
    every = read_objects(again.output)
    assert len(every) == 9
    families: dict[str, set[str]] = {}
    for item, where in every.values():
        families.setdefault(item.family, set()).add(where)
        assert where == found[f"{item.source[:4]}_nontextured"][1]
    assert all(len(splits) == 1 for splits in families.values())


def test_families_are_declared_in_a_file_that_run_toml_names(
    tmp_path: Path, mesh_dir: Path
) -> None:
    with pytest.raises(ConfigError, match=r"mine\.toml is missing, and split\.families names it"):
        context(tmp_path, mesh_dir, '[split]\nfamilies = "mine.toml"\n')
    (tmp_path / "runs" / "one" / "mine.toml").write_text('boxes = ["box_*"]')
    (mesh_dir / "families.toml").write_text("not TOML")
    folder = RunFolder(tmp_path / "runs" / "one")
    stage = stage_context(OBJECTS, folder, inputs_of, mesh_dir, workers=1)
    (family,) = objects.declared_families(stage)
    assert family.name == "boxes"


def test_a_run_takes_meshes_or_embedded_objects_unless_told_otherwise(
    tmp_path: Path, mesh_dir: Path
) -> None:
    jobs, added = objects.sources(context(tmp_path / "a", mesh_dir, ""))
    assert sorted(job.label for job in jobs) == [f"box_{number}.ply" for number in range(7)]
    assert not added
    jobs, added = objects.sources(context(tmp_path / "b", None, BESIDE))
    assert {job.label for job in jobs} == set(PARAMETRIC_OBJECTS)
    assert not added


def test_a_mesh_of_an_embedded_objects_name_is_an_error(tmp_path: Path, mesh_dir: Path) -> None:
    taken = next(iter(PARAMETRIC_OBJECTS))
    (mesh_dir / "box_0.ply").rename(mesh_dir / f"{taken}.ply")
    with pytest.raises(MeshError, match=rf"{taken}\.ply has the name of an embedded object"):
        objects.sources(context(tmp_path, mesh_dir, BESIDE))
