"""The cameras of the closed loop: beside the table, and on the wrist."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.config.evaluation import HandConfig
from pipeline.control.cloud import DepthPicture
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.transforms import look_at
from pipeline.physics.engine import Body
from pipeline.sensing.depth_by_rays import measured, window_around
from pipeline.world.cameras import PinholeCamera, camera_at, static_cameras
from pipeline.world.posed_bodies import PosedBodies

_ORIGIN = np.zeros(3)  # a camera that is moved anyway


class SimulatedEyes:
    """`pipeline.control.robot.Eyes` on the bodies as they are, with the sensors' noise.

    The gripper itself is in no picture: a robot that knows itself cuts it out, and the cameras
    beside the table look while it is home.
    """

    def __init__(
        self,
        bodies: dict[int, Body],
        objects: Mapping[int, CatalogueObject],
        gripper_pose: Callable[[], Float[np.ndarray, "4 4"]],
        config: RunConfig,
        rng: np.random.Generator,
    ) -> None:
        self._bodies = bodies
        self._gripper_pose = gripper_pose
        self._config = config
        self._rng = rng if config.sensing.disturbed else None
        self._surfaces = PosedBodies(
            {i: item.mesh for i, item in objects.items()}, config.scenes.table_side_m
        )
        self._transparent = {i for i, item in objects.items() if item.material == "transparent"}
        self._beside = static_cameras(config.cameras.static)
        self._on_wrist = camera_at("wrist", config.cameras.wrist, _ORIGIN, 1.0, 0.0, 0.0)
        self._gripper_from_camera = gripper_from_camera(config.evaluate.hand)

    def static(self) -> list[DepthPicture] | None:
        """One picture of every camera beside the table."""
        return [self._taken(camera) for camera in self._beside]

    def wrist_camera(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> PinholeCamera:
        """The wrist's camera for the gripper at a pose."""
        pose = world_from_gripper @ self._gripper_from_camera
        return moved(self._on_wrist, pose)

    def wrist(self, around_m: Float[np.ndarray, " 3"], radius_m: float) -> DepthPicture | None:
        """The part of the wrist's picture that shows a ball around a point."""
        camera = self.wrist_camera(self._gripper_pose())
        return self._taken(window_around(camera, around_m, radius_m))

    def _taken(self, camera: PinholeCamera) -> DepthPicture:
        poses = {i: body.world_from_object for i, body in self._bodies.items()}
        opaque = None
        if not self._transparent.isdisjoint(poses):
            opaque = self._surfaces.at(
                {i: pose for i, pose in poses.items() if i not in self._transparent}
            )
        depth_m, bodies = measured(camera, self._surfaces.at(poses), opaque, self._rng)
        segmented = self._config.evaluate.segmentation == "ideal"
        return DepthPicture(depth_m, camera, bodies if segmented else None)


def gripper_from_camera(hand: HandConfig) -> Float[np.ndarray, "4 4"]:
    """Where the wrist's camera sits: beside the axis, looking at a point on it below the pad."""
    eye = np.array([hand.camera_aside_m, 0.0, hand.camera_above_m])
    return look_at(eye, np.array([0.0, 0.0, -hand.camera_focus_m]))


def moved(camera: PinholeCamera, world_from_camera: Float[np.ndarray, "4 4"]) -> PinholeCamera:
    """The camera somewhere else."""
    return replace(camera, world_from_camera=world_from_camera)
