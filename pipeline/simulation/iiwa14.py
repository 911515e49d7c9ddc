"""The KUKA LBR iiwa 14 R820 with the gripper on it, as a URDF of primitive shapes.

The links' centres of mass and inertias are those of their shapes (`pipeline.geometry.iiwa14`).
"""

import math
from xml.etree import ElementTree as Xml

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import HandConfig
from pipeline.geometry.iiwa14 import AXES, LINKS, LinkShape

GRIPPER_LINK = "pad"
_FOOT_MASS_KG = 5.0  # it is fixed to the ground: any mass serves


def stem_shape(hand: HandConfig) -> LinkShape:
    """The stem as a shape along the flange's z axis, from the flange to the soft pad."""
    return LinkShape("stem", hand.stem_radius_m, 0.0, hand.length_m - hand.stem_begins_m)


def flange_from_gripper(hand: HandConfig) -> Float[np.ndarray, "4 4"]:
    """Pose of GCS in the flange's frame; its z axis points from the pad back to the flange.

    The camera is on the x axis, which points away from the forearm where the last joint is at 0.
    """
    pose = np.diag([-1.0, 1.0, -1.0, 1.0])
    pose[2, 3] = hand.length_m
    return pose


def urdf(hand: HandConfig, hand_mass_kg: float) -> str:
    """Describe the arm with stem and pad as a URDF.

    Parameters
    ----------
    hand
        Sizes of the stem.
    hand_mass_kg
        Mass of the hand [kg].

    Returns
    -------
    The URDF as text.
    """
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
    _link(robot, stem_shape(hand), hand_mass_kg)
    _joint(robot, "flange", "fixed", parent, "stem", d_m, alpha_rad)
    Xml.SubElement(robot, "link", name=GRIPPER_LINK)
    _joint(robot, "suction", "fixed", "stem", GRIPPER_LINK, hand.length_m, math.pi, math.pi)
    Xml.indent(robot)
    return Xml.tostring(robot, encoding="unicode")


def _link(robot: Xml.Element, shape: LinkShape, mass_kg: float) -> None:
    """Add a link of one shape, with its mass and inertia."""
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
