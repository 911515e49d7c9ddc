"""``torchrun -m -- stages.train``: two processes make the one artifact, from the same samples."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.artifacts import open_artifact
from pipeline.execution import RunFolder
from schemas.softgrip.v1.training_pb2 import Epoch
from tests.stages.conftest import ROOT
from tests.stages.test_sweep import folder_with_shards


def test_two_processes_publish_once_what_one_would(run: RunFolder, tmp_path: Path) -> None:
    folder = folder_with_shards(run, tmp_path)
    done = subprocess.run(
        [
            *(sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2"),
            *("-m", "--", "stages.train", "--run", "tiny", "--runs-dir", str(tmp_path)),
        ],
        cwd=ROOT,
        env={k: v for k, v in os.environ.items() if k not in ("MESH_DIR", "RUN", "WORKERS")},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stderr.count("train: done in") == 1
    curves = []
    for made in (folder, run):
        with open_artifact(made.artifact("train")) as artifact:
            curves.append([message for _, message in artifact.messages(Epoch)])
    together, alone = curves
    assert [epoch.samples for epoch in together] == [epoch.samples for epoch in alone]
    assert together[0].train_mae == pytest.approx(alone[0].train_mae, rel=1e-2)
    summary = json.loads(folder.summary("train").read_text())
    assert summary["processes"] == 2
    assert 0 < summary["test_mae"] < 1
    assert summary["samples"]["train"] == together[0].samples
