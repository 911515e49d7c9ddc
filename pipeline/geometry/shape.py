"""What a closed mesh says of its object: area, volume, NSVR and class, mass and inertia."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TypedDict

import numpy as np
from jaxtyping import Float

from pipeline.geometry import topology
from pipeline.geometry.mesh import Mesh

TYPICAL_FROM = 2.6  # Supplement V: basic below, typical from here
COMPLEX_FROM = 3.5  # Supplement V: complex from here on


class ShapeClass(StrEnum):
    """Complexity of a shape by its NSVR: Supplement V, Fig. 2 and 3."""

    BASIC = "basic"
    TYPICAL = "typical"
    COMPLEX = "complex"


@dataclass(frozen=True, eq=False)
class MassProperties:
    """A homogeneous solid's mass, in the frame of its mesh."""

    mass_kg: float
    centre_of_mass_m: Float[np.ndarray, " 3"]
    inertia_kg_m2: Float[np.ndarray, "3 3"]
    """About the centre of mass, along the mesh frame's axes."""


class SolidProperties(TypedDict):
    """All that a closed mesh of one density says of its object, by the catalogue's names."""

    area_m2: float
    volume_m3: float
    nsvr: float
    shape_class: ShapeClass
    mass_kg: float
    centre_of_mass_m: Float[np.ndarray, " 3"]
    inertia_kg_m2: Float[np.ndarray, "3 3"]


def solid_properties(mesh: Mesh, density_kg_m3: float) -> SolidProperties:
    """The functions below, together. Raises ValueError where the volume is not positive."""
    mass, value = mass_properties(mesh, density_kg_m3), nsvr(mesh)
    return {
        "area_m2": surface_area(outer_surface(mesh)),
        "volume_m3": volume(mesh),
        "nsvr": value,
        "shape_class": shape_class(value),
        "mass_kg": mass.mass_kg,
        "centre_of_mass_m": mass.centre_of_mass_m,
        "inertia_kg_m2": mass.inertia_kg_m2,
    }


def surface_area(mesh: Mesh) -> float:
    """Sum of the triangle areas [m2]."""
    a, b, c = (mesh.vertices_m[mesh.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def volume(mesh: Mesh) -> float:
    """Signed volume of a closed mesh by the divergence theorem [m3]; positive if outward."""
    return float(_tetrahedra(mesh, _reference(mesh))[1].sum())


def nsvr(mesh: Mesh) -> float:
    """NSVR of Eq. (15): sqrt(A) / cbrt(V) of a closed mesh's outer surface [1]; free of scale.

    Parameters
    ----------
    mesh
        Closed, faces outward, in any unit.

    Returns
    -------
    At least 2.199, that of a ball.

    Raises
    ------
    ValueError
        The volume is not positive: open or inverted surfaces have no NSVR.
    """
    outer = outer_surface(mesh)
    enclosed = volume(outer)
    if not enclosed > 0.0:
        raise ValueError(f"NSVR needs a positive volume, got {enclosed}")
    return float(np.sqrt(surface_area(outer)) / np.cbrt(enclosed))


def outer_surface(mesh: Mesh) -> Mesh:
    """A closed mesh without the inward shells that bound its cavities; itself if it has none."""
    if topology.is_connected(mesh):
        return mesh
    shells = topology.components(mesh.faces)
    reference = _reference(mesh)
    tetrahedra = _tetrahedra(mesh, reference)[1]
    outward = [shell for shell in shells if tetrahedra[shell].sum() > 0.0]
    if len(outward) in (0, len(shells)):
        return mesh
    return topology.submesh(mesh, np.sort(np.concatenate(outward)))


def mean_thickness(mesh: Mesh) -> float:
    """2 V / A over all shells of a closed mesh [m]: a sheet's thickness, a needle's radius."""
    return 2 * volume(mesh) / surface_area(mesh)


def shape_class(value: float) -> ShapeClass:
    """Class of an NSVR: Basic < 2.6 <= Typical < 3.5 <= Complex; Supplement V."""
    if value < TYPICAL_FROM:
        return ShapeClass.BASIC
    return ShapeClass.TYPICAL if value < COMPLEX_FROM else ShapeClass.COMPLEX


def mass_properties(mesh: Mesh, density_kg_m3: float) -> MassProperties:
    """Mass, centre of mass and inertia of a closed mesh filled with one density.

    Exact for the polyhedron: sums over the signed tetrahedra between its faces and one point.

    Parameters
    ----------
    mesh
        Closed, faces outward [m].
    density_kg_m3
        Of the whole inside [kg/m3].

    Returns
    -------
    Mass [kg], centre [m] and inertia about it [kg m2], in the mesh's frame.

    Raises
    ------
    ValueError
        The volume is not positive.
    """
    reference = _reference(mesh)
    corners, volumes = _tetrahedra(mesh, reference)
    total = float(volumes.sum())
    if not total > 0.0:
        raise ValueError(f"mass properties need a positive volume, got {total}")
    corner_sum = corners.sum(axis=1)
    centre = volumes @ corner_sum / (4 * total)
    # Second moments of a tetrahedron with one corner in the origin:
    # integral of x x^T = V / 20 (sum_i c_i c_i^T + s s^T), with s the sum of the corners.
    moments = (
        np.einsum("n,nij,nik->jk", volumes, corners, corners)
        + np.einsum("n,nj,nk->jk", volumes, corner_sum, corner_sum)
    ) / 20 - total * np.outer(centre, centre)
    inertia = density_kg_m3 * (np.trace(moments) * np.eye(3) - moments)
    return MassProperties(total * density_kg_m3, reference + centre, (inertia + inertia.T) / 2)


def _reference(mesh: Mesh) -> Float[np.ndarray, " 3"]:
    """A point near the mesh: sums about it lose no digits when the mesh is far off."""
    return np.asarray(mesh.vertices_m.mean(axis=0))


def _tetrahedra(
    mesh: Mesh, reference: Float[np.ndarray, " 3"]
) -> tuple[Float[np.ndarray, "m 3 3"], Float[np.ndarray, " m"]]:
    """Corners relative to the reference, and signed volumes, of face-to-reference tetrahedra."""
    corners = (mesh.vertices_m - reference)[mesh.faces]
    volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return corners, volumes
