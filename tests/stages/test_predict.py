"""`make predict` from files to files: what it writes, says and refuses."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.config.learning import NetworkConfig
from pipeline.geometry.transforms import pose_from
from pipeline.network.export import export_onnx_bytes
from pipeline.network.ga_cnn import build_network
from schemas.softgrip.v1.predictions_pb2 import RankedGrasps
from tests.camera.scenes import box, seen, table, written
from tests.network.test_inference import lively

ROOT = Path(__file__).resolve().parents[2]


def predict(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("RUN", "NETWORK")}
    return subprocess.run(
        [sys.executable, "-m", "stages.predict", *map(str, arguments)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def frame(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A 16-bit PNG in millimetres with its camera beside it."""
    folder = tmp_path_factory.mktemp("frames")
    target = box((0.12, 0.10, 0.08), (0.03, 0.02, 0.04))
    picture = seen([table(), target], (0.05, -0.35, 0.6), 0.001, posed=True)
    return written(picture, folder, "desk")


@pytest.fixture(scope="module")
def network(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("network") / "small.onnx"
    config = NetworkConfig(layers=18, channels=(8, 8, 16, 16))
    path.write_bytes(export_onnx_bytes(lively(build_network(config, seed=0)), cells=24))
    return path


@pytest.fixture(scope="module")
def results(frame: Path, network: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("results")
    done = predict(frame, "--network", network, "--out", out, "--top", "5")
    assert done.returncode == 0, done.stderr
    return out


def test_every_file_is_there(results: Path) -> None:
    names = {path.name for path in results.iterdir()}
    assert names == {f"grasps.{ending}" for ending in ("json", "csv", "mcap", "rrd", "png")}


def test_files_agree_with_each_other_and_the_scene(results: Path) -> None:
    record = json.loads((results / "grasps.json").read_text())
    rows = list(csv.DictReader((results / "grasps.csv").open()))
    with open_artifact(results / "grasps.mcap") as artifact:
        message = artifact.one(RankedGrasps)
    poses, quality = from_tensor(message.world_from_contact), from_tensor(message.quality)
    assert len(record["grasps"]) == len(rows) == len(poses)
    assert 1 <= len(poses) <= 5
    for index, (grasp, row) in enumerate(zip(record["grasps"], rows, strict=True)):
        world = grasp["world"]
        pose = pose_from(np.array(world["position_m"]), np.array(world["quaternion"]))
        assert pose == pytest.approx(poses[index], abs=1e-5)
        assert world["approach"] == pytest.approx(-poses[index][:3, 2], abs=1e-5)
        assert grasp["quality"] == pytest.approx(quality[index], abs=1e-4)
        assert float(row["world_position_z_m"]) == world["position_m"][2]
        assert int(row["pixel_column"]) == grasp["pixel"][0]
        assert world["position_m"][2] == pytest.approx(0.08, abs=0.085)  # on the box
    assert [g["quality"] for g in record["grasps"]] == sorted(
        (g["quality"] for g in record["grasps"]), reverse=True
    )


def test_the_picture_shows_the_frame_with_a_scale(results: Path) -> None:
    picture = Image.open(results / "grasps.png")
    assert picture.width > 960
    assert len(set(picture.convert("RGB").getdata())) > 200


def test_the_same_input_gives_the_same_bytes(
    frame: Path, network: Path, results: Path, tmp_path: Path
) -> None:
    done = predict(frame, "--network", network, "--out", tmp_path, "--top", "5")
    assert done.returncode == 0, done.stderr
    for name in ("grasps.json", "grasps.csv", "grasps.mcap", "grasps.png"):
        assert (tmp_path / name).read_bytes() == (results / name).read_bytes()


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        (("--depth-scale-m", "1.0"), "the unit is wrong"),
        (("--camera", "missing.json"), "missing.json cannot be read"),
        (("--workspace", "missing.json"), "missing.json cannot be read"),
        (("--run", "nosuchrun"), "nosuchrun"),
        (("--network", "missing.onnx"), "missing.onnx cannot be read"),
    ],
)
def test_bad_input_ends_in_one_sentence(
    frame: Path, network: Path, tmp_path: Path, changed: tuple[str, str], says: str
) -> None:
    given = ("--network", network, "--out", tmp_path)
    done = predict(frame, *given, *changed)
    assert done.returncode == 1
    assert says in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_workspace_leaves_out_what_lies_outside(
    frame: Path, network: Path, tmp_path: Path
) -> None:
    workspace = tmp_path / "workspace.json"
    workspace.write_text(json.dumps({"box_m": [[0.03, -1, 0], [1, 1, 1]]}))
    done = predict(frame, "--network", network, "--out", tmp_path, "--workspace", workspace)
    assert done.returncode == 0, done.stderr
    record = json.loads((tmp_path / "grasps.json").read_text())
    assert record["grasps"]
    assert all(grasp["world"]["position_m"][0] > 0.025 for grasp in record["grasps"])
    workspace.write_text(json.dumps({"box_m": [[5, 5, 5], [6, 6, 6]]}))
    done = predict(frame, "--network", network, "--out", tmp_path, "--workspace", workspace)
    assert "nothing that desk measured lies in this workspace" in done.stderr
