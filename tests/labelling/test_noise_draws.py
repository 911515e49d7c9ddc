"""Each label of a training scene serves several clouds, each with noise of its own."""

from functools import lru_cache

import numpy as np

from pipeline.config import RunConfig
from pipeline.labelling.grasps import LabelledGrasps
from pipeline.labelling.scene import label_scene
from tests.labelling.ball import scene_of_a_ball

DRAWS = 3


@lru_cache
def labelled(split: str, draws: int, shared_by: int = 0) -> list[LabelledGrasps]:
    """Grasps of a ball that one camera sees, batch by batch."""
    drawn = {"noise_draws": draws, "noise_shared_by": shared_by}
    config = RunConfig.model_validate(
        {"grasps": {"merged_share": 0.0, "oversampling": 1.0, **drawn}}
    )
    scene, surfaces = scene_of_a_ball(split)
    batches = label_scene(scene, surfaces, config, 30, np.random.default_rng(0))
    return [grasps for _, grasps in batches]


def test_a_training_grasp_has_as_many_clouds_as_are_asked_for_and_one_label() -> None:
    batches = labelled("train", DRAWS)
    assert len(batches) == DRAWS
    for further in batches[1:]:
        np.testing.assert_array_equal(further.quality, batches[0].quality)
        np.testing.assert_array_equal(further.world_from_gripper, batches[0].world_from_gripper)
    for one, other in ((0, 1), (0, 2), (1, 2)):
        both = batches[one].cloud_mask & batches[other].cloud_mask
        assert both.any()
        apart = batches[one].cloud[both] - batches[other].cloud[both]
        # A lidar's noise at half a metre: 1.7 mm, of 25 that the unit has, in each of the two.
        assert 0.02 < np.abs(apart).std() < 0.3


def test_the_first_clouds_are_those_without_further_ones() -> None:
    np.testing.assert_array_equal(labelled("train", DRAWS)[0].cloud, labelled("train", 1)[0].cloud)


def test_a_test_grasp_has_one_cloud() -> None:
    assert len(labelled("test", DRAWS)) == 1


def test_each_part_of_a_views_grasps_has_noise_of_its_own() -> None:
    whole, parts = labelled("train", 1)[0], labelled("train", 1, shared_by=8)
    assert [len(part.quality) for part in parts] == [8, 8, 7, 7]
    for index, part in enumerate(parts):
        rows = slice(index, None, len(parts))
        np.testing.assert_array_equal(part.world_from_gripper, whole.world_from_gripper[rows])
        np.testing.assert_array_equal(part.quality, whole.quality[rows])
        both = part.cloud_mask & whole.cloud_mask[rows]
        # The same contacts under noise of another picture.
        assert 0.02 < np.abs(part.cloud[both] - whole.cloud[rows][both]).std() < 0.3
    assert len(labelled("train", 2, shared_by=8)) == 2 * len(parts)


def test_test_grasps_share_the_noise_of_their_picture() -> None:
    whole, same = labelled("test", 1), labelled("test", 1, shared_by=8)
    np.testing.assert_array_equal(whole[0].cloud, same[0].cloud)
