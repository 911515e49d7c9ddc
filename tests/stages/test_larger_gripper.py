"""All six stages run for the 150 mm pad of Supplement VII: one line of run.toml."""

import json
from pathlib import Path

from pipeline.execution import RunFolder
from stages.graph import STAGES
from tests.stages.conftest import TINY, run_stage

LARGE = TINY + "[gripper.pad]\nradius_m = 0.075\n"


def test_every_stage_runs_for_a_pad_three_times_as_large(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "runs" / "tiny")
    folder.path.mkdir(parents=True)
    folder.config.write_text(LARGE)
    for stage in STAGES:
        done = run_stage(stage, folder.path.parent, workers=1)
        assert done.returncode == 0, done.stderr[-3000:]
    grasps = json.loads(folder.summary("grasps").read_text())
    assert grasps["grasps"] == 240
    assert sum(grasps["quality_histogram"][3:]) > 20  # it seals on objects of its own size
    assert folder.artifact("evaluate").is_file()
