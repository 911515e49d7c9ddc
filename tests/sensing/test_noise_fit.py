"""The fit finds the parameters of pictures that the noise model itself has disturbed."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.camera.frame_files import FrameFiles, read_frame
from pipeline.config.cameras import DepthSensor
from pipeline.sensing.depth_noise import NOISE_MODELS, NoiseModel, disturb
from pipeline.sensing.noise_fit import SensorFit, edge_gaps, fit_sensor, plane_residues, unit_of
from pipeline.world.cameras import PinholeCamera
from pipeline.world.view import CameraView

FOCAL_PX, WIDTH_PX, HEIGHT_PX = 600.0, 640, 480
INTRINSICS = np.array([[FOCAL_PX, 0, 320.0], [0, FOCAL_PX, 240.0], [0, 0, 1.0]])
TILTS_RAD = (0.0, 0.5, 0.9, 1.15)
DISTANCES_M = (0.45, 0.65, 0.9)
REAL = os.environ.get("REAL_FRAMES_DIR")


def plate_before_a_plane(distance_m: float, tilt_rad: float, sensor: DepthSensor) -> CameraView:
    """An upright plate before a plane that is tilted about the picture's horizontal axis."""
    rows = (np.arange(HEIGHT_PX) + 0.5 - 240.0) / FOCAL_PX
    normal = np.array([0.0, -np.sin(tilt_rad), -np.cos(tilt_rad)])
    # n . (x, y, 1) z = -cos(tilt) distance
    depth = np.cos(tilt_rad) * distance_m / (np.cos(tilt_rad) + np.sin(tilt_rad) * rows)
    depth = np.where((depth > 0) & (depth < 1.2), depth, 0.0)  # steps of a pixel stay small
    depth = np.repeat(depth[:, None], WIDTH_PX, axis=1)
    normals = np.tile(np.round(normal * 127 + 128).astype(np.uint8), (HEIGHT_PX, WIDTH_PX, 1))
    plate = np.zeros(depth.shape, dtype=bool)
    plate[180:300, 250:390] = True
    plate &= depth > 0.35
    depth[plate] = 0.3
    normals[plate] = (128, 128, 1)
    camera = PinholeCamera(
        "made",
        WIDTH_PX,
        HEIGHT_PX,
        INTRINSICS,
        np.eye(4),
        sensor,
        0.1,
        5.0,
    )
    none = np.zeros(depth.shape, dtype=np.uint16)
    return CameraView(
        camera=camera,
        colour=np.zeros((*depth.shape, 3), dtype=np.uint8),
        depth_m=depth.astype(np.float32),
        segmentation=none,
        normals=normals,
    )


def fitted(model: NoiseModel, monkeypatch: pytest.MonkeyPatch) -> SensorFit:
    monkeypatch.setitem(NOISE_MODELS, "structured-light", model)
    rng = np.random.default_rng(0)
    views = [
        plate_before_a_plane(distance_m, tilt_rad, "structured-light")
        for distance_m in DISTANCES_M
        for tilt_rad in TILTS_RAD
    ]
    return fit_sensor([(disturb(view, rng), INTRINSICS) for view in views])


MODEL = NoiseModel(0.0003, 0.0, 0.004, 1.4, 0.02, 0.7, 0.0, steepness=1.0, step_m=1e-4)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"grain_px": 1.5, "steepness": 1.6},
        {"grain_px": 0.8, "baseline_m": 0.06, "edge_loss": 0.4},
        {"baseline_m": -0.05, "linear": 0.001, "quadratic_1_m": 0.0},
    ],
)
def test_known_parameters_are_found_again(
    changes: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = replace(MODEL, **changes)
    found = fitted(model, monkeypatch)
    assert found.grain_px == pytest.approx(model.grain_px, abs=0.25)
    assert found.steepness == pytest.approx(model.steepness, abs=0.25)
    assert found.step_m == pytest.approx(model.step_m)
    assert found.baseline_m == pytest.approx(model.baseline_m, abs=0.006)
    assert found.edge_loss == pytest.approx(model.edge_loss, abs=0.15)
    same = replace(
        model,
        floor_m=found.floor_m,
        linear=found.linear,
        quadratic_1_m=found.quadratic_1_m,
        steepness=found.steepness,
    )
    depth, cosine = np.meshgrid([0.45, 0.6, 0.8, 1.0], np.cos([0.0, 0.5, 0.9]))
    ratio = same.sigma_m(depth, cosine) / model.sigma_m(depth, cosine)
    assert np.abs(np.log(ratio)).max() < 0.2


def test_a_plane_leaves_nothing_and_tells_its_angle() -> None:
    view = plate_before_a_plane(0.6, 0.5, "ideal")
    found = plane_residues(view.depth_m.astype(np.float64), INTRINSICS)
    away = np.abs(found.depth_m - 0.3) > 0.01
    assert np.sqrt(np.median(found.variance_m2)) < 1e-6
    assert np.abs(found.incidence_rad[away] - 0.5).max() < 0.55  # rays are up to 0.55 off the axis
    assert np.median(found.incidence_rad[away]) == pytest.approx(0.5, abs=0.12)


def test_gaps_are_counted_between_two_depths() -> None:
    depth = np.array([[1.0, 1.0, 0.0, 0.0, 0.5, 0.5, 0.0, 1.0], [1.0, 0, 1.0, 1, 1, 1, 1, 1]])
    found = edge_gaps(depth)
    assert found.missing_px.tolist() == [2, 1]
    assert found.parallax.tolist() == [1.0, -1.0]
    assert unit_of([np.array([[0.5, 0.501, 0.0, 0.6]])]) == pytest.approx(0.001)


@pytest.mark.skipif(REAL is None, reason="REAL_FRAMES_DIR names no folder of real depth frames")
@pytest.mark.parametrize(("sensor", "frames"), [("coded-light", "bin"), ("active-stereo", "table")])
def test_presets_are_what_the_real_frames_give(sensor: DepthSensor, frames: str) -> None:
    files = sorted(Path(str(REAL)).glob(f"{frames}_*.depth.png"))
    read = [read_frame(FrameFiles(path)) for path in files]
    found = fit_sensor([(frame.depth_m, frame.camera.intrinsics) for frame in read])
    model = NOISE_MODELS[sensor]
    depth_m, incidence_rad, sigma_m, blocks = found.bins.T
    ratio = sigma_m / model.sigma_m(depth_m, np.cos(incidence_rad))
    assert np.average(np.log(ratio), weights=blocks) == pytest.approx(0.0, abs=0.15)
    assert found.baseline_m == pytest.approx(model.baseline_m, abs=0.005)
    assert found.grain_px == pytest.approx(model.grain_px, abs=0.2)
