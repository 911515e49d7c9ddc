"""What renders runs once on every node that renders like the driver, and survives a lost node."""

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.errors import SceneError, SoftgripError
from pipeline.execution import ray_cluster
from pipeline.execution.ray_cluster import (
    Found,
    Node,
    cluster_nodes,
    connected,
    what_is_here,
    what_is_lacking,
)
from pipeline.execution.ray_executor import run_on_ray
from pipeline.execution.rendering_nodes import run_on_rendering_nodes

cluster_utils = pytest.importorskip("ray.cluster_utils", reason="Ray is not installed")
HERE = Found({"pipeline/x.py": "1"}, {"python": "3.11.7", "numpy": "2"}, "Embree rays")
OBJECT_STORE_BYTES = 10**8
MODULES = ["pipeline.execution.code"]


def test_a_node_like_the_driver_lacks_nothing() -> None:
    there = Found(HERE.code, HERE.packages | {"black": "1"}, HERE.renderer)
    assert what_is_lacking(HERE, there) == ()


def test_what_a_node_lacks_is_named() -> None:
    there = Found({"pipeline/y.py": "1"}, {"python": "3.12.1"}, "SAPIEN, llvmpipe")
    code, packages, renderer = what_is_lacking(HERE, there)
    assert "pipeline/x.py, pipeline/y.py" in code
    assert "python 3.12.1 (here 3.11.7), numpy not installed (here 2)" in packages
    assert "SAPIEN, llvmpipe (here Embree rays)" in renderer


def test_of_many_differences_a_few_are_shown() -> None:
    there = Found({f"pipeline/{n}.py": "1" for n in range(9)} | HERE.code, HERE.packages, "")
    assert "and 6 more" in what_is_lacking(HERE, there)[0]


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    """A head that takes no work, and two nodes of one CPU each; one connection for all tests."""
    made = cluster_utils.Cluster(
        initialize_head=True,
        head_node_args={"num_cpus": 0, "object_store_memory": OBJECT_STORE_BYTES},
    )
    for _ in range(2):
        made.add_node(num_cpus=1, object_store_memory=OBJECT_STORE_BYTES)
    before = os.environ.get("RAY_ADDRESS")
    os.environ["RAY_ADDRESS"] = made.address
    with connected():
        yield
    os.environ.pop("RAY_ADDRESS")
    if before is not None:
        os.environ["RAY_ADDRESS"] = before
    made.shutdown()


def squared_by(item: int) -> tuple[int, int]:
    """The square, and the process that took it."""
    return item**2, os.getpid()


def mortal(item: tuple[Path, int]) -> int:
    """The first process that meets item 3 is gone."""
    mark, number = item
    if number == 3 and not mark.exists():
        mark.touch()
        os._exit(1)
    return number


def refused(item: int) -> int:
    raise SceneError(f"clutter {item} cannot be built", "Add meshes")


@pytest.mark.usefixtures("cluster")
def test_every_node_of_this_machine_is_like_the_driver() -> None:
    nodes = cluster_nodes(what_is_here(MODULES, "embree"), MODULES, "embree")
    assert [node.lacks for node in nodes] == [(), ()]
    assert [node.cpus for node in nodes] == [1, 1]
    assert {node.renderer for node in nodes} == {"Embree rays"}


@pytest.mark.usefixtures("cluster")
def test_one_process_a_node_works_and_results_keep_their_order() -> None:
    results = list(run_on_rendering_nodes(squared_by, range(8), "ray", "embree"))
    assert [square for square, _ in results] == [n**2 for n in range(8)]
    processes = {process for _, process in results}
    assert len(processes) == 2
    assert os.getpid() not in processes


@pytest.mark.usefixtures("cluster")
def test_items_of_a_lost_process_go_to_another(tmp_path: Path) -> None:
    items = [(tmp_path / "mark", n) for n in range(6)]
    assert list(run_on_rendering_nodes(mortal, items, "ray", "embree")) == list(range(6))
    assert (tmp_path / "mark").exists()


@pytest.mark.usefixtures("cluster")
def test_what_an_item_raises_arrives_as_it_was_raised() -> None:
    with pytest.raises(SceneError, match="clutter 1 cannot be built"):
        list(run_on_rendering_nodes(refused, [1], "ray", "embree"))


def never_end(item: int) -> int:
    time.sleep(600)
    return item


@pytest.mark.usefixtures("cluster")
def test_a_node_that_hangs_is_a_sentence() -> None:
    with pytest.raises(SoftgripError, match=r"longer than 2 s: its worker hangs"):
        list(run_on_ray(never_end, [1], limit_s=2.0))


@pytest.mark.usefixtures("cluster")
def test_where_no_node_renders_alike_the_driver_renders(monkeypatch: pytest.MonkeyPatch) -> None:
    other = Node("0", "far", 8, 16.0, "SAPIEN", ("renders with SAPIEN (here Embree rays)",))
    monkeypatch.setattr(ray_cluster, "cluster_nodes", lambda *_: [other])
    results = run_on_rendering_nodes(squared_by, [3], "ray", "embree")
    assert list(results) == [(9, os.getpid())]


def test_locally_this_process_renders() -> None:
    results = run_on_rendering_nodes(squared_by, [2, 3], "local", "embree")
    assert list(results) == [(4, os.getpid()), (9, os.getpid())]
