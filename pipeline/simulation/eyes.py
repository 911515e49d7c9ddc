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
from pipeline.sensing.depth_by_rays import measure_depth, window_around
from pipeline.world.cameras import PinholeCamera, camera_at, static_cameras
from pipeline.world.posed_bodies import PosedBodies

_ORIGIN = np.zeros(3)  # the wrist camera gets its pose at every picture


class SimulatedEyes:
    """The cameras of the closed loop as `pipeline.control.robot.Eyes`, with the sensors' noise.

    Pictures show the table and the bodies where they are at that moment. They do not show the
    gripper: a real robot would cut its own gripper out of the wrist camera's picture, and the
    static cameras take their pictures while the gripper is at home.
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
        """One depth picture from each camera beside the table."""
        return [self._taken(camera) for camera in self._beside]

    def wrist_camera(self, world_from_gripper: Float[np.ndarray, "4 4"]) -> PinholeCamera:
        """The wrist camera as it stands when the gripper has this pose."""
        pose = world_from_gripper @ self._gripper_from_camera
        return place_camera(self._on_wrist, pose)

    def wrist(self, around_m: Float[np.ndarray, " 3"], radius_m: float) -> DepthPicture | None:
        """Take the part of the wrist camera's picture that shows a sphere.

        Parameters
        ----------
        around_m
            Centre of the sphere in WCS [m], shape (3,).
        radius_m
            Radius of the sphere [m].

        Returns
        -------
        The picture, with a camera that describes this part only.
        """
        camera = self.wrist_camera(self._gripper_pose())
        return self._taken(window_around(camera, around_m, radius_m))

    def _taken(self, camera: PinholeCamera) -> DepthPicture:
        """One picture of the bodies where they are now."""
        poses = {i: body.world_from_object for i, body in self._bodies.items()}
        opaque = None
        if not self._transparent.isdisjoint(poses):
            opaque = self._surfaces.at(
                {i: pose for i, pose in poses.items() if i not in self._transparent}
            )
        depth_m, bodies = measure_depth(camera, self._surfaces.at(poses), opaque, self._rng)
        segmented = self._config.evaluate.segmentation == "ideal"
        return DepthPicture(depth_m, camera, bodies if segmented else None)


def gripper_from_camera(hand: HandConfig) -> Float[np.ndarray, "4 4"]:
    """Pose of the wrist camera in GCS: beside the axis, looking at a point on it below the pad."""
    eye = np.array([hand.camera_aside_m, 0.0, hand.camera_above_m])
    return look_at(eye, np.array([0.0, 0.0, -hand.camera_focus_m]))


def place_camera(
    camera: PinholeCamera, world_from_camera: Float[np.ndarray, "4 4"]
) -> PinholeCamera:
    """The same camera at another pose."""
    return replace(camera, world_from_camera=world_from_camera)
