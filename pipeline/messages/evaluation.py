"""Attempts and results by level ↔ softgrip.v1.Attempt and LevelResult."""

import numpy as np

from pipeline.artifacts.tensors import to_tensor
from pipeline.control.cloud import DepthPicture
from pipeline.control.decision import Cause
from pipeline.simulation.picking import JudgedAttempt
from pipeline.world.cameras import thinned
from schemas.softgrip.v1 import evaluation_pb2

PICTURE_EVERY = 4  # pixels a side: a film needs to show what was seen, not to measure it


def attempt_message(
    scene_id: str, level: int, bodies: int, number: int, policy: str, made: JudgedAttempt
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
    made
        The attempt.

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
        "object_paths": np.array(objects).reshape(-1, bodies, 4, 4),
        "base_wrench": np.array([s.wrench for s in samples]).reshape(-1, 6),
    }
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
        pictures=[picture_message(picture) for picture in decision.pictures],
        **{name: to_tensor(np.asarray(array, np.float64)) for name, array in arrays.items()},
    )


def picture_message(picture: DepthPicture) -> evaluation_pb2.DepthPicture:
    """Write a depth picture as a message, with one pixel of `PICTURE_EVERY` on each side."""
    depth = np.nan_to_num(picture.depth_m[::PICTURE_EVERY, ::PICTURE_EVERY])
    camera = thinned(picture.camera, PICTURE_EVERY)
    return evaluation_pb2.DepthPicture(
        camera=camera.name,
        depth_mm=to_tensor(np.round(np.clip(1e3 * depth, 0, 65_535)).astype(np.uint16)),
        intrinsics=to_tensor(camera.intrinsics),
        world_from_camera=to_tensor(camera.world_from_camera),
    )
