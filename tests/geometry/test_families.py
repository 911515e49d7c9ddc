"""Near-copies and declared kin are one family; what would join two splits is left out by name."""

from pathlib import Path

import pytest
import trimesh

from pipeline.config import ObjectsConfig, SplitConfig
from pipeline.errors import ConfigError
from pipeline.geometry.catalogue import MeasuredObject, measure_object
from pipeline.geometry.families import DeclaredFamily, group, read_declared
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.settled import Settled, read_settled
from pipeline.geometry.splits import split_objects
from tests.bodies import mesh_of

THRESHOLD = SplitConfig().family_threshold


def measured(name: str, shape: trimesh.Trimesh) -> MeasuredObject:
    source = MeshSource(name, f"{name}.ply", f"digest of {name}", mesh_of(shape), "m", "declared")
    return measure_object(source, ObjectsConfig())


BALL = measured("ball", trimesh.creation.icosphere(subdivisions=3))
SMALL_BALL = measured("small_ball", trimesh.creation.icosphere(subdivisions=4, radius=0.02))
CUBE = measured("cube", trimesh.creation.box())
PLATE = measured("plate", trimesh.creation.cylinder(radius=1.0, height=0.1))
ROD = measured("rod", trimesh.creation.cylinder(radius=0.05, height=1.0))
ALL = {item.source.name: item.descriptor for item in (BALL, SMALL_BALL, CUBE, PLATE, ROD)}


def test_shapes_that_are_alike_are_one_family() -> None:
    families = group(ALL, (), THRESHOLD, {})
    assert families.of == {
        "ball": "ball", "small_ball": "ball", "cube": "cube", "plate": "plate", "rod": "rod",
    }  # fmt: skip
    assert not families.joining


def test_what_a_person_declares_is_one_family_under_its_name() -> None:
    declared = (DeclaredFamily("turned", ("pl*", "rod")), DeclaredFamily("others", ("no_such",)))
    families = group(ALL, declared, THRESHOLD, {})
    assert families.of["plate"] == families.of["rod"] == "turned"
    assert families.of["cube"] == "cube"


def test_a_new_object_that_would_join_two_splits_is_left_out_by_name() -> None:
    declared = (DeclaredFamily("a", ("plate", "rod")), DeclaredFamily("b", ("rod", "cube")))
    families = group(ALL, declared, THRESHOLD, {"cube": "test", "plate": "train"})
    assert set(families.joining) == {"rod"}
    why = families.joining["rod"].what
    assert "cube (test)" in why
    assert "plate (train)" in why
    assert "rod" not in families.of


def test_settled_objects_of_two_splits_cannot_become_one_family() -> None:
    declared = (DeclaredFamily("a", ("plate", "rod")),)
    with pytest.raises(ConfigError, match=r"plate \(train\)|rod \(test\)"):
        group(ALL, declared, THRESHOLD, {"rod": "test", "plate": "train"})


def test_families_are_read_from_a_file_and_anything_else_is_named(tmp_path: Path) -> None:
    path = tmp_path / "families.toml"
    path.write_text('"toy bricks" = ["073-*", "brick"]\n', encoding="utf-8")
    assert read_declared(path) == (DeclaredFamily("toy bricks", ("073-*", "brick")),)
    for text, reason in (("a = ", "as TOML"), ("a = 3", "no|not a list"), ("[a]\nb = 1", "'a'")):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ConfigError, match=reason):
            read_declared(path)


def test_splits_stay_when_an_object_is_added_or_renamed() -> None:
    items = [BALL, CUBE, PLATE, ROD]
    split, _ = split_objects(items, (), (), SplitConfig(), 3, Settled("x"))
    settled = Settled("x").with_splits({i.content: split[i.source.name] for i in items})
    for seed in range(10):
        again, families = split_objects([*items, SMALL_BALL], (), (), SplitConfig(), seed, settled)
        assert {name: again[name] for name in split} == split
        assert again["small_ball"] == split["ball"]
        assert not families.joining


def test_a_mesh_like_an_embedded_object_is_trained_on_beside_it() -> None:
    for seed in range(10):
        split, _ = split_objects(
            [BALL, SMALL_BALL, CUBE, PLATE, ROD], {"ball"}, (), SplitConfig(), seed, Settled("x")
        )
        assert split["small_ball"] == split["ball"] == "train"


def test_what_is_settled_is_kept_by_content_and_forgotten_on_other_grounds(tmp_path: Path) -> None:
    path = tmp_path / "settled.json"
    assert read_settled(path, "x") == Settled("x")
    path.write_text(Settled("x").with_splits({"b": "test", "a": "train"}).to_json())
    assert read_settled(path, "x").splits == {"a": "train", "b": "test"}
    assert read_settled(path, "x").with_splits({"a": "val", "c": "val"}).splits["a"] == "train"
    assert read_settled(path, "y") == Settled("y")
    path.write_text("[1]")
    with pytest.raises(ConfigError, match="damaged"):
        read_settled(path, "x")


def test_where_nothing_is_trained_every_object_is_for_test() -> None:
    config = SplitConfig(all_in_test=True)
    for items in ([CUBE], [BALL, SMALL_BALL, CUBE, PLATE, ROD]):
        split, families = split_objects(items, (), (), config, 0, Settled("x"))
        assert split == {item.source.name: "test" for item in items}
        assert not families.joining


def test_where_meshes_are_held_out_none_is_trained_on_and_families_stay_whole() -> None:
    config = SplitConfig(meshes_in_training=False)
    for seed in range(10):
        split, families = split_objects(
            [BALL, SMALL_BALL, CUBE, PLATE, ROD], (), (), config, seed, Settled("x")
        )
        assert set(split) == {"ball", "small_ball", "cube", "plate", "rod"}
        assert set(split.values()) <= {"val", "test"}
        assert split["ball"] == split["small_ball"]
        assert not families.joining
