"""Ranked grasps of real pictures → softgrip.v1.RankedGrasps, with the pictures beside it."""

import numpy as np

from pipeline.artifacts.tensors import to_tensor
from pipeline.artifacts.writing import ArtifactWriter
from pipeline.camera.prediction import Prediction
from pipeline.messages.foxglove import (
    camera_calibration,
    frame_transforms,
    poses_in_world,
    raw_image,
)
from schemas.softgrip.v1.predictions_pb2 import LeftOut, RankedGrasps

TOPIC, POSES_TOPIC = "/grasps", "/grasps/poses"


def prediction_message(prediction: Prediction) -> RankedGrasps:
    """The message of all grasps."""
    proposals = prediction.proposals
    message = RankedGrasps(
        frames=[frame.name for frame in prediction.frames],
        ranking=prediction.ranking,
        radius_m=prediction.radius_m,
        quality_min=prediction.quality_min,
        world_from_contact=to_tensor(proposals.world_from_contact),
        camera_from_contact=to_tensor(prediction.camera_from_contact),
        quality=to_tensor(proposals.quality.astype(np.float32)),
        roughness_m=to_tensor(proposals.roughness_m.astype(np.float32)),
        pixel=to_tensor(prediction.pixel.astype(np.int32)),
        instance=to_tensor(proposals.instance.astype(np.int32)),
        left_out=[
            LeftOut(reason=reason, contacts=number) for reason, number in proposals.left_out.items()
        ],
    )
    if proposals.support is not None:
        message.world_from_support.CopyFrom(to_tensor(proposals.support.world_from_support))
    return message


def write_prediction(artifact: ArtifactWriter, prediction: Prediction) -> None:
    """The grasps, the pictures they were found on, and where the cameras stood."""
    artifact.write(TOPIC, prediction_message(prediction), log_time_ns=0)
    poses = prediction.proposals.world_from_contact
    artifact.write(POSES_TOPIC, poses_in_world(poses, 0), log_time_ns=0)
    cameras = {frame.camera.name: frame.camera.world_from_camera for frame in prediction.frames}
    artifact.write("/tf", frame_transforms(cameras, 0), log_time_ns=0)
    for frame in prediction.frames:
        topic = f"/camera/{frame.name}"
        artifact.write(f"{topic}/calibration", camera_calibration(frame.camera, 0), log_time_ns=0)
        depth = raw_image(frame.depth_m, "32FC1", "<f4", frame.camera, 0)
        artifact.write(f"{topic}/depth", depth, log_time_ns=0)
        if frame.colour is not None:
            colour = raw_image(frame.colour, "rgb8", "u1", frame.camera, 0)
            artifact.write(f"{topic}/colour", colour, log_time_ns=0)
