"""URDF as tools write it; each places the mesh ``meshes/my part.stl`` of its own folder."""

from collections.abc import Iterator

from tests.geometry.corpus.case import Case
from tests.geometry.corpus.solids import BOX, TRIANGLES, box
from tests.geometry.corpus.stl_dialects import stl

MESH = {"meshes/my part.stl": stl(TRIANGLES)}
_WORLD = (
    '<link name="world"/><joint name="j" type="{0}"><parent link="world"/><child link="l"/></joint>'
)


def _link(geometry: str, name: str = "l", kind: str = "visual", origin: str = "") -> str:
    return f'<link name="{name}"><{kind}>{origin}<geometry>{geometry}</geometry></{kind}></link>'


def _mesh(filename: str, more: str = "") -> str:
    return f'<mesh filename="{filename}"{more}/>'


def _case(name: str, what: str, body: str, **more: object) -> Case:
    data = f'<?xml version="1.0"?>\n<robot name="r">{body}</robot>\n'.encode()
    files = {f"{name}/{path}": held for path, held in MESH.items()}
    return Case(f"{name}/thing.urdf", data, what, beside=files, **more)  # type: ignore[arg-type]


def cases() -> Iterator[Case]:
    """What URDF files of single objects hold. {folder} stands for the corpus's folder."""
    for name, filename, what in (
        ("urdf_plain", "meshes/my part.stl", "a path with a blank"),
        ("urdf_percent", "meshes/my%20part.stl", "percent escapes"),
        ("urdf_backslash", r"meshes\my part.stl", "backslashes"),
        ("urdf_dot", r".\meshes\my%20part.stl", "all of these"),
        ("urdf_address", "file://{folder}/urdf_address/meshes/my%20part.stl", "a file address"),
        ("urdf_short_address", "file:meshes/my%20part.stl", "a short file address"),
        ("urdf_two_slashes", "file://meshes/my%20part.stl", "a relative file address"),
        ("urdf_package", "package://things/meshes/my part.stl", "a package"),
        ("urdf_package_percent", "package://things/meshes/my%20part.stl", "an escaped package"),
        ("urdf_model", "model://things/meshes/my part.stl", "a model of Gazebo"),
        ("urdf_absolute", "{folder}/urdf_absolute/meshes/my part.stl", "a path from the root"),
    ):
        yield _case(name, what, _link(_mesh(filename)), solid=BOX)
    part = _link(_mesh("meshes/my part.stl"))
    for kind in ("floating", "fixed", "planar"):
        body = _WORLD.format(kind) + part
        yield _case(f"urdf_world_{kind}", f"the world as a link, a {kind} joint", body, solid=BOX)
    body = part + _WORLD.format("floating").replace("world", "camera_frame").replace(
        'parent link="camera_frame"/><child link="l"', 'parent link="l"/><child link="camera_frame"'
    )
    yield _case("urdf_frame", "a frame without geometry on a joint", body, solid=BOX)
    mirrored = _link(_mesh("meshes/my part.stl", ' scale="-1 1 1"'))
    yield _case("urdf_mirrored", "a scale that mirrors", mirrored, solid=BOX)
    twice = _link(_mesh("meshes/my part.stl", ' scale="-1 -1 1"'))
    yield _case("urdf_mirrored_twice", "a scale that mirrors twice", twice, solid=BOX)
    scaled = _link(_mesh("meshes/my part.stl", ' scale="0.5 0.5 0.5"'))
    yield _case("urdf_scaled", "a scale", scaled, solid=BOX.scaled(0.5))
    collision = _link(_mesh("meshes/my part.stl"), kind="collision")
    yield _case("urdf_collision", "collision geometry alone", collision, solid=BOX)
    visual = '<visual><geometry><box size="0.05 0.05 0.05"/></geometry></visual>'
    moved = visual.replace("<visual>", '<visual><origin xyz="0.025 0 0"/>')
    body = f'<link name="l">{visual}{moved}</link>'
    yield _case("urdf_several", "several visuals", body, solid=box(0.075, 0.05, 0.05), bodies=2)
    yield from _refused(part)


def _refused(part: str) -> Iterator[Case]:
    for name, filename, reason in (
        ("bad_urdf_outside", "../../../etc/hostname.stl", "not there|leads out"),
        ("bad_urdf_address", "file:///etc/passwd", "leads out of its folder"),
        ("bad_urdf_escaped", "..%2f..%2f..%2f..%2f..%2f..%2fetc/passwd", "leads out|not there"),
        ("bad_urdf_remote", "https://example.org/a.stl", "https"),
        ("bad_urdf_missing", "meshes/other.stl", "is not there"),
        ("bad_urdf_none", "", "names no file"),
    ):
        yield _case(name, f"a mesh at '{filename}'", _link(_mesh(filename)), refused=reason)
    moving = _link('<box size="0.1 0.1 0.1"/>', "m")
    joint = '<joint name="j" type="{0}"><parent link="l"/><child link="m"/></joint>'
    for kind in ("revolute", "floating"):
        yield _case(
            f"bad_urdf_{kind}", f"two parts on a {kind} joint", part + moving + joint.format(kind),
            refused=f"{kind} joint",
        )  # fmt: skip
    joint = '<joint name="j" type="fixed"><parent link="l"/><child link="gone"/></joint>'
    yield _case("bad_urdf_link", "a joint to no link", part + joint, refused="link 'gone'")
    macro = '<xacro:include filename="a.xacro" xmlns:xacro="http://www.ros.org/wiki/xacro"/>'
    yield _case("bad_urdf_xacro", "macros not yet expanded", macro, refused="xacro")
