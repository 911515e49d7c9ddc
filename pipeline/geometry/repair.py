"""From a mesh as it came to one watertight body, every change recorded."""

import manifold3d
import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int

from pipeline.errors import MeshError
from pipeline.geometry import topology
from pipeline.geometry.bodies import one_body, outward
from pipeline.geometry.manifolds import from_manifold, to_manifold
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import surface_area, volume
from pipeline.geometry.welding import weld

# Vertices nearer than this share of the longest extent are one vertex written twice.
_MERGE_SHARE = 1e-7
# An open part is a sheet, and no body with an opening, where closing it would take this share of
# its own area: 1 for a flat one, half for a hemisphere, a fifth for a pipe five radii long.
_SHEET_OPENING_SHARE = 0.25
# Loose sheets are labels and marks where together they have at most this share of the bodies' area.
_MOST_LOOSE_SHARE = 0.5
# A cube has V / A^1.5 = 0.068; a sheet whose two sides coincide has none.
_LEAST_FULLNESS = 1e-6


def repair(label: str, mesh: Mesh, max_hole_fraction: float) -> tuple[Mesh, tuple[str, ...]]:
    """The watertight surface, and what was done to get it (nothing: an empty tuple).

    Parameters
    ----------
    label
        The mesh, as errors name it.
    mesh
        As it was read [m].
    max_hole_fraction
        Largest share of the surface that closing its openings may add [1].

    Returns
    -------
    Closed, consistently wound and of one connected body: its outer surface points outward, the
    shells of its cavities, if any, inward, so that volume and mass lack them.

    Raises
    ------
    MeshError
        No honest repair leads there: an open shell has no inside, and no number is made up for it.
        The message names the mesh and the reason.
    """
    done: list[str] = []
    if not topology.is_closed(mesh):
        mesh = _merge_vertices(mesh, done)
        mesh = _drop_bad_faces(mesh, done)
        if len(mesh.faces) == 0:
            raise MeshError(f"{label} has no face of any area", "Mend the mesh")
        mesh = _leave_loose_sheets(mesh, max_hole_fraction, done)
        _refuse_soup(label, mesh)
        mesh = _consistent_winding(mesh, done)
        mesh = _fill_holes(label, mesh, max_hole_fraction, done)
    mesh = _one_body(label, mesh, done)
    mesh = _drop_unused_vertices(mesh)
    _check_closed(label, mesh)
    return mesh, tuple(done)


def _merge_vertices(mesh: Mesh, done: list[str]) -> Mesh:
    tolerance = _MERGE_SHARE * float(mesh.extents_m.max())
    first, merged = weld(mesh.vertices_m, tolerance)
    if len(first) == len(mesh.vertices_m):
        return mesh
    done.append(f"merged {len(mesh.vertices_m) - len(first)} duplicate vertices")
    return Mesh(mesh.vertices_m[first], merged[mesh.faces])


def _drop_bad_faces(mesh: Mesh, done: list[str]) -> Mesh:
    """Without faces that use a vertex twice, repeated faces, and pairs that face each other."""
    a, b, c = mesh.faces.T
    faces = mesh.faces[(a != b) & (b != c) & (c != a)]
    if len(faces) < len(mesh.faces):
        done.append(f"dropped {len(mesh.faces) - len(faces)} degenerate faces")
    if len(faces) == 0:
        return Mesh(mesh.vertices_m, faces)
    _, group = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    group = group.reshape(-1)
    turn = np.array([_turn(face) for face in faces])
    balance = np.bincount(group, weights=turn)
    # Of each set of faces over the same vertices, one stays, in the direction most of them have;
    # as many one way as the other enclose nothing, and none stays.
    order = np.flatnonzero((balance[group] != 0) & (np.sign(balance[group]) == turn))
    _, first = np.unique(group[order], return_index=True)
    keep = np.sort(order[first])
    if len(keep) < len(faces):
        done.append(f"dropped {len(faces) - len(keep)} coincident faces")
    return Mesh(mesh.vertices_m, faces[keep])


def _turn(face: Int[np.ndarray, " 3"]) -> int:
    """+1 if the face names its vertices in cyclically ascending order, else -1."""
    a, b, c = face
    return 1 if (a < b < c) or (b < c < a) or (c < a < b) else -1


def _refuse_soup(label: str, mesh: Mesh) -> None:
    """Edges with three, five... faces bound no volume whichever way the faces are paired."""
    _, counts = topology.undirected_edge_counts(mesh.faces)
    odd = int(((counts > 2) & (counts % 2 == 1)).sum())
    if odd:
        raise MeshError(
            f"{label} is not a surface: {odd} edges have three or more faces that do not pair up",
            "Rebuild the mesh as one closed surface",
        )


def _consistent_winding(mesh: Mesh, done: list[str]) -> Mesh:
    edges = topology.directed_edges(mesh.faces)
    if len(np.unique(edges, axis=0)) == len(edges):
        return mesh
    work = trimesh.Trimesh(mesh.vertices_m, mesh.faces.copy(), process=False)
    trimesh.repair.fix_winding(work)
    turned = int((np.asarray(work.faces) != mesh.faces).any(axis=1).sum())
    if turned == 0:
        return mesh
    done.append(f"turned {turned} faces to one winding")
    return Mesh(mesh.vertices_m, np.asarray(work.faces, dtype=np.int64))


def _fill_holes(label: str, mesh: Mesh, max_hole_fraction: float, done: list[str]) -> Mesh:
    """Each opening closed by a fan about its middle, if all of them are small together."""
    try:
        loops = topology.boundary_loops(mesh.faces)
    except ValueError as error:
        raise MeshError(
            f"{label} is not a surface: {error}", "Rebuild the mesh as one closed surface"
        ) from error
    if not loops:
        return mesh
    fans = [_fan(mesh.vertices_m, loop, len(mesh.vertices_m) + k) for k, loop in enumerate(loops)]
    middles = np.array([mesh.vertices_m[loop].mean(axis=0) for loop in loops])
    vertices = np.concatenate([mesh.vertices_m, middles])
    caps = Mesh(vertices, np.concatenate(fans))
    share = surface_area(caps) / surface_area(mesh)
    if share > max_hole_fraction:
        raise MeshError(
            f"{label} is an open shell: closing its {len(loops)} opening(s) would invent "
            f"{share:.1%} of its surface, more than the {max_hole_fraction:.1%} allowed",
            "Give its wall a thickness, or close it, in a mesh editor",
        )
    done.append(f"closed {len(loops)} hole(s), {share:.2%} of the surface")
    return Mesh(vertices, np.concatenate([mesh.faces, caps.faces]))


def _leave_loose_sheets(mesh: Mesh, max_hole_fraction: float, done: list[str]) -> Mesh:
    """Without open sheets that hang on nothing beside a closed body, as a label's decal.

    They stay, for the body to be closed or refused with them, where closing all openings is
    allowed, where nothing else is there, or where they are too large to be a mark on it.
    """
    groups = topology.components(mesh.faces)
    parts = [topology.submesh(mesh, group) for group in groups]
    areas = np.array([surface_area(part) for part in parts])
    openings = np.array([_opening_area(part) for part in parts])
    sheets = (openings > _SHEET_OPENING_SHARE * areas) & ~_on_shared_edges(mesh, groups)
    if (
        openings.sum() <= max_hole_fraction * areas.sum()
        or sheets.all()
        or areas[sheets].sum() > _MOST_LOOSE_SHARE * areas[~sheets].sum()
    ):
        return mesh
    share = areas[sheets].sum() / areas.sum()
    done.append(f"left off {int(sheets.sum())} loose sheet(s), {share:.1%} of the surface")
    kept = [group for group, sheet in zip(groups, sheets, strict=True) if not sheet]
    return topology.submesh(mesh, np.sort(np.concatenate(kept)))


def _on_shared_edges(mesh: Mesh, groups: list[Int[np.ndarray, " k"]]) -> Bool[np.ndarray, " g"]:
    """Whether a part has an edge that three or more faces share: it hangs on another part."""
    edges = np.sort(topology.directed_edges(mesh.faces), axis=1)
    _, inverse, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    shared = np.any((counts[inverse.reshape(-1)] > 2).reshape(-1, 3), axis=1)
    return np.array([bool(np.any(np.take(shared, group))) for group in groups])


def _opening_area(part: Mesh) -> float:
    """Area of the fans that would close a part; without bound where its openings are no loops."""
    if topology.is_closed(part):
        return 0.0
    try:
        loops = topology.boundary_loops(part.faces)
    except ValueError:
        return float("inf")
    count = len(part.vertices_m)
    middles = np.array([part.vertices_m[loop].mean(axis=0) for loop in loops]).reshape(-1, 3)
    fans = [_fan(part.vertices_m, loop, count + k) for k, loop in enumerate(loops)]
    if not fans:
        return 0.0
    return surface_area(Mesh(np.concatenate([part.vertices_m, middles]), np.concatenate(fans)))


def _fan(
    vertices_m: Float[np.ndarray, "n 3"], loop: Int[np.ndarray, " k"], middle: int
) -> Int[np.ndarray, "f 3"]:
    """Triangles that close a loop: against the direction in which its faces run along it."""
    if len(loop) == 3:
        return loop[::-1].reshape(1, 3)
    return np.column_stack([np.roll(loop, -1), loop, np.full(len(loop), middle)])


def _one_body(label: str, mesh: Mesh, done: list[str]) -> Mesh:
    """One body: parts turned outward, the overlapping united, cavities kept, debris dropped."""
    if topology.is_closed(mesh):
        shells = [topology.submesh(mesh, part) for part in topology.components(mesh.faces)]
        if len(shells) == 1:
            return outward(mesh, done)
    else:  # where surfaces meet in an edge they are taken apart there
        shells = [from_manifold(body) for body in _manifold(label, mesh).decompose()]
    return one_body(label, shells, done)


def _manifold(label: str, mesh: Mesh) -> manifold3d.Manifold:
    try:
        return to_manifold(mesh)
    except ValueError as error:
        raise MeshError(
            f"{label} is not a surface: its faces do not pair up along their edges",
            "Rebuild the mesh as one closed surface",
        ) from error


def _drop_unused_vertices(mesh: Mesh) -> Mesh:
    if len(np.unique(mesh.faces)) == len(mesh.vertices_m):
        return mesh
    return topology.submesh(mesh, np.arange(len(mesh.faces)))


def _check_closed(label: str, mesh: Mesh) -> None:
    if not topology.is_closed(mesh):
        raise MeshError(
            f"{label} cannot be made watertight: after repair some edges still have not two faces",
            "Rebuild the mesh as one closed surface",
        )
    if volume(mesh) < _LEAST_FULLNESS * surface_area(mesh) ** 1.5:
        raise MeshError(f"{label} encloses no volume", "Give its wall a thickness")
