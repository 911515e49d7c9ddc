"""Film, openings and fan against closed forms, and the compiled way against the plain one."""

import numpy as np
import pytest

from pipeline.referee import compiled_leak, leak
from pipeline.referee.disc import build_disc
from pipeline.referee.leak import AIR_DENSITY_KG_M3, AIR_VISCOSITY_PA_S, Face, film_mobility
from pipeline.referee.pump import Fan, working_point
from tests.referee.shapes import referee, rough

DISC = build_disc(0.025, 0.025 / 32)
EVERYWHERE = np.ones(len(DISC.areas_m2), dtype=bool)
WAYS = [leak.leak, compiled_leak.leak]


def test_an_annular_gap_leaks_as_poiseuille_says() -> None:
    """Q = π h³ Δp / (6 μ ln(r₂ / r₁)) between a mouth of radius r₁ and the rim r₂."""
    errors = []
    for elements in (16, 32, 64):
        disc = build_disc(0.025, 0.025 / elements)
        film = np.full(len(disc.areas_m2), 1e-4)
        mouth = np.linalg.norm(disc.vertices_xy_m, axis=1) <= 0.0125 * (1 + 1e-9)
        # Openings so wide that the mouth is at the cushion's vacuum, and none outside.
        shares = leak.film_shares(disc, film, film < 0, np.where(mouth, 1e3, 0.0))
        flow = float((disc.rim_weights * film_mobility(film)) @ shares)
        exact = np.pi * 1e-4**3 / (6 * AIR_VISCOSITY_PA_S * np.log(2.0))
        errors.append(abs(flow / exact - 1))
    assert errors[2] < 0.012  # the rim is half an element farther: first order
    assert errors[0] > errors[1] > errors[2]


@pytest.mark.parametrize("way", WAYS)
def test_an_open_pad_is_an_orifice(way) -> None:  # type: ignore[no-untyped-def]
    """Q = C_d φ A √(2 Δp / ρ), at the vacuum where the fan gives as much."""
    face = Face(0.0, AIR_DENSITY_KG_M3 / (2 * (0.6 * 0.02) ** 2))
    fan = Fan(10e3, 5e-3, 1.0)
    found = way(DISC, np.full(len(EVERYWHERE), 1e-4), EVERYWHERE, face, fan)
    orifice = 0.6 * 0.02 * DISC.area_m2 * np.sqrt(2 * found.in_cushion_pa / AIR_DENSITY_KG_M3)
    assert found.flow_m3_s == pytest.approx(orifice, rel=1e-3)
    assert fan.vacuum_at(found.flow_m3_s) == pytest.approx(found.in_cushion_pa, rel=1e-3)
    assert not found.under_face_pa.any()


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_the_working_point_lies_on_fan_and_leak(exponent: float) -> None:
    fan = Fan(12e3, 4.5e-3, exponent)
    conductance = 3e-7
    vacuum = working_point(fan, conductance)
    assert fan.vacuum_at(conductance * vacuum) == pytest.approx(vacuum)
    if exponent == 1.0:
        assert vacuum == pytest.approx(12e3 / (1 + conductance * 12e3 / 4.5e-3))
    assert working_point(fan, 0.0) == 12e3
    assert working_point(fan, 1e3) == pytest.approx(0.0, abs=1e-2)


@pytest.mark.parametrize("way", WAYS)
def test_a_film_of_nothing_is_a_full_seal(way) -> None:  # type: ignore[no-untyped-def]
    pad = referee()
    closed = np.zeros(len(pad.disc.areas_m2), dtype=bool)
    film = np.full(len(closed), 1e-7)
    found = way(pad.disc, film, closed, pad.face, pad.fan)
    np.testing.assert_allclose(found.under_face_pa, pad.fan.vacuum_pa, rtol=1e-3)
    assert found.flow_m3_s < 1e-4 * pad.fan.flow_m3_s


def test_a_wider_film_seals_less() -> None:
    pad = referee()
    closed = np.zeros(len(pad.disc.areas_m2), dtype=bool)
    pulls = [
        pad.disc.areas_m2
        @ leak.leak(pad.disc, np.full(len(closed), film), closed, pad.face, pad.fan).under_face_pa
        for film in (1e-5, 1e-4, 3e-4, 1e-3, 3e-3)
    ]
    assert (np.diff(pulls) < 0).all()
    assert pulls[-1] < 0.1 * pulls[0]


def test_openings_are_linear_at_small_drops_and_orifices_at_large() -> None:
    face = Face.of(0.02, 0.6, 0.002, 0.03)
    assert face.permeance(np.zeros(1))[0] == pytest.approx(1 / face.viscous)
    large = 1e6
    velocity = face.permeance(np.array([large]))[0] * large
    assert velocity == pytest.approx(0.6 * 0.02 * np.sqrt(2 * large / AIR_DENSITY_KG_M3), rel=0.01)


@pytest.mark.parametrize("seed", range(8))
def test_compiled_and_plain_agree_and_air_is_conserved(seed: int) -> None:
    pad = referee()
    rng = np.random.default_rng(seed)
    surface = rough(pad.disc, rng, 1e-3)
    gap = np.where(np.isfinite(surface.height_m), -surface.height_m, 1.0)
    film = 2e-5 + np.maximum(gap - np.quantile(gap, 0.5), 0.0)
    plain = leak.leak(pad.disc, film, surface.open_to_air, pad.face, pad.fan)
    quick = compiled_leak.leak(pad.disc, film, surface.open_to_air, pad.face, pad.fan)
    np.testing.assert_allclose(quick.under_face_pa, plain.under_face_pa, atol=0.5)
    assert quick.in_cushion_pa == pytest.approx(plain.in_cushion_pa, rel=1e-5)
    drop = plain.in_cushion_pa - plain.under_face_pa
    drawn = pad.disc.areas_m2 @ (pad.face.permeance(drop) * drop)
    assert drawn == pytest.approx(plain.flow_m3_s, rel=2e-3)
    assert (plain.under_face_pa >= 0).all()
    assert plain.under_face_pa.max() <= plain.in_cushion_pa * (1 + 1e-12)
