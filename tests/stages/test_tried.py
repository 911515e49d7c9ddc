"""Logged attempts of the tiny run: compared with q-hat, and trained on."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import ArtifactWriter, open_artifact
from pipeline.artifacts.listing import artifacts_in
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.execution.staleness import stage_context
from pipeline.messages.attempts import read_attempts, tried_contacts
from pipeline.network.samples import GraspTensors
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from stages.graph import TRAIN, inputs_of
from stages.train import training_set
from stages.tried import tried


def test_q_hat_is_held_against_what_was_lifted(run: RunFolder, tmp_path: Path) -> None:
    evaluated = run.artifact("evaluate")
    tried([evaluated], run="ci", out=tmp_path)
    figures = json.loads((tmp_path / "attempts.json").read_text())
    attempts = read_attempts([evaluated])
    contacts = [one for attempt in attempts for one in attempt.contacts]
    assert figures["attempts"] == len(attempts) == sum(figures["ended"].values())
    assert figures["judges"] == ["referee"]
    assert next(iter(figures["rankings"])) == "as it was tried"
    assert len(figures["rankings"]) == 3
    for found in figures["rankings"].values():
        assert found["contacts"] == len(contacts) == sum(a.seals for a in attempts)
        assert found["lifted"] == sum(a.outcome == "lifted" for a in attempts)
        assert sum(one["contacts"] for one in found["bins"]) == len(contacts)
    page = (tmp_path / "attempts.md").read_text()
    assert f"{len(attempts)} attempts, judged by referee" in page
    assert "attempts.svg" in page
    assert (tmp_path / "attempts.svg").read_text().count("<svg") == 1
    assert "data:image/svg+xml" in (tmp_path / "attempts.html").read_text()


def test_a_training_takes_what_logged_attempts_lifted(run: RunFolder, tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "tiny")
    shutil.copytree(run.path, folder.path)
    logged = folder.path / "robot"
    logged.mkdir()
    shutil.copy(run.artifact("evaluate"), logged / "attempt_00000.mcap")
    text = folder.config.read_text()
    more = '[train]\nattempts = ["robot"]\nattempt_repeats = 2\n'
    folder.config.write_text(text.replace("[train]\n", more))
    without = stage_context(TRAIN, run, inputs_of, None, 1)
    stage = stage_context(TRAIN, folder, inputs_of, None, 1)
    assert "attempts/0" in stage.inputs
    assert stage.key != without.key
    opened = training_set(stage)
    train_set, joined = opened.fitted, opened.learned
    assert isinstance(joined, GraspTensors)
    contacts = tried_contacts(read_attempts([logged / "attempt_00000.mcap"]))
    seen = contacts.mask.any(axis=(1, 2))
    assert len(joined) == len(train_set) + 2 * seen.sum()
    good = train_set.quality >= 0.5
    high, low = train_set.quality[good].mean(), train_set.quality[~good].mean()
    behind = joined.quality[len(train_set) :]
    assert behind == pytest.approx(np.tile(np.where(contacts.lifted[seen], high, low), 2))
    assert len(training_set(without).learned) == len(train_set) == opened.count


def test_attempts_that_cannot_be_used_are_told(run: RunFolder, tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match="is not there"):
        artifacts_in([tmp_path / "none.mcap"])
    with pytest.raises(ArtifactError, match="holds no MCAP file"):
        artifacts_in([tmp_path])
    evaluated = run.artifact("evaluate")
    attempts = read_attempts([evaluated])
    other = Attempt.FromString(attempts[0].SerializeToString())
    other.pad_radius_m = 0.04
    with pytest.raises(ArtifactError, match="pads of 25, 40 mm"):
        tried_contacts([*attempts, other])
    bare = Attempt(pad_radius_m=0.025)
    with pytest.raises(ArtifactError, match="in none of 1 attempts was a contact sealed"):
        tried_contacts([bare])
    with pytest.raises(ArtifactError, match="an older program logged them"):
        tried_contacts([Attempt()])
    with open_artifact(evaluated) as artifact:
        provenance = artifact.provenance
    with ArtifactWriter(tmp_path / "empty.mcap", provenance):
        pass
    with pytest.raises(ArtifactError, match=r"empty.mcap hold no attempt.*make robot"):
        read_attempts([tmp_path / "empty.mcap"])
