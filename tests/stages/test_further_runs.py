"""make train with samples of other runs: what train.further_runs names, counts and refuses."""

import shutil
from pathlib import Path

import pytest

from pipeline.artifacts import read_provenance
from pipeline.artifacts.inspection import verify_files
from pipeline.errors import ArtifactError, ConfigError
from pipeline.execution import RunFolder, further_runs
from pipeline.execution.staleness import stage_context
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.messages.objects import read_objects, write_objects
from stages import train
from stages.graph import TRAIN, inputs_of
from tests.stages.conftest import TINY

FURTHER = TINY.replace("epochs = 2", 'epochs = 1\nfurther_runs = ["../other"]')


@pytest.fixture
def folder(run: RunFolder, tmp_path: Path) -> RunFolder:
    """A run with a dataset that learns from run `other` too, which has the same dataset."""
    for name in ("joined", "other"):
        own = tmp_path / "runs" / name
        own.mkdir(parents=True)
        shutil.copytree(run.path / "shards", own / "shards")
        for stage in ("objects", "grasps", "shards"):
            shutil.copy(run.artifact(stage), RunFolder(own).artifact(stage))
    joined = RunFolder(tmp_path / "runs" / "joined")
    joined.config.write_text(FURTHER)
    return joined


def test_a_run_learns_from_the_samples_of_another(run: RunFolder, folder: RunFolder) -> None:
    stage = stage_context(TRAIN, folder, inputs_of, None, workers=1)
    alone = train.training_set(stage_context(TRAIN, run, inputs_of, None, workers=1))
    told = train.build(stage)
    assert told["samples"]["train"] == 2 * alone.count
    (folder.path.parent / "other" / "run.toml").write_text(TINY)
    files = {f.path.resolve() for f in verify_files(stage.output, None)}
    assert folder.path.parent / "other" / "shards.mcap" in files
    cached = folder.state(train.SAMPLES)
    assert [path.name for path in cached.glob("further-*")] == ["further-1"]
    folder.config.write_text(TINY)
    train.training_set(stage_context(TRAIN, folder, inputs_of, None, workers=1))
    assert not list(cached.glob("further-*"))


def test_a_run_that_learns_from_what_is_held_out_here_is_refused(
    folder: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = folder.path.parent / "other" / "objects.mcap"

    def known(path: Path) -> dict[str, tuple[CatalogueObject, str]]:
        found = read_objects(path)
        return {n: (item, "train") for n, (item, _) in found.items()} if path == other else found

    monkeypatch.setattr(further_runs, "read_objects", lambda path: known(path.resolve()))
    with pytest.raises(ConfigError, match=r"Run other, which train\.further_runs names, learns"):
        train.training_set(stage_context(TRAIN, folder, inputs_of, None, workers=1))


def test_samples_of_other_objects_than_lie_beside_them_are_refused(folder: RunFolder) -> None:
    other = RunFolder(folder.path.parent / "other").artifact("objects")
    items = [item for item, _ in read_objects(other).values()]
    write_objects(
        other, read_provenance(other), items, dict.fromkeys(read_objects(other), "test"), []
    )
    with pytest.raises(ArtifactError, match=r"grasps\.mcap is not made from the objects\.mcap"):
        train.training_set(stage_context(TRAIN, folder, inputs_of, None, workers=1))


def test_another_gripper_s_labels_are_refused(folder: RunFolder) -> None:
    (folder.path.parent / "other" / "run.toml").write_text("[gripper.pad]\nradius_m = 0.03\n")
    with pytest.raises(ConfigError, match=r"Run other, .* has another \[gripper\]"):
        train.training_set(stage_context(TRAIN, folder, inputs_of, None, workers=1))


@pytest.mark.parametrize("named", ['"../other", "../other/"', '"."', '"../joined"'])
def test_a_run_is_named_once_and_not_by_itself(folder: RunFolder, named: str) -> None:
    folder.config.write_text(FURTHER.replace('"../other"', named))
    with pytest.raises(ConfigError, match="which is this run or was named before"):
        inputs_of(TRAIN, folder, None)


def test_a_dataset_that_is_missing_is_told(folder: RunFolder) -> None:
    (folder.path.parent / "other" / "shards.mcap").unlink()
    with pytest.raises(ConfigError, match=r"shards\.mcap is missing.*further_runs.*") as caught:
        inputs_of(TRAIN, folder, None)
    assert caught.value.remedy.endswith("with the same MESH_DIR: make dataset RUN=other")
