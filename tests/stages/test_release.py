"""`make release` on a tiny run: the files, their digests, and figures of the test split alone."""

import json
from pathlib import Path

import numpy as np
import pytest

import stages.release
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.messages.samples import read_split
from pipeline.network.sources import sha256_of
from stages.release import release


def test_a_runs_network_takes_the_place_of_the_released_one(
    run: RunFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stages.release, "FITTED", 20)
    release("tiny", run.path.parent, tmp_path)
    digests = json.loads((tmp_path / "digests.json").read_text())
    assert set(digests) == {
        *("ga_cnn.onnx", "ga_cnn.safetensors", "analytic.json", "figures.json"),
        *("test_grasps.safetensors", "train_grasps.safetensors"),
    }
    for name, digest in digests.items():
        assert sha256_of(tmp_path / name) == digest
    assert (tmp_path / "ga_cnn.onnx").read_bytes() == (
        run.path / "train" / "ga_cnn.onnx"
    ).read_bytes()
    figures = json.loads((tmp_path / "figures.json").read_text())
    trained = json.loads(run.summary("train").read_text())
    assert figures["mae_single"] == pytest.approx(trained["test_mae_single"], abs=1e-4)
    assert figures["learnt_from"] == trained["samples"]["train"]
    assert figures["mae"] == pytest.approx(trained["test_mae"], abs=1e-4)
    grasps = sum(one["grasps"] for one in figures["by_object"].values())
    assert grasps == len(np.asarray(read_split(run.artifact("shards"), "test").quality))


def test_a_run_without_a_network_is_told(tmp_path: Path) -> None:
    (tmp_path / "none").mkdir()
    (tmp_path / "none" / "run.toml").write_text("")
    with pytest.raises(ArtifactError, match=r"ga_cnn\.onnx is missing.*make train RUN=none"):
        release("none", tmp_path, tmp_path / "into")
