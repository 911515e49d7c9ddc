"""What a reader makes of a file, and what every reader refuses in the same words."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pipeline.errors import MeshError
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.polygons import Polygons, cut

EXPORT_AGAIN = "Export the mesh again, or fetch the file again"


@dataclass(frozen=True, eq=False)
class Surface:
    """A file's triangles in its own unit."""

    mesh: Mesh
    unit: str | None = None
    """The unit that the format itself fixes."""
    notes: tuple[str, ...] = ()
    """What the object's record should say of how the file was read."""
    beside: tuple[bytes, ...] = ()
    """Bytes of further files that it is made of."""


def surface_of(label: str, polygons: Polygons, notes: tuple[str, ...] = ()) -> Surface:
    """The polygons in triangles, over those of their vertices that they use.

    Parameters
    ----------
    label
        The file, for what is said of it.
    polygons
        Faces whose corners are in range.
    notes
        What the object's record should say already.

    Returns
    -------
    Triangles, with what was done to get them.

    Raises
    ------
    MeshError
        Where no face has three corners, a vertex that is used is not finite, or a face cannot be
        cut.
    """
    if not (polygons.counts >= 3).any():
        raise MeshError(f"{label} has no faces of three or more corners", "Export its surface")
    used = np.zeros(len(polygons.vertices), dtype=bool)
    used[polygons.corners] = True
    vertices, corners = polygons.vertices, polygons.corners
    if not used.all():
        vertices, corners = vertices[used], (np.cumsum(used) - 1)[corners]
    check_finite(label, vertices)
    triangles, more = cut(label, Polygons(vertices, corners, polygons.counts))
    return Surface(Mesh(vertices, triangles), notes=(*notes, *more))


def check_finite(label: str, vertices: Float[np.ndarray, "n 3"]) -> None:
    """Raise MeshError for vertices that are NaN or infinite."""
    bad = int((~np.isfinite(vertices)).any(axis=1).sum())
    if bad:
        what = "a vertex that is" if bad == 1 else f"{bad} vertices that are"
        raise MeshError(f"{label} has {what} NaN or infinite", "Mend the mesh")


def check_indices(label: str, corners: Int[np.ndarray, " k"], vertices: int) -> None:
    """Raise MeshError where a corner, counted from 0, is none of the vertices."""
    if len(corners) == 0:
        return
    for worst in (int(corners.max()), int(corners.min())):
        if not 0 <= worst < vertices:
            raise MeshError(
                f"{label} has a face that refers to vertex {worst}, and it has vertices 0 to "
                f"{vertices - 1}",
                "Export the mesh again",
            )


def check_faces_allowed(label: str, count: int, max_faces: int) -> None:
    """Raise MeshError where a file declares, or places, too many faces."""
    if count > max_faces:
        raise MeshError(
            f"{label} declares {count} faces, more than the {max_faces} allowed",
            "Simplify the mesh, or raise objects.max_faces",
        )


def check_long_enough(label: str, present: int, declared: int, least: bool = False) -> None:
    """Raise MeshError where fewer bytes are there than a header declares."""
    if present < declared:
        at_least = "at least " if least else ""
        raise MeshError(
            f"{label} is truncated: its header declares {at_least}{declared} bytes, "
            f"{present} are there",
            EXPORT_AGAIN,
        )


def cut_or_malformed(row: int, rows: int) -> str:
    """What is wrong with a row that is too short: the last one was cut, another was not."""
    return "truncated" if row == rows - 1 else "malformed"
