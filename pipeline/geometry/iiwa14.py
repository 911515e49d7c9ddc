"""The KUKA LBR iiwa 14 R820: its axes as a table, its links as simple shapes, and where they are.

Kinematics: Denavit-Hartenberg lengths 0.36, 0.42, 0.40 m and 0.126 m to the flange, and axis ranges
+-170, +-120, ..., +-175 degrees, from the data sheet (KUKA, «LBR iiwa», Spez LBR iiwa, 2015).
Torques and speeds of the axes: KUKA, «Sensitive robotics: LBR iiwa» (brochure). Link masses:
Stürz, Affolter and Smith, «Parameter identification of the KUKA LBR iiwa robot including
constraints on physical feasibility», IFAC 2017. Shapes are ours: cylinders and balls of about
the arm's girth.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

FLANGE_M = 0.126  # from joint A6 to the flange; KUKA data sheet
_CLEAR_M, _FOOT_M = 0.01, 0.12  # cylinders of links end short of each other; height of the foot


@dataclass(frozen=True)
class Axis:
    """One axis: standard Denavit-Hartenberg d and alpha (a = 0), its bounds, and its link."""

    d_m: float
    alpha_rad: float
    limit_rad: float
    torque_nm: float
    speed_rad_s: float
    mass_kg: float
    radius_m: float


_QUARTER = math.pi / 2  # joints of the arm stand at right angles
# Lengths, limits, torques and masses of KUKA's data sheet.
AXES = (
    Axis(0.36, -_QUARTER, math.radians(170), 320, math.radians(85), 3.94781, 0.07),
    Axis(0.00, _QUARTER, math.radians(120), 320, math.radians(85), 4.50275, 0.09),
    Axis(0.42, _QUARTER, math.radians(170), 176, math.radians(100), 2.45520, 0.07),
    Axis(0.00, -_QUARTER, math.radians(120), 176, math.radians(75), 2.61155, 0.08),
    Axis(0.40, -_QUARTER, math.radians(170), 110, math.radians(130), 3.41000, 0.065),
    Axis(0.00, _QUARTER, math.radians(120), 40, math.radians(135), 3.38795, 0.065),
    Axis(FLANGE_M, 0.0, math.radians(175), 40, math.radians(135), 0.35432, 0.04),
)
LIMITS_RAD = np.array([axis.limit_rad for axis in AXES])


@dataclass(frozen=True)
class LinkShape:
    """A cylinder along its link's z from one place to another, or a ball where it has no length."""

    link: str
    radius_m: float
    from_m: float
    to_m: float

    @property
    def length_m(self) -> float:
        """0 for a ball."""
        return self.to_m - self.from_m

    @property
    def middle_m(self) -> float:
        """Where its centre lies on the link's z."""
        return (self.from_m + self.to_m) / 2


# The first link begins above the foot: what turns must be clear of the table.
LINKS = (
    LinkShape("base", 0.09, _CLEAR_M, _FOOT_M),
    *(
        LinkShape(f"link{n}", axis.radius_m, _FOOT_M if n == 1 else 0.0, axis.d_m)
        for n, axis in enumerate(AXES, start=1)
    ),
)
"""The foot and the seven links, in the order of `link_poses`."""


def link_poses(q_rad: Float[np.ndarray, "*t 7"]) -> Float[np.ndarray, "*t 8 4 4"]:
    """base_from_link of the foot and the seven links in closed form, for any number of rows."""
    poses = np.zeros((*q_rad.shape[:-1], len(LINKS), 4, 4))
    poses[..., 0, :, :] = np.eye(4)
    d_m, alpha_rad = 0.0, 0.0
    for number, axis in enumerate(AXES, start=1):
        turned = _before_from_link(d_m, alpha_rad, q_rad[..., number - 1])
        poses[..., number, :, :] = poses[..., number - 1, :, :] @ turned
        d_m, alpha_rad = axis.d_m, axis.alpha_rad
    return poses


def _before_from_link(
    d_m: float, alpha_rad: float, q_rad: Float[np.ndarray, "*t"]
) -> Float[np.ndarray, "*t 4 4"]:
    """Along the last link's z, about its x, then by the joint about z: as the URDF's joints are."""
    c, s = np.cos(q_rad), np.sin(q_rad)
    ca, sa = math.cos(alpha_rad), math.sin(alpha_rad)
    pose = np.zeros((*q_rad.shape, 4, 4))
    pose[..., 0, 0], pose[..., 0, 1] = c, -s
    pose[..., 1, 0], pose[..., 1, 1], pose[..., 1, 2] = ca * s, ca * c, -sa
    pose[..., 2, 0], pose[..., 2, 1], pose[..., 2, 2] = sa * s, sa * c, ca
    pose[..., 2, 3], pose[..., 3, 3] = d_m, 1.0
    return pose
