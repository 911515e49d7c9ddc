"""make train from a network: what train.start names, and what the summary and the artifact tell."""

import shutil
from pathlib import Path

import pytest

from pipeline.artifacts import open_artifact
from pipeline.artifacts.named_inputs import STARTING_NETWORK
from pipeline.errors import ConfigError
from pipeline.execution import RunFolder
from pipeline.execution.staleness import stage_context
from pipeline.messages.training import fine_tuning_of
from pipeline.network.released_files import CHECKPOINT_FILE, RELEASED_FOLDER
from pipeline.recording.train import tuning_table
from schemas.softgrip.v1.training_pb2 import TrainingResult
from stages import train
from stages.graph import TRAIN, inputs_of
from tests.stages.conftest import TINY


def test_a_run_begins_with_the_network_of_another(run: RunFolder, tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "runs" / "tuned")
    folder.path.mkdir(parents=True)
    for name in ("shards", "shards.mcap"):
        copy = shutil.copytree if (run.path / name).is_dir() else shutil.copy
        copy(run.path / name, folder.path / name)
    shutil.copy(run.path / "train" / CHECKPOINT_FILE, folder.path / "mine.safetensors")
    begun = 'epochs = 1\nstart = "mine.safetensors"\nstart_shares = [0.0, 0.5]'
    begun += '\nteachers = ["released", "mine.safetensors"]'
    folder.config.write_text(TINY.replace("epochs = 2", begun))
    stage = stage_context(TRAIN, folder, inputs_of, None, workers=1)
    summary = train.build(stage)
    by_share = summary["val_mae_by_start_share"]
    assert summary["start_share"] == float(min(by_share, key=by_share.__getitem__))
    assert set(by_share) == {"0", "0.5"}
    told = summary["fine_tuning"]
    assert told["own_before"] > 0
    assert told["released_grasps"] == 600
    with open_artifact(stage.output) as artifact:
        read_back = fine_tuning_of(artifact.one(TrainingResult))
    assert read_back is not None
    assert read_back.headline()["fine_tuning"] == told
    assert f"| {told['released_before']:.4f} | {told['released_after']:.4f} |" in tuning_table(
        read_back
    )


def test_the_released_network_is_a_name_and_a_missing_file_is_told(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "runs" / "one")
    folder.path.mkdir(parents=True)
    folder.config.write_text('[train]\nstart = "released"\n')
    assert inputs_of(TRAIN, folder, None)[STARTING_NETWORK] == RELEASED_FOLDER / CHECKPOINT_FILE
    folder.config.write_text('[train]\nstart = "none.safetensors"\n')
    with pytest.raises(ConfigError, match=r"none\.safetensors is missing, and train\.start names"):
        inputs_of(TRAIN, folder, None)
    folder.config.write_text('[train]\nteachers = ["released", "none.safetensors"]\n')
    with pytest.raises(ConfigError, match=r"none\.safetensors is missing, and train\.teachers"):
        inputs_of(TRAIN, folder, None)
    folder.config.write_text('[train]\nstart = "../solids/train/ga_cnn.safetensors"\n')
    with pytest.raises(ConfigError, match=r"Put a ga_cnn\.safetensors there, or"):
        inputs_of(TRAIN, folder, None)
    (tmp_path / "runs" / "solids").mkdir()
    (tmp_path / "runs" / "solids" / "run.toml").touch()
    with pytest.raises(ConfigError, match="Train that run first: make train RUN=solids, or"):
        inputs_of(TRAIN, folder, None)
