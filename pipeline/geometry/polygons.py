"""Polygons cut into triangles: concave ones, with holes, whichever corner comes first.

A polygon's surface is known where its corners lie in a plane and its edges do not cross. Where
they nearly do, as in most meshes of quadrilaterals, it is cut and the object's record says so;
where they do not, the polygon is refused by its number.
"""

from dataclasses import dataclass

import manifold3d
import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.errors import MeshError

# Corners of a polygon may lie this far off its plane, as a share of the mesh's longest extent.
# Cut one way or the other, the surface differs by about as much: on an object of 100 mm, in the
# middle of the supplement's sizes, by 2 mm, one step of the pad's grid. Twisted quadrilaterals of
# coarse models are off by 1 to 2 %.
MOST_OFF_PLANE = 0.02
# From here on it is recorded: less is what corners written to five digits are off anyway.
_RECORDED_OFF_PLANE = 1e-4
# Edges cross where their ends lie further than this to both sides, as a share of the polygon's
# extent: corners written to five digits move by this much.
_CROSSING = 1e-5
# All pairs of edges are compared up to this many corners; the cut itself tells of larger ones.
_MOST_PAIRED_CORNERS = 512
_TRIANGULATE_REMEDY = "Mend that face, or export the mesh in triangles"


@dataclass(frozen=True, eq=False)
class Polygons:
    """Faces of any number of corners over shared vertices.

    vertices: (n, 3) in the file's unit. corners: (k,) vertex indices, face after face; counts:
    (m,) corners of each face.
    """

    vertices: Float[np.ndarray, "n 3"]
    corners: Int[np.ndarray, " k"]
    counts: Int[np.ndarray, " m"]


def cut(label: str, polygons: Polygons) -> tuple[Int[np.ndarray, "t 3"], tuple[str, ...]]:
    """Every face in triangles, in the order and direction of the faces.

    Parameters
    ----------
    label
        The file, for what is said of a face.
    polygons
        Faces whose corners are in range, over finite vertices.

    Returns
    -------
    Triangles, shape (t, 3), and what the object's record should say of them.

    Raises
    ------
    MeshError
        Where a face is not flat or crosses itself: with its number, from 1 in the file's order.
    """
    if (polygons.counts == 3).all():
        return polygons.corners.reshape(-1, 3), ()
    notes: list[str] = []
    number, corners, counts = _without_repeats(polygons)
    dropped = int((counts < 3).sum())
    if dropped:
        notes.append(f"dropped {dropped} faces of fewer than three different corners")
    starts = np.cumsum(counts) - counts
    pieces = [np.zeros((0, 3), dtype=np.int64)]
    owners = [np.zeros(0, dtype=np.int64)]
    worst = _Flatness(label, float(np.ptp(polygons.vertices, axis=0).max()))
    for size in np.unique(counts[counts >= 3]).tolist():
        chosen = np.flatnonzero(counts == size)
        rows = corners[starts[chosen, None] + np.arange(size)]
        if size == 3:
            pieces.append(rows)
            owners.append(chosen)
            continue
        triangles = _cut_equal(label, polygons.vertices, rows, number[chosen], worst)
        pieces.append(triangles.reshape(-1, 3))
        owners.append(np.repeat(chosen, size - 2))
    order = np.argsort(np.concatenate(owners), kind="stable")
    return np.concatenate(pieces)[order], (*notes, *worst.notes())


class _Flatness:
    """How far faces are off their planes, and which is the worst."""

    def __init__(self, label: str, extent: float) -> None:
        self.label, self.extent = label, extent
        self.bent, self.worst, self.worst_number = 0, 0.0, 0

    def note(self, off_plane: Float[np.ndarray, " m"], number: Int[np.ndarray, " m"]) -> None:
        """Record faces of one size. Raises MeshError where one is too far off."""
        if len(off_plane) == 0:
            return
        at = int(np.argmax(off_plane))
        if off_plane[at] > MOST_OFF_PLANE * self.extent:
            raise MeshError(
                f"{self.label}: face {number[at]} is not flat: its corners are up to "
                f"{off_plane[at]:.3g} off their plane, {off_plane[at] / self.extent:.1%} of the "
                f"mesh's longest extent, and more than {MOST_OFF_PLANE:.0%} leaves its surface "
                "unknown",
                _TRIANGULATE_REMEDY,
            )
        self.bent += int((off_plane > _RECORDED_OFF_PLANE * self.extent).sum())
        if off_plane[at] > self.worst:
            self.worst, self.worst_number = float(off_plane[at]), int(number[at])

    def notes(self) -> list[str]:
        """What the record says."""
        if not self.bent:
            return []
        return [
            f"cut {self.bent} faces that are not flat, by at most {self.worst / self.extent:.2%} "
            f"of the longest extent (face {self.worst_number})"
        ]


def _without_repeats(
    polygons: Polygons,
) -> tuple[Int[np.ndarray, " m"], Int[np.ndarray, " k"], Int[np.ndarray, " m"]]:
    """Face numbers from 1, and the faces without corners that repeat the one before."""
    counts, corners = polygons.counts, polygons.corners
    face = np.repeat(np.arange(len(counts)), counts)
    before = np.arange(len(corners)) - 1
    starts = np.cumsum(counts) - counts
    filled = counts > 0
    before[starts[filled]] = (starts + counts - 1)[filled]
    keep = corners != corners[before]
    # A face that names one vertex only keeps none of its corners: too few, and dropped for it.
    number = np.arange(1, len(counts) + 1)
    return number, corners[keep], np.bincount(face[keep], minlength=len(counts))


def _cut_equal(
    label: str,
    vertices: Float[np.ndarray, "n 3"],
    rows: Int[np.ndarray, "m c"],
    number: Int[np.ndarray, " m"],
    flatness: _Flatness,
) -> Int[np.ndarray, "m triangles 3"]:
    """Faces of one number of corners; a fan for each convex one, ears for the others."""
    size = rows.shape[1]
    points = vertices[rows]
    points = points - points.mean(axis=1, keepdims=True)
    following = np.roll(points, -1, axis=1)
    area = np.cross(points, following).sum(axis=1) / 2
    twice = np.linalg.norm(area, axis=1)
    normal = area / np.maximum(twice, np.finfo(np.float64).tiny)[:, None]
    flatness.note(np.abs(np.einsum("mck,mk->mc", points, normal)).max(axis=1), number)
    ring = np.arange(1, size - 1)
    fan = np.stack([np.zeros_like(ring), ring, ring + 1], axis=1)
    chosen = np.broadcast_to(fan, (len(rows), size - 2, 3)).copy()
    turn = np.einsum(
        "mck,mk->mc", np.cross(points - np.roll(points, 1, 1), following - points), normal
    )
    plain = _convex(points, following, normal, turn)
    if size == 4:
        # One reflex corner: the diagonal starts there.
        strict = np.abs(turn) > _CROSSING * twice[:, None]
        arrow = strict.all(axis=1) & ((turn < 0).sum(axis=1) == 1)
        reflex = np.argmin(turn, axis=1)[arrow]
        chosen[arrow] = (fan[None] + reflex[:, None, None]) % size
        plain |= arrow
    for at in np.flatnonzero(~plain).tolist():
        chosen[at] = _ears(label, points[at], normal[at], int(number[at]))
    return np.take_along_axis(rows[:, None, :].repeat(size - 2, axis=1), chosen, axis=2)


def _convex(
    points: Float[np.ndarray, "m c 3"],
    following: Float[np.ndarray, "m c 3"],
    normal: Float[np.ndarray, "m 3"],
    turn: Float[np.ndarray, "m c"],
) -> Bool[np.ndarray, " m"]:
    """Every corner turns left, and all of them together once round: twice is a pentagram."""
    edges = following - points
    along = np.einsum("mck,mck->mc", np.roll(edges, 1, axis=1), edges)
    round_about = np.arctan2(turn, along).sum(axis=1)
    return np.asarray((turn > 0).all(axis=1) & (np.abs(round_about - 2 * np.pi) < 0.1))


def _ears(
    label: str, points: Float[np.ndarray, "c 3"], normal: Float[np.ndarray, " 3"], number: int
) -> Int[np.ndarray, "triangles 3"]:
    """One face in its plane, cut by ears: every corner stays, those in line with others too."""
    extent = float(np.abs(points).max())
    flat = points @ _plane(points, normal).T / (extent or 1.0)
    triangles = np.asarray(manifold3d.triangulate([flat]), dtype=np.int64).reshape(-1, 3)
    first, second = (flat[triangles[:, k]] - flat[triangles[:, 0]] for k in (1, 2))
    areas = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    least = float(areas.min(initial=0.0))
    if len(triangles) != len(points) - 2 or least < -_CROSSING or _crosses(flat):
        raise MeshError(f"{label}: face {number} crosses itself", _TRIANGULATE_REMEDY)
    return triangles


def _plane(
    points: Float[np.ndarray, "c 3"], normal: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "2 3"]:
    """Two directions across a normal; where a face has none, those of its largest spread."""
    if not np.linalg.norm(normal) > 0.5:
        _, _, directions = np.linalg.svd(points, full_matrices=True)
        return np.asarray(directions[:2])
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def _crosses(flat: Float[np.ndarray, "c 2"]) -> bool:
    """Whether two edges cross: where they only touch, as around a hole, they do not."""
    if len(flat) > _MOST_PAIRED_CORNERS:
        return False
    ends = np.roll(flat, -1, axis=0)
    along = ends - flat
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    start = _beside(flat, along, flat)
    end = _beside(flat, along, ends)
    apart = (np.minimum(start, end) < -_CROSSING) & (np.maximum(start, end) > _CROSSING)
    return bool((apart & apart.T).any())


def _beside(
    origin: Float[np.ndarray, "c 2"],
    along: Float[np.ndarray, "c 2"],
    points: Float[np.ndarray, "c 2"],
) -> Float[np.ndarray, "c c"]:
    """How far point j lies to the left of line i."""
    offset = points[None] - origin[:, None]
    return np.asarray(along[:, None, 0] * offset[..., 1] - along[:, None, 1] * offset[..., 0])
