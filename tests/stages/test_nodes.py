"""How the nodes of a cluster are told."""

from pipeline.execution.ray_cluster import Node
from stages.cluster import as_lines


def test_a_node_is_told_with_what_it_has_or_lacks() -> None:
    able = Node("1", "a 10.0.0.1", 8, 16.0, "Embree rays", ())
    other = Node("2", "b 10.0.0.2", 4, 8.0, "", ("does not see the project under /data",))
    assert as_lines([able, other]) == [
        "cluster: 1 of 2 nodes can do this run's work, on 8 cores",
        "  a 10.0.0.1: 8 cores, 16 GiB, renders with Embree rays",
        "  b 10.0.0.2: does not see the project under /data",
    ]
