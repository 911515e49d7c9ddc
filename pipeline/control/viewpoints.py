"""Poses of the gripper: those from which the wrist's camera looks, and those before a contact."""

import numpy as np
from jaxtyping import Float


def choose_apart(
    places_m: Float[np.ndarray, "k 3"], quality: Float[np.ndarray, " k"], count: int, apart_m: float
) -> list[Float[np.ndarray, " 3"]]:
    """Choose the places of highest quality that are not close to each other.

    Parameters
    ----------
    places_m
        Places in WCS [m], shape (k, 3).
    quality
        Quality of each, shape (k,).
    count
        Greatest number of places.
    apart_m
        Least distance between two of them [m].

    Returns
    -------
    The chosen places, the best first.
    """
    chosen: list[Float[np.ndarray, " 3"]] = []
    for index in np.argsort(-quality, kind="stable"):
        if len(chosen) == count:
            break
        if all(np.linalg.norm(places_m[index] - other) >= apart_m for other in chosen):
            chosen.append(places_m[index])
    return chosen


def gripper_above(
    place_m: Float[np.ndarray, " 3"], height_m: float, before: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "4 4"]:
    """Pose of the gripper above a place, pad facing down, with the heading of another pose.

    Parameters
    ----------
    place_m
        The place in WCS [m], shape (3,).
    height_m
        Height of the pad above it [m].
    before
        world_from_gripper that gives the heading, shape (4, 4).

    Returns
    -------
    world_from_gripper, shape (4, 4).
    """
    pose = np.eye(4)
    heading = np.arctan2(before[1, 0], before[0, 0])
    cosine, sine = np.cos(heading), np.sin(heading)
    pose[:2, :2] = [[cosine, -sine], [sine, cosine]]
    pose[:3, 3] = place_m
    pose[2, 3] += height_m
    return pose


def turn_half_about_approach(
    world_from_gripper: Float[np.ndarray, "4 4"],
) -> Float[np.ndarray, "4 4"]:
    """The pose turned by half a turn about its approach: the camera is then on the other side."""
    return np.asarray(world_from_gripper * np.array([-1.0, -1.0, 1.0, 1.0]))


def turn_least(
    world_from_contact: Float[np.ndarray, "4 4"], before: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "4 4"]:
    """The pose turned about its approach axis so that the wrist turns as little as possible.

    The pad is round, so the angle about the axis is free.
    """
    z = world_from_contact[:3, 2]
    x = before[:3, 0] - (before[:3, 0] @ z) * z
    length = np.linalg.norm(x)
    if length < 1e-6:
        return world_from_contact
    pose = world_from_contact.copy()
    pose[:3, 0] = x / length
    pose[:3, 1] = np.cross(z, pose[:3, 0])
    return pose


def is_on_axis(
    world_from_gripper: Float[np.ndarray, "4 4"],
    world_from_contact: Float[np.ndarray, "4 4"],
    within_m: float,
    within_rad: float,
) -> bool:
    """Whether the gripper stands on the axis of a contact, and along it.

    Parameters
    ----------
    world_from_gripper
        The gripper, shape (4, 4).
    world_from_contact
        The contact, shape (4, 4).
    within_m
        How far beside the axis counts as on it [m].
    within_rad
        Angle between the axes that counts as none [rad].

    Returns
    -------
    Whether both are kept.
    """
    axis = world_from_contact[:3, 2]
    way = world_from_gripper[:3, 3] - world_from_contact[:3, 3]
    aside_m = float(np.linalg.norm(way - (way @ axis) * axis))
    return aside_m <= within_m and bool(world_from_gripper[:3, 2] @ axis >= np.cos(within_rad))


def turn_camera_up(
    world_from_gripper: Float[np.ndarray, "4 4"], aside_m: float, above_m: float
) -> Float[np.ndarray, "4 4"]:
    """The pose, turned by half a turn about its approach where the camera is lower than the pad.

    Parameters
    ----------
    world_from_gripper
        The pose, shape (4, 4).
    aside_m
        How far the camera is off the gripper's axis, along x [m].
    above_m
        How far it is above the pad, along z [m].

    Returns
    -------
    world_from_gripper, shape (4, 4).
    """
    rises_m = aside_m * world_from_gripper[2, 0] + above_m * world_from_gripper[2, 2]
    return turn_half_about_approach(world_from_gripper) if rises_m < 0.0 else world_from_gripper


def back_off(
    world_from_contact: Float[np.ndarray, "4 4"], distance_m: float
) -> Float[np.ndarray, "4 4"]:
    """The pose moved back by a distance [m], against its approach; forward where it is negative."""
    pose = world_from_contact.copy()
    pose[:3, 3] += distance_m * pose[:3, 2]
    return pose
