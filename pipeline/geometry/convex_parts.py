"""Convex parts of a closed mesh for collision: CoACD, kept by content.

Wei et al., "Approximate Convex Decomposition for 3D Meshes with Collision-Aware Concavity and
Tree Search", 2022.
"""

import hashlib
import importlib.metadata
import io
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from pipeline.artifacts.kept_bytes import kept_bytes
from pipeline.config.objects import ConvexPartsConfig
from pipeline.geometry.manifolds import from_manifold, to_manifold
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import outer_surface, volume

# PhysX cooks convex meshes of up to 255 vertices; fewer make contacts cheaper.
_MOST_VERTICES = 127
# A mesh that fills this share of its convex hull is its own only part.
_CONVEX_SHARE = 0.995
_SEED = 0
_LLOYD_STEPS = 60
_CUBE_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
# Parts with less of the mesh's volume than this have lost some of it.
_LEAST_COVERAGE = 0.9
_MOST_DECIMATION_SHARE = 0.02
# Bodies that are not thin change by 3 % at most.
_MOST_VOLUME_CHANGE = 0.1
# Distances of so many points to so many planes are taken at once: 64 MiB.
_MOST_DISTANCES = 1 << 23
# Part of the cache key: raise it when what is computed from equal inputs changes.
_METHOD_VERSION = 9


class TooIntricateError(ValueError):
    """A mesh has too many details to be cut into convex parts; to be read behind its name."""


def convex_parts(mesh: Mesh, config: ConvexPartsConfig, cache_dir: Path) -> tuple[Mesh, ...]:
    """Closed convex meshes that together cover a closed mesh, cavities filled, in its frame.

    At most config.max_parts parts of at most 127 vertices each; deterministic. Results are kept
    in cache_dir by a digest of mesh, parameters and CoACD's version; a damaged entry is
    recomputed. Raises TooIntricateError as `decompose` does.
    """
    mesh = outer_surface(mesh)
    entry = cache_dir / f"{cache_key(mesh, config)}.parts"
    return _unpacked(kept_bytes(entry, lambda: _packed(decompose(mesh, config))))


def decompose(mesh: Mesh, config: ConvexPartsConfig) -> tuple[Mesh, ...]:
    """The convex parts, computed: the hull alone if the mesh is convex, else by CoACD.

    The mesh is decimated to config.input_faces first, whose error is far below the concavity
    that a part may have. CoACD's measure is relative to the mesh's size, so the parts of a rescaled
    mesh are the rescaled parts. Raises TooIntricateError where more than config.max_cut_faces
    are left, as of a sponge: CoACD's work has no bound but that of its faces.
    """
    hull = convex_hull(mesh.vertices_m)
    if volume(mesh) >= _CONVEX_SHARE * volume(hull):
        return (_within_limit(hull),)
    coarse = decimate(mesh, config.input_faces)
    if len(coarse.faces) > config.max_cut_faces:
        raise TooIntricateError(
            f"keeps {len(coarse.faces)} faces when it is simplified, more than the "
            f"{config.max_cut_faces} that are cut into convex parts"
        )
    parts = _run_coacd(coarse, config, "off")
    if sum(volume(part) for part in parts) < _LEAST_COVERAGE * volume(mesh):
        parts = _run_coacd(coarse, config, "on")
    return tuple(_within_limit(part) for part in covering(parts, mesh.vertices_m))


def _run_coacd(
    mesh: Mesh, config: ConvexPartsConfig, preprocess: Literal["on", "off"]
) -> tuple[Mesh, ...]:
    """CoACD's parts. Its preprocessing rebuilds the surface, at up to six times the cost and
    with thicker walls: needed only where cutting the closed surface itself loses material."""
    # Not at the top: SAPIEN must be loaded before it in a process that renders (see
    # pipeline/physics/vulkan.py), and most processes need no CoACD.
    import coacd

    coacd.set_log_level("off")
    raw = coacd.run_coacd(
        coacd.Mesh(mesh.vertices_m, mesh.faces.astype(np.int32)),
        threshold=config.concavity,
        max_convex_hull=config.max_parts,
        preprocess_mode=preprocess,
        resolution=config.resolution,
        mcts_iterations=config.search_iterations,
        mcts_nodes=config.search_nodes,
        preprocess_resolution=config.preprocess_resolution,
        seed=_SEED,
    )
    hulls = [convex_hull(np.asarray(vertices, dtype=np.float64)) for vertices, _ in raw]
    return tuple(hulls)


def covering(parts: Sequence[Mesh], vertices_m: Float[np.ndarray, "n 3"]) -> list[Mesh]:
    """The parts, grown so that every vertex of the true surface lies in one of them.

    CoACD works on a coarser surface: without this, objects would sink into what they rest on.
    Each vertex goes to the part it lies least outside of, and that part's hull takes it in.
    """
    outside = np.stack([_outside_of(part, vertices_m) for part in parts], axis=1)
    owner = np.argmin(outside, axis=1)
    missing = outside[np.arange(len(vertices_m)), owner] > 0.0
    return [
        convex_hull(np.concatenate([part.vertices_m, vertices_m[missing & (owner == index)]]))
        for index, part in enumerate(parts)
    ]


def _outside_of(part: Mesh, points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
    """How far each point lies beyond the farthest face plane of a convex part; below 0 inside."""
    a, b, c = (part.vertices_m[part.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    solid = lengths > 0
    normals = normals[solid] / lengths[solid, None]
    offsets = np.einsum("ij,ij->i", normals, a[solid])
    step = max(1, _MOST_DISTANCES // max(1, len(offsets)))
    found = [
        (points_m[start : start + step] @ normals.T - offsets).max(axis=1)
        for start in range(0, len(points_m), step)
    ]
    return np.concatenate(found)


def convex_hull(points_m: Float[np.ndarray, "n 3"]) -> Mesh:
    """The convex hull as a closed mesh with outward faces.

    Parameters
    ----------
    points_m
        Any points, shape (n, 3) [m].

    Returns
    -------
    The hull.

    Raises
    ------
    scipy.spatial.QhullError
        The points lie in a plane.
    """
    # QJ moves flat points aside instead of merging facets: slivers of CoACD pass.
    hull = ConvexHull(points_m, qhull_options="QJ Pp")
    used, inverse = np.unique(hull.simplices, return_inverse=True)
    vertices, faces = points_m[used], inverse.reshape(-1, 3)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return Mesh(vertices, faces.astype(np.int64))


def decimate(mesh: Mesh, faces: int) -> Mesh:
    """A closed mesh simplified until it has at most the given number of faces; still closed.

    Edges collapse within a tolerance, which doubles from a ten-thousandth of the longest extent
    to at most 2 %: beyond that the shape matters more than the count. It ends before that where the
    walls of a thin body begin to pass through each other, which its volume tells: at 2 % of its
    width a plate is inside out.
    """
    extent, whole = float(mesh.extents_m.max()), volume(mesh)
    coarse, share = mesh, 1e-4
    solid = to_manifold(mesh)
    while len(coarse.faces) > faces and share <= _MOST_DECIMATION_SHARE:
        coarser = from_manifold(solid.simplify(share * extent))
        if len(coarser.faces) == 0 or abs(volume(coarser) - whole) > _MOST_VOLUME_CHANGE * whole:
            break
        coarse = coarser
        share *= 2
    return coarse


def cache_key(mesh: Mesh, config: ConvexPartsConfig) -> str:
    """SHA-256 over everything that the parts depend on, as hexadecimal digits."""
    digest = hashlib.sha256()
    digest.update(np.ascontiguousarray(mesh.vertices_m, dtype="<f8").tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, dtype="<i8").tobytes())
    version = importlib.metadata.version("coacd")
    settings = (config.model_dump_json(), version, _METHOD_VERSION, len(mesh.vertices_m))
    digest.update(repr(settings).encode())
    return digest.hexdigest()


def _within_limit(hull: Mesh) -> Mesh:
    """A hull of at most 127 vertices, so of fewer than the 255 faces PhysX takes.

    Of vertices spread evenly over all directions (good for round bodies) and vertices taken in
    greedily (good for flat sides), those are kept whose hull lacks less; half of what it lacks
    is made up by growing it, so that it errs to both sides alike.
    """
    points = hull.vertices_m
    if len(points) <= _MOST_VERTICES:
        return hull
    tried = [convex_hull(points[chosen]) for chosen in (_spread(points), _greedy(points))]
    lacking, kept = min(
        ((max(float(_outside_of(mesh, points).max()), 0.0), mesh) for mesh in tried),
        key=lambda pair: pair[0],
    )
    centre = kept.vertices_m.mean(axis=0)
    reach = float(np.linalg.norm(kept.vertices_m - centre, axis=1).mean())
    grown = centre + (kept.vertices_m - centre) * (1.0 + 0.5 * lacking / reach)
    return Mesh(grown, kept.faces)


def _spread(points: Float[np.ndarray, "n 3"]) -> list[int]:
    """Support points of directions spread evenly over the sphere."""
    return _support(points, _even_directions(_MOST_VERTICES))


@lru_cache
def _even_directions(count: int) -> Float[np.ndarray, "k 3"]:
    """Unit vectors that leave no large gap: a Fibonacci lattice, evened out by Lloyd's steps."""
    directions, sky = _fibonacci(count), _fibonacci(100 * count)
    for _ in range(_LLOYD_STEPS):
        nearest = np.argmax(sky @ directions.T, axis=1)
        sums = np.stack([np.bincount(nearest, sky[:, k], count) for k in range(3)], axis=1)
        directions = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    return directions


def _fibonacci(count: int) -> Float[np.ndarray, "k 3"]:
    index = np.arange(count) + 0.5
    height, turn = 1.0 - 2.0 * index / count, np.pi * (1.0 + 5.0**0.5) * index
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)


def _greedy(points: Float[np.ndarray, "n 3"]) -> list[int]:
    """Each time the point farthest outside the hull of those before."""
    chosen = _support(points, np.concatenate([np.eye(3), -np.eye(3), _CUBE_CORNERS]))
    for _ in range(_MOST_VERTICES - len(chosen)):
        chosen.append(int(np.argmax(_outside_of(convex_hull(points[chosen]), points))))
    return chosen


def _support(points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "k 3"]) -> list[int]:
    return list(dict.fromkeys(np.argmax(directions @ points.T, axis=1).tolist()))


def _packed(parts: tuple[Mesh, ...]) -> bytes:
    """Convex parts as the bytes of an .npz file."""
    data = io.BytesIO()
    np.savez_compressed(
        data,
        vertices_m=np.concatenate([part.vertices_m for part in parts]),
        faces=np.concatenate([part.faces for part in parts]),
        vertex_ends=np.cumsum([len(part.vertices_m) for part in parts]),
        face_ends=np.cumsum([len(part.faces) for part in parts]),
    )
    return data.getvalue()


def _unpacked(data: bytes) -> tuple[Mesh, ...]:
    """The parts that `_packed` wrote."""
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        vertices = np.split(arrays["vertices_m"], arrays["vertex_ends"][:-1])
        faces = np.split(arrays["faces"], arrays["face_ends"][:-1])
    return tuple(Mesh(*part) for part in zip(vertices, faces, strict=True))
