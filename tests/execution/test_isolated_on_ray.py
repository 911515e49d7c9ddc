"""On a Ray cluster an item is lost in the words of local processes; Ray's own kills have theirs."""

from collections.abc import Iterator

import pytest

from pipeline.errors import SoftgripError
from pipeline.execution import Isolation, Lost, run_in_order
from tests.execution.test_isolated import FATES, PLENTY, fate

cluster_utils = pytest.importorskip("ray.cluster_utils", reason="Ray is not installed")


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """One node of one CPU, found by its address."""
    made = cluster_utils.Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "object_store_memory": 10**8}
    )
    monkeypatch.setenv("RAY_ADDRESS", made.address)
    yield
    made.shutdown()


@pytest.mark.usefixtures("cluster")
def test_what_ends_its_process_is_told_as_by_local_processes() -> None:
    with Isolation(1, PLENTY, "ray") as apart:
        for some in (["abort", "one"], ["take all memory", "two"]):
            assert list(apart.run_in_order(fate, some)) == [FATES[item] for item in some]


@pytest.fixture
def node_without_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ray takes its node for full and kills every task, which is tried again once."""
    monkeypatch.setenv("RAY_memory_usage_threshold", "0.001")
    monkeypatch.setenv("RAY_memory_monitor_refresh_ms", "50")
    monkeypatch.setenv("RAY_task_oom_retries", "1")
    monkeypatch.setenv("RAY_task_oom_retry_delay_base_ms", "10")


@pytest.mark.usefixtures("node_without_memory", "cluster")
def test_a_task_that_ray_kills_for_its_node_s_memory_is_lost() -> None:
    with Isolation(1, PLENTY, "ray") as apart:
        (outcome,) = apart.run_in_order(fate, ["never end"])
    assert outcome == Lost("took the memory of its node")
    with pytest.raises(SoftgripError, match=r"of memory again and again.*goes on where it stopped"):
        list(run_in_order(fate, ["never end"], 1, "ray"))
