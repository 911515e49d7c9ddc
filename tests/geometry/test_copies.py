"""Files of one surface are one object; which of them stands for it depends on no order."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.config import ObjectsConfig, SplitConfig
from pipeline.geometry.catalogue import MeasuredObject, measure_object
from pipeline.geometry.copies import find_copies
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.plan import Plan, plan_catalogue
from pipeline.geometry.settled import Settled
from tests.bodies import mesh_of

RMS = ObjectsConfig().copies_rms


def measured(
    label: str, shape: trimesh.Trimesh, scale: float = 1.0, turn: int = 0
) -> MeasuredObject:
    shape.merge_vertices()
    mesh = mesh_of(shape)
    rotation = Rotation.random(rng=np.random.default_rng(turn)).as_matrix() if turn else np.eye(3)
    mesh = Mesh(scale * (mesh.vertices_m @ rotation.T + 0.3 * turn), mesh.faces)
    source = MeshSource(label, label, f"digest of {label}", mesh, "m", "declared")
    return measure_object(source, ObjectsConfig())


def box(*extents: float) -> trimesh.Trimesh:
    return trimesh.creation.box(extents)


FINE = box(0.1, 0.07, 0.04).subdivide_to_size(0.02)
ITEMS = [
    measured("b/mesh.ply", box(0.1, 0.07, 0.04)),
    measured("b/mesh.stl", box(0.1, 0.07, 0.04), turn=1),
    measured("b/inches.obj", box(0.1, 0.07, 0.04), 1 / 0.0254, turn=2),
    measured("b/z_fine.obj", FINE, 1000, turn=3),
    measured("other.ply", box(0.1, 0.07, 0.042)),
    measured("larger.ply", box(0.12, 0.084, 0.048)),
    measured("ball.ply", trimesh.creation.icosphere(3, 0.04)),
    measured("ball_cm.ply", trimesh.creation.icosphere(4, 4.0)),
    measured("ball_of_another_size.ply", trimesh.creation.icosphere(3, 0.05)),
]
FOUND = {
    "b/z_fine.obj": ("b/inches.obj", "b/mesh.ply", "b/mesh.stl"),
    "ball_cm.ply": ("ball.ply",),
}


@settings(deadline=None, max_examples=8)
@given(st.permutations(ITEMS))
def test_copies_are_found_in_any_order(items: list[MeasuredObject]) -> None:
    assert find_copies(items, (), RMS) == FOUND


def test_the_finest_that_needed_no_repair_stands_then_the_first_by_path() -> None:
    mended = [replace(ITEMS[3], repairs=("closed 1 hole(s)",)), *ITEMS[:3]]
    assert set(find_copies(mended, (), RMS)) == {"b/inches.obj"}


def test_what_stood_for_an_object_stands_again() -> None:
    assert set(find_copies(ITEMS[:4], {"b/mesh.stl"}, RMS)) == {"b/mesh.stl"}


def test_a_hollow_object_is_another_than_a_solid_one() -> None:
    inner = box(0.05, 0.05, 0.03)
    inner.invert()
    hollow = trimesh.util.concatenate([box(0.1, 0.07, 0.04), inner])
    items = [ITEMS[0], measured("hollow.ply", hollow), measured("hollow.stl", hollow, 1000, 4)]
    assert find_copies(items, (), RMS) == {"hollow.ply": ("hollow.stl",)}


def test_a_threshold_of_nothing_joins_equal_bytes_alone() -> None:
    same = replace(ITEMS[0], source=replace(ITEMS[0].source, label="again.ply"))
    assert find_copies([*ITEMS[:3], same], (), 0.0) == {"again.ply": ("b/mesh.ply",)}


def plan(
    items: list[MeasuredObject],
    settled: Settled | None = None,
    config: ObjectsConfig | None = None,
    seed: int = 3,
) -> Plan:
    """With families of copies alone."""
    configs = (config or ObjectsConfig(), SplitConfig(family_threshold=0.0))
    return plan_catalogue(items, frozenset(), (), configs, seed, settled or Settled("x"))


def test_copies_are_left_out_and_listed() -> None:
    made = plan(ITEMS)
    assert len(made.taken) == 5
    assert made.copies == {
        "b_z_fine": ("b/inches.obj", "b/mesh.ply", "b/mesh.stl"),
        "ball_cm": ("ball.ply",),
    }
    assert "b_mesh" not in made.split


@pytest.mark.parametrize("seed", range(3))
def test_all_copies_may_be_objects_of_one_family(seed: int) -> None:
    made = plan(ITEMS, config=ObjectsConfig(copies="all"), seed=seed)
    assert len(made.taken) == len(ITEMS)
    assert not made.copies
    box_files = {name for name in made.split if name.startswith("b_")}
    assert len(box_files) == 4
    assert len({made.split[name] for name in box_files}) == 1
    assert {made.families.of[name] for name in box_files} == {min(box_files)}


def test_name_and_split_stay_when_a_finer_copy_comes_and_when_the_first_goes() -> None:
    first = plan(ITEMS[:3] + ITEMS[4:])
    second = plan(ITEMS, first.settled)
    assert "b_inches" in first.split
    assert second.split == first.split
    assert second.copies["b_inches"] == ("b/mesh.ply", "b/mesh.stl", "b/z_fine.obj")
    third = plan([*ITEMS[:2], *ITEMS[3:]], second.settled)
    assert third.split["b_z_fine"] == first.split["b_inches"]
