"""What the driver of stage grasps spends itself, and how many nodes it feeds with that."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from pipeline.execution import RunFolder

STATED = ("driver_s_per_1000_grasps", "nodes_one_driver_feeds")  # in the stage's summary
WORKERS = 2  # at least: work in the driver's own process would be told as its workers'


def driver_share(run: RunFolder) -> dict[str, object]:
    """Make the grasps of a run's scenes anew beside it, and read what its driver spends.

    Parameters
    ----------
    run
        Its objects and scenes are there.

    Returns
    -------
    The driver's processor time a thousand grasps [s], and nodes of eight cores that it feeds.

    Raises
    ------
    RuntimeError
        The stage failed.
    """
    with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR")) as scratch:
        beside = RunFolder(Path(scratch) / run.path.name)
        beside.path.mkdir()
        for of_run, of_copy in (
            (run.config, beside.config),
            *((run.artifact(name), beside.artifact(name)) for name in ("objects", "scenes")),
        ):
            of_copy.symlink_to(of_run.resolve())
        # An index names no file outside of its run: a link to the folder would lead there.
        shutil.copytree(run.shards("scenes"), beside.shards("scenes"))
        command = [sys.executable, "-m", "stages.grasps", "--run", beside.path.name]
        command += ["--runs-dir", scratch, "--workers", str(WORKERS)]
        if code := subprocess.run(command, check=False).returncode:
            raise RuntimeError(f"stage grasps ended with {code}")
        stated = json.loads(beside.summary("grasps").read_text())
    return {name: stated[name] for name in STATED}
