"""Loads that a sealed pad bears according to the label, in newtons: Eq. (7)-(11) at a given vacuum.

Eq. (7) gives the vacuum force, Eq. (8)-(11) what friction bears along and about the surface.
The supplement ignores moments about x and y (A-3). A lifted object has weight and exerts such
moments, so they are limited here to the vacuum force at the lever r_v: beyond that the rim of the
pad carries no load and the pad peels off.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.evaluation import SuctionConfig
from pipeline.config.grasps import GripperConfig
from pipeline.gripper.contact import contact_of
from pipeline.gripper.draping import contact_vertices, drape
from pipeline.gripper.pad import Pad
from pipeline.gripper.wrench import vacuum_force


@dataclass(frozen=True)
class SealLimits:
    """Greatest loads that a seal bears.

    Attributes
    ----------
    pressure
        p of Eq. (2).
    pull_n
        Force away from the pad, Eq. (10) [N].
    side_n
        Force along the surface, on each axis, Eq. (8), (9) [N].
    torsion_nm
        Moment about the pad's axis, Eq. (11) [N m].
    peel_nm
        Moment about an axis in the surface [N m].
    seal_min
        Least p at which the seal holds anything.
    """

    pressure: float
    pull_n: float
    side_n: float
    torsion_nm: float
    peel_nm: float
    seal_min: float = 0.0

    @property
    def closes(self) -> bool:
        """Whether p is enough to close the joint."""
        return self.pressure > 0.0 and self.pressure >= self.seal_min

    def seals(self, at_rest: Float[np.ndarray, " 6"]) -> bool:
        """Whether p is enough, whatever hangs on the pad."""
        return self.closes

    def largest_scale(self, loads: Float[np.ndarray, "n 6"]) -> float:
        """How many times each of several loads is within every limit.

        Parameters
        ----------
        loads
            As in `bears`, a load a row, shape (n, 6).

        Returns
        -------
        The largest factor that all of them may be multiplied with; inf where no load pulls.
        """
        asked = np.column_stack(
            [
                np.maximum(-loads[:, 2], 0.0),
                np.abs(loads[:, :2]).max(axis=1),
                np.abs(loads[:, 5]),
                np.hypot(loads[:, 3], loads[:, 4]),
            ]
        )
        borne = np.array([self.pull_n, self.side_n, self.torsion_nm, self.peel_nm])
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.where(asked > 0.0, borne / asked, np.inf).min())

    def bears(self, load: Float[np.ndarray, " 6"]) -> bool:
        """Whether a load is within every limit.

        Parameters
        ----------
        load
            Force [N] and moment [N m] that the object exerts on the pad, in GCS, shape (6,); a pull
            away from the pad is along -z.

        Returns
        -------
        False where the seal breaks.
        """
        return (
            max(-float(load[2]), 0.0) <= self.pull_n
            and bool(np.abs(load[:2]).max() <= self.side_n)
            and abs(float(load[5])) <= self.torsion_nm
            and float(np.hypot(load[3], load[4])) <= self.peel_nm
        )


def seal_limits(
    pad: Pad,
    heights_m: Float[np.ndarray, " vertices"],
    on_target: Bool[np.ndarray, " vertices"],
    gripper: GripperConfig,
    suction: SuctionConfig,
) -> SealLimits:
    """Drape the pad over the surface below it and find what its seal bears.

    Parameters
    ----------
    pad
        The pad in GCS.
    heights_m
        Height of the surface under each vertex, z in GCS [m], shape (vertices,).
    on_target
        Vertices over the target object, shape (vertices,).
    gripper
        Contact physics.
    suction
        The vacuum, and the least p that seals.

    Returns
    -------
    The limits; all 0 where the pad touches nothing.
    """
    draped = drape(pad, heights_m[None])[0]
    contact = contact_of(pad, draped, contact_vertices(pad, draped, heights_m, on_target))
    if not contact.triangles.size:
        return SealLimits(0.0, 0.0, 0.0, 0.0, 0.0, suction.seal_min)
    force_n = suction.vacuum_pa * pad.area_m2 * vacuum_force(pad, contact)  # Eq. (7)
    side_n = math.sqrt(3) / 3 * gripper.friction * force_n  # Eq. (8), (9)
    return SealLimits(
        pressure=contact.pressure,
        pull_n=force_n,  # Eq. (10)
        side_n=side_n,
        torsion_nm=side_n * pad.radius_m,  # Eq. (11)
        peel_nm=force_n * gripper.pad.seal_radius_m,
        seal_min=suction.seal_min,
    )
