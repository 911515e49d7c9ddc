"""First hits of many rays with many bodies: Embree finds the triangle, float64 the distance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from jaxtyping import Bool, Float, Int

from pipeline.compiled_code import njit
from pipeline.geometry.mesh import Mesh
from pipeline.world.cameras import PinholeCamera
from pipeline.world.drawn_pixels import first_faces
from pipeline.world.lines_down import PosedBlocks
from pipeline.world.triangle_blocks import blocks_of

# Embree works in float32. The scene is moved to the origin and scaled to this size, so that neither
# a scene far from its origin nor very small triangles lose digits.
_EMBREE_EXTENT = 100.0
# A ray that passed through an edge is cast again, moved sideways by this share of the scene.
_ASIDE = 1e-6


@dataclass(frozen=True, eq=False)
class RayHits:
    """First hit of each ray; arrays of one length n.

    Attributes
    ----------
    distance_m
        Distance from the ray's origin along its direction [m], shape (n,); inf where nothing is
        hit.
    body
        Number of the body hit, shape (n,): its index in the scene, or its id where the scene has
        ids; -1 where nothing is hit.
    triangle
        Index of the face within that body's mesh, shape (n,); -1 where nothing is hit.
    """

    distance_m: Float[np.ndarray, " n"]
    body: Int[np.ndarray, " n"]
    triangle: Int[np.ndarray, " n"]


@dataclass(frozen=True, eq=False)
class RestingBody:
    """A mesh in its own frame, where it stays the same in all scenes, its pose and its number."""

    mesh: Mesh
    world_from_mesh: Float[np.ndarray, "4 4"]
    body_id: int

    @cached_property
    def posed_blocks(self) -> PosedBlocks:
        """Its triangles as they are drawn, sorted when they are first asked for."""
        return PosedBlocks(blocks_of(self.mesh), self.world_from_mesh, self.body_id)


class Surfaces(Protocol):
    """Surfaces of bodies at which rays can be cast: fixed (`RayScene`), or at poses that change
    (`posed_bodies.PosedScene`)."""

    @property
    def bodies(self) -> tuple["RestingBody", ...]:
        """What can be drawn instead of cast at, highest first; nothing where rays must be cast."""
        ...

    def cast(
        self, origins_m: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> RayHits:
        """First hit of each ray."""
        ...

    def normals_at(self, hits: RayHits) -> Float[np.ndarray, "n 3"]:
        """Unit outward normal where each ray hit; NaN where nothing was hit."""
        ...


class RayScene:
    """Triangle surfaces of several bodies, all in one frame: rays are cast, pictures are drawn.

    The scene is fixed: build another when a body moves.

    Parameters
    ----------
    bodies
        Meshes in the scene's frame, usually the world.
    body_ids
        Number by which `RayHits` names each body, distinct and not negative; by default its index.
    placed
        Body id → a mesh in its own frame and its pose: what the body was made from.

    Raises
    ------
    ValueError
        The bodies have no triangle, or the ids are not one for each body, distinct and from 0.
    """

    def __init__(
        self,
        bodies: Sequence[Mesh],
        body_ids: Sequence[int] | None = None,
        placed: Mapping[int, tuple[Mesh, Float[np.ndarray, "4 4"]]] | None = None,
    ) -> None:
        counts = [len(body.faces) for body in bodies]
        if sum(counts) == 0:
            raise ValueError("a ray scene needs at least one triangle")
        ids = np.arange(len(bodies)) if body_ids is None else np.asarray(body_ids, dtype=np.int64)
        if len(ids) != len(bodies) or len(np.unique(ids)) != len(ids) or ids.min() < 0:
            raise ValueError(f"{len(bodies)} bodies need as many distinct ids from 0, got {ids}")
        vertices, faces = _joined(bodies)
        lower, upper = vertices.min(axis=0), vertices.max(axis=0)
        self._centre = (lower + upper) / 2
        self._scale = _EMBREE_EXTENT / max(float(np.max(upper - lower)), 1e-12)
        self._vertices, self._faces = vertices, faces
        self._body_of_face = np.repeat(ids, counts)
        self._first_face = np.zeros(int(ids.max()) + 1, dtype=np.int64)  # by body id
        self._first_face[ids] = np.cumsum([0, *counts])[:-1]
        own = {int(i): (body, np.eye(4)) for i, body in zip(ids, bodies, strict=True)}
        own |= placed or {}
        tops = [float(body.vertices_m[:, 2].max(initial=-np.inf)) for body in bodies]
        self._bodies = tuple(
            RestingBody(*own[int(ids[i])], body_id=int(ids[i]))
            for i in np.argsort(tops, kind="stable")[::-1]
            if counts[i] > 0
        )

    @cached_property
    def _embree(self) -> rtcore_scene.EmbreeScene:
        """The triangles in Embree's tree, built when the first ray is cast."""
        tree = rtcore_scene.EmbreeScene(robust=True)
        TriangleMesh(
            scene=tree,
            vertices=((self._vertices - self._centre) * self._scale).astype(np.float32),
            indices=self._faces,
        )
        return tree

    @property
    def bodies(self) -> tuple[RestingBody, ...]:
        """The bodies, highest first."""
        return self._bodies

    def normals_at(self, hits: RayHits) -> Float[np.ndarray, "n 3"]:
        """Unit outward normal of the triangle each ray hit; NaN where nothing was hit."""
        return np.asarray(
            _normals(self._vertices, self._faces, hits.body, hits.triangle, self._first_face)
        )

    def barycentric_at(
        self, hits: RayHits, points_m: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, "n 3"]:
        """Weights of the hit triangle's corners at each point on it; NaN where nothing was hit."""
        weights = np.full((len(hits.body), 3), np.nan)
        hit = hits.body >= 0
        face = self._first_face[hits.body[hit]] + hits.triangle[hit]
        a, b, c = self._vertices[self._faces[face]].swapaxes(0, 1)
        doubled = np.cross(b - a, c - a)
        area = (doubled**2).sum(axis=1)
        point = points_m[hit]
        weights[hit, 1] = (np.cross(point - a, c - a) * doubled).sum(axis=1) / area
        weights[hit, 2] = (np.cross(b - a, point - a) * doubled).sum(axis=1) / area
        weights[hit, 0] = 1.0 - weights[hit, 1] - weights[hit, 2]
        return weights

    def cast(
        self,
        origins_m: Float[np.ndarray, "n 3"],
        directions: Float[np.ndarray, "n 3"] | Float[np.ndarray, " 3"],
    ) -> RayHits:
        """Find the first hit of each ray; triangles are hit from both sides.

        Embree only chooses the triangle; the distance to it is computed in float64.

        Parameters
        ----------
        origins_m
            Origins of the rays in the scene's frame [m], shape (n, 3).
        directions
            Directions of any length above zero, shape (n, 3), or (3,) for parallel rays.

        Returns
        -------
        The hits.

        Raises
        ------
        ValueError
            An array has another shape or is not finite, or a direction has length zero.
        """
        origins = np.ascontiguousarray(origins_m, dtype=np.float64)
        if origins.ndim != 2 or origins.shape[1] != 3:
            raise ValueError(f"origins_m must be (n, 3), got {origins.shape}")
        rays = np.ascontiguousarray(
            np.broadcast_to(np.asarray(directions, dtype=np.float64), origins.shape)
        )
        lengths = np.sqrt(np.einsum("ij,ij->i", rays, rays))
        rays, near, along, sound = _prepared(origins, rays, lengths, self._centre, self._scale)
        if not sound:
            raise ValueError("rays need finite origins and finite directions of length above zero")
        if len(origins) == 0:
            nothing = np.empty(0, dtype=np.int64)
            return RayHits(np.empty(0), nothing, nothing)
        face = self._first_faces(near, along)
        distance, from_inside = self._distances(face, origins, rays)
        # About one in a thousand of the rays aimed exactly at an edge passes through it and hits
        # the far wall from inside. Rays that start inside a body are cast again too, and keep
        # their hit.
        again = np.flatnonzero(from_inside)
        if len(again):
            aside = np.array([0.6, -0.48, 0.64]) * (_ASIDE * _EMBREE_EXTENT / self._scale)
            moved = ((origins[again] + aside - self._centre) * self._scale).astype(np.float32)
            second = self._first_faces(moved, along[again])
            nearer, _ = self._distances(second, origins[again], rays[again])
            better = nearer < distance[again]
            face[again[better]] = second[better]
            distance[again[better]] = nearer[better]
        return RayHits(distance, *_named(face, self._body_of_face, self._first_face))

    def first_seen(
        self,
        camera: PinholeCamera,
        shown: Bool[np.ndarray, "h w"],
        directions: Float[np.ndarray, "n 3"],
    ) -> RayHits:
        """First hit of the ray through each chosen pixel's centre, row by row.

        The same as `cast` with `cameras.pixel_rays`, without a tree: triangles are drawn into the
        picture. Where a ray meets the edge of two triangles, either may be named.

        Parameters
        ----------
        camera
            A camera in the scene's frame.
        shown
            The chosen pixels, shape (h, w).
        directions
            Their rays by `cameras.pixel_rays`, shape (n, 3).

        Returns
        -------
        The hits.
        """
        # Scaled as `cast` scales rays: where both name the same face, distances have the same bits.
        rays = directions / np.sqrt(np.einsum("ij,ij->i", directions, directions))[:, None]
        face = first_faces(self._vertices, self._faces, camera, shown, directions)
        origins = np.tile(camera.world_from_camera[:3, 3], (len(rays), 1))
        distance, _ = self._distances(face, origins, rays)
        return RayHits(distance, *_named(face, self._body_of_face, self._first_face))

    def _distances(
        self,
        face: Int[np.ndarray, " n"],
        origins: Float[np.ndarray, "n 3"],
        rays: Float[np.ndarray, "n 3"],
    ) -> tuple[Float[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
        """Distance to each ray's face, and whether it is seen from behind."""
        distance, from_inside = _plane_distances(self._vertices, self._faces, face, origins, rays)
        return distance, from_inside

    def _first_faces(
        self, origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"]
    ) -> Int[np.ndarray, " n"]:
        """Face each unit ray hits first, bodies one after the other; -1 for none.

        Both arrays are of single precision, in Embree's scaled frame.
        """
        # Without `output`, Embree returns only the triangle, which is twice as fast.
        return np.asarray(self._embree.run(origins, rays), dtype=np.int64)


def _joined(
    bodies: Sequence[Mesh],
) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "m 3"]]:
    """Corners of all bodies, and faces that index them, in Embree's integers."""
    vertices = np.empty((sum(len(body.vertices_m) for body in bodies), 3))
    faces = np.empty((sum(len(body.faces) for body in bodies), 3), dtype=np.int32)
    vertex = face = 0
    for body in bodies:
        faces_to, vertices_to = face + len(body.faces), vertex + len(body.vertices_m)
        vertices[vertex:vertices_to] = body.vertices_m
        np.add(body.faces, vertex, out=faces[face:faces_to], casting="same_kind")
        vertex, face = vertices_to, faces_to
    return vertices, faces


@njit()
def _prepared(
    origins: Float[np.ndarray, "n 3"],
    rays: Float[np.ndarray, "n 3"],
    lengths: Float[np.ndarray, " n"],
    centre: Float[np.ndarray, " 3"],
    scale: float,
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"], bool]:
    """Unit rays; origins and rays for Embree, in single precision; and whether all are sound."""
    unit = np.empty_like(rays)
    near, along = np.empty(rays.shape, np.float32), np.empty(rays.shape, np.float32)
    sound = True
    for i in range(len(rays)):
        # Infinite or NaN components make the length so too.
        if not (np.isfinite(lengths[i]) and lengths[i] != 0.0):
            return unit, near, along, False
        for axis in range(3):
            sound = sound and np.isfinite(origins[i, axis])
            unit[i, axis] = rays[i, axis] / lengths[i]
            near[i, axis] = np.float32((origins[i, axis] - centre[axis]) * scale)
            along[i, axis] = np.float32(unit[i, axis])
    return unit, near, along, sound


@njit(error_model="numpy")
def _normals(
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "m 3"],
    body: Int[np.ndarray, " n"],
    triangle: Int[np.ndarray, " n"],
    first_face: Int[np.ndarray, " bodies"],
) -> Float[np.ndarray, "n 3"]:
    """Unit normals of triangles of bodies; NaN where there is no body or no area."""
    normals = np.full((len(body), 3), np.nan)
    for i in range(len(body)):
        if body[i] < 0:
            continue
        corners = faces[first_face[body[i]] + triangle[i]]
        a, b, c = vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        normals[i, 0], normals[i, 1], normals[i, 2] = nx / length, ny / length, nz / length
    return normals


@njit()
def _named(
    face: Int[np.ndarray, " n"],
    body_of_face: Int[np.ndarray, " m"],
    first_face: Int[np.ndarray, " bodies"],
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """Body of each face, and the face's index within it; -1 of none."""
    body, triangle = np.full(len(face), -1), np.full(len(face), -1)
    for i in range(len(face)):
        if face[i] >= 0:
            body[i] = body_of_face[face[i]]
            triangle[i] = face[i] - first_face[body[i]]
    return body, triangle


@njit()
def _plane_distances(
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "m 3"],
    face: Int[np.ndarray, " n"],
    origins: Float[np.ndarray, "n 3"],
    rays: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Distance along unit rays to the plane of the given face, inf where face is -1; and whether
    the face is seen from behind.

    The distance is limited to the range of the face's corners along the ray. Where a face is almost
    parallel to the ray, the float32 hit may lie slightly outside the face, and the ray then meets
    its plane far away.
    """
    distance = np.full(len(face), np.inf)
    from_inside = np.zeros(len(face), dtype=np.bool_)
    for i in range(len(face)):
        if face[i] < 0:
            continue
        corners = faces[face[i]]
        a, b, c = vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]
        x, y, z = rays[i]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        ox, oy, oz = a[0] - origins[i, 0], a[1] - origins[i, 1], a[2] - origins[i, 2]
        along_a = ox * x + oy * y + oz * z
        along_b = along_a + ux * x + uy * y + uz * z
        along_c = along_a + vx * x + vy * y + vz * z
        nearest = min(along_a, along_b, along_c)
        farthest = max(along_a, along_b, along_c)
        slope = nx * x + ny * y + nz * z
        plane = (nx * ox + ny * oy + nz * oz) / slope if slope != 0.0 else nearest
        distance[i] = max(0.0, min(max(plane, nearest), farthest))
        from_inside[i] = slope > 0.0
    return distance, from_inside
