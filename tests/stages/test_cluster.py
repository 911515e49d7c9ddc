"""A Ray cluster of two nodes gives the bytes of local processes, though a node is killed."""

import hashlib
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.execution import RunFolder
from stages.graph import STAGES
from tests.docs.pages import blocks_of
from tests.stages.conftest import TINY, with_convex_parts
from tests.stages.project_copy import copied_project, quiet_environment

cluster_utils = pytest.importorskip("ray.cluster_utils", reason="Ray is not installed")
DOCUMENTED = "make dataset RUN=ci EXECUTOR=ray"
PATIENCE_S = 900


@pytest.fixture
def cluster() -> Iterator[object]:
    """A head that takes no work, and two nodes of one CPU each."""
    made = cluster_utils.Cluster(
        initialize_head=True, head_node_args={"num_cpus": 0, "object_store_memory": 10**8}
    )
    yield made
    made.shutdown()


def digests(folder: RunFolder) -> dict[str, str]:
    """SHA-256 of every artifact that the stages hand over."""
    files = [folder.artifact(stage) for stage in STAGES]
    for stage in STAGES:
        files += sorted(path for path in folder.shards(stage).rglob("*") if path.is_file())
    return {
        path.relative_to(folder.path).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
    }


def make(goal: str, project: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["make", goal, "RUN=ci", "EXECUTOR=ray"],
        cwd=project,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_six_stages_from_cold_write_the_bytes_of_local_processes_though_a_node_dies(
    cluster: object, run: RunFolder, tmp_path: Path
) -> None:
    """The command that the page shows, on a run of which nothing is made."""
    assert DOCUMENTED in [
        line for block in blocks_of("runs/README.md") for line in block.splitlines()
    ]
    nodes = [cluster.add_node(num_cpus=1, object_store_memory=10**8) for _ in range(2)]  # type: ignore[attr-defined]
    copy = copied_project(tmp_path / "softgrip")
    folder = RunFolder(copy / "runs" / "ci")
    folder.path.mkdir()
    folder.config.write_text(TINY)
    with_convex_parts(run, folder.path.parent)
    environment = quiet_environment() | {"RAY_ADDRESS": cluster.address}  # type: ignore[attr-defined]
    dataset = subprocess.Popen(
        DOCUMENTED.split(), cwd=copy, env=environment, stderr=subprocess.PIPE, text=True
    )
    deadline = time.monotonic() + PATIENCE_S
    while not list(folder.shards("grasps").glob("*.mcap")):
        assert dataset.poll() is None, dataset.stderr and dataset.stderr.read()[-3000:]
        assert time.monotonic() < deadline, "no shard was made"
        time.sleep(0.05)
    cluster.remove_node(nodes[0], allow_graceful=False)  # type: ignore[attr-defined]
    _, errors = dataset.communicate(timeout=PATIENCE_S)
    assert dataset.returncode == 0, errors[-3000:]
    assert "renders nothing" not in errors  # both nodes are this machine, with its renderer
    assert "renders itself" not in errors
    judged = make("eval", copy, environment)
    assert judged.returncode == 0, judged.stderr[-3000:]
    assert digests(folder) == digests(run)
    told = make("status", copy, environment)
    assert told.returncode == 0, told.stderr[-3000:]
    assert "cluster: 1 of 1 nodes can do this run's work, on 1 cores" in told.stdout
