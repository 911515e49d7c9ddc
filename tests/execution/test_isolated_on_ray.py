"""On a Ray cluster an item is lost in the words of local processes; Ray's own kills have theirs."""

from collections.abc import Iterator

import pytest

from pipeline.errors import SoftgripError
from pipeline.execution import Isolation, Lost, run_in_order
from pipeline.execution.ray_executor import JobByName, Sending, TaskSize
from tests.execution.test_isolated import FATES, PLENTY, fate

cluster_utils = pytest.importorskip("ray.cluster_utils", reason="Ray is not installed")


REFUSED = 150  # an item in a task of several


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
def tasks(monkeypatch: pytest.MonkeyPatch) -> list[list[int]]:
    """The items of each task that is sent."""
    sent: list[list[int]] = []
    message = Sending.message

    def noted(self: Sending, job: JobByName, items: list[int]) -> object:
        sent.append(items)
        return message(self, job, items)

    monkeypatch.setattr(Sending, "message", noted)
    return sent


def tenth_of(number: int) -> float:
    """A short job; some numbers are refused."""
    if number == REFUSED:
        raise ValueError(f"{number} is refused")
    return number / 10


@pytest.mark.usefixtures("cluster")
def test_short_items_share_tasks_and_come_back_in_order(tasks: list[list[int]]) -> None:
    numbers = list(range(REFUSED))
    assert list(run_in_order(tenth_of, numbers, 1, "ray")) == [n / 10 for n in numbers]
    assert [number for some in tasks for number in some] == numbers
    assert len(tasks) < len(numbers) / 4
    assert len(tasks[0]) == 1


@pytest.mark.usefixtures("cluster")
def test_an_item_that_fails_costs_no_result_before_it(
    tasks: list[list[int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    # As if all items took an eighth of a second: on a busy machine the true times would decide
    # whether the item that fails stands first in its task.
    monkeypatch.setattr(TaskSize, "learn", lambda self, *_: setattr(self, "items", 8))
    results = run_in_order(tenth_of, range(2 * REFUSED), 1, "ray")
    assert [next(results) for _ in range(REFUSED)] == [number / 10 for number in range(REFUSED)]
    with pytest.raises(ValueError, match="is refused"):
        next(results)
    (together,) = [some for some in tasks if REFUSED in some and len(some) > 1]
    assert [REFUSED] in tasks  # the others of its task were made again, each alone
    assert together.index(REFUSED) > 0


@pytest.mark.parametrize(
    ("seconds", "items", "next_ones"),
    [(2.0, 1, 1), (0.5, 1, 2), (0.01, 1, 2), (0.1, 4, 8), (1.0, 8, 8), (6.0, 8, 1), (0.0, 64, 64)],
)
def test_a_task_holds_as_many_items_as_take_a_second(
    seconds: float, items: int, next_ones: int
) -> None:
    size = TaskSize()
    assert size.items == 1
    size.learn(seconds, items)
    assert size.items == next_ones


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
