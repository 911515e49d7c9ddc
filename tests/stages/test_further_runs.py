"""make train with samples of other runs: what train.further_runs names, counts and refuses."""

import shutil
from pathlib import Path

import pytest

from pipeline.artifacts import read_provenance
from pipeline.artifacts.inspection import verify_files
from pipeline.errors import ConfigError
from pipeline.execution import RunFolder
from pipeline.execution.staleness import stage_context
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
        for file in ("objects.mcap", "shards.mcap"):
            shutil.copy(run.path / file, own / file)
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


def test_a_window_goes_with_no_further_run(folder: RunFolder) -> None:
    folder.config.write_text(FURTHER.replace("[train]", "[train]\nshuffle_window = 64"))
    with pytest.raises(ConfigError, match=r"leave train\.attempts and train\.further_runs out"):
        train.training_set(stage_context(TRAIN, folder, inputs_of, None, workers=1))


def test_a_run_that_knows_what_is_held_out_here_is_refused(folder: RunFolder) -> None:
    other = RunFolder(folder.path.parent / "other").artifact("objects")
    known = read_objects(other)
    learnt = dict.fromkeys(known, "train")
    items = [item for item, _ in known.values()]
    write_objects(other, read_provenance(other), items, learnt, [])
    with pytest.raises(ConfigError, match=r"Run other, which train\.further_runs names, learns"):
        train.training_set(stage_context(TRAIN, folder, inputs_of, None, workers=1))


def test_a_dataset_that_is_missing_is_told(folder: RunFolder) -> None:
    (folder.path.parent / "other" / "shards.mcap").unlink()
    with pytest.raises(ConfigError, match=r"shards\.mcap is missing.*further_runs.*") as caught:
        inputs_of(TRAIN, folder, None)
    assert caught.value.remedy == "Make it first: make dataset RUN=other"
