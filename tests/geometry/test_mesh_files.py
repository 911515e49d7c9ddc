"""Every bad file gets one sentence with its name; good ones come in metres."""

import os
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.config import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.mesh_files import load_mesh_file
from pipeline.geometry.mesh_folders import list_mesh_files

CONFIG = ObjectsConfig()
BOX = trimesh.creation.box(extents=(0.1, 0.05, 0.02))


def load(path: Path, config: ObjectsConfig = CONFIG) -> object:
    return load_mesh_file(path, path.parent, path.stem, config)


@pytest.mark.parametrize("suffix", ["ply", "obj", "stl", "off", "glb"])
def test_every_format_gives_the_same_surface(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"box.{suffix}"
    BOX.export(path)
    source = load_mesh_file(path, tmp_path, "box", CONFIG)
    np.testing.assert_allclose(source.mesh.extents_m, [0.1, 0.05, 0.02], rtol=1e-6)
    assert source.unit == "m"


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "m"), (1000.0, "mm")])
def test_units_are_detected_by_size(tmp_path: Path, factor: float, unit: str) -> None:
    path = tmp_path / "box.stl"
    trimesh.creation.box(extents=np.array([0.1, 0.05, 0.02]) * factor).export(path)
    source = load_mesh_file(path, tmp_path, "box", CONFIG)
    assert (source.unit, source.unit_known_by) == (unit, "detected")
    np.testing.assert_allclose(source.mesh.extents_m, [0.1, 0.05, 0.02], rtol=1e-6)


def test_a_configured_unit_holds_where_none_is_declared(tmp_path: Path) -> None:
    path = tmp_path / "box.stl"
    BOX.export(path)
    source = load_mesh_file(path, tmp_path, "box", ObjectsConfig(unit="cm", min_extent_m=1e-4))
    assert (source.unit, source.unit_known_by) == ("cm", "configured")
    np.testing.assert_allclose(source.mesh.extents_m.max(), 0.001, rtol=1e-6)


def binary_stl(vertices: np.ndarray) -> bytes:
    facets = b"".join(
        struct.pack("<12fH", 0, 0, 1, *triangle.ravel(), 0)
        for triangle in vertices.astype(np.float32)
    )
    return b"\0" * 80 + struct.pack("<I", len(vertices)) + facets


def with_nan() -> bytes:
    triangles = BOX.vertices[BOX.faces].copy()
    triangles[0, 0, 0] = np.nan
    return binary_stl(triangles)


BAD_FILES = {
    "empty.stl": (b"", "is empty"),
    "page.obj": (b"<!DOCTYPE html><html><body>404</body></html>", "web page"),
    "pointer.ply": (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "LFS"),
    "nan.stl": (with_nan(), "NaN"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "3 points and no faces"),
    "wild.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "refers to vertex 9, and it has 3"),
    "tiny.stl": (binary_stl(1e-9 * BOX.vertices[BOX.faces]), "absurd size"),
    "huge.stl": (binary_stl(1e9 * BOX.vertices[BOX.faces]), "absurd size"),
    "cut.stl": (binary_stl(BOX.vertices[BOX.faces])[:-30], "truncated"),
    "bomb.stl": (b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 900, "absurd size"),
    "bomb.ply": (
        b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
        b"property float y\nproperty float z\nelement face 100000000000\n"
        b"property list uchar int vertex_indices\nend_header\n" + b"\0" * 64,
        "more than",
    ),
    "bomb.off": (b"OFF\n4000000000 3 0\n0 0 0\n", "truncated"),
    "noise.glb": (bytes(range(256)) * 4, "glTF"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_is_named_with_its_reason(tmp_path: Path, name: str) -> None:
    data, reason = BAD_FILES[name]
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(MeshError, match=reason) as failure:
        load(path)
    assert name in failure.value.what
    assert failure.value.remedy


@pytest.mark.parametrize("suffix", ["ply", "stl", "off", "glb"])
def test_a_cut_file_never_passes_for_the_whole(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"box.{suffix}"
    BOX.export(path)
    data = path.read_bytes()
    for keep in range(0, len(data) - 8, max(1, len(data) // 40)):
        path.write_bytes(data[:keep])
        with pytest.raises(MeshError):
            load(path)


def test_a_cut_text_file_never_passes_for_the_whole(tmp_path: Path) -> None:
    path = tmp_path / "box.ply"
    whole = BOX.export(file_type="ply", encoding="ascii").rstrip()
    for keep in range(len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:keep])
        with pytest.raises(MeshError, match=r"box\.ply"):
            load(path)


def test_a_part_placed_too_often_is_refused(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for i in range(4):
        shift = trimesh.transformations.translation_matrix((0.2 * i, 0, 0))
        scene.add_geometry(BOX, geom_name="box", transform=shift)
    path = tmp_path / "boxes.glb"
    scene.export(path)
    whole = load_mesh_file(path, tmp_path, "boxes", ObjectsConfig(max_faces=48))
    assert len(whole.mesh.faces) == 48
    with pytest.raises(MeshError, match=r"boxes\.glb declares 48 faces, more than the 47 allowed"):
        load(path, ObjectsConfig(max_faces=47))


def test_a_file_over_the_limit_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "big.stl"
    with path.open("wb") as file:
        file.truncate(3 * 2**20)
    with pytest.raises(MeshError, match="more than the 1 allowed"):
        load(path, ObjectsConfig(max_file_mib=1))


def test_listing_sorts_and_stays_inside(tmp_path: Path) -> None:
    inside, outside = tmp_path / "meshes", tmp_path / "secret.stl"
    BOX.export(outside)
    (inside / "sub").mkdir(parents=True)
    (inside / ".hidden").mkdir()
    for name in ("b.stl", "a.ply", "sub/c.off", ".hidden/d.stl"):
        BOX.export(inside / name)
    (inside / "notes.txt").write_text("no mesh")
    (inside / "leak.stl").symlink_to(outside)
    files = list_mesh_files(inside)
    assert [f.relative_to(inside).as_posix() for f in files] == ["a.ply", "b.stl", "sub/c.off"]
    with pytest.raises(MeshError, match="leads out of its folder"):
        load_mesh_file(inside / "leak.stl", inside, "leak", CONFIG)


def test_a_folder_without_meshes_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="holds no mesh file"):
        list_mesh_files(tmp_path)
    with pytest.raises(MeshError, match="not a folder"):
        list_mesh_files(tmp_path / "absent")


def test_a_file_name_that_is_no_text_is_an_error(tmp_path: Path) -> None:
    BOX.export(tmp_path / "good.ply")
    (tmp_path / os.fsdecode(b"caf\xe9.ply")).write_bytes(b"")
    with pytest.raises(MeshError, match=r"name is not UTF-8: caf\\xe9\.ply"):
        list_mesh_files(tmp_path)
