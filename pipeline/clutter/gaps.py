"""Gaps, contacts and interpenetration between true meshes, measured with FCL."""

from collections.abc import Sequence
from functools import lru_cache

import fcl
import numpy as np
import trimesh
from jaxtyping import Float

from pipeline.geometry.mesh import Mesh
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene

NO_NEIGHBOUR_M = np.inf

Box = tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]
"""Lower and upper corner of an axis-aligned box."""


class Surface:
    """A mesh prepared for distance queries at any pose."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._collision = fcl.CollisionObject(_bounding_volumes(mesh))

    def at(self, world_from_object: Float[np.ndarray, "4 4"]) -> fcl.CollisionObject:
        """FCL's object, moved there. One pose at a time: the next call moves it on."""
        self._collision.setTransform(
            fcl.Transform(world_from_object[:3, :3].copy(), world_from_object[:3, 3].copy())
        )
        return self._collision


@lru_cache(maxsize=256)
def _bounding_volumes(mesh: Mesh) -> fcl.BVHModel:
    """The mesh's tree, built once: it takes far longer than a query."""
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices_m), len(mesh.faces))
    model.addSubModel(mesh.vertices_m, mesh.faces)
    model.endModel()
    return model


def gap_m(
    first: Surface,
    world_from_first: Float[np.ndarray, "4 4"],
    second: Surface,
    world_from_second: Float[np.ndarray, "4 4"],
) -> float:
    """Surface-to-surface distance of two bodies [m]; 0 where their surfaces intersect.

    ``first`` and ``second`` must be different ``Surface`` objects.
    """
    distance = fcl.distance(
        first.at(world_from_first),
        second.at(world_from_second),
        fcl.DistanceRequest(),
        fcl.DistanceResult(),
    )
    return max(float(distance), 0.0)


def pairwise_gaps_m(
    surfaces: Sequence[Surface],
    poses: Sequence[Float[np.ndarray, "4 4"]],
    beyond_m: float = NO_NEIGHBOUR_M,
    known: Float[np.ndarray, "n n"] | None = None,
    known_poses: Sequence[Float[np.ndarray, "4 4"]] = (),
) -> Float[np.ndarray, "n n"]:
    """Gap of every pair [m], inf on the diagonal.

    Parameters
    ----------
    surfaces
        True surfaces of the bodies, in their own frames.
    poses
        world_from_object of each.
    beyond_m
        Pairs whose bounding boxes are farther apart than this are not measured and get the
        boxes' distance, which is a lower bound of the gap.
    known
        Gaps by the same ``beyond_m`` at ``known_poses``; a pair of which neither has moved
        since keeps its own. None: nothing is known.
    known_poses
        Poses at which ``known`` was measured.

    Returns
    -------
    Gaps [m], shape (n, n).
    """
    count = len(surfaces)
    gaps = np.full((count, count), NO_NEIGHBOUR_M)
    still = [np.array_equal(a, b) for a, b in zip(known_poses, poses, strict=False)]
    boxes = [bounds_of(s.mesh, pose) for s, pose in zip(surfaces, poses, strict=True)]
    for i in range(count):
        for j in range(i + 1, count):
            if known is not None and still[i] and still[j]:
                gaps[i, j] = gaps[j, i] = known[i, j]
                continue
            apart = box_distance_m(boxes[i], boxes[j])
            if apart <= beyond_m:
                apart = gap_m(surfaces[i], poses[i], surfaces[j], poses[j])
            gaps[i, j] = gaps[j, i] = apart
    return gaps


def nearest_gaps_m(
    surfaces: Sequence[Surface],
    poses: Sequence[Float[np.ndarray, "4 4"]],
    bounds_m: Float[np.ndarray, "n n"],
) -> Float[np.ndarray, " n"]:
    """Gap of each body to its nearest neighbour [m], measured; inf for a lone body.

    Parameters
    ----------
    surfaces
        True surfaces of the bodies, in their own frames.
    poses
        world_from_object of each.
    bounds_m
        Lower bounds of the gaps, as of ``pairwise_gaps_m``: pairs whose bound exceeds a gap
        already found are not measured.

    Returns
    -------
    Gaps [m], shape (n,).
    """
    nearest = np.full(len(surfaces), NO_NEIGHBOUR_M)
    for i in range(len(surfaces)):
        for j in np.argsort(bounds_m[i], kind="stable"):
            if bounds_m[i, j] >= nearest[i]:
                break
            nearest[i] = min(nearest[i], gap_m(surfaces[i], poses[i], surfaces[j], poses[j]))
    return nearest


def bounds_of(mesh: Mesh, world_from_object: Float[np.ndarray, "4 4"]) -> Box:
    """The mesh's box in the world."""
    vertices = mesh.transformed(world_from_object).vertices_m
    return vertices.min(axis=0), vertices.max(axis=0)


def box_distance_m(first: Box, second: Box) -> float:
    """Distance of two axis-aligned boxes, 0 where they overlap [m]."""
    apart = np.maximum(first[0] - second[1], second[0] - first[1])
    return float(np.linalg.norm(np.maximum(apart, 0.0)))


def penetration_m(first: Mesh, second: Mesh) -> float:
    """How deep vertices of either body lie inside the other [m]; both in the world, closed."""
    return max(_deepest_vertex_m(first, second), _deepest_vertex_m(second, first))


def _deepest_vertex_m(points_of: Mesh, inside_of: Mesh) -> float:
    lower, upper = inside_of.vertices_m.min(axis=0), inside_of.vertices_m.max(axis=0)
    vertices = points_of.vertices_m
    near = vertices[((vertices > lower) & (vertices < upper)).all(axis=1)]
    if len(near) == 0:
        return 0.0
    # From inside a closed surface, the first hit of any ray is seen from behind.
    low, high = near.min(axis=0), near.max(axis=0)
    above = _faces_in(inside_of, low, np.array([high[0], high[1], np.inf]))
    if len(above.faces) == 0:
        return 0.0
    rays = RayScene([above])
    hits = rays.cast(near, np.array([0.0, 0.0, 1.0]))
    inside = np.nan_to_num(rays.normals_at(hits)[:, 2]) > 0
    if not inside.any():
        return 0.0
    # The surface is no farther than the ray went: what lies beyond need not be searched.
    reach = float(hits.distance_m[inside].max())
    around = _faces_in(
        inside_of, near[inside].min(axis=0) - reach, near[inside].max(axis=0) + reach
    )
    surface = trimesh.Trimesh(around.vertices_m, around.faces, process=False)
    _, distance, _ = trimesh.proximity.closest_point(surface, near[inside])
    return float(distance.max())


def _faces_in(
    mesh: Mesh, lower_m: Float[np.ndarray, " 3"], upper_m: Float[np.ndarray, " 3"]
) -> Mesh:
    """The mesh's faces whose boxes reach into a box."""
    corners = mesh.vertices_m[mesh.faces]
    reaching = (corners.min(axis=1) <= upper_m) & (corners.max(axis=1) >= lower_m)
    return Mesh(mesh.vertices_m, mesh.faces[reaching.all(axis=1)])


def gap_mm_by_level(scenes: Sequence[ClutterScene]) -> dict[str, dict[str, float]]:
    """Least and greatest gap between neighbours [mm], by level, over all scenes of the level."""
    gaps = {
        str(level): [
            round(1e3 * float(gap), 3)
            for scene in scenes
            if scene.level == level
            for gap in scene.gaps_m
        ]
        for level in sorted({scene.level for scene in scenes})
    }
    return {level: {"least": min(found), "greatest": max(found)} for level, found in gaps.items()}
