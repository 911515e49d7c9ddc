"""All six stages run for the 150 mm pad of Supplement VII: one line of run.toml."""

import json
from pathlib import Path

from pipeline.execution import RunFolder
from stages.graph import STAGES
from tests.stages.conftest import TINY, run_stage, with_convex_parts

# What a policy does at all is held by other tests; here a robot without errors stands beside one.
FEW_SEALS = {
    "attempts_per_clutter = 2": "attempts_per_clutter = 1",
    'policies = ["closed-loop", "open-loop", "geometric"]': 'policies = ["closed-loop"]',
    "curve = [1.0]": 'curve = [0.0, 1.0]\ncurve_policies = ["closed-loop"]',
}


def test_every_stage_runs_for_a_pad_three_times_as_large(run: RunFolder, tmp_path: Path) -> None:
    text = TINY + "[gripper.pad]\nradius_m = 0.075\n"
    for line, instead in FEW_SEALS.items():
        assert line in text
        text = text.replace(line, instead)
    folder = RunFolder(tmp_path / "runs" / "tiny")
    folder.path.mkdir(parents=True)
    folder.config.write_text(text)
    with_convex_parts(run, folder.path.parent)
    for stage in STAGES:
        done = run_stage(stage, folder.path.parent, workers=1)
        assert done.returncode == 0, done.stderr[-3000:]
    grasps = json.loads(folder.summary("grasps").read_text())
    assert grasps["grasps"] == 240
    assert sum(grasps["quality_histogram"][3:]) > 20  # it seals on objects of its own size
    judged = json.loads(folder.summary("evaluate").read_text())
    by_scale = judged["imperfection"]["closed-loop"]
    assert list(by_scale) == ["0", "1"]
    assert all(one["attempts"] == 1 for one in by_scale.values())
