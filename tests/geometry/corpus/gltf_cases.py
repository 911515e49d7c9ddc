"""Binary glTF, and glTF of one file, as tools write them."""

import base64
import json
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.geometry.corpus.case import Case
from tests.geometry.corpus.gltf_dialects import Gltf, GltfWriter, glb, gltf
from tests.geometry.corpus.solids import BOX, TRIANGLES, Solid, box, in_triangles

_DIALECTS = {
    "plain": (Gltf(), "as most tools write it"),
    "u1": (Gltf(index="u1"), "indices of one byte"),
    "u2": (Gltf(index="u2"), "indices of two bytes"),
    "not_indexed": (Gltf(index=""), "no indices"),
    "strided": (Gltf(stride=20), "other data between the positions"),
    "sparse": (Gltf(sparse=True), "positions stored sparsely"),
    "matrix": (Gltf(pose="matrix"), "a node with a matrix"),
    "nested": (Gltf(pose="nested"), "nodes within nodes"),
    "mirrored": (Gltf(pose="mirrored"), "a mirrored node"),
    "mirrored_not_indexed": (Gltf(pose="mirrored", index=""), "the same without indices"),
    "strips": (Gltf(mode="strip"), "triangle strips of one triangle"),
    "fans": (Gltf(mode="fan"), "triangle fans of one triangle"),
    "extra": (Gltf(extra_primitives=True), "points, lines, and a primitive without positions"),
    "quantised": (Gltf(real="quantised"), "positions of two bytes"),
    "quantised_strided": (Gltf(real="quantised", stride=8), "the same, aligned to four bytes"),
}


def cases() -> Iterator[Case]:
    """Every way of writing glTF, and what its files get wrong."""
    for name, (how, what) in _DIALECTS.items():
        coarse = 1e-4 if how.real == "quantised" else 1e-6
        yield Case(f"glb_{name}.glb", gltf(TRIANGLES, how), what, BOX, tolerance=coarse)
    yield Case("gltf_embedded.gltf", gltf(TRIANGLES, Gltf(text=True)), "data in its text", BOX)
    yield Case("glb_text.glb", gltf(TRIANGLES, Gltf(text=True)), "text glTF named GLB", BOX)
    yield from _strips()
    yield from _placed()
    yield _halves()
    yield from _beside()
    yield from _refused()


def _tree(parts: list[dict[str, object]], **more: object) -> dict[str, object]:
    return {
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": parts}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        **more,
    }


def _strips() -> Iterator[Case]:
    """A box of one strip and two fans; strips and fans without indices."""
    strip = np.array([3, 2, 0, 1, 4, 5, 7, 6, 3, 2], dtype="<u2")
    fans = [np.array(fan, dtype="<u2") for fan in ((1, 2, 6, 5), (0, 4, 7, 3))]
    for indexed in (True, False):
        writer = GltfWriter()
        corners = BOX.corners_m.astype("<f4")
        parts: list[dict[str, object]] = []
        for mode, order in ((5, strip), *((6, fan) for fan in fans)):
            if indexed:
                position = writer.accessor(corners, "VEC3")
                extra = {"indices": writer.accessor(order, "SCALAR")}
            else:
                position, extra = writer.accessor(corners[order], "VEC3"), {}
            parts.append({"attributes": {"POSITION": position}, "mode": mode, **extra})
        name = "glb_strip_fan.glb" if indexed else "glb_strip_fan_not_indexed.glb"
        yield Case(name, writer.finish(_tree(parts)), "a strip and two fans", BOX)
    joined = np.array([3, 2, 0, 1, 4, 5, 7, 6, 3, 2, 2, 1, 1, 2, 5, 6, 6, 0, 0, 4, 3, 7], "<u2")
    writer = GltfWriter()
    part = {
        "attributes": {"POSITION": writer.accessor(BOX.corners_m.astype("<f4"), "VEC3")},
        "indices": writer.accessor(joined, "SCALAR"),
        "mode": 5,
    }
    yield Case(
        "glb_joined_strip.glb",
        writer.finish(_tree([part])),
        "strips joined by empty triangles",
        BOX,
    )


def _placed() -> Iterator[Case]:
    """Instances, by nodes and by the extension; scenes; nodes that nobody places."""
    cube = in_triangles(box(0.05, 0.05, 0.05))
    union = box(0.075, 0.05, 0.05)
    shift = np.array([[0, 0, 0], [0.025, 0, 0]], dtype="<f4")
    for name in ("nodes", "extension", "scenes", "no_scene"):
        writer = GltfWriter()
        part = _part(writer, cube)
        tree = _tree([part])
        tree["nodes"] = [{"mesh": 0, "translation": row.tolist()} for row in shift]
        tree["scenes"] = [{"nodes": [0, 1]}]
        if name == "extension":
            moved = writer.accessor(shift, "VEC3")
            placed = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": moved}}}
            tree["nodes"] = [{"mesh": 0, "extensions": placed}]
            tree["scenes"] = [{"nodes": [0]}]
            tree["extensionsUsed"] = tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
        elif name == "scenes":
            tree["scenes"], tree["scene"] = [{"nodes": [2]}, {"nodes": [0, 1]}], 1
            tree["nodes"] += [{"mesh": 0, "translation": [9, 9, 9]}]  # type: ignore[operator]
        elif name == "no_scene":
            del tree["scenes"]
        yield Case(
            f"glb_instances_{name}.glb", writer.finish(tree), f"instances: {name}", union, bodies=2
        )
    writer = GltfWriter()
    tree = _tree([_part(writer, cube)])
    mirrored = {"mesh": 0, "scale": [-1, 1, 1], "translation": [0.075, 0, 0]}
    tree["nodes"] = [{"mesh": 0}, mirrored]
    tree["scenes"] = [{"nodes": [0, 1]}]
    yield Case(
        "glb_mirror_image.glb", writer.finish(tree), "a part and its mirror image", union, bodies=2
    )


def _halves() -> Case:
    """Half a box, open where its mirror image goes on."""
    half = box(0.05, 0.07, 0.04)
    sides = [p for p in half.polygons if any(half.corners_m[i, 0] for i in p)]
    writer = GltfWriter()
    tree = _tree([_part(writer, in_triangles(replace(half, polygons=tuple(sides))))])
    tree["nodes"] = [{"mesh": 0}, {"mesh": 0, "scale": [-1, 1, 1]}]
    tree["scenes"] = [{"nodes": [0, 1]}]
    data = writer.finish(tree)
    return Case("glb_halves.glb", data, "an open half and its mirror image", box(0.1, 0.07, 0.04))


def _part(writer: GltfWriter, solid: Solid) -> dict[str, object]:
    indices = np.array(solid.polygons, dtype="<u2").reshape(-1)
    return {
        "attributes": {"POSITION": writer.accessor(solid.corners_m.astype("<f4"), "VEC3")},
        "indices": writer.accessor(indices, "SCALAR"),
    }


def _beside() -> Iterator[Case]:
    """glTF with its data in a file of its own."""
    writer = GltfWriter()
    tree = _tree([_part(writer, TRIANGLES)])
    embedded = json.loads(writer.finish(tree, text=True))
    embedded["buffers"][0]["uri"] = "gltf%20beside.bin"
    yield Case(
        "gltf_beside.gltf", json.dumps(embedded).encode(), "data in a file beside it", BOX,
        beside={"gltf beside.bin": writer.body},
    )  # fmt: skip
    for name, uri, reason in (
        ("bad_outside.gltf", "../../outside.bin", "leads out of its folder"),
        ("bad_missing.gltf", "missing.bin", "is not there"),
        ("bad_remote.gltf", "https://example.org/a.bin", "https"),
    ):
        embedded["buffers"][0]["uri"] = uri
        yield Case(name, json.dumps(embedded).encode(), f"data in {uri}", refused=reason)
    uri = "data:application/octet-stream;base64," + base64.b64encode(writer.body).decode()
    tree["buffers"] = [{"byteLength": len(writer.body), "uri": uri}]
    tree |= {"bufferViews": writer.views, "accessors": writer.accessors}
    yield Case("glb_data_uri.glb", glb(tree), "data as text in a binary file", BOX)


def _refused() -> Iterator[Case]:
    whole = gltf(TRIANGLES)
    yield Case("bad_cut.glb", whole[:-20], "cut", refused="is truncated")
    yield Case("bad_first.glb", glb(_tree([]), version=1), "glTF 1", refused="version 1")
    writer = GltfWriter()
    position = writer.accessor(BOX.corners_m.astype("<f4"), "VEC3")
    points = {"attributes": {"POSITION": position}, "mode": 0}
    yield Case(
        "bad_points.glb", writer.finish(_tree([points])), "points alone", refused="no triangles"
    )
    for name in ("KHR_draco_mesh_compression", "EXT_meshopt_compression"):
        writer = GltfWriter()
        part = _part(writer, TRIANGLES)
        tree = _tree([part], extensionsUsed=[name], extensionsRequired=[name])
        if name.startswith("KHR"):
            part["extensions"] = {name: {"bufferView": 0, "attributes": {"POSITION": 0}}}
            for accessor in writer.accessors:
                del accessor["bufferView"]
        else:
            view = {"buffer": 0, "byteLength": 96, "byteStride": 12, "count": 8}
            writer.views[0]["extensions"] = {name: {**view, "mode": "ATTRIBUTES"}}
        word = "Draco" if name.startswith("KHR") else "meshopt"
        yield Case(
            f"bad_{word.lower()}.glb", writer.finish(tree), f"packed by {word}", refused=word
        )
    writer = GltfWriter()
    tree = _tree([_part(writer, TRIANGLES)], extensionsRequired=["ACME_shapes"])
    yield Case(
        "bad_extension.glb", writer.finish(tree), "an unknown extension", refused="ACME_shapes"
    )
    writer = GltfWriter()
    tree = _tree([_part(writer, replace(TRIANGLES, polygons=((0, 1, 9), *TRIANGLES.polygons)))])
    yield Case(
        "bad_index.glb", writer.finish(tree), "an index too large",
        refused="vertex 9, and it has vertices 0 to 7",
    )  # fmt: skip
    nowhere = _tree([{"attributes": {"POSITION": 7}}])
    yield Case("bad_accessor.glb", glb(nowhere), "data that is not there", refused="damaged glTF")
