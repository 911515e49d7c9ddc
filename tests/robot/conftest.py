"""The example's cell: its calibration file is the truth of the fake, but for what a test spoils."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.robot import vendor
from tests.robot.vendor import Box, World

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "runs" / "robot" / "my_robot.py"
CALIBRATION = ROOT / "runs" / "robot" / "calibration.json"
RADIUS_M = 0.025


def small(camera: dict[str, Any], by: int = 2) -> dict[str, Any]:
    """The same camera with fewer pixels: a test takes many pictures."""
    changed = {name: camera[name] / by for name in ("fx", "fy")}
    changed |= {name: (camera[name] + 0.5) / by - 0.5 for name in ("cx", "cy")}
    changed |= {name: camera[name] // by for name in ("width", "height")}
    return {**camera, **changed}


def calibration() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(CALIBRATION.read_text())
    content["wrist_camera"] = small(content["wrist_camera"])
    content["static_cameras"] = [small(one) for one in content["static_cameras"]]
    return content


def world_of(content: dict[str, Any]) -> World:
    """Three boxes on the table, one of them porous."""
    static = content["static_cameras"][0]
    return World(
        world_from_base=np.array(content["world_from_base"]),
        flange_from_gripper=np.array(content["flange_from_gripper"]),
        flange_from_camera=np.array(content["flange_from_camera"]),
        world_from_static=np.array(static["world_from_camera"]),
        cameras={"wrist": content["wrist_camera"], "static": static},
        hand_mass_kg=content["hand_mass_kg"],
        hand_centre_m=np.array(content["hand_centre_m"]),
        radius_m=RADIUS_M,
        boxes=[
            Box(np.array([0.0, 0.0, 0.03]), np.array([0.06, 0.05, 0.03]), 0.3),
            Box(np.array([0.05, 0.16, 0.02]), np.array([0.05, 0.04, 0.02]), 0.15, smooth=False),
        ],
    )


@pytest.fixture
def cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, World]:
    """The path of a calibration file, and the world that it is true of."""
    content = calibration()
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(content))
    world = world_of(content)
    monkeypatch.setattr(vendor, "WORLD", world, raising=False)
    monkeypatch.setitem(__import__("sys").modules, "vendor", vendor)
    return path, world
