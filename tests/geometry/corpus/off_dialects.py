"""One solid written as OFF in each way that some tool writes it."""

from dataclasses import dataclass

from tests.geometry.corpus.solids import Solid


@dataclass(frozen=True)
class Off:
    """How an OFF file is written."""

    head: str = "OFF\n{0} {1} 0"
    vertex_more: str = ""
    face_more: str = ""
    newline: str = "\n"
    note: str = ""
    comments: bool = False
    blank_lines: bool = False
    mark: bytes = b""


def off(solid: Solid, how: Off = Off()) -> bytes:
    """OFF."""
    rows = [" ".join(f"{c:.17g}" for c in at) + how.vertex_more for at in solid.corners_m]
    rows += [" ".join(map(str, (len(p), *p))) + how.face_more for p in solid.polygons]
    lines = [how.head.format(len(solid.corners_m), len(solid.polygons))]
    for row in rows:
        if how.comments:
            lines.append("# a remark 1 2 3")
        if how.blank_lines:
            lines.append("")
        lines.append(row + how.note)
    return how.mark + (how.newline.join(lines).replace("\n", how.newline) + how.newline).encode()
