"""A Ray cluster of two nodes gives the bytes of local processes, though a node is killed."""

import hashlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.execution import RunFolder
from tests.stages.conftest import ROOT

cluster_utils = pytest.importorskip("ray.cluster_utils", reason="Ray is not installed")
PATIENCE_S = 240


@pytest.fixture
def cluster() -> Iterator[object]:
    """A head that takes no work, and two nodes of one CPU each."""
    made = cluster_utils.Cluster(
        initialize_head=True, head_node_args={"num_cpus": 0, "object_store_memory": 10**8}
    )
    yield made
    made.shutdown()


def digests(folder: RunFolder) -> dict[str, str]:
    files = [folder.artifact("grasps"), *sorted(folder.shards("grasps").glob("*.mcap"))]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_two_nodes_one_killed_midway_write_the_same_bytes(
    cluster: object, run: RunFolder, tmp_path: Path
) -> None:
    nodes = [cluster.add_node(num_cpus=1, object_store_memory=10**8) for _ in range(2)]  # type: ignore[attr-defined]
    folder = RunFolder(tmp_path / "runs" / run.path.name)
    folder.path.mkdir(parents=True)
    for name in ("run.toml", "objects.mcap", "scenes.mcap"):
        shutil.copy(run.path / name, folder.path / name)
    command = [sys.executable, "-m", "stages.grasps", "--run", run.path.name]
    process = subprocess.Popen(
        [*command, "--runs-dir", str(folder.path.parent), "--executor", "ray"],
        cwd=ROOT,
        env=os.environ | {"RAY_ADDRESS": cluster.address},  # type: ignore[attr-defined]
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + PATIENCE_S
    while not list(folder.shards("grasps").glob("*.mcap")):
        assert process.poll() is None, process.stderr and process.stderr.read()[-3000:]
        assert time.monotonic() < deadline, "no shard was made"
        time.sleep(0.05)
    cluster.remove_node(nodes[0], allow_graceful=False)  # type: ignore[attr-defined]
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, errors[-3000:]
    assert digests(folder) == digests(run)
