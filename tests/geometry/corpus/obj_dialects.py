"""One solid written as OBJ in each way that some tool writes it."""

from dataclasses import dataclass
from itertools import chain
from typing import Literal

import numpy as np

from tests.geometry.corpus.solids import Solid


@dataclass(frozen=True)
class Obj:
    """How an OBJ file is written. Every field alone is something that tools do."""

    gap: str = " "
    indent: str = ""
    newline: str = "\n"
    mark: bytes = b""  # before the first line
    note: str = ""  # behind every line of data
    counted: Literal["on", "back", "both"] = "on"
    corner: str = "{0}"  # {0} is the vertex, {1} any other index
    colours: bool = False
    weight: str = ""  # the fourth number of a vertex
    continued: bool = False
    faces_first: bool = False
    interleaved: bool = False  # vertices of a face just before it, counted back
    groups: bool = False
    elements: bool = False  # points and lines among the faces
    number: str = "{:.17g}"
    final_newline: bool = True


def obj(solid: Solid, how: Obj = Obj()) -> bytes:
    """Wavefront OBJ."""
    if how.interleaved:
        lines = []
        for polygon in solid.polygons:
            lines += [_obj_vertex(solid.corners_m[i], how) for i in polygon]
            corners = [how.corner.format(k - len(polygon), -1) for k in range(len(polygon))]
            lines.append(how.gap.join(["f", *corners]))
        return _text(lines, how)
    vertices = [_obj_vertex(corner, how) for corner in solid.corners_m]
    faces = []
    for number, polygon in enumerate(solid.polygons):
        back = how.counted == "back" or (how.counted == "both" and number % 2 == 1)
        count = len(solid.corners_m)
        names = [i - count if back else i + 1 for i in polygon]
        corners = [how.corner.format(i, 1) for i in names]
        if how.continued and len(corners) > 2:
            corners[1] += " \\" + how.newline
        if how.groups:
            faces += [f"o part{number}", f"g side{number} all", "usemtl grey shade", "s off"]
        if how.elements:
            faces += ["p 1", "l 1 2 3"]
        faces.append(how.gap.join(["f", *corners]))
    extra = ["vt 0.5 0.5", "vn 0 0 1"]
    parts = [faces, vertices, extra] if how.faces_first else [vertices, extra, faces]
    return _text(["# made by a script", "mtllib none.mtl", *chain.from_iterable(parts)], how)


def _obj_vertex(corner: np.ndarray, how: Obj) -> str:
    words = ["v", *(how.number.format(c) for c in corner)]
    if how.weight:
        words.append(how.weight)
    if how.colours:
        words += ["0.5", "0.25", "1"]
    return how.gap.join(words)


def _text(lines: list[str], how: Obj) -> bytes:
    written = how.newline.join(how.indent + line + how.note for line in lines)
    return how.mark + (written + (how.newline if how.final_newline else "")).encode()
