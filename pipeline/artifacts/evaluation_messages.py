"""Attempts and results by level ↔ softgrip.v1.Attempt and LevelResult."""

import numpy as np

from pipeline.artifacts.tensors import to_tensor
from pipeline.control.policy import Cause
from pipeline.simulation.picking import Attempt
from schemas.softgrip.v1 import evaluation_pb2

ARRAYS = (
    "world_from_gripper",
    "reached_pose",
    "time_s",
    "gripper_path",
    "object_paths",
    "base_wrench",
)


def attempt_message(
    scene_id: str, level: int, number: int, made: Attempt
) -> evaluation_pb2.Attempt:
    """The message of one attempt."""
    lifted = made.cause is Cause.LIFTED
    message = evaluation_pb2.Attempt(
        scene_id=scene_id,
        level=level,
        attempt=number,
        outcome="lifted" if lifted else "failed",
        cause="" if lifted else str(made.cause),
        target=made.target,
        candidates=made.candidates,
        predicted_quality=made.predicted_quality,
        reached_quality=made.reached_quality,
        seal_pressure=made.seal_pressure,
        lifted_height_m=made.lifted_height_m,
        duration_s=made.duration_s,
        states=made.states,
    )
    for name in ARRAYS:
        getattr(message, name).CopyFrom(to_tensor(np.asarray(getattr(made, name), np.float64)))
    return message
