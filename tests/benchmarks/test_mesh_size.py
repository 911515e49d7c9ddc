"""Finer meshes are the same surfaces, and each fineness is compared."""

import numpy as np
import pytest
import trimesh

from pipeline.benchmarks import mesh_size
from pipeline.geometry.mesh import Mesh
from pipeline.world.scene import ClutterScene, PlacedObject


@pytest.fixture
def box() -> Mesh:
    shape = trimesh.creation.box((0.1, 0.2, 0.3))
    return Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))


def test_a_finer_mesh_is_the_same_surface(box: Mesh) -> None:
    finer = mesh_size.cut_in_four(box, 2)
    solid = trimesh.Trimesh(finer.vertices_m, finer.faces)
    assert len(finer.faces) == 16 * len(box.faces)
    assert solid.volume == pytest.approx(0.1 * 0.2 * 0.3)


def test_each_fineness_has_its_ratio(box: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    placed = (PlacedObject("box", 1, np.eye(4)),)
    scene = ClutterScene("one", 1, "train", 0, placed, np.full(1, np.inf), (), 0.0, ())
    monkeypatch.setattr(
        mesh_size,
        "compare",
        lambda given, questions: {"label": len(given["meshes"]["box"][1]) / 12},
    )
    assert mesh_size.labelling_by_faces(scene, {"box": box}) == {12: 1.0, 48: 4.0, 192: 16.0}


def test_heights_are_timed_both_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_size, "BALLS", (1,))
    monkeypatch.setattr(mesh_size, "GRASPS", 2)
    found = mesh_size.heights_by_faces()
    assert list(found) == [80]
    assert set(found[80]) == {"drawn", "rays"}
