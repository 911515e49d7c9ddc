"""What can honestly be made watertight is, with a record; what cannot is refused."""

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.config import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import load_mesh_file
from pipeline.geometry.mesh_folders import list_mesh_files
from pipeline.geometry.repair import repair
from pipeline.geometry.shape import volume
from pipeline.geometry.topology import is_closed
from tests.bodies import mesh_of

BOX = trimesh.creation.box()
BALL = trimesh.creation.icosphere(subdivisions=3)
CONFIG = ObjectsConfig()


def repaired(mesh: Mesh) -> tuple[Mesh, tuple[str, ...]]:
    return repair("it.stl", mesh, CONFIG.max_hole_fraction)


def test_a_closed_mesh_is_left_alone() -> None:
    mesh = mesh_of(BALL)
    result, done = repaired(mesh)
    assert done == ()
    np.testing.assert_array_equal(result.vertices_m, mesh.vertices_m)
    np.testing.assert_array_equal(result.faces, mesh.faces)


def test_triangle_soup_of_a_closed_surface_is_welded() -> None:
    corners = BOX.vertices[BOX.faces].reshape(-1, 3)
    result, done = repaired(Mesh(corners, np.arange(len(corners)).reshape(-1, 3)))
    assert is_closed(result)
    assert volume(result) == pytest.approx(1.0)
    assert done == ("merged 28 duplicate vertices",)


def test_a_small_hole_is_closed_and_told() -> None:
    mesh = mesh_of(BALL)
    result, done = repaired(Mesh(mesh.vertices_m, mesh.faces[1:]))
    assert is_closed(result)
    assert volume(result) == pytest.approx(volume(mesh), rel=1e-9)
    assert len(done) == 1
    assert "closed 1 hole" in done[0]


def test_mixed_and_inverted_windings_are_turned() -> None:
    faces = np.array(BALL.faces)
    faces[::3] = faces[::3, ::-1]
    mixed, done = repaired(Mesh(np.array(BALL.vertices), faces))
    assert is_closed(mixed)
    assert volume(mixed) == pytest.approx(BALL.volume)
    assert any("winding" in step for step in done)
    inverted, told = repaired(Mesh(np.array(BALL.vertices), np.array(BALL.faces)[:, ::-1]))
    assert volume(inverted) == pytest.approx(BALL.volume)
    assert told == ("turned a part inside out",)


def test_overlapping_parts_become_one_outer_surface() -> None:
    other = BOX.copy()
    other.apply_translation([0.5, 0.2, 0.1])
    both = trimesh.util.concatenate([BOX, other])
    result, done = repaired(mesh_of(both))
    assert is_closed(result)
    assert volume(result) == pytest.approx(2.0 - 0.5 * 0.8 * 0.9)
    assert any("united 2 parts" in step for step in done)


def open_bowl() -> Mesh:
    """Half a sphere without thickness."""
    centres = np.asarray(BALL.triangles_center)
    return Mesh(np.array(BALL.vertices), np.array(BALL.faces)[centres[:, 2] < 0])


def odd_edges() -> Mesh:
    """A box with a fin: three faces at one edge."""
    vertices = np.concatenate([BOX.vertices, [[2.0, 0.3, 0.1]]])
    edge = BOX.faces[0][:2]
    return Mesh(vertices, np.concatenate([BOX.faces, [[edge[0], edge[1], len(BOX.vertices)]]]))


def sheet() -> Mesh:
    return Mesh(
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    )


def two_bodies() -> Mesh:
    far = BOX.copy()
    far.apply_translation([3, 0, 0])
    return mesh_of(trimesh.util.concatenate([BOX, far]))


@pytest.mark.parametrize(
    ("mesh", "reason"),
    [
        (open_bowl(), "open shell"),
        (odd_edges(), "not a surface"),
        (sheet(), "open shell"),
        (two_bodies(), "2 bodies"),
        (Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]])), "no face of any area"),
    ],
    ids=["bowl", "fin", "sheet", "two bodies", "a point"],
)
def test_what_has_no_inside_is_refused_by_name(mesh: Mesh, reason: str) -> None:
    with pytest.raises(MeshError, match=reason) as failure:
        repaired(mesh)
    assert "it.stl" in failure.value.what


def test_scanned_meshes_come_out_watertight_or_named() -> None:
    named = os.environ.get("MESH_DIR", "")
    if not named:
        pytest.skip("MESH_DIR is not set: no scanned meshes")
    folder = Path(named)
    whole, refused = 0, list[tuple[str, str]]()
    for path in list_mesh_files(folder)[::4]:
        source = load_mesh_file(path, folder, path.stem, CONFIG)
        try:
            mesh, _ = repair(source.label, source.mesh, CONFIG.max_hole_fraction)
        except MeshError as error:
            refused.append((path.name, error.what))
            continue
        assert trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False).is_volume
        whole += 1
    assert all(name in said for name, said in refused)
    assert whole > 0
