"""Folders of several files: which objects they are, under which names, in which unit."""

import hashlib
import math
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipeline.config import ObjectsConfig, SplitConfig
from pipeline.geometry.catalogue import measure_object
from pipeline.geometry.mesh_folders import list_mesh_files
from pipeline.geometry.plan import Plan, plan_catalogue
from pipeline.geometry.settled import Settled
from pipeline.geometry.urdf_files import load_object_file, standalone
from tests.geometry.corpus.obj_dialects import obj
from tests.geometry.corpus.ply_dialects import ply
from tests.geometry.corpus.solids import BOX, NOTCHED, Solid, box, in_triangles
from tests.geometry.corpus.stl_dialects import stl

# About a slanted axis, by a third of a turn and a bit; no corner stays on an axis.
_ANGLE, _AXIS = 2.2, np.array([1.0, 2.0, 2.0]) / 3
_CROSS = np.cross(np.eye(3), -_AXIS)
TURN = np.eye(3) + np.sin(_ANGLE) * _CROSS + (1 - np.cos(_ANGLE)) * _CROSS @ _CROSS
_A, _B, _C = 0.05, 0.08, 0.12
CORNER = Solid(  # no turn makes its mirror image
    np.array([[0, 0, 0], [_A, 0, 0], [0, _B, 0], [0, 0, _C]]),
    ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)),
    _A * _B * _C / 6,
    (_A * _B + _B * _C + _C * _A + math.hypot(_A * _B, _B * _C, _C * _A)) / 2,
)


@dataclass(frozen=True)
class Known:
    """What is right for one object of a folder."""

    source: str
    """The file that stands for it."""
    unit: str = "m"
    copies: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class FolderCase:
    """A folder of files, and the objects that they are."""

    name: str
    what: str
    files: Mapping[str, bytes]
    objects: Mapping[str, Known]
    """By name."""


def write_folder(case: FolderCase, place: Path) -> Path:
    """The case's files in a folder of its name; returns that."""
    for name, data in case.files.items():
        path = place / case.name / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return place / case.name


def plan_of(folder: Path) -> Plan:
    """What a run at first sight of a folder makes of it, with sizes as they are."""
    config = ObjectsConfig(rescaled=False)
    items = [
        measure_object(load_object_file(path, folder, path.name, config), config)
        for path in standalone(list_mesh_files(folder), folder)
    ]
    return plan_catalogue(items, frozenset(), (), (config, SplitConfig()), 0, Settled("first"))


def folder_cases() -> Iterator[FolderCase]:
    """Copies, names and units."""
    yield _downloaded()
    yield from _copies()
    yield from _names()
    yield from _units()


def _binary(solid: Solid) -> bytes:
    return stl(in_triangles(solid))


def _downloaded() -> FolderCase:
    files: dict[str, bytes] = {}
    objects: dict[str, Known] = {}
    for number in range(2):
        solid = box(0.1, 0.05 + 0.01 * number, 0.03)
        at = f"obj{number}/google_16k"
        files |= {
            f"{at}/nontextured.ply": ply(solid),
            f"{at}/nontextured.stl": _binary(solid),
            f"{at}/textured.obj": obj(solid),
        }
        copies = (f"{at}/nontextured.stl", f"{at}/textured.obj")
        name = f"obj{number}_google_16k_nontextured"
        objects[name] = Known(f"{at}/nontextured.ply", copies=copies)
    return FolderCase("folder_downloaded", "each object in three files, as YCB has", files, objects)


def _copies() -> Iterator[FolderCase]:
    moved = BOX.turned(TURN).moved((0.3, -0.2, 0.1))
    yield FolderCase(
        "folder_moved",
        "one box: as it is, turned and moved, in millimetres",
        {"a.ply": ply(BOX), "b.obj": obj(moved), "c.stl": _binary(moved.scaled(1000))},
        {"a": Known("a.ply", copies=("b.obj", "c.stl"))},
    )
    mirrored = replace(
        CORNER,
        corners_m=CORNER.corners_m * [-1, 1, 1],
        polygons=tuple(polygon[::-1] for polygon in CORNER.polygons),
    )
    yield FolderCase(
        "folder_mirrored",
        "a corner of three unlike legs, turned, and its mirror image",
        {
            "a.ply": ply(CORNER),
            "b.ply": ply(CORNER.turned(TURN)),
            "mirrored.ply": ply(mirrored),
        },
        {"a": Known("a.ply", copies=("b.ply",)), "mirrored": Known("mirrored.ply")},
    )
    yield FolderCase(
        "folder_sizes",
        "two boxes alike but for their size",
        {"a.ply": ply(BOX), "b.ply": ply(BOX.scaled(1.2))},
        {"a": Known("a.ply"), "b": Known("b.ply")},
    )
    link = (
        '<robot name="r"><link name="l">'
        '<visual><geometry><mesh filename="visual.obj"/></geometry></visual>'
        '<collision><geometry><mesh filename="collision.stl"/></geometry></collision>'
        "</link></robot>\n"
    )
    yield FolderCase(
        "folder_urdf",
        "a URDF with a mesh to be seen and one to collide",
        {"r.urdf": link.encode(), "visual.obj": obj(NOTCHED), "collision.stl": _binary(BOX)},
        {"r": Known("r.urdf", copies=("collision.stl",))},
    )


def _names() -> Iterator[FolderCase]:
    letters = ("звезда", "杯子", "カップ", "फूल", "tüte")
    files = {
        unicodedata.normalize("NFD", f"{name}.ply"): ply(box(0.1, 0.05, 0.02 + 0.01 * number))
        for number, name in enumerate(letters)
    }
    objects = {name: Known(label) for name, label in zip(letters, files, strict=True)}
    yield FolderCase("folder_letters", "names in several scripts, decomposed", files, objects)
    labels = ("Mug 1.ply", "mug_1.obj", "mug_1.stl", "sub/mug 1.ply")
    solids = [box(0.1, 0.05 + 0.01 * number, 0.02) for number in range(4)]
    made = (ply(solids[0]), obj(solids[1]), _binary(solids[2]), ply(solids[3]))
    yield FolderCase(
        "folder_one_name",
        "different objects whose names would be one",
        dict(zip(labels, made, strict=True)),
        {
            "mug_1": Known("mug_1.obj"),
            f"mug_1-{_digest('mug_1.stl')}": Known("mug_1.stl"),
            f"mug_1-{_digest('Mug 1.ply')}": Known("Mug 1.ply"),
            "sub_mug_1": Known("sub/mug 1.ply"),
        },
    )


def _units() -> Iterator[FolderCase]:
    yield FolderCase(
        "folder_millimetres",
        "sizes in millimetres, one of which would be three metres on its own",
        {
            "washer.stl": _binary(box(3, 2, 1)),
            "part.stl": _binary(box(60, 40, 20)),
            "plate.stl": _binary(box(90, 80, 20)),
        },
        {name: Known(f"{name}.stl", "mm") for name in ("washer", "part", "plate")},
    )
    yield FolderCase(
        "folder_units",
        "three files in metres and one in millimetres",
        {
            "a.ply": ply(box(0.1, 0.05, 0.02)),
            "b.ply": ply(box(0.1, 0.06, 0.02)),
            "c.ply": ply(box(0.3, 0.06, 0.2)),
            "d.stl": _binary(box(90, 80, 20)),
        },
        {**{name: Known(f"{name}.ply") for name in "abc"}, "d": Known("d.stl", "mm")},
    )


def _digest(label: str) -> str:
    return hashlib.sha256(label.encode()).hexdigest()[:6]
