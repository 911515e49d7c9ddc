"""What seals under the vacuum, and what the seal bears: by the referee, or as the label has it.

A judge is a name of `evaluate.judge`, and an object that finds, of the bodies under the pad, the
one that is held best. Whether it hangs is then asked of what it found, load by load.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.gripper.pad import Pad
from pipeline.labelling.heights import pad_heights
from pipeline.referee.seal import Seal, referee_of, seal
from pipeline.referee.surface import surface_of, surface_under
from pipeline.simulation.suction import holding
from pipeline.world.posed_bodies import PosedScene


class Bearing(Protocol):
    """What a seal can bear."""

    @property
    def pressure(self) -> float:
        """How good the seal is, in [0, 1]; 0 is none."""

    @property
    def closes(self) -> bool:
        """Whether anything hangs on it at all."""

    def bears(self, load: Float[np.ndarray, " 6"]) -> bool:
        """Whether it holds a load that the object exerts on the pad, in GCS [N, N m]."""


class Judge(Protocol):
    """Finds what seals."""

    def sealed(
        self, world_from_gripper: Float[np.ndarray, "4 4"], surfaces: PosedScene
    ) -> tuple[int, Bearing] | None:
        """The body held best and what bears it; None where the pad meets no body."""


def judge_of(config: RunConfig, pad: Pad) -> Judge:
    """What `evaluate.judge` names."""
    return RefereeJudge(config) if config.evaluate.judge == "referee" else LabelJudge(config, pad)


@dataclass(frozen=True, eq=False)
class LabelJudge:
    """p of Eq. (2) from the draped pad, limits of Eq. (7)-(11) at a named vacuum."""

    config: RunConfig
    pad: Pad

    def sealed(
        self, world_from_gripper: Float[np.ndarray, "4 4"], surfaces: PosedScene
    ) -> tuple[int, Bearing] | None:
        """By the greatest p."""
        reach_m = self.config.grasps.clearance_m
        heights, below = pad_heights(world_from_gripper[None], surfaces, self.pad, reach_m)
        gripper, suction = self.config.gripper, self.config.evaluate.suction
        found = [
            (int(body), holding(self.pad, heights[0], below[0] == body, gripper, suction))
            for body in np.unique(below[below > 0])
        ]
        return max(found, key=lambda one: one[1].pressure) if found else None


@dataclass(frozen=True, eq=False)
class RefereeBearing:
    """A seal of the referee's. pressure : its pull over a closed fan's on the whole pad."""

    seal: Seal
    pressure: float

    @property
    def closes(self) -> bool:
        """Where air is drawn at all, something may hang; loads decide."""
        return self.seal.pull_n > 0.0

    def bears(self, load: Float[np.ndarray, " 6"]) -> bool:
        """By contact pressure and friction against the vacuum's pull."""
        return self.seal.hold.bears(load)


@dataclass(frozen=True, eq=False)
class RefereeJudge:
    """The soft pad pressed, the leak against the fan: `pipeline.referee`."""

    config: RunConfig

    def sealed(
        self, world_from_gripper: Float[np.ndarray, "4 4"], surfaces: PosedScene
    ) -> tuple[int, Bearing] | None:
        """By the strongest pull."""
        pad = referee_of(self.config.referee, self.config.gripper.pad.radius_m)
        under, below = surface_under(
            pad.disc, world_from_gripper, surfaces, 0, self.config.grasps.clearance_m
        )
        found = []
        for body in np.unique(below[below > 0]):
            mine = surface_of(pad.disc, under.height_m, under.normals, below == body)
            sealed = seal(pad, mine)
            share = sealed.pull_n / (pad.fan.vacuum_pa * pad.disc.area_m2)
            found.append((int(body), RefereeBearing(sealed, share)))
        return max(found, key=lambda one: one[1].pressure) if found else None
