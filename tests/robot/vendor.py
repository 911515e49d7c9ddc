"""A fake of an arm's and a camera's libraries: a KUKA iiwa above a table with boxes, no physics.

It shares no code with the program's simulation: joints move by a numerical Jacobian, depth is the
intersection of rays with boxes in closed form, an object is held where the whole pad lies on a box.
"""

from dataclasses import dataclass, field

import numpy as np

from tests.simulation.kinematics import flange_pose

STIFF_N_M = 3000.0  # the pad pushes back so hard
GRAVITY_M_S2 = 9.81
START_RAD = np.array([0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0])
REACH_M = (0.3, 0.85)  # from the shoulder, to the flange


@dataclass
class Box:
    """Axis-aligned at first; carried along where it is held."""

    centre_m: np.ndarray
    half_m: np.ndarray
    mass_kg: float
    smooth: bool = True

    @property
    def top_m(self) -> float:
        return float(self.centre_m[2] + self.half_m[2])


@dataclass
class World:
    """The truth of the cell, which the tested program knows by its calibration only."""

    world_from_base: np.ndarray
    flange_from_gripper: np.ndarray
    flange_from_camera: np.ndarray
    world_from_static: np.ndarray
    cameras: dict[str, dict[str, float]]
    hand_mass_kg: float
    hand_centre_m: np.ndarray
    radius_m: float
    boxes: list[Box] = field(default_factory=list)
    bias: np.ndarray = field(default_factory=lambda: np.array([1.5, -2.0, 4.0, 0.1, 0.2, -0.05]))
    noise_n: float = 0.0
    leaks_at_carry: bool = False
    camera_scale: float = 1.0

    def __post_init__(self) -> None:
        self.q_rad = START_RAD.copy()
        self.held: Box | None = None
        self.offset_m = np.zeros(3)
        self.sucks = False
        self.time_s = 0.0
        self.steps = 0
        self.fastest_rad_s = 0.0
        self.rng = np.random.default_rng(1)

    def pad(self) -> np.ndarray:
        flange = flange_pose(self.q_rad)
        return np.asarray(self.world_from_base @ flange @ self.flange_from_gripper)

    def push_n(self) -> np.ndarray:
        """What a surface pushes the pad with, in the world."""
        pad = self.pad()
        for box in self.boxes:
            beside = np.abs(pad[:2, 3] - box.centre_m[:2]) - box.half_m[:2]
            deep_m = box.top_m - pad[2, 3]
            if box is not self.held and (beside < self.radius_m).all() and 0 < deep_m < 0.05:
                return np.array([0.0, 0.0, STIFF_N_M * deep_m])
        return np.zeros(3)

    def under_pad(self) -> Box | None:
        pad = self.pad()
        for box in self.boxes:
            inside = np.abs(pad[:2, 3] - box.centre_m[:2]) + self.radius_m <= box.half_m[:2]
            if inside.all() and abs(pad[2, 3] - box.top_m) < 0.004 and pad[2, 2] > 0.98:
                return box
        return None


WORLD: World  # set by the test


class Arm:
    def __init__(self, address: str) -> None:
        self.address = address

    def flange_pose(self) -> np.ndarray:
        return flange_pose(WORLD.q_rad)

    def inverse_kinematics(self, base_from_flange: np.ndarray) -> np.ndarray | None:
        far_m = np.linalg.norm(base_from_flange[:3, 3] - np.array([0.0, 0.0, 0.36]))
        return WORLD.q_rad if REACH_M[0] < far_m < REACH_M[1] else None

    def servo(self, target: np.ndarray, period_s: float) -> None:
        """Joints go half of what is left, as a controller that lags."""
        now = flange_pose(WORLD.q_rad)
        columns = []
        for joint in range(7):
            q = WORLD.q_rad.copy()
            q[joint] += 1e-5
            columns.append(difference(flange_pose(q), now) / 1e-5)
        jacobian = np.array(columns).T
        step = np.linalg.pinv(jacobian, rcond=1e-3) @ difference(target, now)
        step *= min(1.0, 0.15 / max(float(np.abs(step).max()), 1e-9))
        WORLD.q_rad = WORLD.q_rad + 0.5 * step
        WORLD.fastest_rad_s = max(WORLD.fastest_rad_s, float(np.abs(step).max()) / period_s)
        WORLD.time_s += period_s
        WORLD.steps += 1
        if WORLD.held is not None:
            WORLD.held.centre_m = WORLD.pad()[:3, 3] + WORLD.offset_m

    def stopped(self) -> bool:
        return False

    def force_torque(self) -> np.ndarray:
        """Bias, the hand's weight, a surface's push and a held box's weight, at the flange."""
        world_from_flange = WORLD.world_from_base @ flange_pose(WORLD.q_rad)
        turn = world_from_flange[:3, :3].T
        down = np.array([0.0, 0.0, -GRAVITY_M_S2])
        weight = turn @ (WORLD.hand_mass_kg * down)
        total = np.concatenate([weight, np.cross(WORLD.hand_centre_m, weight)])
        at_pad = WORLD.flange_from_gripper[:3, 3]
        load = turn @ WORLD.push_n()
        total += np.concatenate([load, np.cross(at_pad, load)])
        if WORLD.held is not None:
            load = turn @ (WORLD.held.mass_kg * down)
            lever = turn @ (WORLD.held.centre_m - world_from_flange[:3, 3])
            total += np.concatenate([load, np.cross(lever, load)])
        return np.asarray(total + WORLD.bias + WORLD.noise_n * WORLD.rng.normal(size=6))

    def set_output(self, pin: int, on: bool) -> None:
        WORLD.sucks = on
        WORLD.held = None
        below = WORLD.under_pad() if on else None
        if below is not None and below.smooth:
            WORLD.held, WORLD.offset_m = below, below.centre_m - WORLD.pad()[:3, 3]
        if not on:  # what is let go is taken away
            WORLD.boxes = [box for box in WORLD.boxes if box.centre_m[2] - box.half_m[2] < 0.05]

    def analog_input(self, pin: int) -> float | None:
        closed = WORLD.held is not None and not WORLD.leaks_at_carry
        return (55_000.0 if closed else 1_000.0) / 20_000.0 if WORLD.sucks else 0.0

    def clock_s(self) -> float:
        return WORLD.time_s


class DepthCamera:
    def __init__(self, name: str) -> None:
        self.name = name

    def depth_mm(self) -> np.ndarray:
        pose = WORLD.world_from_static
        if self.name == "wrist":
            world_from_flange = WORLD.world_from_base @ flange_pose(WORLD.q_rad)
            pose = world_from_flange @ WORLD.flange_from_camera
        return WORLD.camera_scale * 1000.0 * depth_m(pose, WORLD.cameras[self.name], WORLD.boxes)


def depth_m(pose: np.ndarray, camera: dict[str, float], boxes: list[Box]) -> np.ndarray:
    """Depth along z of table and boxes, by the slab method; whole numbers are pixel centres."""
    u, v = np.meshgrid(np.arange(int(camera["width"])), np.arange(int(camera["height"])))
    rays = np.stack(
        [
            (u - camera["cx"]) / camera["fx"],
            (v - camera["cy"]) / camera["fy"],
            np.ones(u.shape),
        ],
        axis=-1,
    )
    ways, eye = rays @ pose[:3, :3].T, pose[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(ways[..., 2] < 0, -eye[2] / ways[..., 2], np.inf)
        for box in boxes:
            one = (box.centre_m - box.half_m - eye) / ways
            other = (box.centre_m + box.half_m - eye) / ways
            enters, leaves = np.minimum(one, other).max(-1), np.maximum(one, other).min(-1)
            depth = np.where((enters <= leaves) & (enters > 0), np.minimum(depth, enters), depth)
    return np.where(np.isfinite(depth), depth, 0.0)


def difference(target: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Translation and small rotation from one pose to another, in the base."""
    turn = target[:3, :3] @ now[:3, :3].T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate([target[:3, 3] - now[:3, 3], axis / 2])
