"""How worlds look: lights, the table, object colours, and shading normals."""

import colorsys
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import sapien
from jaxtyping import Float, Int, Integer

from pipeline.compiled_code import njit
from pipeline.geometry.mesh import Mesh

_TABLE_COLOUR = (0.52, 0.51, 0.49, 1.0)  # a grey that no object has
_GOLDEN_RATIO = 0.618033988749895  # steps of hue that never come near each other soon
# Edges sharper than this stay edges; flatter ones are shaded smooth.
_CREASE_COSINE = float(np.cos(np.radians(35.0)))


def body_colour(body_id: int) -> tuple[float, float, float]:
    """Colour of a body by its id, linear RGB in [0, 1]; successive ids differ clearly in hue."""
    hue = (0.02 + body_id * _GOLDEN_RATIO) % 1.0
    lightness = (0.46, 0.34, 0.56)[body_id % 3]
    saturation = (0.75, 0.65, 0.60)[body_id % 3]
    return colorsys.hls_to_rgb(hue, lightness, saturation)


def add_lights(world: sapien.Scene, extent_m: float) -> None:
    """A key light with shadows over the table, a cool fill light, and ambient light."""
    world.set_ambient_light([0.32, 0.33, 0.35])
    world.add_directional_light(
        [0.45, 0.55, -1.0],
        [1.75, 1.68, 1.55],
        shadow=True,
        shadow_scale=extent_m * 0.75,
        shadow_near=-2.0,
        shadow_far=2.0,
        shadow_map_size=2048,
    )
    world.add_directional_light([-0.7, -0.3, -0.6], [0.45, 0.50, 0.60])


def table_visual(half_size_m: Sequence[float]) -> sapien.render.RenderBodyComponent:
    """A matt grey box with the given half sides [m]."""
    material = sapien.render.RenderMaterial(
        base_color=list(_TABLE_COLOUR), specular=0.1, roughness=0.9
    )
    visual = sapien.render.RenderBodyComponent()
    visual.attach(sapien.render.RenderShapeBox(list(half_size_m), material))
    return visual


def mesh_visual(
    mesh: Mesh, colour: tuple[float, float, float]
) -> sapien.render.RenderBodyComponent:
    """A mesh in one colour, smooth but for its creases."""
    material = sapien.render.RenderMaterial(base_color=[*colour, 1.0], specular=0.4, roughness=0.45)
    vertices, faces, normals = _shading_arrays(mesh)
    visual = sapien.render.RenderBodyComponent()
    visual.attach(
        sapien.render.RenderShapeTriangleMesh(
            vertices, faces, normals, np.zeros((len(vertices), 2), np.float32), material
        )
    )
    return visual


def crease_normals(mesh: Mesh) -> Float[np.ndarray, "m 3 3"]:
    """Unit shading normal at each face's corners.

    The area-weighted mean over the faces at that vertex that lie within the crease angle of this
    face: smooth over curves, sharp at edges.
    """
    corners = mesh.vertices_m[mesh.faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    order = np.argsort(mesh.faces.ravel(), kind="stable")
    starts = np.searchsorted(mesh.faces.ravel()[order], np.arange(len(mesh.vertices_m) + 1))
    return np.asarray(
        _corner_normals(mesh.faces.astype(np.int64), doubled, order // 3, starts, _CREASE_COSINE)
    )


@njit()
def _corner_normals(
    faces: Int[np.ndarray, "m 3"],
    doubled: Float[np.ndarray, "m 3"],
    faces_by_vertex: Int[np.ndarray, " k"],
    starts: Int[np.ndarray, " n1"],
    crease_cosine: float,
) -> Float[np.ndarray, "m 3 3"]:
    normals = np.zeros((len(faces), 3, 3))
    lengths = np.sqrt((doubled**2).sum(axis=1))
    for i in range(len(faces)):
        for k in range(3):
            vertex = faces[i, k]
            total = np.zeros(3)
            for j in faces_by_vertex[starts[vertex] : starts[vertex + 1]]:
                cosine = (doubled[i] * doubled[j]).sum()
                if j == i or cosine >= crease_cosine * lengths[i] * lengths[j]:
                    total += doubled[j]
            length = np.sqrt((total**2).sum())
            if length > 0.0:
                normals[i, k] = total / length
            else:
                normals[i, k, 2] = 1.0
    return normals


@lru_cache(maxsize=256)
def _shading_arrays(
    mesh: Mesh,
) -> tuple[Float[np.ndarray, "k 3"], Integer[np.ndarray, "m 3"], Float[np.ndarray, "k 3"]]:
    """Vertices, faces and normals with each face's corners its own, ready for upload."""
    vertices = mesh.vertices_m[mesh.faces].reshape(-1, 3).astype(np.float32)
    normals = crease_normals(mesh).reshape(-1, 3).astype(np.float32)
    faces = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
    return vertices, faces, normals
