"""Building blocks of the embedded objects: solids in metres, joined by exact Boolean operations.

Every object is built in a pose in which z is up and its size is near that of the real thing.
"""

import math
from collections.abc import Sequence
from typing import TypeAlias

import manifold3d
import numpy as np
from jaxtyping import Float

Solid: TypeAlias = manifold3d.Manifold
Section: TypeAlias = manifold3d.CrossSection
Outline = Sequence[tuple[float, float]]

# Segments of a full circle, and of one that is small in its object.
ROUND = 64
SMALL_ROUND = 24


def box(size_x: float, size_y: float, size_z: float) -> Solid:
    """A box standing on z = 0, centred in x and y."""
    return Solid.cube((size_x, size_y, size_z), center=True).translate((0, 0, size_z / 2))


def rounded_box(size_x: float, size_y: float, size_z: float, radius: float) -> Solid:
    """A box with all edges rounded, standing on z = 0: the hull of eight balls."""
    ball = Solid.sphere(radius, SMALL_ROUND)
    reach = [(size / 2 - radius) for size in (size_x, size_y, size_z)]
    balls = [
        ball.translate((x * reach[0], y * reach[1], z * reach[2]))
        for x in (-1, 1)
        for y in (-1, 1)
        for z in (-1, 1)
    ]
    return Solid.batch_hull(balls).translate((0, 0, size_z / 2))


def cylinder(
    radius: float, height: float, top_radius: float = -1.0, segments: int = ROUND
) -> Solid:
    """A cylinder or truncated cone on z = 0; a negative top radius means the same as below."""
    return Solid.cylinder(height, radius, top_radius, segments)


def rod(
    start: tuple[float, float, float],
    end: tuple[float, float, float],
    radius: float,
    segments: int = SMALL_ROUND,
) -> Solid:
    """A round rod with ball ends between two points: the hull of two balls."""
    ball = Solid.sphere(radius, segments)
    return Solid.batch_hull([ball.translate(start), ball.translate(end)])


def sweep(
    path: Float[np.ndarray, "n 3"], radius: float, segments: int = SMALL_ROUND, closed: bool = False
) -> Solid:
    """A round wire along a path that does not come near itself, with flat ends if it is open.

    Cross-sections are carried along without twisting (double reflection would do as well; the
    projection of the previous normal is enough for short steps).
    """
    after = np.roll(path, -1, axis=0) - path
    before = path - np.roll(path, 1, axis=0)
    if not closed:
        after[-1], before[0] = before[-1], after[0]
    tangents = after / np.linalg.norm(after, axis=1)[:, None]
    tangents = tangents + before / np.linalg.norm(before, axis=1)[:, None]
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    normal = np.eye(3)[np.argmin(np.abs(tangents[0]))]
    normals = []
    for tangent in tangents:
        normal = normal - (normal @ tangent) * tangent
        normal = normal / np.linalg.norm(normal)
        normals.append(normal)
    sides = np.array(normals)
    ups = np.cross(tangents, sides)
    twist = 0.0
    if closed:
        # What one turn along the path leaves over is spread along it.
        end = sides[-1] - (sides[-1] @ tangents[0]) * tangents[0]
        twist = -math.atan2(float(end @ ups[0]), float(end @ sides[0]))
    turn = np.linspace(0, 2 * math.pi, segments, endpoint=False)[None, :]
    turn = turn + (twist * np.arange(len(path)) / len(path))[:, None]
    rings = path[:, None, :] + radius * (
        np.cos(turn)[..., None] * sides[:, None, :] + np.sin(turn)[..., None] * ups[:, None, :]
    )
    return _tube(rings, closed)


def _tube(rings: Float[np.ndarray, "n k 3"], closed: bool) -> Solid:
    count, around = rings.shape[:2]
    spans = count if closed else count - 1
    faces = []
    for i in range(spans):
        a = i * around + np.arange(around)
        b = i * around + (np.arange(around) + 1) % around
        c, d = (a + around) % (count * around), (b + around) % (count * around)
        faces += [np.column_stack([a, b, d]), np.column_stack([a, d, c])]
    if not closed:
        fan = np.arange(1, around - 1)
        start = np.column_stack([np.zeros_like(fan), fan + 1, fan])
        last = (count - 1) * around
        faces += [start, np.column_stack([np.full_like(fan, last), last + fan, last + fan + 1])]
    solid = Solid(
        manifold3d.Mesh64(
            vert_properties=np.ascontiguousarray(rings.reshape(-1, 3)),
            tri_verts=np.concatenate(faces).astype(np.uint64),
        )
    )
    if solid.status() != manifold3d.Error.NoError:
        raise ValueError(f"the sweep is not a solid: {solid.status()}")
    return solid


def revolve(profile: Outline, segments: int = ROUND) -> Solid:
    """The closed outline (radius, z) turned about z."""
    return Section([np.array(profile, dtype=np.float64)]).revolve(segments)


def plate(outline: Outline, thickness: float) -> Solid:
    """A flat plate of the given outline, from z = 0 up."""
    return Section([np.array(outline, dtype=np.float64)]).extrude(thickness)


def torus(radius: float, tube_radius: float, segments: int = ROUND) -> Solid:
    """A ring about z, centred at the origin."""
    circle = Section.circle(tube_radius, SMALL_ROUND).translate((radius, 0))
    return circle.revolve(segments)


def circle_points(count: int, radius: float, phase: float = 0.0) -> Float[np.ndarray, "n 2"]:
    """Points evenly spaced on a circle in the plane."""
    angle = phase + 2 * math.pi * np.arange(count) / count
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def union(parts: Sequence[Solid]) -> Solid:
    """All parts as one."""
    return Solid.batch_boolean(list(parts), manifold3d.OpType.Add)


def around_z(part: Solid, count: int) -> Solid:
    """The part repeated evenly about z."""
    return union([part.rotate((0, 0, 360 * k / count)) for k in range(count)])
