"""PLY, text and binary of either order: vertices, faces of any list types, triangle strips."""

import numpy as np
from jaxtyping import Float

from pipeline.errors import MeshError
from pipeline.geometry.formats.ply_bytes import rows_of_bytes
from pipeline.geometry.formats.ply_header import Lists, read_header
from pipeline.geometry.formats.ply_text import rows_of_text
from pipeline.geometry.formats.strips import strip_triangles
from pipeline.geometry.formats.surface import (
    EXPORT_AGAIN,
    Surface,
    check_faces_allowed,
    check_indices,
    surface_of,
)
from pipeline.geometry.polygons import Polygons


def read(label: str, data: bytes, max_faces: int) -> Surface:
    """A PLY file's faces and triangle strips.

    Parameters
    ----------
    label
        The file, for what is said of it.
    data
        The whole file.
    max_faces
        More are refused before memory is taken for them.

    Returns
    -------
    The surface in the file's own unit.

    Raises
    ------
    MeshError
        Where the file is no PLY, ends before its last face, has no faces or too many, or a face
        refers to a vertex that is not there.
    """
    order, elements, body = read_header(label, data, max_faces)
    wanted = [element for element in elements if element.name in ("vertex", "face", "tristrips")]
    vertices = next((element for element in wanted if element.name == "vertex"), None)
    if vertices is None:
        raise MeshError(f"{label} has no vertices", EXPORT_AGAIN)
    for axis in "xyz":
        if not any(held.name == axis and not held.length for held in vertices.properties):
            raise MeshError(f"{label} has vertices with no {axis}", EXPORT_AGAIN)
    if sum(element.count for element in wanted if element is not vertices) == 0:
        raise MeshError(
            f"{label} has {vertices.count} points and no faces",
            "A point cloud must be meshed first",
        )
    reader = rows_of_text if not order else rows_of_bytes
    points, faces, strips = reader(label, data, order, elements, body)
    polygons = _polygons(points, faces, strips)
    check_indices(label, polygons.corners, len(points))
    check_faces_allowed(label, len(polygons.counts), max_faces)
    return surface_of(label, polygons)


def _polygons(
    points: Float[np.ndarray, "n 3"], faces: Lists | None, strips: Lists | None
) -> Polygons:
    corners, counts = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    if faces is not None:
        corners.append(faces.values)
        counts.append(faces.counts)
    if strips is not None:
        # -1 ends a strip, and so does the end of a row.
        ends = np.flatnonzero(strips.values < 0)
        cuts = np.unique(np.concatenate([ends, np.cumsum(strips.counts)]))
        for part in np.split(strips.values, cuts):
            triangles = strip_triangles(part[part >= 0])
            corners.append(triangles.reshape(-1))
            counts.append(np.full(len(triangles), 3, dtype=np.int64))
    return Polygons(points, np.concatenate(corners), np.concatenate(counts))
