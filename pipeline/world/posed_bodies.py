"""First hits of rays with rigid bodies that move, and with the table.

Each body has a `RayScene` in its own frame that is built once. Rays are transformed into that
frame, so a moved body needs no new scene. Rays that miss the bounding sphere of a body are not cast
at it.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType

import numpy as np
from jaxtyping import Float, Int

from pipeline.compiled_code import njit
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert, transform_points
from pipeline.world.raycasting import RayHits, RayScene, RestingBody
from pipeline.world.scene import PlacedObject
from pipeline.world.table import table_mesh

TABLE = 0  # segmentation holds 0 where no object is


def bodies_at_rest(
    placed: Sequence[PlacedObject], meshes: Mapping[str, Mesh], table_side_m: float
) -> dict[int, Mesh]:
    """The objects of a scene and its table, in WCS, by body id.

    Parameters
    ----------
    placed
        The objects and their poses.
    meshes
        Surface of each object by its name, in the object's own frame [m].
    table_side_m
        Side of the square table at z = 0 [m].

    Returns
    -------
    Body id → surface in WCS [m].
    """
    bodies = {p.body_id: meshes[p.object_name].transformed(p.world_from_object) for p in placed}
    return bodies | {TABLE: table_mesh(table_side_m)}


def surfaces_at_rest(
    bodies: Mapping[int, Mesh],
    placed: Sequence[PlacedObject] = (),
    meshes: Mapping[str, Mesh] = MappingProxyType({}),
) -> RayScene:
    """Surfaces of bodies that do not move; hits name them by their ids.

    Parameters
    ----------
    bodies
        Body id → surface in WCS [m].
    placed
        The objects and their poses, where what is kept for their meshes is to be used.
    meshes
        Surface of each of these objects by its name, in the object's own frame [m].

    Returns
    -------
    The surfaces.
    """
    own = {p.body_id: (meshes[p.object_name], p.world_from_object) for p in placed}
    return RayScene(list(bodies.values()), list(bodies), own)


class PosedBodies:
    """Meshes by id, from 1, each in its own frame; the table is a square at z = 0."""

    def __init__(self, meshes: Mapping[int, Mesh], table_side_m: float) -> None:
        self._meshes = dict(meshes)
        self._half_m = table_side_m / 2

    def at(self, poses: Mapping[int, Float[np.ndarray, "4 4"]]) -> "PosedScene":
        """The bodies for which a pose is given, at their poses; others are left out."""
        return PosedScene({i: (self._meshes[i], pose) for i, pose in poses.items()}, self._half_m)


class PosedScene:
    """Bodies at their poses, with `cast` and `normals_at` as in `RayScene`; hits hold body ids."""

    def __init__(
        self, bodies: Mapping[int, tuple[Mesh, Float[np.ndarray, "4 4"]]], table_half_m: float
    ) -> None:
        self._bodies = bodies
        self._half_m = table_half_m

    @property
    def bodies(self) -> tuple[RestingBody, ...]:
        """Nothing: they move, and few lines are followed before they do."""
        return ()

    def cast(
        self, origins_m: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> RayHits:
        """First hit of each ray with a body or the table.

        Parameters
        ----------
        origins_m
            Origins of the rays in WCS [m], shape (n, 3).
        directions
            Unit directions in WCS, shape (n, 3).

        Returns
        -------
        Hits with the body's id, 0 for the table, -1 for nothing. The ``triangle`` is -1 for the
        table, which has none.
        """
        origins = np.ascontiguousarray(origins_m, dtype=np.float64)
        rays = np.ascontiguousarray(directions, dtype=np.float64)
        distance, body = _table_hits(origins, rays, self._half_m)
        triangle = np.full(len(origins), -1, dtype=np.int64)
        for body_id, (mesh, pose) in sorted(self._bodies.items()):
            scene, centre, radius = _own_scene(mesh)
            near = _meeting(origins, rays, transform_points(pose, centre), radius)
            if len(near) == 0:
                continue
            hits = scene.cast(*_in_frame(invert(pose), origins, rays, near))
            _take_nearer(near, hits.distance_m, hits.triangle, body_id, distance, body, triangle)
        return RayHits(distance, body, triangle)

    def normals_at(self, hits: RayHits) -> Float[np.ndarray, "n 3"]:
        """Unit outward normal, in WCS, of the surface each ray hit; NaN where nothing was hit."""
        normals = np.full((len(hits.body), 3), np.nan)
        normals[hits.body == TABLE] = [0.0, 0.0, 1.0]
        for body_id, (mesh, pose) in self._bodies.items():
            rows = np.flatnonzero(hits.body == body_id)
            if len(rows) == 0:
                continue
            of_body = RayHits(
                hits.distance_m[rows], np.zeros_like(hits.body[rows]), hits.triangle[rows]
            )
            normals[rows] = _turned(pose, _own_scene(mesh)[0].normals_at(of_body))
        return normals


@lru_cache(maxsize=512)
def _own_scene(mesh: Mesh) -> tuple[RayScene, Float[np.ndarray, " 3"], float]:
    """Ray scene of a mesh in its own frame, and centre and radius of a sphere around it [m]."""
    centre = (mesh.vertices_m.min(axis=0) + mesh.vertices_m.max(axis=0)) / 2
    radius = float(np.linalg.norm(mesh.vertices_m - centre, axis=1).max())
    return RayScene([mesh]), centre, radius * (1 + 1e-6)


@njit()
def _table_hits(
    origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"], half: float
) -> tuple[Float[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """Distance to the table and its id, or inf and -1."""
    distance = np.full(len(origins), np.inf)
    body = np.full(len(origins), -1, dtype=np.int64)
    for i in range(len(origins)):
        if rays[i, 2] == 0.0:
            continue
        t = -origins[i, 2] / rays[i, 2]
        x, y = origins[i, 0] + t * rays[i, 0], origins[i, 1] + t * rays[i, 1]
        if t >= 0.0 and abs(x) <= half and abs(y) <= half:
            distance[i] = t
            body[i] = 0
    return distance, body


@njit()
def _meeting(
    origins: Float[np.ndarray, "n 3"],
    rays: Float[np.ndarray, "n 3"],
    centre: Float[np.ndarray, " 3"],
    radius: float,
) -> Int[np.ndarray, " k"]:
    """Indices of the rays that pass through a sphere or start in it."""
    found = np.empty(len(origins), dtype=np.int64)
    count = 0
    for i in range(len(origins)):
        x = centre[0] - origins[i, 0]
        y = centre[1] - origins[i, 1]
        z = centre[2] - origins[i, 2]
        along = x * rays[i, 0] + y * rays[i, 1] + z * rays[i, 2]
        squared = x * x + y * y + z * z
        if squared > radius * radius and along < 0.0:
            continue
        if squared - along * along <= radius * radius:
            found[count] = i
            count += 1
    return found[:count]


@njit()
def _in_frame(
    frame_from_world: Float[np.ndarray, "4 4"],
    origins: Float[np.ndarray, "n 3"],
    rays: Float[np.ndarray, "n 3"],
    chosen: Int[np.ndarray, " k"],
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, "k 3"]]:
    """Origins and directions of the chosen rays in another frame."""
    moved, turned = np.empty((len(chosen), 3)), np.empty((len(chosen), 3))
    t = frame_from_world
    for row in range(len(chosen)):
        i = chosen[row]
        for axis in range(3):
            moved[row, axis] = t[axis, 3] + (
                t[axis, 0] * origins[i, 0] + t[axis, 1] * origins[i, 1] + t[axis, 2] * origins[i, 2]
            )
            turned[row, axis] = (
                t[axis, 0] * rays[i, 0] + t[axis, 1] * rays[i, 1] + t[axis, 2] * rays[i, 2]
            )
    return moved, turned


@njit()
def _take_nearer(
    rows: Int[np.ndarray, " k"],
    hit_m: Float[np.ndarray, " k"],
    hit_triangle: Int[np.ndarray, " k"],
    body_id: int,
    distance: Float[np.ndarray, " n"],
    body: Int[np.ndarray, " n"],
    triangle: Int[np.ndarray, " n"],
) -> None:
    """Store a body's hits where they are nearer than the hits stored so far."""
    for k in range(len(rows)):
        i = rows[k]
        if hit_m[k] < distance[i]:
            distance[i] = hit_m[k]
            body[i] = body_id
            triangle[i] = hit_triangle[k]


@njit()
def _turned(
    pose: Float[np.ndarray, "4 4"], vectors: Float[np.ndarray, "k 3"]
) -> Float[np.ndarray, "k 3"]:
    """Rotate vectors by a pose, one by one.

    The last bits of `transforms.rotate_vectors` depend on the number of vectors; these do not.
    """
    turned = np.empty_like(vectors)
    for k in range(len(vectors)):
        for axis in range(3):
            turned[k, axis] = (
                pose[axis, 0] * vectors[k, 0]
                + pose[axis, 1] * vectors[k, 1]
                + pose[axis, 2] * vectors[k, 2]
            )
    return turned
