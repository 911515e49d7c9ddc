"""All six stages on a tiny run: artifacts, recordings, and what they hold."""

import hashlib
import json
from pathlib import Path

import numpy as np

from pipeline.artifacts import open_artifact, read_provenance
from pipeline.artifacts.inspection import verify_files
from pipeline.execution import RunFolder
from pipeline.messages.objects import read_objects
from pipeline.messages.samples import read_split
from pipeline.messages.scenes import read_scenes
from schemas.softgrip.v1.evaluation_pb2 import Attempt, Comparison, LevelResult
from schemas.softgrip.v1.training_pb2 import TrainingResult
from stages.graph import STAGES
from tests.stages.conftest import TINY, run_stage


def digests(folder: RunFolder) -> dict[str, str]:
    files = [*folder.path.glob("*.mcap"), *folder.path.glob("*/*/*.mcap")]
    files += [*folder.path.glob("*/*.mcap"), *folder.path.glob("train/*")]
    return {
        str(path.relative_to(folder.path)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
        if path.is_file()
    }


def test_every_stage_leaves_artifact_recording_and_summary(run: RunFolder) -> None:
    for name in STAGES:
        provenance = read_provenance(run.artifact(name))
        summary = json.loads(run.summary(name).read_text())
        assert provenance.stage == name
        assert summary["key"] == provenance.key
        assert summary["wall_time_s"] > 0
        assert run.recording(name).stat().st_size > 1000


def test_a_second_run_of_any_stage_does_nothing(run: RunFolder) -> None:
    before = digests(run)
    for name in STAGES:
        done = run_stage(name, run.path.parent, workers=2)
        assert done.returncode == 0
        assert f"{name}: up to date, nothing to do" in done.stderr
    assert digests(run) == before


def test_every_file_is_verified_from_the_last_stage(run: RunFolder) -> None:
    found = list(verify_files(run.artifact("evaluate"), None))
    assert [f for f in found if f.problem] == []
    assert {f.path.resolve() for f in found} >= {f.resolve() for f in run.path.rglob("*.mcap")}


def test_no_object_is_in_two_splits(run: RunFolder) -> None:
    split_of = {name: split for name, (_, split) in read_objects(run.artifact("objects")).items()}
    assert set(split_of.values()) == {"train", "val", "test"}
    for scene in read_scenes(run.artifact("scenes")):
        assert {split_of[p.object_name] for p in scene.objects} == {scene.split}


def test_samples_are_whole_and_span_good_and_bad(run: RunFolder) -> None:
    samples = [read_split(run.artifact("shards"), split) for split in ("train", "val", "test")]
    assert sum(map(len, samples)) == 240
    quality = np.concatenate([part.quality for part in samples])
    assert quality.min() >= 0
    assert quality.max() <= 1
    assert quality.std() > 0.1
    for part in samples:
        assert part.cloud.shape[1:] == (24, 24, 3)
        assert (part.cloud_mask.mean(axis=(1, 2)) > 0).all()
        assert np.isfinite(part.cloud).all()
        assert (part.cloud[~part.cloud_mask] == 0).all()


def test_half_the_clouds_are_cut_from_all_pictures_and_show_more(run: RunFolder) -> None:
    parts = [read_split(run.artifact("shards"), split) for split in ("train", "val", "test")]
    pictures = np.concatenate([part.pictures for part in parts])
    seen = np.concatenate([part.cloud_mask for part in parts]).mean(axis=(1, 2))
    views = {len(scene.views) for scene in read_scenes(run.artifact("scenes"))}
    assert set(pictures.tolist()) == {1, *views}
    # Binomial(240, 1/2): four standard deviations are 0.13.
    assert abs((pictures == 1).mean() - 0.5) < 0.13
    assert seen[pictures > 1].mean() > seen[pictures == 1].mean() + 0.02


def test_training_and_evaluation_report_what_they_did(run: RunFolder) -> None:
    with open_artifact(run.artifact("train")) as artifact:
        result = artifact.one(TrainingResult)
        assert artifact.attachment("ga_cnn.safetensors")
        assert artifact.attachment("ga_cnn.onnx")
    assert 0 < result.test_mae < 1
    assert 0 < result.test_mae_as_proposed < 1
    assert sorted(result.test_mae_by_pictures) == ["1 picture", "3 pictures"]
    with open_artifact(run.artifact("evaluate")) as artifact:
        attempts = [message for _, message in artifact.messages(Attempt)]
        levels = [message for _, message in artifact.messages(LevelResult, "/levels")]
        overall = [message for _, message in artifact.messages(LevelResult, "/policies")]
        comparisons = [message for _, message in artifact.messages(Comparison)]
    assert [level.policy for level in levels] == ["closed-loop", "open-loop", "geometric"]
    assert [c.baseline for c in comparisons] == ["open-loop", "geometric"]
    for level, whole in zip(levels, overall, strict=True):
        mine = [made for made in attempts if made.policy == level.policy]
        assert level.attempts == whole.attempts == len(mine) <= 2
        assert level.lifted == sum(made.outcome == "lifted" for made in mine)
        assert level.lifted + sum(level.failures.values()) == level.attempts
        assert whole.seals == sum(made.seals for made in mine)
        assert whole.lifted_at_first_seal <= level.lifted == whole.carried["5"]
        assert sorted(whole.carried) == ["1", "3", "5"]
        assert all(len(made.states) == made.time_s.shape[0] for made in mine)
    text = (run.path / "evaluate.md").read_text()
    assert all(level.policy in text for level in levels)
    summary = json.loads(run.summary("evaluate").read_text())
    assert summary["success_by_level"]["1"]["lifted"] == levels[0].lifted
    assert set(summary["comparisons"]["open-loop"]) >= {"p_paired", "p_fisher"}


def test_a_stage_without_its_input_says_which_and_how(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "runs" / "tiny")
    folder.path.mkdir(parents=True)
    folder.config.write_text(TINY)
    done = run_stage("grasps", tmp_path / "runs", workers=1)
    assert done.returncode == 1
    assert "objects.mcap is missing" in done.stderr
    assert "Traceback" not in done.stderr
