"""What both commits are given, and what is said where the older one is not to be had."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.benchmarks import asked, commits
from pipeline.geometry.mesh import Mesh
from pipeline.gripper.limits import wrench_limits
from pipeline.gripper.problem import QualityProblem
from pipeline.gripper.quality import target_wrench
from pipeline.world.scene import ClutterScene, PlacedObject

MODULES = ("pipeline.world.scene", "pipeline.world.view", "pipeline.world.cameras")


@pytest.fixture
def scene() -> ClutterScene:
    placed = (PlacedObject("tile", 1, np.eye(4)),)
    return ClutterScene("one", 1, "train", 0, placed, np.full(1, np.inf), (), 0.0, ())


@pytest.fixture
def meshes() -> dict[str, Mesh]:
    return {
        "tile": Mesh(np.eye(3), np.array([[0, 1, 2]])),
        "unused": Mesh(np.eye(3), np.eye(3, 3, dtype=int)[:1]),
    }


def problem(count: int, force: float) -> QualityProblem:
    matrix = np.tile([[0.0], [0.0], [force / count], [0.0]], (1, count))
    return QualityProblem(matrix, force, *wrench_limits(force, 0.5), target_wrench(), 4.6, 0.1, 100)


def test_a_scene_given_is_the_scene_that_is_labelled(
    scene: ClutterScene, meshes: dict[str, Mesh]
) -> None:
    """Of a training scene a test scene is made: its noise is drawn once by every commit."""
    given = commits.plain(scene, meshes, [problem(3, 0.5), problem(5, 1.0)])
    made, surfaces = asked.instances(given, *MODULES)
    assert (made.scene_id, made.split, made.objects[0].object_name) == ("one", "test", "tile")
    assert list(surfaces) == ["tile"]
    np.testing.assert_array_equal(surfaces["tile"].faces, [[0, 1, 2]])


def test_problems_given_are_solved_as_they_were(
    scene: ClutterScene, meshes: dict[str, Mesh], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each by its own triangles, under limits that are shares of its own force."""
    given = commits.plain(scene, meshes, [problem(3, 0.5), problem(5, 1.0)])["problems"]
    np.testing.assert_array_equal(given["counts"], [3, 5])
    np.testing.assert_array_equal(given["matrices"][0, 2], [0.5 / 3] * 3 + [0.0, 0.0])
    np.testing.assert_allclose(
        given["forces"][:, None] * given["setting"][1],
        [problem(3, 0.5).upper, problem(5, 1.0).upper],
    )
    solved: list[np.ndarray] = []
    monkeypatch.setattr(
        "pipeline.gripper.solvers.structured.solve_into",
        lambda matrices, counts, forces, *rest: solved.append(counts),
    )
    asked.solve(given)
    np.testing.assert_array_equal(np.concatenate(solved), [3, 5])


def test_a_folder_without_history_has_no_older_commit(tmp_path: Path) -> None:
    assert not commits.in_history(tmp_path, commits.OLDER)


def test_without_the_older_commit_the_figures_are_left_out(
    scene: ClutterScene, meshes: dict[str, Mesh], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(commits, "in_history", lambda root, commit: False)
    assert commits.against_older(scene, meshes, [problem(3, 0.5)]) == {}
