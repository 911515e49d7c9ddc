"""The pressed pad against Winkler's closed forms, and its compiled twin against it."""

import numpy as np
import pytest

from pipeline.referee import compiled_press, foundation
from pipeline.referee.disc import build_disc, laplacian
from pipeline.referee.foundation import Cushion
from tests.referee.shapes import referee, rough

SOFT = Cushion(stiffness_pa_m=2e6, tension_n_m=0.0)
WAYS = [foundation.press, compiled_press.press]


@pytest.mark.parametrize("press", WAYS)
def test_a_plane_is_pressed_evenly(press) -> None:  # type: ignore[no-untyped-def]
    disc = build_disc(0.025, 0.0025)
    pressed = press(disc, Cushion(2e6, 30.0), np.zeros(len(disc.areas_m2)), 5.0)
    assert pressed.back_m == pytest.approx(-5.0 / (2e6 * disc.area_m2), rel=1e-4)
    np.testing.assert_allclose(pressed.contact_n / disc.areas_m2, 5.0 / disc.area_m2, rtol=1e-4)


@pytest.mark.parametrize("press", WAYS)
def test_winkler_contact_on_a_sphere(press) -> None:  # type: ignore[no-untyped-def]
    """F = π k R δ² and a² = 2 R δ, for a cushion without a skin on a paraboloid of radius R."""
    disc = build_disc(0.025, 0.025 / 48)
    ball_m, force_n = 0.04, 3.0
    squared = (disc.vertices_xy_m**2).sum(axis=1)
    pressed = press(disc, SOFT, -squared / (2 * ball_m), force_n)
    depth_m = np.sqrt(force_n / (np.pi * SOFT.stiffness_pa_m * ball_m))
    assert -pressed.back_m == pytest.approx(depth_m, rel=2e-3)
    touching = disc.areas_m2[pressed.touches].sum()
    assert touching == pytest.approx(np.pi * 2 * ball_m * depth_m, rel=0.05)


def test_a_skin_over_a_pin_is_a_bessel_function() -> None:
    """One point pushes: z - z_0 falls as K_0(r / √(T/k)) does."""
    from scipy.special import k0

    disc = build_disc(0.025, 0.025 / 32)
    cushion = Cushion(2e6, 8.0)  # a length of 2 mm
    pin = np.full(len(disc.areas_m2), -np.inf)
    pin[0] = 0.0
    pressed = foundation.press(disc, cushion, pin, 1.0)
    r = np.linalg.norm(disc.vertices_xy_m, axis=1)
    far = (r > 0.004) & (r < 0.010)
    expected = 1.0 / (2 * np.pi * cushion.tension_n_m) * k0(r[far] / 0.002)
    np.testing.assert_allclose(pressed.face_m[far] - pressed.back_m, expected, rtol=0.06)
    assert pressed.contact_n[0] == pytest.approx(1.0)


@pytest.mark.parametrize("seed", range(12))
def test_the_pad_obeys_the_variational_inequality_either_way(seed: int) -> None:
    """z ≥ s, contact ≥ 0, no contact across a gap, and the force is carried."""
    pad = referee()
    rng = np.random.default_rng(seed)
    surface = rough(pad.disc, rng, rng.choice([2e-4, 2e-3, 8e-3])).height_m
    force_n = float(rng.uniform(1.0, 20.0))
    plain = foundation.press(pad.disc, pad.cushion, surface, force_n)
    assert (plain.face_m >= surface).all()
    assert (plain.contact_n >= 0.0).all()
    assert (plain.face_m[plain.touches] == surface[plain.touches]).all()
    assert plain.contact_n.sum() == pytest.approx(force_n)
    skin = pad.cushion.tension_n_m * laplacian(pad.disc, pad.disc.weights)
    springs = pad.cushion.stiffness_pa_m * pad.disc.areas_m2
    rest = skin @ plain.face_m + springs * (plain.face_m - plain.back_m) - plain.contact_n
    assert np.abs(rest).max() < 1e-9 * force_n
    quick = compiled_press.press(pad.disc, pad.cushion, surface, force_n)
    np.testing.assert_allclose(quick.face_m, plain.face_m, atol=1e-7)
    np.testing.assert_allclose(quick.contact_n, plain.contact_n, atol=1e-4 * force_n)
    less = compiled_press.press(pad.disc, pad.cushion, surface, 0.7 * force_n)
    warm = compiled_press.press(pad.disc, pad.cushion, surface, force_n, less)
    np.testing.assert_allclose(warm.face_m, plain.face_m, atol=1e-7)


@pytest.mark.parametrize("press", WAYS)
def test_nothing_under_the_pad_is_refused(press) -> None:  # type: ignore[no-untyped-def]
    pad = referee()
    with pytest.raises(ValueError, match="no surface"):
        press(pad.disc, pad.cushion, np.full(len(pad.disc.areas_m2), -np.inf), 1.0)
