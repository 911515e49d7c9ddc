"""How good first choices on a real frame are, as far as the frame itself can tell.

No robot tries them. What can be told: whether a first choice lies in a mask that a person drew,
whether its pad would lie on one surface or across an edge, and whether it stays the same with
other contacts drawn or pixels lost.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from pipeline.camera.frame import Frame, in_camera
from pipeline.camera.prediction import Prediction
from pipeline.camera.proposals import Proposals, pixels_of
from pipeline.config.predict import TrialConfig
from pipeline.geometry.transforms import invert, transform_points

RINGS, SPOKES = 6, 24  # places that a pad is looked at: closer than pixels at usual distances


@dataclass(frozen=True, eq=False)
class FirstChoice:
    """The best grasp of a frame, looked at.

    Attributes
    ----------
    world_from_contact
        Its pose, shape (4, 4).
    quality
        Its q-hat.
    best_m
        Places of the best grasps, this one first, shape (k, 3) [m].
    in_mask
        Whether it lies in the frame's mask; None where there is no mask.
    off_edges
        Whether the surface goes on around it, within the mask where there is one.
    """

    world_from_contact: Float[np.ndarray, "4 4"]
    quality: float
    best_m: Float[np.ndarray, "k 3"]
    in_mask: bool | None
    off_edges: bool


@dataclass(frozen=True, eq=False)
class Stability:
    """First choices of the same frame under changes that change nothing in the scene.

    A first choice may move to a place that is as good, as on the face of a large box: so beside the
    distance stand its q-hat and how many of the best places are found again.

    Attributes
    ----------
    moved_m
        How far each lies from the first choice without the change; infinite where none was left
        [m].
    quality_change
        q-hat of each less that without the change; a missing one counts as 0.
    found_again
        Of the best places without the change, the share that is among the best with each.
    """

    moved_m: Float[np.ndarray, " n"]
    quality_change: Float[np.ndarray, " n"]
    found_again: Float[np.ndarray, " n"]


@dataclass(frozen=True, eq=False)
class FrameTrial:
    """One ranking on one frame.

    Attributes
    ----------
    frame
        The frame with its mask.
    ranking
        What predicted the quality.
    kept_to_mask
        Whether grasps were kept to the frame's mask; else it only judges them.
    prediction
        All grasps; None where there could be none.
    refused
        Why there could be none, one sentence; empty where there could.
    first
        The best grasp; None where there is none.
    redrawn
        Its stability when contacts are drawn anew; None where there is no first choice.
    thinned
        Its stability when pixels are lost; None where there is no first choice.
    seconds
        Median wall time from the frame in memory to ranked grasps [s].
    """

    frame: Frame
    ranking: str
    kept_to_mask: bool
    prediction: Prediction | None
    refused: str
    first: FirstChoice | None
    redrawn: Stability | None
    thinned: Stability | None
    seconds: float


def unmasked(frame: Frame) -> Frame:
    """The frame with grasps allowed everywhere."""
    return replace(frame, allowed=np.ones(frame.depth_m.shape, dtype=bool))


def with_lost_pixels(frame: Frame, share: float, rng: np.random.Generator) -> Frame:
    """The frame with a share of its pixels, drawn at random, not measured."""
    lost = rng.random(frame.depth_m.shape) < share
    return replace(frame, depth_m=np.where(lost, 0.0, frame.depth_m))


def first_choice(
    frame: Frame, found: Proposals, radius_m: float, config: TrialConfig
) -> FirstChoice | None:
    """Look at the best grasp that was found on a frame.

    Parameters
    ----------
    frame
        The frame with its mask, whether or not the grasps were kept to it.
    found
        Grasps on it.
    radius_m
        r_G of the gripper [m].
    config
        What counts as near an edge.

    Returns
    -------
    What can be told of it; None where there is no grasp.
    """
    if len(found) == 0:
        return None
    pose = found.world_from_contact[0]
    masked = not frame.allowed.all()
    pixel, seen = pixels_of(frame, pose[None, :3, 3])
    column, row = pixel[0]
    return FirstChoice(
        world_from_contact=pose,
        quality=float(found.quality[0]),
        best_m=found.world_from_contact[: config.compared, :3, 3],
        in_mask=bool(seen[0] and frame.allowed[row, column]) if masked else None,
        off_edges=edge_share(frame, pose, radius_m, config) <= config.edge_share_max,
    )


def edge_share(
    frame: Frame, world_from_contact: Float[np.ndarray, "4 4"], radius_m: float, config: TrialConfig
) -> float:
    """Of places around a contact, how many show no surface there.

    Parameters
    ----------
    frame
        The frame.
    world_from_contact
        Pose of the pad, shape (4, 4).
    radius_m
        r_G of the gripper [m].
    config
        How far around the contact to look, and how far a surface may be from the pad's plane.

    Returns
    -------
    Share of the places that the picture does not show, that were not measured, that lie beside
    the mask, or at which what was measured is off the pad's plane.
    """
    reach_m = config.edge_clear_share * radius_m
    ring, angle = np.meshgrid(
        reach_m * np.arange(1, RINGS + 1) / RINGS, 2 * np.pi * np.arange(SPOKES) / SPOKES
    )
    disc = np.stack([ring * np.cos(angle), ring * np.sin(angle), 0.0 * ring], axis=-1)
    places = transform_points(world_from_contact, disc.reshape(-1, 3))
    pixel, seen = pixels_of(frame, places)
    column, row = np.where(seen[:, None], pixel, 0).T
    depth_m = frame.depth_m[row, column]
    # What the pixel measured lies on the place's own ray.
    local = in_camera(frame, places)
    measured = local * (depth_m / np.maximum(local[:, 2], 1e-9))[:, None]
    world = transform_points(frame.camera.world_from_camera, measured)
    height_m = transform_points(invert(world_from_contact), world)[:, 2]
    on_surface = (
        seen & (depth_m > 0) & frame.allowed[row, column] & (np.abs(height_m) <= config.edge_jump_m)
    )
    return float(np.mean(~on_surface))


def stability_of(
    first: FirstChoice, others: Sequence[Proposals | None], apart_m: float
) -> Stability:
    """How far the first choices of other draws lie from one, and whether the best are the same.

    Parameters
    ----------
    first
        Without a change.
    others
        Grasps found under each change; None where there could be none.
    apart_m
        Two grasps nearer than this are in one place [m].

    Returns
    -------
    Distance, change of q-hat and share of places found again, for each of them.
    """
    moved, change, again = [], [], []
    for found in others:
        if found is None or len(found) == 0:
            moved.append(np.inf)
            change.append(-first.quality)
            again.append(0.0)
            continue
        best_m = found.world_from_contact[: len(first.best_m), :3, 3]
        away_m = np.linalg.norm(first.best_m[:, None] - best_m[None], axis=2)
        moved.append(float(away_m[0, 0]))
        change.append(float(found.quality[0]) - first.quality)
        again.append(float(np.mean((away_m < apart_m).any(axis=1))))
    return Stability(np.array(moved), np.array(change), np.array(again))
