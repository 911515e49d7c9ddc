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
from pipeline.control.clearance import STEM_BEGINS_M

FLANGE_M = 0.126
GRIPPER_LINK = "pad"
_HAND_MASS_KG = 0.6
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
    """GCS on the flange: its z points back from the pad to the flange."""
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[2, 3] = hand.length_m
    return pose


def urdf(hand: HandConfig) -> str:
    """The arm with stem and pad, as URDF text."""
    robot = Xml.Element("robot", name="iiwa14")
    _link(robot, "base", 5.0, 0.09, _CLEAR_M, _FOOT_M)
    parent, d_m, alpha_rad = "base", 0.0, 0.0
    for number, axis in enumerate(AXES, start=1):
        name = f"link{number}"
        # The first link begins above the foot: what turns must be clear of the table.
        from_m = _FOOT_M if number == 1 else 0.0
        _link(robot, name, axis.mass_kg, axis.radius_m, from_m, axis.d_m)
        joint = _joint(robot, f"A{number}", "revolute", parent, name, d_m, alpha_rad)
        Xml.SubElement(joint, "axis", xyz="0 0 1")
        Xml.SubElement(
            joint,
            "limit",
            lower=repr(-axis.limit_rad),
            upper=repr(axis.limit_rad),
            effort=repr(float(axis.torque_nm)),
            velocity=repr(axis.speed_rad_s),
        )
        parent, d_m, alpha_rad = name, axis.d_m, axis.alpha_rad
    # The stem lies along the flange's z, from the flange to where the soft pad begins.
    _link(robot, "stem", _HAND_MASS_KG, hand.stem_radius_m, 0.0, hand.length_m - STEM_BEGINS_M)
    _joint(robot, "flange", "fixed", parent, "stem", d_m, alpha_rad)
    Xml.SubElement(robot, "link", name=GRIPPER_LINK)
    _joint(robot, "suction", "fixed", "stem", GRIPPER_LINK, hand.length_m, math.pi)
    Xml.indent(robot)
    return Xml.tostring(robot, encoding="unicode")


def _link(
    robot: Xml.Element, name: str, mass_kg: float, radius_m: float, from_m: float, to_m: float
) -> None:
    """A link whose shape is a cylinder along its z, or a ball where it has no length."""
    link = Xml.SubElement(robot, "link", name=name)
    length = to_m - from_m
    middle = f"0 0 {(from_m + to_m) / 2!r}"
    inertial = Xml.SubElement(link, "inertial")
    Xml.SubElement(inertial, "origin", xyz=middle, rpy="0 0 0")
    Xml.SubElement(inertial, "mass", value=repr(mass_kg))
    if length > 0:
        across = mass_kg * (3 * radius_m**2 + length**2) / 12
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
    shape = Xml.SubElement(link, "collision")
    Xml.SubElement(shape, "origin", xyz=middle, rpy="0 0 0")
    geometry = Xml.SubElement(shape, "geometry")
    if length > 0:
        Xml.SubElement(geometry, "cylinder", radius=repr(radius_m), length=repr(length))
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
) -> Xml.Element:
    joint = Xml.SubElement(robot, "joint", name=name, type=kind)
    Xml.SubElement(joint, "parent", link=parent)
    Xml.SubElement(joint, "child", link=child)
    Xml.SubElement(joint, "origin", xyz=f"0 0 {along_m!r}", rpy=f"{about_x_rad!r} 0 0")
    return joint
