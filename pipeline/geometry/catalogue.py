"""The object catalogue: from a source mesh to everything later stages need of an object."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.convex_parts import TooIntricateError, convex_parts
from pipeline.geometry.descriptor import ShapeDescriptor, describe
from pipeline.geometry.masses import density_of
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.mesh_files import MeshSource
from pipeline.geometry.object_names import is_named
from pipeline.geometry.repair import repair
from pipeline.geometry.rescaling import draw_stretch, draw_target_extent, rescale
from pipeline.geometry.shape import (
    ShapeClass,
    mass_properties,
    mean_thickness,
    nsvr,
    shape_class,
    solid_properties,
)
from pipeline.geometry.units import METRES_PER_UNIT, UnitSource

Material = Literal["opaque", "transparent"]
EMBEDDED = "parametric"
"""Label and digest of an embedded object's source."""


@dataclass(frozen=True, eq=False)
class MeasuredObject:
    """A source repaired to a watertight surface, at its own size; cheap to make."""

    source: MeshSource
    mesh: Mesh
    repairs: tuple[str, ...]
    nsvr: float
    shape_class: ShapeClass
    descriptor: ShapeDescriptor

    @property
    def content(self) -> str:
        """What the object is known by, whatever it is called."""
        return content_of(self.source.name, self.source.sha256)

    @property
    def embedded(self) -> bool:
        """Whether it is of the embedded set, and no file's."""
        return self.source.sha256 == EMBEDDED

    @property
    def origin(self) -> str:
        """A mesh file's path in its folder, or an embedded object's name."""
        return self.source.name if self.embedded else self.source.label

    def in_unit(self, unit: str, config: ObjectsConfig) -> "MeasuredObject":
        """The same object, its file read in another unit. Raises MeshError where it is too thin."""
        source = self.source.in_unit(unit)
        factor = METRES_PER_UNIT[unit] / METRES_PER_UNIT[self.source.unit]
        mesh, shape = self.mesh.scaled(factor), self.descriptor
        check_thickness(source.label, mesh, config)
        descriptor = replace(shape, length=shape.length * factor)
        return replace(self, source=source, mesh=mesh, descriptor=descriptor)

    def called(self, name: str) -> "MeasuredObject":
        """The same object under another name."""
        return replace(self, source=replace(self.source, name=name))


@dataclass(frozen=True, eq=False)
class CatalogueObject:
    """An object at its final size; its frame's origin is its centre of mass."""

    name: str
    source: str
    """The source file's path in its folder, or `parametric`."""
    source_sha256: str
    """Digest of the source file; `parametric` for the embedded objects."""
    unit: str
    unit_known_by: UnitSource
    repairs: tuple[str, ...]
    scale: float
    """Rescaled size over the source's size in metres [1]."""
    stretch: Float[np.ndarray, " 3"]
    """Further factors along the object's axes; ones but for a stretched copy [1]."""
    target_extent_m: float
    area_m2: float
    volume_m3: float
    nsvr: float
    """Eq. (15)."""
    shape_class: ShapeClass
    mass_kg: float
    centre_of_mass_m: Float[np.ndarray, " 3"]
    """In the object's frame: zero to rounding."""
    inertia_kg_m2: Float[np.ndarray, "3 3"]
    """About the centre of mass, along the object frame's axes."""
    mesh: Mesh
    convex_parts: tuple[Mesh, ...]
    """Closed convex collision shapes, in the object's frame."""
    material: Material
    """What depth cameras make of it."""
    family: str = ""
    """Objects of one family are alike, and all in one split."""
    copies: tuple[str, ...] = ()
    """Further files of the same surface, left out."""
    key: str = ""
    """Digest of what shape, size, mass and appearance rest on; empty where it is not told."""

    @property
    def content(self) -> str:
        """What the object is known by, whatever it is called."""
        return content_of(self.name, self.source_sha256)

    @property
    def density_kg_m3(self) -> float:
        """Mean density of the closed mesh [kg/m3]."""
        return self.mass_kg / self.volume_m3


def content_of(name: str, sha256: str) -> str:
    """Digest of a mesh's file; an embedded object goes by its name.

    The last digits of an embedded object's vertices may differ between machines.
    """
    return name if sha256 == EMBEDDED else sha256


def measure_object(source: MeshSource, config: ObjectsConfig) -> MeasuredObject:
    """Repair and NSVR. Raises MeshError where the source must be refused."""
    mesh, repairs = repair(source.label, source.mesh, config.max_hole_fraction)
    check_thickness(source.label, mesh, config)
    value = nsvr(mesh)
    changes = (*source.notes, *repairs)
    return MeasuredObject(source, mesh, changes, value, shape_class(value), describe(mesh))


def check_thickness(label: str, mesh: Mesh, config: ObjectsConfig) -> None:
    """Raise MeshError for a sheet or needle too thin at the largest size it may be given."""
    largest = config.target_extent_max_m if config.rescaled else float(mesh.extents_m.max())
    thickness = mean_thickness(mesh) / float(mesh.extents_m.max()) * largest
    if thickness < config.min_thickness_m:
        raise MeshError(
            f"{label} is too thin: {1e3 * thickness:.2g} mm (2 V / A) at a length of "
            f"{1e3 * largest:.0f} mm, and pad and physics need {1e3 * config.min_thickness_m:.2g}",
            "Give it a thickness, or lower objects.min_thickness_m",
        )


def finish_object(
    measured: MeasuredObject,
    config: ObjectsConfig,
    rng: np.random.Generator,
    cache_dir: Path,
    mass_kg: float | None = None,
) -> CatalogueObject:
    """Rescaling, centring, mass properties and convex parts (S-1.01's object, at its size).

    rng: draws the target extent, then the density. cache_dir: where convex parts are kept.
    mass_kg: of the object at its own size, where it is known.
    """
    target = _target_extent_m(measured.mesh, config, rng)
    density_kg_m3 = density_of(measured.mesh, mass_kg, config, rng)
    scaled, scale = rescale(measured.mesh, target)
    centre = mass_properties(scaled, density_kg_m3).centre_of_mass_m
    mesh = Mesh(scaled.vertices_m - centre, scaled.faces)
    source = measured.source
    return CatalogueObject(
        name=source.name,
        source=source.label,
        source_sha256=source.sha256,
        unit=source.unit,
        unit_known_by=source.unit_known_by,
        repairs=measured.repairs,
        scale=scale,
        stretch=np.ones(3),
        target_extent_m=target,
        **solid_properties(mesh, density_kg_m3),
        mesh=mesh,
        convex_parts=_parts_of(measured.origin, mesh, config, cache_dir),
        material=material_of(source.name, config),
    )


def _parts_of(label: str, mesh: Mesh, config: ObjectsConfig, cache_dir: Path) -> tuple[Mesh, ...]:
    """The convex parts. Raises MeshError where the mesh is too intricate."""
    try:
        return convex_parts(mesh, config.convex, cache_dir)
    except TooIntricateError as error:
        raise MeshError(
            f"{label} {error}", "Simplify the mesh, or raise objects.convex.max_cut_faces"
        ) from error


def stretched_copy(
    item: CatalogueObject, name: str, config: ObjectsConfig, rng: np.random.Generator
) -> CatalogueObject:
    """Another shape: the object stretched along its axes, at a size of its own.

    An affine map keeps centroids, and keeps convex parts convex and covering: neither is searched
    for again. The density is the object's. NSVR and class are the copy's own.

    rng: draws the factors, then the target extent.
    """
    stretch = draw_stretch(config, rng)
    stretched = Mesh(item.mesh.vertices_m * stretch, item.mesh.faces)
    target = _target_extent_m(stretched, config, rng)
    mesh, scale = rescale(stretched, target)
    parts = [Mesh(part.vertices_m * (scale * stretch), part.faces) for part in item.convex_parts]
    return replace(
        item,
        name=name,
        scale=item.scale * scale,
        stretch=item.stretch * stretch,
        target_extent_m=target,
        **solid_properties(mesh, item.density_kg_m3),
        mesh=mesh,
        convex_parts=tuple(parts),
        copies=(),
    )


def _target_extent_m(mesh: Mesh, config: ObjectsConfig, rng: np.random.Generator) -> float:
    """Longest extent to rescale to: drawn, or the mesh's own where nothing is rescaled.

    A thin object is not drawn so small that pad and physics could no longer hold it.
    """
    longest = float(mesh.extents_m.max())
    if config.rescaled:
        least = config.min_thickness_m * longest / mean_thickness(mesh)
        return draw_target_extent(config, rng, least)
    return longest


def material_of(name: str, config: ObjectsConfig) -> Material:
    """Transparent where a pattern of ``objects.transparent`` matches the object's name."""
    matched = any(is_named(name, pattern) for pattern in config.transparent)
    return "transparent" if matched else "opaque"


def prepare_object(
    source: MeshSource, config: ObjectsConfig, rng: np.random.Generator, cache_dir: Path
) -> CatalogueObject:
    """`measure_object`, then `finish_object`. Raises MeshError where the source is refused."""
    return finish_object(measure_object(source, config), config, rng, cache_dir)
