"""Poses of the gripper for pictures of the wrist's camera, and where an approach begins."""

import numpy as np
from jaxtyping import Float


def choose_apart(
    places_m: Float[np.ndarray, "k 3"], quality: Float[np.ndarray, " k"], count: int, apart_m: float
) -> list[Float[np.ndarray, " 3"]]:
    """The most promising places, each at least ``apart_m`` from those before; at most ``count``."""
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
    """The gripper upright above a place; about the vertical it stays as it was before."""
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
    """The pose turned by half a turn about its approach: the wrist's camera looks from opposite."""
    return np.asarray(world_from_gripper * np.array([-1.0, -1.0, 1.0, 1.0]))


def turn_least(
    world_from_contact: Float[np.ndarray, "4 4"], before: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "4 4"]:
    """The pose turned about its approach axis so that the wrist turns as little as possible.

    The pad is round, so the angle about the axis is free; this choice makes the arm's way shortest.
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


def back_off(
    world_from_contact: Float[np.ndarray, "4 4"], distance_m: float
) -> Float[np.ndarray, "4 4"]:
    """The pose moved by a distance [m] against its approach direction; negative: ahead."""
    pose = world_from_contact.copy()
    pose[:3, 3] += distance_m * pose[:3, 2]
    return pose
