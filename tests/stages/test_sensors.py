"""`make sensors` on frames made here, and the network's error on grasps of a run."""

import json
from pathlib import Path

import numpy as np
import pytest

from pipeline.config import load_run_config
from pipeline.errors import PictureError
from pipeline.execution import RunFolder
from pipeline.network.sources import QualitySource
from pipeline.sensing.depth_noise import NOISE_MODELS
from stages.sensors import errors_by_sensor, sensors
from tests.camera.scenes import box, seen, table, written


def test_a_folder_of_frames_becomes_a_model_and_a_page(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    for number, eye in enumerate([(0.0, -0.3, 0.5), (0.1, -0.5, 0.4), (0.0, -0.1, 0.7)]):
        target = box((0.12, 0.10, 0.08), (0.0, 0.0, 0.04))
        written(
            seen([table(), target], eye, 0.004, posed=True, seed=number), frames, f"my_{number}"
        )
    (tmp_path / "ci").mkdir()
    (tmp_path / "ci" / "run.toml").write_text("")
    sensors(frames, name="mine", names="my_*", scenes=0, run="ci", runs_dir=tmp_path)
    folder = tmp_path / "ci" / "sensors" / "mine"
    figures = json.loads((folder / "sensors.json").read_text())
    model = figures["model"]
    assert model["step_m"] == pytest.approx(0.001)
    # The frames' noise is 0.4 % of the depth at every angle, pixel by pixel.
    spread = model["floor_m"] + 0.6 * model["linear"] + 0.04 * model["quadratic_1_m"]
    assert spread == pytest.approx(0.0024, rel=0.25)
    assert model["grain_px"] < 0.5
    assert "From 3 frames" in (folder / "sensors.md").read_text()
    assert "data:image/svg" in (folder / "sensors.html").read_text()
    with pytest.raises(PictureError, match=r"has no frame yours_\*"):
        sensors(frames, names="yours_*", run="ci", runs_dir=tmp_path)


def test_every_sensor_is_tried_on_equal_grasps(run: RunFolder) -> None:
    config = load_run_config(run.config)
    always_half = QualitySource("half", lambda cloud, _: np.full(len(cloud), 0.5), "")
    found = errors_by_sensor(run, config, always_half, scenes=1, grasps=12)
    assert set(found) == {"ideal", *NOISE_MODELS}
    assert len({(one["grasps"], one["mae"]) for one in found.values()}) == 1
    assert found["ideal"]["unseen_share"] == min(one["unseen_share"] for one in found.values())
