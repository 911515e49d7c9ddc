"""The best pose of an object: found where it is known to be, looked for anew where it matters."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from pipeline.config import RunConfig
from pipeline.config.evaluation import CeilingConfig, EvaluateConfig
from pipeline.config.policy import PolicyConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.gripper.pad import build_pad
from pipeline.labelling.sampling import Candidates
from pipeline.simulation.ceiling import Best, Ceilings, likeliest_apart, upward_surface
from pipeline.simulation.judges import LabelJudge
from pipeline.simulation.payload import weight_borne_n
from pipeline.world.posed_bodies import PosedBodies
from tests.bodies import catalogue_object, mesh_of, pose_at

CONFIG = RunConfig(evaluate=EvaluateConfig(ceiling=CeilingConfig(poses=60, judged=6)))
FIRST = RunConfig(
    evaluate=EvaluateConfig(ceiling=CeilingConfig(poses=60, judged=6, first_that_lifts=True))
)
PAD = build_pad(CONFIG.gripper.pad)
JUDGE = LabelJudge(CONFIG, PAD)  # quick; what is looked for is the same with either
BAR = trimesh.creation.box(extents=(0.16, 0.06, 0.04))
LIES = pose_at(0, 0, 0.02)


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> CatalogueObject:
    return catalogue_object("bar", BAR, tmp_path_factory.mktemp("parts"))


@pytest.fixture(scope="module")
def heavy(tmp_path_factory: pytest.TempPathFactory) -> CatalogueObject:
    return catalogue_object("bar", BAR, tmp_path_factory.mktemp("parts"), 20_000.0)


def ceilings(
    *items: CatalogueObject, reachable: bool = True, config: RunConfig = CONFIG
) -> Ceilings:
    numbered = dict(enumerate(items, start=1))
    return Ceilings(numbered, PAD, JUDGE, lambda _: reachable, config, seed=7)


def found(looked: Ceilings, *poses: np.ndarray) -> dict[int, Best]:
    numbered = dict(enumerate(poses, start=1))
    meshes = {i: mesh_of(BAR) for i in numbered}
    return looked.update(numbered, PosedBodies(meshes, 1.0).at(numbered))


def middle_n(item: CatalogueObject) -> float:
    """What a full seal over the bar's middle bears."""
    surfaces = PosedBodies({1: item.mesh}, 1.0).at({1: LIES})
    sealed = JUDGE.find_seal(pose_at(0, 0, 0.04), surfaces)
    assert sealed is not None
    return weight_borne_n(sealed[1], pose_at(0, 0, 0.04), LIES[:3, 3], CONFIG.evaluate)


def test_the_best_pose_of_a_bar_is_over_its_middle(bar: CatalogueObject) -> None:
    best = found(ceilings(bar), LIES)[1]
    assert best.lifts
    assert best.reached == 60
    assert abs(best.world_from_gripper[0, 3]) < 0.02
    # By the label a pad that is turned by 45 degrees bears up to √2 times the side force.
    assert 0.8 * middle_n(bar) < best.borne_n < 1.45 * middle_n(bar)


def test_what_is_too_heavy_for_a_full_seal_cannot_be_lifted(heavy: CatalogueObject) -> None:
    best = found(ceilings(heavy), LIES)[1]
    assert not best.lifts
    assert best.weight_n == pytest.approx(9.81 * heavy.mass_kg)
    # Poses near the best were judged too, as none lifted it: this comes closer to the middle's.
    assert 0.9 * middle_n(heavy) < best.borne_n < 1.45 * middle_n(heavy)


def test_the_search_may_end_at_the_first_pose_that_lifts(
    bar: CatalogueObject, heavy: CatalogueObject
) -> None:
    first, best = (found(ceilings(bar, config=c), LIES)[1] for c in (FIRST, CONFIG))
    assert first.lifts
    assert first.borne_n <= best.borne_n
    # What no pose lifts is looked for to the end.
    first, best = (found(ceilings(heavy, config=c), LIES)[1] for c in (FIRST, CONFIG))
    assert first.borne_n == best.borne_n


def test_a_pose_that_lifted_goes_with_the_object(bar: CatalogueObject) -> None:
    looked, beside = ceilings(bar, bar, config=FIRST), pose_at(0, 0.08, 0.02)
    first = found(looked, LIES, beside)[1]
    moved = pose_at(0.03, -0.01, 0.02)
    moved[:3, :3] = Rotation.from_euler("z", 20, degrees=True).as_matrix()
    after = found(looked, moved, beside)[1]
    assert after.lifts
    np.testing.assert_allclose(
        after.world_from_gripper, moved @ np.linalg.inv(LIES) @ first.world_from_gripper, atol=1e-4
    )
    # Under a lid that pose is gone, and no other is found.
    lid = moved.copy()
    lid[2, 3] = 0.0601
    assert found(looked, moved, lid)[1].borne_n < 0.2 * first.borne_n


def test_out_of_reach_nothing_is_borne(bar: CatalogueObject) -> None:
    best = found(ceilings(bar, reachable=False), LIES)[1]
    assert (best.borne_n, best.reached, best.lifts) == (0.0, 0, False)


def test_no_pose_is_steeper_than_the_policy_may_try(bar: CatalogueObject) -> None:
    most = np.radians(30)
    policy = PolicyConfig(tilt_max_rad=most, steepest_rad=most)
    evaluate = CONFIG.evaluate.model_copy(update={"policy": policy})
    config = CONFIG.model_copy(update={"evaluate": evaluate})
    leans = pose_at(0, 0, 0.05)
    leans[:3, :3] = Rotation.from_euler("x", 45, degrees=True).as_matrix()
    best = found(ceilings(bar, config=config), leans)[1]
    assert best.reached > 0
    assert best.world_from_gripper[2, 2] >= np.cos(most)


def test_under_a_lid_nothing_is_borne(bar: CatalogueObject) -> None:
    lid = pose_at(0, 0, 0.0601)
    both = found(ceilings(bar, bar), LIES, lid)
    assert both[2].lifts
    assert both[1].borne_n < 0.2 * both[2].borne_n


def test_the_same_poses_are_tried_whatever_the_policy(bar: CatalogueObject) -> None:
    one, two = found(ceilings(bar), LIES)[1], found(ceilings(bar), LIES)[1]
    assert one.borne_n == two.borne_n
    np.testing.assert_array_equal(one.world_from_gripper, two.world_from_gripper)


def test_it_is_looked_for_anew_only_where_something_moved(bar: CatalogueObject) -> None:
    looked, far = ceilings(bar, bar), pose_at(0.4, 0, 0.02)
    first = found(looked, LIES, far)
    assert found(looked, LIES, far)[1] is first[1]
    trembling = LIES.copy()
    trembling[0, 3] += 1e-4
    assert found(looked, trembling, far)[1] is first[1]
    after = found(looked, LIES, pose_at(0.41, 0, 0.02))
    assert after[1] is first[1]  # too far away to matter
    assert after[2] is not first[2]
    beside = found(looked, LIES, pose_at(0, 0.061, 0.02))
    assert beside[1] is not first[1]
    # The neighbour is gone, and the bar could be lifted already: it bears at least that much.
    assert found(looked, LIES)[1] is beside[1]


def test_poses_that_are_judged_lie_apart_and_the_likeliest_come_first() -> None:
    frames = np.array([pose_at(x, 0, 0) for x in (0.0, 0.001, 0.02, 0.04)])
    some = Candidates(frames, np.ones(4, np.int64), np.zeros(4), np.zeros(4, np.int64))
    expected = np.array([3.0, 5.0, 0.0, 1.0])
    np.testing.assert_array_equal(likeliest_apart(some, expected, 3, 0.005), [1, 3])
    np.testing.assert_array_equal(likeliest_apart(some, expected, 1, 0.005), [1])


def test_the_surface_that_faces_up_is_the_top_of_a_box() -> None:
    seen = upward_surface(mesh_of(BAR), LIES, 3)
    np.testing.assert_allclose(seen.points_m[:, 2], 0.04)
    assert (seen.normals[:, 2] == 1.0).all()
    assert (seen.body_id == 3).all()
    # Points are spread over the face as its area is.
    assert abs(seen.points_m[:, 0].mean()) < 0.002
    assert seen.points_m[:, 0].std() == pytest.approx(0.16 / np.sqrt(12), rel=0.03)
