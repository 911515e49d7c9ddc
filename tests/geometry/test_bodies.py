"""Parts of one mesh become one body: cavities and pegs stay, labels and specks go, recorded."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.catalogue import measure_object
from pipeline.geometry.convex_parts import convex_parts
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.repair import repair
from pipeline.geometry.shape import mass_properties, nsvr, solid_properties, surface_area, volume
from pipeline.geometry.topology import is_closed
from tests.bodies import mesh_of

CONFIG = ObjectsConfig()


def repaired(*parts: trimesh.Trimesh) -> tuple[Mesh, tuple[str, ...]]:
    whole = mesh_of(trimesh.util.concatenate(list(parts)))
    return repair("it.stl", whole, CONFIG.max_hole_fraction)


def cube(side: float, x: float = 0.0, inverted: bool = False) -> trimesh.Trimesh:
    box = trimesh.creation.box([side] * 3)
    box.apply_translation([x, 0, 0])
    if inverted:
        box.invert()
    return box


@pytest.mark.parametrize("inverted", [True, False], ids=["inward", "outward"])
def test_a_shell_inside_another_is_a_cavity_whichever_way_it_faces(inverted: bool) -> None:
    mesh, done = repaired(cube(0.1), cube(0.05, 0.02, inverted))
    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(1e-3 - 1.25e-4)
    assert nsvr(mesh) == pytest.approx(np.sqrt(0.06) / 0.1)
    solid = solid_properties(mesh, 300.0)
    assert solid["area_m2"] == pytest.approx(0.06)
    assert solid["mass_kg"] == pytest.approx(300 * (1e-3 - 1.25e-4))
    # The centre moves away from the cavity: by its moment over the mass that is left.
    assert solid["centre_of_mass_m"][0] == pytest.approx(-1.25e-4 * 0.02 / (1e-3 - 1.25e-4))
    own, missing = 1e-3 * 0.01 / 6, 1.25e-4 * (0.0025 / 6 + 0.02**2)
    shift = (1e-3 - 1.25e-4) * solid["centre_of_mass_m"][0] ** 2
    about_y = mass_properties(mesh, 1.0).inertia_kg_m2[1, 1]
    assert about_y == pytest.approx(own - missing - shift)
    assert any("cavit" in step for step in done)
    assert any("inside out" in step for step in done) is not inverted


def test_a_solid_inside_a_cavity_hangs_on_nothing() -> None:
    with pytest.raises(MeshError, match="2 bodies that do not touch"):
        repaired(cube(0.1), cube(0.08, inverted=True), cube(0.05))


def test_collision_shapes_know_no_cavity(tmp_path: Path) -> None:
    mesh, _ = repaired(cube(0.1), cube(0.05, inverted=True))
    (part,) = convex_parts(mesh, CONFIG.convex, tmp_path)
    assert volume(part) == pytest.approx(1e-3)


def test_a_part_that_touches_the_wall_from_inside_digs_no_hole() -> None:
    """A block flush with the side of the cube that holds it is no cavity."""
    mesh, done = repaired(cube(0.1), cube(0.05, 0.025))
    assert volume(mesh) == pytest.approx(1e-3)
    assert not any("cavit" in step for step in done)


def test_many_small_parts_of_a_body_stay() -> None:
    parts = [trimesh.creation.box([0.1, 0.1, 0.01])]
    for row in range(10):
        for column in range(10):
            peg = trimesh.creation.box([0.001, 0.001, 0.05])
            peg.apply_translation([-0.045 + row * 0.01, -0.045 + column * 0.01, 0.028])
            parts.append(peg)
    mesh, done = repaired(*parts)
    assert mesh.extents_m[2] == pytest.approx(0.058)
    assert volume(mesh) == pytest.approx(1e-4 + 100 * 1e-6 * 0.048)
    assert surface_area(mesh) == pytest.approx(0.024 + 100 * 4 * 0.001 * 0.048)
    assert done == ("united 101 parts",)


def test_specks_are_dropped_where_together_they_are_nothing() -> None:
    few = [cube(0.001, 0.2 + 0.01 * k) for k in range(5)]
    mesh, done = repaired(cube(0.1), *few)
    assert volume(mesh) == pytest.approx(1e-3)
    assert any("dropped 5 specks" in step for step in done)
    many = [cube(0.004, 0.2 + 0.01 * k) for k in range(50)]
    with pytest.raises(MeshError, match="51 bodies"):
        repaired(cube(0.1), *many)


def label(side: float, x: float) -> trimesh.Trimesh:
    """A square without thickness, facing x."""
    h = side / 2
    corners = [[x, -h, -h], [x, h, -h], [x, h, h], [x, -h, h]]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]])


def test_a_loose_sheet_beside_a_closed_body_is_left_off_and_recorded() -> None:
    mesh, done = repaired(cube(0.1), label(0.06, 0.051))
    assert volume(mesh) == pytest.approx(1e-3)
    assert surface_area(mesh) == pytest.approx(0.06)
    assert done == ("left off 1 loose sheet(s), 5.7% of the surface",)


def test_a_sheet_larger_than_a_mark_is_not_left_off() -> None:
    with pytest.raises(MeshError, match="open shell"):
        repaired(cube(0.1), label(0.3, 0.2))


@settings(deadline=None, max_examples=20)
@given(thickness=st.floats(1e-7, 0.01))
def test_what_is_too_thin_to_hold_is_refused_with_its_thickness(thickness: float) -> None:
    sheet = mesh_of(trimesh.creation.box([0.1, 0.07, thickness]))
    source = MeshSource("sheet", "sheet.ply", "digest", sheet, "m", "declared")
    config = ObjectsConfig(rescaled=False)
    mean = 2 * volume(sheet) / surface_area(sheet)
    if mean > config.min_thickness_m:
        assert measure_object(source, config).mesh is not None
        return
    with pytest.raises(MeshError, match=r"sheet\.ply (is too thin|encloses no volume)"):
        measure_object(source, config)


def test_a_needle_is_told_its_radius() -> None:
    needle = mesh_of(trimesh.creation.cylinder(radius=1e-5, height=0.1, sections=64))
    source = MeshSource("needle", "needle.ply", "digest", needle, "m", "declared")
    with pytest.raises(MeshError, match=r"too thin: 0\.01 mm .* at a length of 100 mm"):
        measure_object(source, ObjectsConfig(rescaled=False))
