"""Keys of single items: what one object, scene or scene's grasps rests on, whatever lies beside it.

A stage's own key changes with every mesh that is added and with every count that is raised. An
item's does not: it holds what all items of the stage rest on, less counts, and what this one does.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace

from pipeline.clutter.settled import SettledClutter, settled_by
from pipeline.config import RunConfig, section_digest
from pipeline.execution.freshness import Key
from pipeline.geometry.catalogue import CatalogueObject, MeasuredObject
from pipeline.geometry.masses import mass_of
from pipeline.world.scene import ClutterScene

# What says how many items there are, which is no property of any.
OBJECT_COUNTS = (
    *("objects.limit", "objects.embedded_in_training"),
    *("objects.stretched_copies", "objects.random_solids", "objects.first_solid"),
)
SCENE_COUNTS = (
    *("scenes.levels", "scenes.clutters_per_level", "scenes.splits", "scenes.impossible"),
    "scenes.test_seed",  # in the seed of each scene that it decides
)
GRASP_COUNTS = ("grasps.count", "grasps.per_scene", "grasps.portions")


def items_basis(
    key: Key, config: RunConfig, sections: tuple[str, ...], besides: tuple[str, ...]
) -> str:
    """Digest of what all items of a stage rest on.

    Parameters
    ----------
    key
        Of the stage; its code and machine count.
    config
        The run's configuration.
    sections
        Sections that items depend on.
    besides
        Fields of these, dotted, that do not count.

    Returns
    -------
    The digest, as hex.
    """
    return _digest([section_digest(config, sections, besides), key.code, key.machine])


def objects_basis(key: Key, config: RunConfig) -> str:
    """What all objects of stage objects, whose key is given, rest on."""
    return items_basis(key, config, ("seed", "objects"), OBJECT_COUNTS)


def object_key(basis: str, item: MeasuredObject, masses: Mapping[str, float]) -> str:
    """Key of an object, which may not be finished yet.

    Split, family and copies depend on other objects, and do not count.

    Parameters
    ----------
    basis
        What all objects rest on, by `objects_basis`.
    item
        The object at its own size.
    masses
        Name, with * and ?, → mass of the object at that size [kg]; of others density is drawn.

    Returns
    -------
    The digest, as hex.
    """
    source = item.source
    named = {"name": source.name, "source": source.label, "unit": source.unit}
    mass_kg = mass_of(source.name, masses)
    weighed = {} if mass_kg is None else {"mass_kg": mass_kg}
    return item_key(basis, content=item.content, **named, **weighed)


def scenes_basis(key: Key, config: RunConfig) -> str:
    """What all scenes of stage scenes, whose key is given, rest on."""
    return items_basis(key, config, ("scenes", "cameras"), SCENE_COUNTS)


def grasps_basis(key: Key, config: RunConfig) -> str:
    """What the grasps of all scenes of stage grasps, whose key is given, rest on."""
    return items_basis(key, config, ("seed", "gripper", "sensing", "grasps"), GRASP_COUNTS)


def with_scene_key(
    scene: ClutterScene, basis: str, pool: Sequence[CatalogueObject]
) -> ClutterScene:
    """A scene with its key.

    Parameters
    ----------
    scene
        The scene.
    basis
        What all scenes rest on, by `scenes_basis`.
    pool
        The objects that its members were drawn from.

    Returns
    -------
    The same scene with its key.
    """
    settled = settled_by(scene, {item.name: item.key for item in pool})
    return replace(scene, key=scene_key(basis, scene.scene_id, settled))


def scene_key(basis: str, scene_id: str, settled: SettledClutter) -> str:
    """Key of a scene, which may not be made yet: of its number and its members.

    Parameters
    ----------
    basis
        What all scenes rest on, by `scenes_basis`.
    scene_id
        Its name: level, split and number.
    settled
        What it is built of.

    Returns
    -------
    The digest, as hex.
    """
    return item_key(basis, scene=scene_id, **vars(settled))


def item_key(basis: str, **parts: str | float | Sequence[str] | Sequence[float]) -> str:
    """Key of one item.

    Parameters
    ----------
    basis
        What all items of its stage rest on, by `items_basis`.
    **parts
        What this item rests on besides, by name.

    Returns
    -------
    The digest, as hex.
    """
    return _digest([basis, parts])


def _digest(value: Mapping[str, object] | list[object]) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
