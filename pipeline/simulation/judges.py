"""Which body the vacuum holds, and the load its seal bears: by the referee or by the label.

`evaluate.judge` names the judge. It looks at all bodies under the pad and returns the one that is
held best, with an object that is then asked, load by load, whether the seal still holds.
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
from pipeline.simulation.suction import seal_limits
from pipeline.world.posed_bodies import PosedScene


class Bearing(Protocol):
    """The loads that a seal bears."""

    @property
    def pressure(self) -> float:
        """Quality of the seal in [0, 1]; 0 means that there is no seal."""

    @property
    def closes(self) -> bool:
        """Whether the seal can hold anything, so that a joint is made."""

    def seals(self, at_rest: Float[np.ndarray, " 6"]) -> bool:
        """Whether the seal holds an object that hangs still: a later loss is then the lift's.

        Parameters
        ----------
        at_rest
            Load of the object's weight alone, as in `bears`, shape (6,).

        Returns
        -------
        False where there is no seal worth the name.
        """

    def largest_scale(self, loads: Float[np.ndarray, "n 6"]) -> float:
        """How many times each of several loads the seal bears, each by itself.

        Parameters
        ----------
        loads
            As in `bears`, a load a row, shape (n, 6).

        Returns
        -------
        The largest factor, ≥ 0.
        """

    def bears(self, load: Float[np.ndarray, " 6"]) -> bool:
        """Whether the seal holds a load.

        Parameters
        ----------
        load
            Force [N] and moment [N m] that the object exerts on the pad, in GCS, shape (6,).

        Returns
        -------
        False where the seal breaks.
        """


class Judge(Protocol):
    """Decides which body under the pad the vacuum holds."""

    def find_seal(
        self, world_from_gripper: Float[np.ndarray, "4 4"], surfaces: PosedScene
    ) -> tuple[int, Bearing] | None:
        """Find the body under the pad that is held best.

        Parameters
        ----------
        world_from_gripper
            Pose of the gripper, shape (4, 4).
        surfaces
            True surfaces of all bodies.

        Returns
        -------
        Body id and what its seal bears; None where no body is under the pad.
        """


def build_judge(config: RunConfig, pad: Pad) -> Judge:
    """The judge that `evaluate.judge` names."""
    return RefereeJudge(config) if config.evaluate.judge == "referee" else LabelJudge(config, pad)


@dataclass(frozen=True, eq=False)
class LabelJudge:
    """Judges as the label does: p of Eq. (2) of the draped pad, limits of Eq. (7)-(11)."""

    config: RunConfig
    pad: Pad

    def find_seal(
        self, world_from_gripper: Float[np.ndarray, "4 4"], surfaces: PosedScene
    ) -> tuple[int, Bearing] | None:
        """See `Judge.find_seal`; the body with the greatest p is held best."""
        reach_m = self.config.grasps.clearance_m
        heights, below = pad_heights(world_from_gripper[None], surfaces, self.pad, reach_m)
        gripper, suction = self.config.gripper, self.config.evaluate.suction
        found = [
            (int(body), seal_limits(self.pad, heights[0], below[0] == body, gripper, suction))
            for body in np.unique(below[below > 0])
        ]
        return max(found, key=lambda one: one[1].pressure) if found else None


@dataclass(frozen=True, eq=False)
class RefereeBearing:
    """The loads that the referee's seal bears.

    Attributes
    ----------
    seal
        The seal that the referee computed.
    pressure
        Pull of the seal over the pull of the closed fan on the whole pad, in [0, 1].
    """

    seal: Seal
    pressure: float

    @property
    def closes(self) -> bool:
        """Whether the seal pulls at all; each load then decides whether it holds."""
        return self.seal.pull_n > 0.0

    def seals(self, at_rest: Float[np.ndarray, " 6"]) -> bool:
        """See `Bearing.seals`; whether the weight is balanced."""
        return self.bears(at_rest)

    def largest_scale(self, loads: Float[np.ndarray, "n 6"]) -> float:
        """See `Bearing.largest_scale`."""
        return self.seal.hold.largest_common_scale(loads)

    def bears(self, load: Float[np.ndarray, " 6"]) -> bool:
        """See `Bearing.bears`; contact pressure and friction must balance load and pull."""
        return self.seal.hold.bears(load)


@dataclass(frozen=True, eq=False)
class RefereeJudge:
    """Judges by `pipeline.referee`: a soft pad pressed on, and a fan against the leak."""

    config: RunConfig

    def find_seal(
        self, world_from_gripper: Float[np.ndarray, "4 4"], surfaces: PosedScene
    ) -> tuple[int, Bearing] | None:
        """See `Judge.find_seal`; the body with the strongest pull is held best."""
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
