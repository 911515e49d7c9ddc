"""Attempts, in simulation and on a robot, ↔ softgrip.v1.Attempt."""

from dataclasses import replace

import numpy as np

from pipeline.artifacts.tensors import to_tensor
from pipeline.config import RunConfig
from pipeline.control.attempts import JudgedAttempt, SeenPicture
from pipeline.control.cloud import DepthPicture
from pipeline.control.decision import Cause, TriedContact
from pipeline.sensing.sub_cloud import merged_sub_clouds
from pipeline.world.cameras import thinned
from schemas.softgrip.v1 import evaluation_pb2

PICTURE_EVERY = 4  # pixels a side: a film needs to show what was seen, not to measure it


def attempt_message(
    scene_id: str,
    level: int,
    bodies: int,
    number: int,
    policy: str,
    judge: str,
    made: JudgedAttempt,
    config: RunConfig,
) -> evaluation_pb2.Attempt:
    """Write one attempt as a message.

    Parameters
    ----------
    scene_id
        The scene.
    level
        Its level, 1 to 9.
    bodies
        Number of bodies in the scene before the first attempt.
    number
        Number of the attempt in its scene, from 0.
    policy
        Name of the policy.
    judge
        What decided how it ended: that of a simulation, or ``robot``.
    made
        The attempt.
    config
        The run: how pictures are thinned, and the grid and pad of sub clouds.

    Returns
    -------
    The message.
    """
    lifted = made.cause is Cause.LIFTED
    decision, samples = made.decision, made.samples
    gone = np.full((4, 4), np.nan)
    objects = [[s.world_from_object.get(i, gone) for i in range(1, bodies + 1)] for s in samples]
    arrays = {
        "world_from_gripper": decision.world_from_contact,
        "reached_pose": made.reached_pose,
        "time_s": np.array([s.time_s for s in samples]),
        "gripper_path": np.array([s.world_from_gripper for s in samples]).reshape(-1, 4, 4),
        "object_paths": np.array(objects).reshape(len(samples), bodies, 4, 4),
        "base_wrench": np.array([s.wrench for s in samples]).reshape(-1, 6),
        "pressure": np.array([s.pressure for s in samples]),
    }
    if made.ceilings_n:
        nothing = (np.nan, np.nan)
        arrays["ceilings_n"] = np.array(
            [made.ceilings_n.get(i, nothing) for i in range(1, bodies + 1)]
        )
    joints = np.array([s.joints_rad for s in samples])
    if joints.size:
        arrays["joint_path"] = joints
    return evaluation_pb2.Attempt(
        scene_id=scene_id,
        level=level,
        attempt=number,
        outcome="lifted" if lifted else "failed",
        cause="" if lifted else str(made.cause),
        target=made.target,
        candidates=len(decision.quality),
        predicted_quality=decision.predicted_quality,
        reached_quality=made.reached_quality,
        seal_pressure=made.seal_pressure,
        lifted_height_m=made.lifted_height_m,
        duration_s=made.duration_s,
        states=[s.state for s in samples],
        policy=policy,
        candidate_poses=to_tensor(decision.candidates.astype(np.float32)),
        candidate_quality=to_tensor(decision.quality.astype(np.float32)),
        corrections=decision.corrections,
        regrasps=decision.regrasps,
        seals=decision.seals,
        carried_m_s2=decision.carried_m_s2,
        borne_n=made.borne_n,
        weight_n=made.weight_n,
        pictures=[picture_message(picture, PICTURE_EVERY) for picture in decision.pictures],
        seen=[seen_message(one, config.evaluate.seen_every) for one in made.seen],
        contacts=[
            contact_message(one, lifted and one is decision.tried[-1], config)
            for one in decision.tried
        ],
        judge=judge,
        target_body=made.body_id,
        pad_radius_m=config.gripper.pad.radius_m,
        **{name: to_tensor(np.asarray(array, np.float64)) for name, array in arrays.items()},
    )


def contact_message(
    tried: TriedContact, lifted: bool, config: RunConfig
) -> evaluation_pb2.TriedContact:
    """Write one tried contact with the sub cloud that was measured around it.

    Parameters
    ----------
    tried
        The contact.
    lifted
        Whether an object was lifted by it to the attempt's end.
    config
        The run: grid and pad of the sub cloud.

    Returns
    -------
    The message.
    """
    views = [(picture.depth_m, picture.camera) for picture in tried.pictures]
    cloud, seen = merged_sub_clouds(
        views, tried.world_from_contact[None], config.sensing, config.gripper.pad.radius_m
    )
    return evaluation_pb2.TriedContact(
        world_from_contact=to_tensor(tried.world_from_contact),
        predicted_quality=tried.quality,
        held=tried.held,
        lifted=lifted,
        cloud=to_tensor(cloud[0].astype(np.float16)),
        cloud_mask=to_tensor(seen[0].astype(np.uint8)),
        pictures=len(tried.pictures),
    )


def seen_message(seen: SeenPicture, every: int) -> evaluation_pb2.DepthPicture:
    """Write a picture that the policy took, with its place in the camera's whole picture.

    Parameters
    ----------
    seen
        The picture.
    every
        One row and column of so many is kept, the same ones as of the whole picture.

    Returns
    -------
    The message; places and sizes count kept pixels.
    """
    picture, whole = seen.picture, seen.whole
    corner = np.round(whole.intrinsics[:2, 2] - picture.camera.intrinsics[:2, 2]).astype(int)
    left, top = (-corner % every).tolist()  # the first pixels that the whole picture keeps
    camera = picture.camera
    k = camera.intrinsics.copy()
    k[:2, 2] -= (left, top)
    cut = replace(
        camera, width_px=camera.width_px - left, height_px=camera.height_px - top, intrinsics=k
    )
    message = picture_message(DepthPicture(picture.depth_m[top:, left:], cut), every)
    small = thinned(whole, every)
    message.step = seen.step
    message.left_px, message.top_px = ((corner + np.array([left, top])) // every).tolist()
    message.whole_width_px, message.whole_height_px = small.width_px, small.height_px
    return message


def picture_message(picture: DepthPicture, every: int) -> evaluation_pb2.DepthPicture:
    """Write a depth picture as a message, with one pixel of ``every`` on each side."""
    depth = np.nan_to_num(picture.depth_m[::every, ::every])
    camera = thinned(picture.camera, every)
    return evaluation_pb2.DepthPicture(
        camera=camera.name,
        depth_mm=to_tensor(np.round(np.clip(1e3 * depth, 0, 65_535)).astype(np.uint16)),
        intrinsics=to_tensor(camera.intrinsics),
        world_from_camera=to_tensor(camera.world_from_camera),
    )
