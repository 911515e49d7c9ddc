"""Errors of a robot: nothing at scale 0, twice as much at 2, constant where they are calibrated."""

import numpy as np
import pytest

from pipeline.config.imperfection import ImperfectionConfig
from pipeline.simulation.imperfection import Calibration, WrenchSensor, draw_calibration

ONE = ImperfectionConfig(scale=1.0)
SEEDS = range(400)


def drawn(scale: float, seed: int = 0) -> Calibration:
    config = ImperfectionConfig(scale=scale)
    return draw_calibration(config, 2, np.random.default_rng(seed))


def turn_rad(pose: np.ndarray) -> float:
    return float(np.arccos(np.clip((np.trace(pose[:3, :3]) - 1) / 2, -1, 1)))


def test_at_scale_0_a_calibration_is_perfect() -> None:
    perfect = drawn(0.0)
    assert not perfect.wrench_bias.any()
    for pose in (perfect.hand_eye, *perfect.beside):
        np.testing.assert_array_equal(pose, np.eye(4))


def test_at_scale_2_the_same_errors_are_twice_as_large() -> None:
    once, twice = drawn(1.0), drawn(2.0)
    np.testing.assert_allclose(twice.wrench_bias, 2 * once.wrench_bias)
    for a, b in ((once.hand_eye, twice.hand_eye), *zip(once.beside, twice.beside, strict=True)):
        np.testing.assert_allclose(b[:3, 3], 2 * a[:3, 3])
        assert turn_rad(b) == pytest.approx(2 * turn_rad(a), rel=1e-6)


def test_the_same_seed_gives_the_same_errors() -> None:
    np.testing.assert_array_equal(drawn(1.0, 3).hand_eye, drawn(1.0, 3).hand_eye)
    assert (drawn(1.0, 3).wrench_bias != drawn(1.0, 4).wrench_bias).all()


def test_errors_are_as_large_as_configured() -> None:
    many = [drawn(1.0, seed) for seed in SEEDS]
    bias = np.array([one.wrench_bias for one in many])
    np.testing.assert_allclose(
        bias.std(axis=0), np.repeat([ONE.force_bias_n, ONE.moment_bias_nm], 3), rtol=0.15
    )
    place_m = np.array([one.hand_eye[:3, 3] for one in many])
    np.testing.assert_allclose(place_m.std(axis=0), ONE.hand_eye_m, rtol=0.15)
    # The length of a normal vector of three: its mean square is three variances.
    turns = [turn_rad(one.beside[1]) for one in many]
    assert np.mean(np.square(turns)) == pytest.approx(3 * ONE.camera_rad**2, rel=0.2)


def test_a_bias_shifts_every_reading_by_itself_until_it_is_tared() -> None:
    silent = ONE.model_copy(update={"force_noise_n": 0.0, "moment_noise_nm": 0.0})
    bias = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])
    sensor = WrenchSensor(silent, bias, np.random.default_rng(0))
    np.testing.assert_array_equal([sensor.error(), sensor.error()], [bias, bias])
    sensor.tare()
    left = sensor.error()
    np.testing.assert_array_equal(sensor.error(), left)
    assert 0 < np.abs(left[:3]).max() < 5 * ONE.force_tare_n
    sensor.tare()
    assert (sensor.error() != left).all()


def test_noise_is_drawn_anew_for_every_reading() -> None:
    sensor = WrenchSensor(ONE, np.zeros(6), np.random.default_rng(0))
    errors = np.array([sensor.error() for _ in SEEDS])
    np.testing.assert_allclose(
        errors.std(axis=0), np.repeat([ONE.force_noise_n, ONE.moment_noise_nm], 3), rtol=0.15
    )


def test_a_vacuum_is_read_with_the_noise_of_its_sensor() -> None:
    for scale in (0.0, 1.0, 2.0):
        config = ImperfectionConfig(scale=scale)
        sensor = WrenchSensor(config, np.zeros(6), np.random.default_rng(0))
        errors = [sensor.vacuum_error() for _ in SEEDS]
        assert np.std(errors) == pytest.approx(scale * ONE.vacuum_noise, rel=0.15)
        assert config.vacuum_error == scale * ONE.vacuum_noise
