"""What two runs were made with: named where it is little, counted where it is much."""

from pipeline.reporting.two_runs import part_changes


def test_parts_that_are_equal_differ_in_nothing() -> None:
    assert part_changes("input", {"a": "1"}, {"a": "1"}) == []


def test_what_differs_and_what_one_side_lacks_is_named() -> None:
    mine, other = {"same": "1", "a": "1", "mine": "1"}, {"same": "1", "a": "2", "other": "1"}
    assert part_changes("code", mine, other) == [
        "code a of other content",
        "code mine in A alone",
        "code other in B alone",
    ]


def test_of_many_some_are_named() -> None:
    meshes = {f"meshes/{n}.ply": "1" for n in range(12)}
    assert part_changes("input", meshes, {}) == [
        "input meshes/0.ply, meshes/1.ply, meshes/2.ply and 9 more in A alone"
    ]
