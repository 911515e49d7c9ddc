"""What an item costs the driver is measured on a cluster."""

from collections.abc import Iterator

import pytest

from pipeline.benchmarks.ray_tasks import table

cluster_utils = pytest.importorskip("ray.cluster_utils", reason="Ray is not installed")


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    made = cluster_utils.Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "object_store_memory": 10**8}
    )
    monkeypatch.setenv("RAY_ADDRESS", made.address)
    yield
    made.shutdown()


@pytest.mark.usefixtures("cluster")
def test_both_ways_are_measured() -> None:
    _, _, *rows = table(count=4).splitlines()
    assert [row.split("|")[1].strip() for row in rows] == ["0 ms", "20 ms"]
    times_ms = [float(cell.split()[0]) for row in rows for cell in row.split("|")[2:4]]
    assert all(time_ms >= 0 for time_ms in times_ms)
    assert max(times_ms) > 0
