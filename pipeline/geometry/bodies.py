"""The closed parts of one mesh as one body: overlapping parts united, cavities kept, specks left.

A shell that lies wholly inside another, touching it nowhere, bounds a cavity, whichever way its
faces point in the file: exporters lose the winding, and a solid hidden in a solid says nothing
about either. A shell inside a cavity is solid again.
"""

from dataclasses import dataclass

import fcl
import manifold3d
import numpy as np

from pipeline.errors import MeshError
from pipeline.geometry import topology
from pipeline.geometry.manifolds import from_manifold, to_manifold
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import surface_area, volume

# What hangs on nothing is debris of the scan where all of it together is this little of the body.
_DEBRIS_VOLUME_SHARE = 1e-3
_DEBRIS_AREA_SHARE = 2e-2
# Surfaces nearer than this share of the longest extent touch: single precision, a few operations.
_TOUCHING_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class _Part:
    """A closed part, outward; the solid it bounds; whether it had to be turned for that."""

    mesh: Mesh
    solid: manifold3d.Manifold
    turned: bool


def one_body(label: str, shells: list[Mesh], done: list[str]) -> Mesh:
    """One closed body of all shells: its outer surface outward, its cavities' shells inward.

    Parameters
    ----------
    label
        What a person calls the mesh.
    shells
        Closed parts, wound either way.
    done
        What was done to the mesh so far; it is added to.

    Returns
    -------
    The closed mesh.

    Raises
    ------
    MeshError
        The shells enclose nothing, or are several bodies that do not touch.
    """
    parts = [_part(label, shell) for shell in shells if volume(shell) != 0.0]
    if not parts:
        raise MeshError(f"{label} encloses no volume", "Give its wall a thickness")
    if len(parts) < len(shells):
        done.append(f"dropped {len(shells) - len(parts)} parts without volume")
    holders = _holders(parts)
    solids = [k for k, above in enumerate(holders) if len(above) % 2 == 0]
    cavities = [k for k, above in enumerate(holders) if len(above) % 2 == 1]
    turned = sum(parts[k].turned for k in solids) + sum(not parts[k].turned for k in cavities)
    if turned:
        done.append(f"turned {turned} part(s) inside out")
    if len(parts) == 1:
        return parts[0].mesh
    hollowed = []
    for k in solids:
        # A cavity belongs to the innermost shell around it.
        own = [c for c in cavities if k in holders[c] and len(holders[c]) == len(holders[k]) + 1]
        hollowed.append(_difference(parts[k].solid, [parts[c].solid for c in own]))
    if cavities:
        done.append(f"kept {len(cavities)} cavities")
    if len(solids) > 1:
        done.append(f"united {len(solids)} parts")
    united = manifold3d.Manifold.batch_boolean(hollowed, manifold3d.OpType.Add)
    return _largest(label, from_manifold(united), done)


def _part(label: str, shell: Mesh) -> _Part:
    mesh = outward(shell, [])
    try:
        return _Part(mesh, to_manifold(mesh), turned=mesh is not shell)
    except ValueError as error:
        raise MeshError(
            f"{label} is not a surface: its faces do not pair up along their edges",
            "Rebuild the mesh as one closed surface",
        ) from error


def outward(mesh: Mesh, done: list[str]) -> Mesh:
    """The closed part with its faces pointing out of what it encloses."""
    if volume(mesh) >= 0.0:
        return mesh
    done.append("turned a part inside out")
    return Mesh(mesh.vertices_m, mesh.faces[:, ::-1])


def _holders(parts: list[_Part]) -> list[list[int]]:
    """For each part, those that it lies wholly inside of, touching them nowhere."""
    lows = np.array([part.mesh.vertices_m.min(axis=0) for part in parts])
    highs = np.array([part.mesh.vertices_m.max(axis=0) for part in parts])
    found: list[list[int]] = []
    for part, low, high in zip(parts, lows, highs, strict=True):
        around = np.flatnonzero((lows < low).all(axis=1) & (high < highs).all(axis=1))
        found.append(
            [
                int(k)
                for k in around
                if _apart(part.mesh, parts[k].mesh) and (part.solid - parts[k].solid).is_empty()
            ]
        )
    return found


def _apart(inner: Mesh, outer: Mesh) -> bool:
    """Whether two surfaces touch nowhere."""
    distance = fcl.distance(
        fcl.CollisionObject(_tree(inner)),
        fcl.CollisionObject(_tree(outer)),
        fcl.DistanceRequest(),
        fcl.DistanceResult(),
    )
    return bool(distance > _TOUCHING_SHARE * float(outer.extents_m.max()))


def _tree(mesh: Mesh) -> fcl.BVHModel:
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices_m), len(mesh.faces))
    model.addSubModel(mesh.vertices_m, mesh.faces)
    model.endModel()
    return model


def _difference(
    solid: manifold3d.Manifold, cavities: list[manifold3d.Manifold]
) -> manifold3d.Manifold:
    for cavity in cavities:
        solid = solid - cavity
    return solid


def _largest(label: str, mesh: Mesh, done: list[str]) -> Mesh:
    """The largest body with its cavities, if the others together are debris."""
    shells = [topology.submesh(mesh, faces) for faces in topology.components(mesh.faces)]
    outer = sorted((s for s in shells if volume(s) > 0.0), key=lambda shell: -volume(shell))
    body, rest = outer[0], outer[1:]
    if rest:
        volumes = sum(volume(shell) for shell in rest) / volume(body)
        areas = sum(surface_area(shell) for shell in rest) / surface_area(body)
        if volumes > _DEBRIS_VOLUME_SHARE or areas > _DEBRIS_AREA_SHARE:
            raise MeshError(
                f"{label} is {len(outer)} bodies that do not touch, not one rigid object",
                "Put each body into a file of its own, or join them",
            )
        done.append(f"dropped {len(rest)} specks, {volumes:.1e} of the volume")
    inner = [shell for shell in shells if volume(shell) < 0.0]
    if not inner:
        return body
    solid = to_manifold(body)
    own = [
        shell
        for shell in inner
        if (to_manifold(Mesh(shell.vertices_m, shell.faces[:, ::-1])) - solid).is_empty()
    ]
    return topology.concatenate([body, *own])
