"""A clutter is built again of the objects that it was built of first, whatever others there are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from pipeline.clutter.building import build_clutter
from pipeline.clutter.settled import (
    SettledClutters,
    generator_at,
    read_settled_clutters,
    settled_by,
    standing,
)
from pipeline.config import ScenesConfig
from pipeline.errors import ConfigError
from pipeline.geometry.catalogue import CatalogueObject
from tests.bodies import catalogue_object

CONFIG = ScenesConfig(objects_per_clutter=3)


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> list[CatalogueObject]:
    cache = tmp_path_factory.mktemp("parts")
    sides = (0.03, 0.04, 0.05, 0.06, 0.07)
    shapes = [trimesh.creation.box(extents=(0.08, side, 0.04)) for side in sides]
    items = [catalogue_object(f"box-{n}", shape, cache) for n, shape in enumerate(shapes)]
    return [replace(item, key=f"key-{item.name}") for item in items]


@given(st.integers(0, 2**63 - 1), st.lists(st.integers(1, 9), max_size=5))
def test_a_generator_goes_on_from_where_it_stood(seed: int, drawn: list[int]) -> None:
    rng = np.random.Generator(np.random.PCG64(seed))
    for count in drawn:
        rng.permutation(count)
    again = generator_at(seed, standing(rng))
    assert again.permutation(50).tolist() == rng.permutation(50).tolist()
    assert again.uniform() == rng.uniform()


@pytest.mark.parametrize("level", [1, 3])
def test_other_objects_do_not_change_a_clutter_that_was_built(
    level: int, pool: list[CatalogueObject]
) -> None:
    first = build_clutter("s", level, "train", pool[:4], CONFIG, seed=7)
    known = settled_by(first, {item.name: item.key for item in pool})
    members = [item for item in pool if item.key in known.members]
    for others in (pool, members):  # more of them, and none
        again = build_clutter("s", level, "train", others, CONFIG, 7, known)
        assert [p.object_name for p in again.objects] == [p.object_name for p in first.objects]
        for one, two in zip(again.objects, first.objects, strict=True):
            assert one.world_from_object.tobytes() == two.world_from_object.tobytes()
        assert again.generator == first.generator


def test_it_stands_while_all_its_members_are_there(
    tmp_path: Path, pool: list[CatalogueObject]
) -> None:
    scene = build_clutter("s", 1, "train", pool, CONFIG, seed=7)
    known = settled_by(scene, {item.name: item.key for item in pool})
    path = tmp_path / "settled.json"
    path.write_text(SettledClutters("basis").with_clutters({"s": known}).to_json())
    settled = read_settled_clutters(path, "basis")
    assert settled.stands("s", 7, pool) == known
    gone = [item for item in pool if item.key != known.members[0]]
    changed = [replace(i, key="other") if i.key == known.members[0] else i for i in pool]
    for seed, there in ((8, pool), (7, gone), (7, changed)):
        assert settled.stands("s", seed, there) is None
    assert settled.stands("t", 7, pool) is None
    assert read_settled_clutters(path, "another").clutters == {}


@pytest.mark.parametrize("text", ["{", "[]", '{"basis": "b", "clutters": {"s": {}}}'])
def test_a_damaged_file_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "settled.json"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"settled\.json is damaged .* drawn anew"):
        read_settled_clutters(path, "b")


@pytest.mark.parametrize("stood", ["", "1:2", "x:0:0", f"{2**130:x}:0:0"])
def test_a_generator_of_no_state_is_refused(stood: str) -> None:
    with pytest.raises(ConfigError, match="is of no generator"):
        generator_at(1, stood)
