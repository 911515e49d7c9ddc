"""Objects from URDF: scale, origins and fixed joints applied; nothing read outside the folder."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.config import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.catalogue import finish_object, measure_object
from pipeline.geometry.mesh_folders import list_mesh_files
from pipeline.geometry.shape import volume
from pipeline.geometry.urdf_files import load_object_file, read_with, standalone

CONFIG = ObjectsConfig()
BOX = trimesh.creation.box(extents=(100.0, 50.0, 20.0))  # in mm, as CAD writes it


def visual(geometry: str, origin: str = "") -> str:
    return f"<visual>{origin}<geometry>{geometry}</geometry></visual>"


def write_urdf(folder: Path, *links: str, joints: str = "") -> Path:
    body = "".join(f'<link name="l{i}">{link}</link>' for i, link in enumerate(links))
    path = folder / "thing.urdf"
    path.write_text(f'<?xml version="1.0"?><robot name="thing">{body}{joints}</robot>')
    return path


def load(path: Path) -> trimesh.Trimesh:
    mesh = load_object_file(path, path.parent, "thing", CONFIG).mesh
    return trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    BOX.export(tmp_path / "box.obj")
    return tmp_path


def test_the_scale_of_a_mesh_is_applied_axis_by_axis(folder: Path) -> None:
    path = write_urdf(folder, visual('<mesh filename="box.obj" scale="0.001 0.002 0.003"/>'))
    np.testing.assert_allclose(load(path).extents, [0.1, 0.1, 0.06], rtol=1e-9)


def test_a_mirrored_mesh_keeps_its_inside_inside(folder: Path) -> None:
    path = write_urdf(folder, visual('<mesh filename="box.obj" scale="-0.001 0.001 0.001"/>'))
    source = load_object_file(path, folder, "thing", CONFIG)
    assert volume(source.mesh) == pytest.approx(1e-4)
    assert (source.unit, source.unit_known_by) == ("m", "declared")


def test_origins_and_fixed_joints_place_the_parts(folder: Path) -> None:
    cube = '<box size="0.02 0.02 0.02"/>'
    joint = (
        '<joint name="j" type="fixed"><parent link="l0"/><child link="l1"/>'
        '<origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/></joint>'
    )
    path = write_urdf(folder, visual(cube), visual(cube, '<origin xyz="0.05 0 0"/>'), joints=joint)
    # The second cube lies 0.05 along the turned x axis, that is, along the root's y.
    np.testing.assert_allclose(load(path).bounds, [[-0.01] * 3, [0.11, 0.06, 0.01]], atol=1e-12)


def test_a_chain_of_joints_adds_up_from_either_end(folder: Path) -> None:
    """Links listed from the tip, which hangs on all others, and from the root."""
    count = 40
    cube = visual('<box size="0.01 0.01 0.01"/>')
    for step in (1, -1):
        joints = "".join(
            f'<joint name="j{i}" type="fixed"><parent link="l{i}"/><child link="l{i + step}"/>'
            '<origin xyz="0.02 0 0"/></joint>'
            for i in range(count)
            if 0 <= i + step < count
        )
        path = write_urdf(folder, *[cube] * count, joints=joints)
        assert load(path).extents[0] == pytest.approx(0.02 * (count - 1) + 0.01)


def test_a_mesh_placed_too_often_is_refused(folder: Path) -> None:
    path = write_urdf(folder, *[visual('<mesh filename="box.obj" scale="0.001"/>')] * 5)
    load_object_file(path, folder, "thing", ObjectsConfig(max_faces=60))
    with pytest.raises(MeshError, match=r"thing\.urdf declares 60 faces, more than the 59"):
        load_object_file(path, folder, "thing", ObjectsConfig(max_faces=59))


def test_solids_have_their_volume(folder: Path) -> None:
    sphere = write_urdf(folder, visual('<sphere radius="0.03"/>'))
    assert load(sphere).volume == pytest.approx(4 / 3 * np.pi * 0.03**3, rel=0.01)
    cylinder = write_urdf(folder, visual('<cylinder radius="0.02" length="0.1"/>'))
    assert load(cylinder).volume == pytest.approx(np.pi * 0.02**2 * 0.1, rel=0.01)


def test_a_placed_mesh_is_no_object_of_its_own(folder: Path) -> None:
    BOX.export(folder / "alone.obj")
    write_urdf(folder, visual('<mesh filename="package://things/box.obj" scale="0.001"/>'))
    files = list_mesh_files(folder)
    assert len(files) == 3
    assert [path.name for path in standalone(files, folder)] == ["alone.obj", "thing.urdf"]


def test_an_object_may_keep_its_own_size(folder: Path, tmp_path: Path) -> None:
    path = write_urdf(folder, visual('<mesh filename="box.obj" scale="0.002"/>'))
    config = ObjectsConfig(rescaled=False)
    measured = measure_object(load_object_file(path, folder, "thing", config), config)
    item = finish_object(measured, config, np.random.default_rng(0), tmp_path / "cache")
    np.testing.assert_allclose(item.mesh.extents_m, [0.2, 0.1, 0.04], rtol=1e-6)
    assert item.scale == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("link", "joints", "reason"),
    [
        (visual('<mesh filename="../outside.obj"/>'), "", "leads out of its folder"),
        (visual('<mesh filename="/etc/hostname"/>'), "", "leads out of its folder"),
        (visual('<mesh filename="gone.obj"/>'), "", "which is not there"),
        (visual('<mesh filename="box.obj" scale="1 x 1"/>'), "", "where 3 numbers belong"),
        (visual('<mesh filename="box.obj" scale="1 0 1"/>'), "", "to nothing"),
        (visual('<mesh filename="box.obj" scale="nan"/>'), "", "where 3 numbers belong"),
        (visual('<mesh filename="thing.urdf"/>'), "", "which is none of"),
        (visual('<box size="0.1"/>') + "<a>", "", "is no XML"),
        ("", "", "has no visual or collision geometry"),
        (visual("<capsule/>"), "", "which URDF does not know"),
        (
            visual('<box size="0.1"/>') + '</link><link name="l1">' + visual('<box size="0.1"/>'),
            '<joint type="revolute"><parent link="l0"/><child link="l1"/></joint>',
            "an object must be rigid",
        ),
        (
            visual('<box size="0.1"/>'),
            '<joint type="fixed"><parent link="l0"/><child link="l0"/></joint>',
            "hangs on no root",
        ),
    ],
)
def test_what_cannot_be_used_says_why(folder: Path, link: str, joints: str, reason: str) -> None:
    inner = folder / "inner"
    inner.mkdir()
    BOX.export(folder / "outside.obj")
    BOX.export(inner / "box.obj")
    path = write_urdf(inner, link, joints=joints)
    with pytest.raises(MeshError, match=reason):
        load_object_file(path, inner, "thing", CONFIG)


def test_links_of_the_file_system_are_not_followed_outside(folder: Path) -> None:
    inner = folder / "inner"
    inner.mkdir()
    (inner / "link.obj").symlink_to(folder / "box.obj")
    path = write_urdf(inner, visual('<mesh filename="link.obj"/>'))
    with pytest.raises(MeshError, match="leads out of its folder"):
        load_object_file(path, inner, "thing", CONFIG)


def test_entities_do_not_reach_files(folder: Path) -> None:
    path = folder / "thing.urdf"
    path.write_text(
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]>'
        '<robot name="x"><link name="l">&x;</link></robot>'
    )
    with pytest.raises(MeshError, match="no XML"):
        load_object_file(path, folder, "thing", CONFIG)


def test_every_file_that_an_object_is_read_from_is_named(tmp_path: Path) -> None:
    meshes, urdfs = tmp_path / "meshes", tmp_path / "urdf"
    meshes.mkdir()
    urdfs.mkdir()
    ball = trimesh.Scene(trimesh.creation.icosphere(1, 0.03))
    files = trimesh.exchange.gltf.export_gltf(ball)
    for name, data in files.items():
        (meshes / name).write_bytes(data)
    BOX.export(meshes / "box.obj")
    body = visual('<mesh filename="../meshes/model.gltf"/>') + visual(
        '<mesh filename="package://meshes/box.obj"/>'
    )
    path = write_urdf(urdfs, body, visual('<mesh filename="missing.obj"/>'))
    named = read_with(path, tmp_path, CONFIG)
    assert set(named) == {meshes / name for name in (*files, "box.obj")}
    assert read_with(meshes / "box.obj", tmp_path, CONFIG) == ()


@pytest.mark.parametrize("text", ["no XML", '{"buffers": [{"uri": 3}]}', '{"buffers": 5}', "{"])
@pytest.mark.parametrize("name", ["thing.urdf", "thing.gltf"])
def test_a_damaged_file_names_no_others(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    assert read_with(tmp_path / name, tmp_path, CONFIG) == ()


def test_no_file_outside_the_folder_is_named(tmp_path: Path) -> None:
    folder = tmp_path / "meshes"
    folder.mkdir()
    BOX.export(tmp_path / "box.obj")
    (tmp_path / "data.bin").write_bytes(b"0")
    (folder / "a.gltf").write_text('{"buffers": [{"uri": "../data.bin"}, {"uri": "http://x"}]}')
    path = write_urdf(folder, visual('<mesh filename="../box.obj"/>'))
    assert read_with(path, folder, CONFIG) == ()
    assert read_with(folder / "a.gltf", folder, CONFIG) == ()
