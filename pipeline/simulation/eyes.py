"""The cameras of the closed loop: beside the table, and on the wrist.

Pictures come late: they show the world as it was at their exposure. On an imperfect robot they are
taken from where the cameras truly are, and carry the pose that the calibration believes in.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np
import trimesh
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.config.evaluation import HandConfig
from pipeline.config.grasps import PadConfig
from pipeline.control.cloud import DepthPicture
from pipeline.control.own_body import cut_gripper_out
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert, look_at
from pipeline.sensing.depth_by_rays import measure_depth, window_around
from pipeline.simulation.imperfection import Calibration
from pipeline.world.cameras import PinholeCamera, camera_at
from pipeline.world.posed_bodies import PosedBodies
from pipeline.world.scene_cameras import static_cameras

_ORIGIN = np.zeros(3)  # the wrist camera gets its pose at every picture
_SECTIONS = 48  # sides of the gripper's outline in pictures: finer than a pixel
Pose = Float[np.ndarray, "4 4"]


class Seen(Protocol):
    """What pictures are taken of: the gripper and the bodies, now and a while ago."""

    def state_before(self, age_s: float) -> tuple[Pose, dict[int, Pose]]:
        """Pose of the gripper, and of each body by its id, so long ago [s]."""
        ...

    def wait(self, time_s: float) -> None:
        """Let simulated time pass while the gripper stands still [s]."""
        ...


class SimulatedEyes:
    """The cameras of the closed loop as `pipeline.control.robot.Eyes`, with the sensors' noise.

    On an imperfect robot pictures also show the gripper, which hides what is behind it. What was
    measured of it is cut out, by the pose that the robot believes in. An arm's links are not shown.
    """

    def __init__(
        self,
        seen: Seen,
        objects: Mapping[int, CatalogueObject],
        config: RunConfig,
        calibration: Calibration,
        rng: np.random.Generator,
    ) -> None:
        """Place the cameras; no picture is taken yet.

        Parameters
        ----------
        seen
            Tells where the gripper and the bodies are and were.
        objects
            Catalogue entry of each body.
        config
            The run.
        calibration
            Errors of the cameras' poses.
        rng
            Draws the sensors' noise.
        """
        self._seen = seen
        self._config = config
        self._imperfection = config.evaluate.imperfection
        self._calibration = calibration
        self._rng = rng if config.sensing.disturbed else None
        meshes = {i: item.mesh for i, item in objects.items()}
        self._own_id = max(meshes, default=0) + 1
        meshes[self._own_id] = gripper_mesh(config.evaluate.hand, config.gripper.pad)
        self._surfaces = PosedBodies(meshes, config.scenes.table_side_m)
        self._transparent = {i for i, item in objects.items() if item.material == "transparent"}
        self._beside = static_cameras(config.cameras.static)
        self._beside_errors = [
            level_error(camera.world_from_camera, error)
            for camera, error in zip(self._beside, calibration.beside, strict=True)
        ]
        self._on_wrist = camera_at("wrist", config.cameras.wrist, _ORIGIN, 1.0, 0.0, 0.0)
        self._gripper_from_camera = gripper_from_camera(config.evaluate.hand)

    def static(self) -> list[DepthPicture] | None:
        """One depth picture from each camera beside the table; the gripper waits for them."""
        gripper, bodies = self._seen.state_before(0.0)
        pictures = [
            self._taken(camera, error, gripper, bodies, 0.0)
            for camera, error in zip(self._beside, self._beside_errors, strict=True)
        ]
        self._seen.wait(self._imperfection.scale * self._imperfection.latency_s)
        return pictures

    def wrist_camera(self, world_from_gripper: Pose) -> PinholeCamera:
        """The wrist camera as the robot believes it stands when the gripper has this pose."""
        pose = world_from_gripper @ self._gripper_from_camera @ self._calibration.hand_eye
        return place_camera(self._on_wrist, pose)

    def wrist(self, around_m: Float[np.ndarray, " 3"], radius_m: float) -> DepthPicture | None:
        """Take the part of the wrist camera's picture that shows a sphere.

        It was exposed a while ago, as much as the picture takes to arrive and the policy to use it;
        the gripper has gone on meanwhile.

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
        age_s = self._imperfection.picture_age_s
        gripper, bodies = self._seen.state_before(age_s)
        window = window_around(self.wrist_camera(gripper), around_m, radius_m)
        true_pose = gripper @ self._gripper_from_camera
        camera = place_camera(window, true_pose)
        return self._taken(camera, self._calibration.hand_eye, gripper, bodies, age_s)

    def _taken(
        self,
        camera: PinholeCamera,
        error: Pose,
        gripper: Pose,
        bodies: Mapping[int, Pose],
        age_s: float,
    ) -> DepthPicture:
        """A picture from the true pose of a camera, with the pose that the robot believes in."""
        poses = dict(bodies)
        shows_gripper = self._imperfection.scale > 0.0
        if shows_gripper:
            poses[self._own_id] = gripper
        opaque = None
        if not self._transparent.isdisjoint(poses):
            opaque = self._surfaces.at(
                {i: pose for i, pose in poses.items() if i not in self._transparent}
            )
        depth_m, shown = measure_depth(camera, self._surfaces.at(poses), opaque, self._rng)
        segmented = self._config.evaluate.segmentation == "ideal"
        instances = (
            np.where(shown == self._own_id, shown.dtype.type(0), shown) if segmented else None
        )
        if not shows_gripper:
            return DepthPicture(depth_m, camera, instances)
        believed = place_camera(camera, camera.world_from_camera @ error)
        return cut_gripper_out(
            DepthPicture(depth_m, believed, instances, age_s),
            gripper,
            self._config.evaluate.hand,
            self._config.gripper.pad,
            self._imperfection.own_margin_m,
        )


def level_error(world_from_camera: Pose, camera_from_believed: Pose) -> Pose:
    """What is left of an error of a camera's pose when the table is seen level and at its height.

    A cell's cameras are checked against its table. Left are the shift of the table's middle along
    the table, and the turn about the vertical.

    Parameters
    ----------
    world_from_camera
        True pose, shape (4, 4).
    camera_from_believed
        The error, shape (4, 4).

    Returns
    -------
    camera_from_believed, shape (4, 4), that moves the table within itself.
    """
    moved = world_from_camera @ camera_from_believed @ invert(world_from_camera)
    turn = np.arctan2(moved[1, 0] - moved[0, 1], moved[0, 0] + moved[1, 1])
    level = np.eye(4)
    level[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    level[:2, 3] = moved[:2, 3]
    return np.asarray(invert(world_from_camera) @ level @ world_from_camera)


def gripper_mesh(hand: HandConfig, pad: PadConfig) -> Mesh:
    """The pad and the stem above it as two cylinders in GCS."""
    parts = [
        trimesh.creation.cylinder(
            radius, segment=[[0.0, 0.0, low], [0.0, 0.0, high]], sections=_SECTIONS
        )
        for radius, low, high in (
            (pad.radius_m, 0.0, pad.altitude_m),
            (hand.stem_radius_m, pad.altitude_m, hand.length_m),
        )
    ]
    both = trimesh.util.concatenate(parts)
    return Mesh(np.asarray(both.vertices, np.float64), np.asarray(both.faces, np.int64))


def gripper_from_camera(hand: HandConfig) -> Float[np.ndarray, "4 4"]:
    """Pose of the wrist camera in GCS: beside the axis, looking at a point on it below the pad."""
    eye = np.array([hand.camera_aside_m, 0.0, hand.camera_above_m])
    return look_at(eye, np.array([0.0, 0.0, -hand.camera_focus_m]))


def place_camera(
    camera: PinholeCamera, world_from_camera: Float[np.ndarray, "4 4"]
) -> PinholeCamera:
    """The same camera at another pose."""
    return replace(camera, world_from_camera=world_from_camera)
