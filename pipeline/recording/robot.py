"""The moving robot in a recording: the gripper, and the links of an arm where there is one."""

from dataclasses import dataclass

import numpy as np
import rerun as rr
from jaxtyping import Float, Int

from pipeline.config.evaluation import ArmConfig, HandConfig
from pipeline.geometry.iiwa14 import LINKS, LinkShape, link_poses
from pipeline.recording import colours

GRIPPER, ARM = "world/gripper", "world/arm"
_PAD_M = 0.004  # the pad is drawn this thick


@dataclass(frozen=True)
class ShownRobot:
    """Sizes of gripper and hand, and the arm's configuration with the position of its foot."""

    pad_radius_m: float
    hand: HandConfig
    arm: ArmConfig


def show_gripper(stream: rr.RecordingStream, robot: ShownRobot) -> None:
    """Log the shapes of pad and stem in GCS; their pose is logged for each frame elsewhere."""
    hand = robot.hand
    stem_m = hand.length_m - hand.stem_begins_m
    show_free_pad(stream, robot)
    stream.log(
        f"{GRIPPER}/stem",
        rr.Cylinders3D(
            lengths=[stem_m],
            radii=[hand.stem_radius_m],
            centers=[[0.0, 0.0, hand.stem_begins_m + stem_m / 2]],
            colors=[colours.PALETTE[7]],
            fill_mode="solid",
        ),
        static=True,
    )


def show_free_pad(stream: rr.RecordingStream, robot: ShownRobot) -> None:
    """Log the pad as a disc, as long as it lies on nothing."""
    stream.log(
        f"{GRIPPER}/pad",
        rr.Cylinders3D(
            lengths=[_PAD_M],
            radii=[robot.pad_radius_m],
            colors=[colours.PALETTE[6]],
            fill_mode="solid",
        ),
    )


def show_arm(stream: rr.RecordingStream) -> None:
    """Log the shapes of the arm's links, each in its own frame; poses are logged elsewhere."""
    for shape in LINKS:
        stream.log(f"{ARM}/{shape.link}", _shown(shape), static=True)


def send_arm(
    stream: rr.RecordingStream,
    timeline: str,
    frames: Int[np.ndarray, " t"],
    joint_path_rad: Float[np.ndarray, "t 7"],
    robot: ShownRobot,
) -> None:
    """Log the poses of the arm's links over time.

    Parameters
    ----------
    stream
        The recording.
    timeline
        Name of its timeline.
    frames
        Steps of the timeline, shape (t,).
    joint_path_rad
        Joint angles at these steps [rad], shape (t, 7).
    robot
        The robot that is shown.
    """
    poses = link_poses(joint_path_rad)
    poses[..., :3, 3] += robot.arm.base_m
    for index, shape in enumerate(LINKS):
        send_poses(stream, timeline, f"{ARM}/{shape.link}", frames, poses[:, index])


def send_poses(
    stream: rr.RecordingStream,
    timeline: str,
    entity: str,
    frames: Int[np.ndarray, " t"],
    poses: Float[np.ndarray, "t 4 4"],
) -> None:
    """Log the pose of one entity over time.

    Parameters
    ----------
    stream
        The recording.
    timeline
        Name of its timeline.
    entity
        Path of the entity.
    frames
        Steps of the timeline, shape (t,).
    poses
        world_from_entity at these steps, shape (t, 4, 4).
    """
    if len(frames):
        columns = rr.Transform3D.columns(translation=poses[:, :3, 3], mat3x3=poses[:, :3, :3])
        indexes = [rr.TimeColumn(timeline, sequence=frames)]
        stream.send_columns(entity, indexes=indexes, columns=columns)


def _shown(shape: LinkShape) -> rr.Cylinders3D | rr.Ellipsoids3D:
    centre, colour = [[0.0, 0.0, shape.middle_m]], [colours.PALETTE[7]]
    if shape.length_m > 0:
        return rr.Cylinders3D(
            lengths=[shape.length_m],
            radii=[shape.radius_m],
            centers=centre,
            colors=colour,
            fill_mode="solid",
        )
    return rr.Ellipsoids3D(radii=[shape.radius_m], centers=centre, colors=colour, fill_mode="solid")
