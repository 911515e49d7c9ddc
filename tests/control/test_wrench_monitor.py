"""The wrench monitor on wrenches of closed form."""

import math

import numpy as np
import pytest

from pipeline.config.policy import PolicyConfig
from pipeline.control.robot import Reading
from pipeline.control.wrench_monitor import Event, WrenchMonitor, line_of_load, trim_pose

CONFIG = PolicyConfig()
WEIGHT = np.array([0.0, 0.0, -2.0])


def reading(
    force: np.ndarray,
    at_m: np.ndarray | None = None,
    peak_n: float = 0.0,
    pressure: float = math.nan,
) -> Reading:
    moment = np.zeros(3) if at_m is None else np.cross(at_m, force)
    wrench = np.concatenate([force, moment])
    return Reading(np.eye(4), wrench, peak_n, arrived=False, pressure=pressure)


def test_a_push_on_the_pad_is_contact_and_a_blow_is_a_collision() -> None:
    monitor = WrenchMonitor(CONFIG)
    assert monitor.moving(reading(np.zeros(3))) is Event.NOTHING
    assert monitor.moving(reading(np.array([0, 0, 2.0]))) is Event.CONTACT
    blow = reading(np.array([0, 0, 2.0]), peak_n=CONFIG.force_limit_n + 1)
    assert monitor.moving(blow) is Event.COLLISION


def test_a_pull_is_a_seal_and_its_end_is_a_loss() -> None:
    monitor = WrenchMonitor(CONFIG)
    assert not monitor.holds(reading(np.zeros(3)))
    assert not monitor.holds(reading(-WEIGHT))
    assert monitor.holds(reading(WEIGHT))
    assert monitor.carrying(reading(WEIGHT)) is Event.NOTHING
    for _ in range(CONFIG.loss_readings - 1):
        assert monitor.carrying(reading(np.zeros(3))) is Event.NOTHING
    assert monitor.carrying(reading(np.zeros(3))) is Event.LOSS


def test_one_reading_that_misses_an_object_is_no_loss() -> None:
    monitor = WrenchMonitor(CONFIG)
    for _ in range(5):
        assert monitor.carrying(reading(WEIGHT)) is Event.NOTHING
        assert monitor.carrying(reading(np.zeros(3))) is Event.NOTHING


def test_less_than_the_robot_can_tell_apart_is_no_touch_and_no_pull() -> None:
    error_n = 0.5
    monitor, sharp = WrenchMonitor(CONFIG, error_n), WrenchMonitor(CONFIG)
    weak = np.array([0.0, 0.0, 0.9 * CONFIG.contact_sigmas * error_n])
    assert sharp.moving(reading(weak)) is Event.CONTACT
    assert monitor.moving(reading(weak)) is Event.NOTHING
    light = np.array([0.0, 0.0, -0.9 * CONFIG.tension_sigmas * error_n])
    assert sharp.holds(reading(light))
    assert not monitor.holds(reading(light))


def test_an_object_too_light_for_the_wrench_is_felt_by_the_vacuum() -> None:
    error_n, vacuum_error = 0.15, 0.02
    monitor = WrenchMonitor(CONFIG, error_n, vacuum_error)
    light = np.array([0.0, 0.0, -0.1 * error_n])
    sealed = 1.1 * CONFIG.vacuum_sigmas * vacuum_error
    assert monitor.holds(reading(light, pressure=sealed))
    assert monitor.carrying(reading(light, pressure=sealed)) is Event.NOTHING
    assert not monitor.pulls(reading(light, pressure=sealed))
    assert not monitor.holds(reading(light, pressure=0.8 * sealed))
    events = [monitor.carrying(reading(light, pressure=0.0)) for _ in range(CONFIG.loss_readings)]
    assert events[-1] is Event.LOSS


def test_a_faint_vacuum_is_told_by_more_readings() -> None:
    """The seal of a light object on studs: three sigma of four readings' mean, not of one."""
    vacuum_error, light = 0.02, np.array([0.0, 0.0, -0.001])
    monitor = WrenchMonitor(CONFIG, 0.15, vacuum_error)
    faint = 0.6 * CONFIG.vacuum_sigmas * vacuum_error
    assert not monitor.holds(reading(light, pressure=faint))
    assert monitor.holds(reading(light, pressure=faint), readings=4)
    # While it is carried, single readings that miss it are no loss; their mean decides.
    for pressure in (2 * faint, 0.0) * 6:
        assert monitor.carrying(reading(light, pressure=pressure)) is Event.NOTHING


def test_a_pad_that_leaks_holds_what_surely_pulls() -> None:
    error_n = 0.15
    monitor = WrenchMonitor(CONFIG, error_n, vacuum_error=0.02)
    likely = np.array([0.0, 0.0, -1.1 * CONFIG.tension_sigmas * error_n])
    sure = np.array([0.0, 0.0, -1.1 * CONFIG.contact_sigmas * error_n])
    assert monitor.holds(reading(likely))  # without a sensor, nothing else tells
    assert not monitor.holds(reading(likely, pressure=0.0))
    assert monitor.holds(reading(sure, pressure=0.0))


def test_where_a_light_load_hangs_is_not_told_by_noise() -> None:
    monitor = WrenchMonitor(CONFIG, error_n=0.15, vacuum_error=0.02)
    light, below = np.array([0.0, 0.0, -0.02]), np.array([0.0, 0.0, -0.25])
    assert monitor.carrying(reading(light, below, pressure=0.5)) is Event.NOTHING
    jumped = below + np.array([5 * CONFIG.slip_m, 0, 0])
    assert monitor.carrying(reading(light, jumped, pressure=0.5)) is Event.NOTHING


def test_a_load_that_jumps_aside_has_slipped() -> None:
    monitor = WrenchMonitor(CONFIG)
    below = np.array([0.0, 0.0, -0.25])
    assert monitor.carrying(reading(WEIGHT, below)) is Event.NOTHING
    aside = below + np.array([CONFIG.slip_m / 2, 0, 0])
    assert monitor.carrying(reading(WEIGHT, aside)) is Event.NOTHING
    aside = aside + np.array([0, 1.5 * CONFIG.slip_m, 0])
    assert monitor.carrying(reading(WEIGHT, aside)) is Event.SLIP


def test_the_load_acts_along_its_line() -> None:
    wrench = reading(WEIGHT, np.array([0.03, -0.01, -0.4])).wrench
    np.testing.assert_allclose(line_of_load(wrench), [0.03, -0.01, 0.0], atol=1e-12)


@pytest.mark.parametrize("aside_m", [0.004, 0.02])
def test_trimming_lessens_the_moment_at_the_base(aside_m: float) -> None:
    """The object hangs rigidly 0.25 m below the base: what a turn of the pose does is exact."""
    hangs_at = np.array([aside_m, -aside_m, -0.25])  # from the base, in GCS
    pose, left, sizes = np.eye(4), 0.5, []
    for _ in range(6):
        force = pose[:3, :3].T @ WEIGHT
        wrench = np.concatenate([force, np.cross(hangs_at, force)])
        sizes.append(float(np.linalg.norm(wrench[3:])))
        pose, turned = trim_pose(pose, wrench, left, CONFIG)
        left -= turned
    assert sizes[-1] < 0.35 * sizes[0]
    assert (np.diff(sizes) <= 1e-12).all()


def test_trimming_stays_within_its_bound() -> None:
    wrench = np.array([0, 0, -2.0, 0.3, 0.0, 0.0])
    pose, turned = trim_pose(np.eye(4), wrench, 0.01, CONFIG)
    assert turned == pytest.approx(0.01)
    assert np.arccos(pose[2, 2]) == pytest.approx(0.01, abs=1e-6)
