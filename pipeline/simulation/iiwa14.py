"""The KUKA LBR iiwa 14 R820 as tables, and as a URDF of primitive shapes with the gripper on it.

Kinematics: Denavit-Hartenberg lengths 0.36, 0.42, 0.40 m and 0.126 m to the flange, and axis ranges
+-170, +-120, ..., +-175 degrees, from the data sheet (KUKA, «LBR iiwa», Spez LBR iiwa, 2015).
Torques and speeds of the axes: KUKA, «Sensitive robotics: LBR iiwa» (brochure). Link masses:
Stürz, Affolter and Smith, «Parameter identification of the KUKA LBR iiwa robot including
constraints on physical feasibility», IFAC 2017. Shapes are ours: cylinders and balls of about
the arm's girth, and with them the links' centres of mass and inertias.
"""

import math
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import HandConfig

FLANGE_M = 0.126
GRIPPER_LINK = "pad"
_FOOT_MASS_KG, _HAND_MASS_KG = 5.0, 0.6
_CLEAR_M, _FOOT_M = 0.01, 0.12


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


_QUARTER = math.pi / 2
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


def stem_shape(hand: HandConfig) -> LinkShape:
    """The stem, along the flange's z to where the soft pad begins."""
    return LinkShape("stem", hand.stem_radius_m, 0.0, hand.length_m - hand.stem_begins_m)


def flange_pose(q_rad: Float[np.ndarray, " 7"]) -> Float[np.ndarray, "4 4"]:
    """base_from_flange in closed form: the product of the seven Denavit-Hartenberg matrices."""
    pose = np.eye(4)
    for axis, q in zip(AXES, q_rad, strict=True):
        c, s = math.cos(q), math.sin(q)
        ca, sa = math.cos(axis.alpha_rad), math.sin(axis.alpha_rad)
        pose = pose @ np.array(
            [
                [c, -s * ca, s * sa, 0.0],
                [s, c * ca, -c * sa, 0.0],
                [0.0, sa, ca, axis.d_m],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
    return pose


def flange_from_gripper(hand: HandConfig) -> Float[np.ndarray, "4 4"]:
    """GCS on the flange: its z points back from the pad to the flange.

    Its x, where the camera is, points away from the forearm where the last axis is at 0.
    """
    pose = np.diag([-1.0, 1.0, -1.0, 1.0])
    pose[2, 3] = hand.length_m
    return pose


def urdf(hand: HandConfig) -> str:
    """The arm with stem and pad, as URDF text."""
    robot = Xml.Element("robot", name="iiwa14")
    _link(robot, LINKS[0], _FOOT_MASS_KG)
    parent, d_m, alpha_rad = LINKS[0].link, 0.0, 0.0
    for number, (axis, shape) in enumerate(zip(AXES, LINKS[1:], strict=True), start=1):
        _link(robot, shape, axis.mass_kg)
        joint = _joint(robot, f"A{number}", "revolute", parent, shape.link, d_m, alpha_rad)
        Xml.SubElement(joint, "axis", xyz="0 0 1")
        Xml.SubElement(
            joint,
            "limit",
            lower=repr(-axis.limit_rad),
            upper=repr(axis.limit_rad),
            effort=repr(float(axis.torque_nm)),
            velocity=repr(axis.speed_rad_s),
        )
        parent, d_m, alpha_rad = shape.link, axis.d_m, axis.alpha_rad
    _link(robot, stem_shape(hand), _HAND_MASS_KG)
    _joint(robot, "flange", "fixed", parent, "stem", d_m, alpha_rad)
    Xml.SubElement(robot, "link", name=GRIPPER_LINK)
    _joint(robot, "suction", "fixed", "stem", GRIPPER_LINK, hand.length_m, math.pi, math.pi)
    Xml.indent(robot)
    return Xml.tostring(robot, encoding="unicode")


def _link(robot: Xml.Element, shape: LinkShape, mass_kg: float) -> None:
    """A link of one shape, with its inertia."""
    link = Xml.SubElement(robot, "link", name=shape.link)
    radius_m, length_m = shape.radius_m, shape.length_m
    middle = f"0 0 {shape.middle_m!r}"
    inertial = Xml.SubElement(link, "inertial")
    Xml.SubElement(inertial, "origin", xyz=middle, rpy="0 0 0")
    Xml.SubElement(inertial, "mass", value=repr(mass_kg))
    if length_m > 0:
        across = mass_kg * (3 * radius_m**2 + length_m**2) / 12
        along = mass_kg * radius_m**2 / 2
    else:
        across = along = 0.4 * mass_kg * radius_m**2
    Xml.SubElement(
        inertial,
        "inertia",
        ixx=repr(across),
        iyy=repr(across),
        izz=repr(along),
        ixy="0",
        ixz="0",
        iyz="0",
    )
    # No visuals: the worlds of the closed loop do not render.
    collision = Xml.SubElement(link, "collision")
    Xml.SubElement(collision, "origin", xyz=middle, rpy="0 0 0")
    geometry = Xml.SubElement(collision, "geometry")
    if length_m > 0:
        Xml.SubElement(geometry, "cylinder", radius=repr(radius_m), length=repr(length_m))
    else:
        Xml.SubElement(geometry, "sphere", radius=repr(radius_m))


def _joint(
    robot: Xml.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    along_m: float,
    about_x_rad: float,
    about_z_rad: float = 0.0,
) -> Xml.Element:
    joint = Xml.SubElement(robot, "joint", name=name, type=kind)
    Xml.SubElement(joint, "parent", link=parent)
    Xml.SubElement(joint, "child", link=child)
    turned = f"{about_x_rad!r} 0 {about_z_rad!r}"
    Xml.SubElement(joint, "origin", xyz=f"0 0 {along_m!r}", rpy=turned)
    return joint
