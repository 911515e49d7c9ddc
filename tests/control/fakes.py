"""A world without physics: eyes that see given points, a robot that does all it is told."""

from dataclasses import replace

import numpy as np

from pipeline.config.cameras import WristCameraConfig
from pipeline.control.cloud import DepthPicture
from pipeline.control.robot import Reading, State
from pipeline.control.viewpoints import gripper_above
from pipeline.geometry.transforms import invert, look_at, transform_points
from pipeline.world.cameras import PinholeCamera, camera_at

_CAMERA = replace(camera_at("fake", WristCameraConfig(), np.zeros(3), 1.0, 0.0, 0.0), near_m=0.0)


def picture_of(points: np.ndarray, eye: np.ndarray, target: np.ndarray) -> DepthPicture:
    """The depth image that points make: the nearest in each pixel."""
    camera = replace(_CAMERA, world_from_camera=look_at(eye, target))
    depth = np.zeros((camera.height_px, camera.width_px))
    seen = transform_points(invert(camera.world_from_camera), points)
    k = camera.intrinsics
    for x, y, z in seen[np.argsort(-seen[:, 2])]:
        if not z > 0:
            continue
        column, row = int(k[0, 0] * x / z + k[0, 2]), int(k[1, 1] * y / z + k[1, 2])
        if 0 <= row < depth.shape[0] and 0 <= column < depth.shape[1]:
            depth[row, column] = z
    return DepthPicture(depth, camera)


class FakeEyes:
    """Sees the points; stops after ``pictures`` pictures."""

    def __init__(self, points: np.ndarray, robot: "FakeRobot", pictures: int = 10_000) -> None:
        self.points = points
        self.robot = robot
        self.left = pictures
        self.static_looks = self.wrist_looks = 0

    def static(self) -> list[DepthPicture] | None:
        self.static_looks += 1
        taken = self._taken(np.array([0.0, 0.05, 0.9]), np.zeros(3))
        return None if taken is None else [taken]

    def wrist_camera(self, world_from_gripper: np.ndarray) -> PinholeCamera:
        eye = world_from_gripper @ np.array([0.16, 0.0, 0.10, 1.0])
        camera = replace(_CAMERA, near_m=0.25)
        return replace(camera, world_from_camera=look_at(eye[:3], world_from_gripper[:3, 3]))

    def wrist(self, around_m: np.ndarray, radius_m: float) -> DepthPicture | None:
        self.wrist_looks += 1
        eye = self.wrist_camera(self.robot.pose()).world_from_camera[:3, 3]
        return self._taken(eye, around_m)

    def _taken(self, eye: np.ndarray, target: np.ndarray) -> DepthPicture | None:
        self.left -= 1
        return None if self.left < 0 else picture_of(self.points, eye, target)


class FakeRobot:
    """Is where it is told to be at once; touches at ``surface_m``; an object weighs 1 N."""

    def __init__(
        self, surface_m: float, fails_at: State | None = None, reach_m: float = 10.0
    ) -> None:
        self.surface_m = surface_m
        self.fails_at = fails_at
        self.reach_m = reach_m
        self.state = State.OBSERVE
        self.states: list[State] = []
        self.poses: list[np.ndarray] = []
        self.sucks = False
        self._pose = gripper_above(np.zeros(3), 0.6, np.eye(4))

    def enter(self, state: State) -> None:
        self.state = state
        self.states.append(state)

    def tare(self) -> None:
        pass

    def think(self) -> None:
        pass

    def pose(self) -> np.ndarray:
        return self._pose.copy()

    def reachable(self, world_from_gripper: np.ndarray) -> bool:
        return bool(np.abs(world_from_gripper[:2, 3]).max() <= self.reach_m)

    def step(self, world_from_gripper: np.ndarray, speed_m_s: float) -> Reading:
        wrench, peak_n = np.zeros(6), 0.0
        failing = self.state is self.fails_at
        way = world_from_gripper[:3, 3] - self._pose[:3, 3]
        share = min(1.0, speed_m_s / 15 / max(float(np.linalg.norm(way)), 1e-9))
        self._pose = world_from_gripper.copy()
        self._pose[:3, 3] -= (1 - share) * way
        if failing and self.state in (State.PREGRASP, State.APPROACH):
            peak_n = 40.0
        elif not self.sucks and self._pose[2, 3] <= self.surface_m:
            wrench[2] = 2.0
        if self.sucks and not failing:
            wrench[:3] = self._pose[:3, :3].T @ np.array([0.0, 0.0, -1.0])
        self.poses.append(self._pose.copy())
        return Reading(self.pose(), wrench, peak_n, share >= 1.0)

    def vacuum(self, on: bool) -> None:
        self.sucks = on

    def shake(self) -> Reading:
        return self.step(self._pose, 1.0)

    def carry(self, acceleration_m_s2: float) -> Reading:
        return self.step(self._pose, 1.0)


class HeavyRobot(FakeRobot):
    """Its object hangs below a place; held with more than ``lever_m`` beside it, it breaks away."""

    def __init__(
        self, surface_m: float, centre_m: np.ndarray, lever_m: float, base_above_pad_m: float
    ) -> None:
        super().__init__(surface_m)
        self.centre_m = centre_m
        self.lever_m = lever_m
        self.base = np.array([0.0, 0.0, base_above_pad_m, 1.0])
        self.sealed_at: list[np.ndarray] = []

    def step(self, world_from_gripper: np.ndarray, speed_m_s: float) -> Reading:
        felt = super().step(world_from_gripper, speed_m_s)
        if not self.sucks:
            return felt
        lever = self.centre_m - (felt.world_from_gripper @ self.base)[:3]
        moment = felt.world_from_gripper[:3, :3].T @ np.cross(lever, [0.0, 0.0, -1.0])
        breaks = bool(np.linalg.norm(self.sealed_at[-1][:2, 3] - self.centre_m[:2]) > self.lever_m)
        self.sucks = not breaks
        wrench = np.concatenate([felt.wrench[:3], moment])
        return replace(felt, wrench=wrench, arrived=felt.arrived and not breaks)

    def vacuum(self, on: bool) -> None:
        super().vacuum(on)
        if on:
            self.sealed_at.append(self.pose())
