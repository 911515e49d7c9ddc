"""Which objects a run's clutters hold, and stay with when objects are added or removed.

Beside the run's artifacts. They hold as long as what all clutters rest on does, and all members of
a clutter are there: else it is drawn anew.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pipeline.errors import ConfigError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.world.scene import ClutterScene

CLUTTERS_FILE = "scenes.settled.json"


@dataclass(frozen=True)
class SettledClutter:
    """What one clutter is built of again.

    Attributes
    ----------
    seed
        Seed that it was drawn from.
    members
        Keys of its objects, in the order they were drawn.
    generator
        Where its generator stood when they were drawn, by `standing`.
    """

    seed: int
    members: tuple[str, ...]
    generator: str


@dataclass(frozen=True)
class SettledClutters:
    """What was decided when a clutter was first built.

    Attributes
    ----------
    basis
        Digest of what all clutters rest on: with another, all are drawn anew.
    clutters
        Scene id → its clutter.
    """

    basis: str
    clutters: dict[str, SettledClutter] = field(default_factory=dict)

    def stands(
        self, scene_id: str, seed: int, pool: Sequence[CatalogueObject]
    ) -> SettledClutter | None:
        """What a clutter is built of again, if all of it is there.

        Parameters
        ----------
        scene_id
            The clutter.
        seed
            Its seed today.
        pool
            The objects that it would be drawn from today.

        Returns
        -------
        The settled clutter; None where it has to be drawn.
        """
        known = self.clutters.get(scene_id)
        there = {item.key for item in pool}
        stands = known and known.seed == seed and there.issuperset(known.members)
        return known if stands else None

    def with_clutters(self, clutters: Mapping[str, SettledClutter]) -> "SettledClutters":
        """These clutters too; one that is not built today stays."""
        return SettledClutters(self.basis, {**self.clutters, **clutters})

    def to_json(self) -> str:
        """As text, the same for the same decisions."""
        record = {"basis": self.basis, "clutters": {n: vars(c) for n, c in self.clutters.items()}}
        return json.dumps(record, indent=1, sort_keys=True) + "\n"


def standing(rng: np.random.Generator) -> str:
    """Where a PCG64 generator stands, to be read by `generator_at`."""
    state = rng.bit_generator.state
    halves = (state["has_uint32"], state["uinteger"])
    return ":".join(f"{number:x}" for number in (state["state"]["state"], *halves))


def generator_at(seed: int, stood: str) -> np.random.Generator:
    """The PCG64 generator of a seed where it stood.

    Parameters
    ----------
    seed
        Its seed.
    stood
        Where it stood, by `standing`.

    Returns
    -------
    The generator: what it draws next is what it drew then.

    Raises
    ------
    ConfigError
        The text is of no generator.
    """
    bits = np.random.PCG64(seed)
    try:
        state, has_uint32, uinteger = (int(part, 16) for part in stood.split(":"))
        stream = bits.state["state"] | {"state": state}
        bits.state = bits.state | {
            "state": stream,
            "has_uint32": has_uint32,
            "uinteger": uinteger,
        }
    except (ValueError, OverflowError) as error:
        raise ConfigError(
            f"'{stood}' in {CLUTTERS_FILE} is of no generator",
            "Delete the file: the run's clutters are then drawn anew",
        ) from error
    return np.random.Generator(bits)


def settled_by(scene: ClutterScene, keys: Mapping[str, str]) -> SettledClutter:
    """What a built scene stays with.

    Parameters
    ----------
    scene
        The scene.
    keys
        Name → key of its objects.

    Returns
    -------
    Its members and where its generator stood.
    """
    members = tuple(keys[placed.object_name] for placed in scene.objects)
    return SettledClutter(scene.seed, members, scene.generator)


def read_settled_clutters(path: Path, basis: str) -> SettledClutters:
    """What is settled already; nothing where it rests on other grounds.

    Parameters
    ----------
    path
        A file in the run's state.
    basis
        Digest of what all clutters rest on today.

    Returns
    -------
    What is settled.

    Raises
    ------
    ConfigError
        The file is damaged.
    """
    if not path.is_file():
        return SettledClutters(basis)
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        stands = record["basis"] == basis
        clutters = {
            str(scene_id): SettledClutter(
                int(one["seed"]), tuple(map(str, one["members"])), str(one["generator"])
            )
            for scene_id, one in record["clutters"].items()
        }
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ConfigError(
            f"{path} is damaged ({error})", "Delete it: the run's clutters are then drawn anew"
        ) from error
    return SettledClutters(basis, clutters if stands else {})
