"""First hits of rays with rigid bodies that move, and with the table.

Each body keeps its own `RayScene` in its own frame, made once: moving one costs nothing, where
a scene in the world's frame would be built anew. Rays are sorted out by bounding spheres first.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
from jaxtyping import Float, Int

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert, transform_points
from pipeline.world.raycasting import RayScene

TABLE = 0
NOTHING = -1


@dataclass(frozen=True, eq=False)
class PosedHits:
    """First hit of each ray; arrays of one length n.

    distance_m : inf where nothing is hit. body : id of the body hit, 0 the table, -1 nothing.
    normals : unit, outward, in WCS; zero where nothing is hit.
    """

    distance_m: Float[np.ndarray, " n"]
    body: Int[np.ndarray, " n"]
    normals: Float[np.ndarray, "n 3"]


class PosedBodies:
    """Meshes by id, from 1, each in its own frame; the table is a square at z = 0."""

    def __init__(self, meshes: Mapping[int, Mesh], table_side_m: float) -> None:
        self._meshes = dict(meshes)
        self._half_m = table_side_m / 2

    def at(self, poses: Mapping[int, Float[np.ndarray, "4 4"]]) -> "PosedScene":
        """The bodies that have a pose, there."""
        return PosedScene({i: (self._meshes[i], pose) for i, pose in poses.items()}, self._half_m)


class PosedScene:
    """Bodies where they are; `cast` as in `RayScene`."""

    def __init__(
        self, bodies: Mapping[int, tuple[Mesh, Float[np.ndarray, "4 4"]]], table_half_m: float
    ) -> None:
        self._bodies = bodies
        self._half_m = table_half_m

    def cast(
        self, origins_m: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> PosedHits:
        """First hit of each ray. directions : unit length."""
        origins = np.ascontiguousarray(origins_m, dtype=np.float64)
        rays = np.ascontiguousarray(directions, dtype=np.float64)
        distance, body, normals = _table_hits(origins, rays, self._half_m)
        for body_id, (mesh, pose) in sorted(self._bodies.items()):
            scene, centre, radius = _own_scene(mesh)
            near = _meeting(origins, rays, transform_points(pose, centre), radius)
            if len(near) == 0:
                continue
            hits = scene.cast(*_in_frame(invert(pose), origins, rays, near))
            _take_nearer(
                near,
                hits.distance_m,
                scene.normals_at(hits),
                pose,
                body_id,
                distance,
                body,
                normals,
            )
        return PosedHits(distance, body, normals)


@lru_cache(maxsize=512)
def _own_scene(mesh: Mesh) -> tuple[RayScene, Float[np.ndarray, " 3"], float]:
    """The mesh's rays in its own frame, and a sphere around it."""
    centre = (mesh.vertices_m.min(axis=0) + mesh.vertices_m.max(axis=0)) / 2
    radius = float(np.linalg.norm(mesh.vertices_m - centre, axis=1).max())
    return RayScene([mesh]), centre, radius * (1 + 1e-6)


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _table_hits(
    origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"], half: float
) -> tuple[Float[np.ndarray, " n"], Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    distance = np.full(len(origins), np.inf)
    body = np.full(len(origins), -1, dtype=np.int64)
    normals = np.zeros((len(origins), 3))
    for i in range(len(origins)):
        if rays[i, 2] == 0.0:
            continue
        t = -origins[i, 2] / rays[i, 2]
        x, y = origins[i, 0] + t * rays[i, 0], origins[i, 1] + t * rays[i, 1]
        if t >= 0.0 and abs(x) <= half and abs(y) <= half:
            distance[i] = t
            body[i] = 0
            normals[i, 2] = 1.0
    return distance, body, normals


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _meeting(
    origins: Float[np.ndarray, "n 3"],
    rays: Float[np.ndarray, "n 3"],
    centre: Float[np.ndarray, " 3"],
    radius: float,
) -> Int[np.ndarray, " k"]:
    """Rays that pass through a sphere, or start in it."""
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


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _in_frame(
    frame_from_world: Float[np.ndarray, "4 4"],
    origins: Float[np.ndarray, "n 3"],
    rays: Float[np.ndarray, "n 3"],
    chosen: Int[np.ndarray, " k"],
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, "k 3"]]:
    """The chosen rays seen from another frame."""
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


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _take_nearer(
    rows: Int[np.ndarray, " k"],
    hit_m: Float[np.ndarray, " k"],
    hit_normals: Float[np.ndarray, "k 3"],
    pose: Float[np.ndarray, "4 4"],
    body_id: int,
    distance: Float[np.ndarray, " n"],
    body: Int[np.ndarray, " n"],
    normals: Float[np.ndarray, "n 3"],
) -> None:
    """Keep a body's hits where they are nearer than what is known."""
    for k in range(len(rows)):
        i = rows[k]
        if hit_m[k] < distance[i]:
            distance[i] = hit_m[k]
            body[i] = body_id
            for axis in range(3):
                normals[i, axis] = (
                    pose[axis, 0] * hit_normals[k, 0]
                    + pose[axis, 1] * hit_normals[k, 1]
                    + pose[axis, 2] * hit_normals[k, 2]
                )
