"""The plan of a catalogue: which of the measured objects a run takes, and into which split."""

import difflib
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any

from pipeline.config.objects import ObjectsConfig, SplitConfig
from pipeline.errors import ConfigError, MeshError
from pipeline.geometry.catalogue import MeasuredObject
from pipeline.geometry.copies import find_copies
from pipeline.geometry.families import DeclaredFamily, Families
from pipeline.geometry.object_names import distinct_names, is_named
from pipeline.geometry.selection import Split, choose_subset
from pipeline.geometry.settled import Settled
from pipeline.geometry.splits import split_objects
from pipeline.geometry.units import FolderUnit, folder_unit


@dataclass(frozen=True, eq=False)
class Plan:
    """What becomes of each measured object."""

    measured: dict[str, MeasuredObject]
    """All objects that could be measured, by name, in the order they were given."""
    copies: dict[str, tuple[str, ...]]
    """Further files of one surface, left out, by the object's name."""
    split: dict[str, Split]
    """Split of each object that is taken."""
    families: Families
    unit: FolderUnit | None
    """What the sizes of files tell that declare no unit; None where there are none."""
    too_thin: tuple[tuple[str, MeshError], ...]
    """Sources that are too thin in the folder's unit, and why."""
    settled: Settled
    """What the run stays with from now on."""

    @property
    def taken(self) -> list[MeasuredObject]:
        """The objects of the catalogue, in the order they were given."""
        return [item for name, item in self.measured.items() if name in self.split]

    @property
    def left_out(self) -> list[tuple[str, MeshError]]:
        """Sources that are no objects after all, and why: they are too thin or join two splits."""
        joining = self.families.joining
        named = [(self.measured[name].source.label, why) for name, why in joining.items()]
        return [*self.too_thin, *named]

    @property
    def remarks(self) -> list[str]:
        """What a person should be told."""
        return self.unit.remarks() if self.unit else []

    @property
    def figures(self) -> dict[str, Any]:
        """For the stage's summary: the unit that sizes told."""
        return {"detected_unit": self.unit.figures() if self.unit else {}}

    @property
    def held_out(self) -> dict[str, MeasuredObject]:
        """The objects that are not for training, by name."""
        return {name: self.measured[name] for name, s in self.split.items() if s != "train"}


def plan_catalogue(
    items: Sequence[MeasuredObject],
    added: AbstractSet[str],
    declared: Sequence[DeclaredFamily],
    configs: tuple[ObjectsConfig, SplitConfig],
    seed: int,
    settled: Settled,
) -> Plan:
    """Choose the objects of a run, group them into families and split these.

    Parameters
    ----------
    items
        The measured objects; those of meshes have no name yet but their file's path.
    added
        Names of those that stand beside meshes, for training alone.
    declared
        Families that a person declared.
    configs
        How many objects are taken; how they are split.
    seed
        Of the draws.
    settled
        What an earlier making of the run decided.

    Returns
    -------
    The plan.

    Raises
    ------
    MeshError
        There is no object.
    ConfigError
        A pattern of ``objects.transparent`` fits no object, or settled splits do not agree with
        the families.
    """
    config, splitting = configs
    unit, settled = _folder_unit(items, config, settled)
    meshes, too_thin = _in_folder_unit([i for i in items if not i.embedded], unit, config)
    copies = find_copies(list(meshes.values()), settled.names, config.copies_rms)
    left_off = {label for of in copies.values() for label in of} if config.copies == "one" else {}
    names = distinct_names([label for label in meshes if label not in left_off], settled.names)
    measured = {names[at]: item.called(names[at]) for at, item in meshes.items() if at in names}
    measured |= {item.source.name: item for item in items if item.embedded}
    classes = {name: item.shape_class for name, item in measured.items() if name not in added}
    if not classes:
        raise MeshError("Not one mesh could be used", "See the reasons above, or unset MESH_DIR")
    check_transparent(config, sorted(measured))
    before = [name for name in classes if measured[name].content in settled.splits]
    taken = {*choose_subset(classes, config.limit, seed, before), *added}
    surfaces = [(label, *of) for label, of in copies.items()]
    contents = [[meshes[label].content for label in surface] for surface in surfaces]
    # A surface is split as that of its files was that came first.
    settled = settled.with_splits(_shared_splits(contents, settled.splits))
    split, families = split_objects(
        [item for name, item in measured.items() if name in taken],
        added & measured.keys(),
        [*declared, *_families_of_copies(surfaces, names)],
        splitting,
        seed,
        settled,
    )
    now = settled.with_splits({measured[name].content: where for name, where in split.items()})
    now = now.with_splits(_shared_splits(contents, now.splits)).with_names(names)
    listed = {
        name: (*item.source.left_off, *(copies.get(item.source.label, ()) if left_off else ()))
        for name, item in measured.items()
    }
    listed = {name: tuple(sorted(of)) for name, of in listed.items() if of}
    return Plan(measured, listed, split, families, unit, too_thin, now)


def _folder_unit(
    items: Sequence[MeasuredObject], config: ObjectsConfig, settled: Settled
) -> tuple[FolderUnit | None, Settled]:
    """The unit of the files that declare none, decided together, and kept."""
    asked = [item.source for item in items if item.source.unit_known_by == "detected"]
    if not asked:
        return None, settled
    contents, bounds = [at.sha256 for at in asked], (config.min_extent_m, config.max_extent_m)
    extents = {source.label: source.extent for source in asked}
    unit = folder_unit(extents, config, settled.unit_of(contents, bounds))
    return unit, settled.with_unit(unit.unit, contents, bounds)


def _in_folder_unit(
    items: Sequence[MeasuredObject], unit: FolderUnit | None, config: ObjectsConfig
) -> tuple[dict[str, MeasuredObject], tuple[tuple[str, MeshError], ...]]:
    """The meshes by path, each in its folder's unit, and those that are too thin in it."""
    found: dict[str, MeasuredObject] = {}
    too_thin: list[tuple[str, MeshError]] = []
    for item in items:
        label, source = item.source.label, item.source
        asked = source.unit_known_by == "detected"
        wanted = unit.of(label) if unit and asked else source.unit
        try:
            found[label] = item if wanted == source.unit else item.in_unit(wanted, config)
        except MeshError as error:
            too_thin.append((label, error))
    return found, tuple(too_thin)


def _shared_splits(
    surfaces: Sequence[Sequence[str]], splits: Mapping[str, Split]
) -> dict[str, Split]:
    """The split of every file of a surface where one of its files has one, by content."""
    found: dict[str, Split] = {}
    for contents in surfaces:
        known = [splits[content] for content in contents if content in splits]
        found |= dict.fromkeys(contents, known[0]) if known else {}
    return found


def _families_of_copies(
    surfaces: Sequence[Sequence[str]], names: Mapping[str, str]
) -> list[DeclaredFamily]:
    """Where copies are objects of their own, one surface's are a family."""
    groups = [sorted(names[at] for at in labels if at in names) for labels in surfaces]
    return [DeclaredFamily(group[0], tuple(group)) for group in groups if len(group) > 1]


def check_transparent(config: ObjectsConfig, names: list[str]) -> None:
    """Raise ConfigError for a pattern of ``objects.transparent`` that no object has."""
    for pattern in config.transparent:
        if not any(is_named(name, pattern) for name in names):
            near = difflib.get_close_matches(pattern, names, n=3) or names[:3]
            raise ConfigError(
                f"objects.transparent names {pattern!r}, and no object is called so",
                f"Names are, for instance: {', '.join(near)}",
            )
