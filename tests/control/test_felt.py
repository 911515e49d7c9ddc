"""What a seal tells of contacts near it: as much as they are near and alike, and no more."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.config.policy import PolicyConfig
from pipeline.control.decision import TriedContact
from pipeline.control.felt import led_by_feeling, tried_already

CONFIG = PolicyConfig()


def contact(x_m: float, tilt_rad: float = 0.0) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("y", tilt_rad).as_matrix()
    pose[0, 3] = x_m
    return pose


def seal(x_m: float, promised: float, vacuum: float) -> TriedContact:
    return TriedContact(contact(x_m), promised, [], False, vacuum)


POSES = np.array([contact(0.001), contact(0.02), contact(0.5), contact(0.001, 1.5)])
QUALITY = np.full(4, 0.04)


def test_without_a_seal_q_hat_is_the_worth() -> None:
    np.testing.assert_array_equal(led_by_feeling(POSES, QUALITY, [], CONFIG), QUALITY)


def test_a_seal_as_good_as_promised_changes_nothing() -> None:
    as_promised = seal(0.0, 0.04, 0.2)
    worth = led_by_feeling(POSES, QUALITY, [as_promised], CONFIG)
    np.testing.assert_allclose(worth, QUALITY, rtol=1e-12)


@pytest.mark.parametrize("vacuum", [0.5, 0.03])
def test_what_was_felt_counts_near_by_and_from_the_same_side(vacuum: float) -> None:
    worth = led_by_feeling(POSES, QUALITY, [seal(0.0, 0.04, vacuum)], CONFIG)
    moved = np.abs(np.log(worth / QUALITY))
    assert np.all(np.sign(worth[:2] - QUALITY[:2]) == np.sign(vacuum - 0.2))
    assert moved[0] > 2 * moved[1] > 0.0
    np.testing.assert_allclose(worth[2:], QUALITY[2:], rtol=1e-3)


def test_at_the_place_itself_the_worth_is_nearly_what_was_felt() -> None:
    worth = led_by_feeling(contact(0.0)[None], np.array([0.01]), [seal(0.0, 0.01, 0.5)], CONFIG)
    exact, prior = np.log(0.5**2), np.log(0.01)
    believed = (np.log(worth[0]) - prior) / (exact - prior)
    assert believed == pytest.approx(1 / (1 + CONFIG.felt_error**2), rel=1e-9)


def test_two_seals_at_one_place_are_their_mean_not_their_sum() -> None:
    one = led_by_feeling(POSES, QUALITY, [seal(0.0, 0.04, 0.5)], CONFIG)
    two = led_by_feeling(POSES, QUALITY, [seal(0.0, 0.04, 0.5)] * 2, CONFIG)
    np.testing.assert_allclose(two, one, rtol=0.15)


def test_the_same_seal_is_not_tried_again() -> None:
    poses = np.array([contact(0.003), contact(0.02), contact(0.003, 0.5)])
    again = tried_already(poses, [seal(0.0, 0.5, 0.1)], CONFIG)
    np.testing.assert_array_equal(again, [True, False, False])
    assert not tried_already(poses, [], CONFIG).any()
