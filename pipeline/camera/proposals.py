"""Ranked grasps of real frames: contacts on what may be grasped, with q-hat, the best ones apart.

They are made by the same functions as in simulation: contacts along the mean surface normal
(`pipeline.control`), sub clouds of all pictures together (`pipeline.sensing`), and q-hat by a
network or by another ranking.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import ndimage

from pipeline.camera.frame import Frame
from pipeline.camera.frame_support import support_beside_masks, upright
from pipeline.camera.support import Support, stands_out
from pipeline.config import RunConfig
from pipeline.config.evaluation import HandConfig
from pipeline.control.candidates import Candidates, candidates_at
from pipeline.control.clearance import free_of_collision
from pipeline.control.cloud import Cloud, DepthPicture, merged_cloud
from pipeline.control.ranking import Ranking
from pipeline.errors import PictureError
from pipeline.geometry.transforms import invert
from pipeline.world.cameras import in_picture, points_of_depth, project


@dataclass(frozen=True, eq=False)
class Proposals:
    """Grasps in descending order of q-hat, and why there are no more.

    Attributes
    ----------
    world_from_contact
        Poses, +z out of the object, shape (k, 4, 4); the frames' world.
    quality
        q-hat of each, shape (k,).
    roughness_m
        Root mean square distance of the surface around each contact from its plane, shape (k,).
    instance
        Label of what each lies on, 0 where frames have no labels, shape (k,).
    support
        What the objects stand on, None where a mask was given and no plane was found.
    left_out
        Reason → how many contacts were left out for it.
    """

    world_from_contact: Float[np.ndarray, "k 4 4"]
    quality: Float[np.ndarray, " k"]
    roughness_m: Float[np.ndarray, " k"]
    instance: Int[np.ndarray, " k"]
    support: Support | None
    left_out: dict[str, int]

    def __len__(self) -> int:
        return len(self.quality)


def propose_grasps(
    frames: Sequence[Frame], ranking: Ranking, config: RunConfig, rng: np.random.Generator
) -> Proposals:
    """The best grasps of one scene seen in one or several frames.

    Parameters
    ----------
    frames
        Pictures of one scene; several need poses in one world.
    ranking
        Gives each contact a value in [0, 1].
    config
        The run's configuration; `predict` and the gripper's size matter.
    rng
        Draws contacts.

    Returns
    -------
    At most `predict.top` grasps, the best first.

    Raises
    ------
    PictureError
        Several frames without poses, no support, or nothing above it.
    """
    if len(frames) > 1 and not all(frame.posed for frame in frames):
        unposed = next(frame.name for frame in frames if not frame.posed)
        raise PictureError(
            f"{unposed} has no pose, and {len(frames)} frames are to be merged",
            "Give world_from_camera of each frame, or one frame alone",
        )
    support = support_beside_masks(frames, config, rng)
    level = support.world_from_support if support else upright(frames[0])
    moved = [frame.moved(invert(level)) for frame in frames]  # from here on z = 0 is the support
    pictures = [DepthPicture(frame.depth_m, frame.camera, frame.instances) for frame in moved]
    graspable = [
        DepthPicture(np.where(_graspable(frame, support, config), frame.depth_m, 0.0), frame.camera)
        for frame in moved
    ]
    policy = config.evaluate.policy
    cloud = merged_cloud(graspable, policy.voxel_m, 0.0)
    if len(cloud) == 0:
        raise PictureError(
            f"{frames[0].name}: nothing stands out of the support where grasps are allowed",
            "Check mask and workspace, or lower predict.above_support_m",
        )
    drawn = rng.integers(len(cloud), size=config.predict.candidates)
    obstacles = merged_cloud(pictures, policy.voxel_m, policy.above_table_m)
    found, left_out = _candidates(cloud, drawn, obstacles, support, config)
    quality = ranking(pictures, found) if len(found) else np.empty(0)
    if len(found):
        first = apart(found.world_from_contact[:, :3, 3], quality, config.predict.apart_m)
        places = found.world_from_contact[first[: config.predict.closer_places], :3, 3]
        drawn = _near(cloud, places, config, rng)
        closer, more = _candidates(cloud, drawn, obstacles, support, config)
        left_out += more
        found = found.joined(closer)
        quality = ranking(pictures, found)
    kept = apart(found.world_from_contact[:, :3, 3], quality, config.predict.apart_m)
    left_out["near a better one"] = len(quality) - len(kept)
    best = kept[: config.predict.top]
    poses = found.world_from_contact[best]
    return Proposals(
        world_from_contact=level @ poses,
        quality=quality[best],
        roughness_m=found.roughness_m[best],
        instance=_instances_at(moved, poses),
        support=support,
        left_out={reason: number for reason, number in left_out.items() if number},
    )


def apart(
    places_m: Float[np.ndarray, "k 3"], worth: Float[np.ndarray, " k"], distance_m: float
) -> Int[np.ndarray, " j"]:
    """Non-maximum suppression: indices, the best first, no two nearer than a distance."""
    kept: list[int] = []
    for i in np.argsort(-worth, kind="stable"):
        near = np.linalg.norm(places_m[kept] - places_m[i], axis=1) < distance_m
        if not near.any():
            kept.append(int(i))
    return np.array(kept, dtype=np.int64)


def clear_of_support(
    support_from_contact: Float[np.ndarray, "k 4 4"],
    radius_m: float,
    hand: HandConfig,
    tolerance_m: float,
) -> Bool[np.ndarray, " k"]:
    """Whether the pad's rim and the hand's stem stay above the plane z = 0.

    Parameters
    ----------
    support_from_contact
        Poses of the pad at its contact, shape (k, 4, 4).
    radius_m
        r_G, the pad's radius [m].
    hand
        The stem's measures.
    tolerance_m
        How far below the plane a rim may be: the pad is soft, the plane measured [m].

    Returns
    -------
    Whether each pose keeps clear, shape (k,).
    """
    height_m, cosine = support_from_contact[:, 2, 3], support_from_contact[:, 2, 2]
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    rim = height_m - radius_m * sine
    ends = np.array([hand.stem_begins_m, hand.length_m])
    stem = (height_m[:, None] + ends * cosine[:, None]).min(axis=1) - hand.stem_radius_m * sine
    return np.asarray(np.minimum(rim, stem) >= -tolerance_m)


def _graspable(frame: Frame, support: Support | None, config: RunConfig) -> Bool[np.ndarray, "h w"]:
    """Pixels that are allowed and show what stands out of the support, within its walls."""
    points, rows, columns = points_of_depth(frame.depth_m, frame.camera, 1)
    chosen = frame.allowed[rows, columns]
    if support is not None:
        eye = np.broadcast_to(frame.camera.world_from_camera[:3, 3], points.shape)
        chosen[chosen] = stands_out(support, points[chosen], eye[chosen], config.predict)
    picture = np.zeros(frame.depth_m.shape, dtype=bool)
    picture[rows[chosen], columns[chosen]] = True
    return np.asarray(picture & _large_enough(frame, picture, config))


def _large_enough(
    frame: Frame, shown: Bool[np.ndarray, "h w"], config: RunConfig
) -> Bool[np.ndarray, "h w"]:
    """Pixels of pieces that are no specks: noise at a bin's walls stands out here and there."""
    pieces, count = ndimage.label(shown, structure=np.ones((3, 3)))
    # A pixel covers at least as much of the surface as of a plane that faces the camera.
    focal = frame.camera.intrinsics
    pixels_m2 = frame.depth_m**2 / (focal[0, 0] * focal[1, 1])
    areas_m2 = np.bincount(pieces.ravel(), weights=pixels_m2.ravel(), minlength=count + 1)
    pad_m2 = np.pi * config.gripper.pad.radius_m**2
    return np.asarray(areas_m2[pieces] >= config.predict.speck_share * pad_m2)


def _near(
    cloud: Cloud,
    places_m: Float[np.ndarray, "k 3"],
    config: RunConfig,
    rng: np.random.Generator,
) -> Int[np.ndarray, " n"]:
    """Indices of points to try around the best places of the first look.

    Contacts drawn over a whole bin lie centimetres apart, so the best of them is better by luck of
    the draw and of the network's error. Around the best places they are drawn as near to each other
    as the ranking averages.
    """
    within_m = config.predict.apart_m / 2
    drawn = []
    for place in places_m:
        near = np.flatnonzero(np.linalg.norm(cloud.points_m - place, axis=1) <= within_m)
        if len(near):
            drawn.append(rng.choice(near, size=config.predict.closer_contacts))
    return np.concatenate([np.empty(0, dtype=np.int64), *drawn])


def _candidates(
    cloud: Cloud,
    drawn: Int[np.ndarray, " n"],
    obstacles: Cloud,
    support: Support | None,
    config: RunConfig,
) -> tuple[Candidates, Counter[str]]:
    """Contacts at points of what may be grasped, clear of all that was measured."""
    settings, hand = config.predict, config.evaluate.hand
    found = candidates_at(
        cloud,
        cloud.points_m[drawn],
        cloud.eye_m[drawn],
        config.grasps.normal_radius_m,
        settings.tilt_max_rad,
    )
    left_out: Counter[str] = Counter()
    left_out["too steep, or too small a surface"] = len(drawn) - len(found)
    free = free_of_collision(found.world_from_contact, obstacles.points_m, hand)
    left_out["hand or stem would meet something"] = int((~free).sum())
    if support is not None:
        clear = clear_of_support(
            found.world_from_contact,
            config.gripper.pad.radius_m,
            hand,
            settings.above_support_m,
        )
        left_out["pad or stem would meet the support"] = int((free & ~clear).sum())
        free &= clear
    return found.take(free), left_out


def _instances_at(
    frames: Sequence[Frame], poses: Float[np.ndarray, "k 4 4"]
) -> Int[np.ndarray, " k"]:
    """The label under each contact in the first frame with labels that shows it."""
    labels = np.zeros(len(poses), dtype=np.int64)
    for frame in frames:
        if frame.instances is None:
            continue
        pixel, seen = pixels_of(frame, poses[:, :3, 3])
        new = seen & (labels == 0)
        labels[new] = frame.instances[pixel[new, 1], pixel[new, 0]]
    return labels


def pixels_of(
    frame: Frame, points_m: Float[np.ndarray, "k 3"], within: bool = True
) -> tuple[Int[np.ndarray, "k 2"], Bool[np.ndarray, " k"]]:
    """Column and row of points of the frame's world, and whether they lie in its picture.

    Parameters
    ----------
    frame
        The picture.
    points_m
        Points in the frame's world, shape (k, 3) [m].
    within
        Whether the picture's edges count; else all that lies ahead of the camera does.

    Returns
    -------
    Column and row of each, shape (k, 2), and whether it is seen, shape (k,).
    """
    pixels, depth_m = project(frame.camera, points_m)
    ahead = depth_m > 0
    seen = in_picture(frame.camera, pixels) if within else ahead
    return np.floor(np.where(ahead[:, None], pixels, -1.0)).astype(np.int64), seen


def approach_of(world_from_contact: Float[np.ndarray, "k 4 4"]) -> Float[np.ndarray, "k 3"]:
    """Which way the gripper moves at each contact: -z of GCS, unit vectors in the world."""
    return -world_from_contact[:, :3, 2]
