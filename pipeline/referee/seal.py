"""From a pad's pose and the true surface to what it bears."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.referee import RefereeConfig
from pipeline.referee import compiled_leak, compiled_press, foundation
from pipeline.referee import leak as film
from pipeline.referee.disc import Disc, build_disc
from pipeline.referee.foundation import Cushion, Pressed
from pipeline.referee.leak import Face, Vacuum
from pipeline.referee.load import (
    Hold,
    contact_wrenches,
    suction_along_normals_n,
    suction_wrench,
    weight_loads,
)
from pipeline.referee.pump import Fan
from pipeline.referee.surface import Surface

GRAVITY_M_S2 = 9.81  # standard gravity to three digits
DRAWN_IN = 0.01  # the pad rests when the vacuum pulls as hard as it is pressed, to this share
MOST_DRAWS = 8  # bounds a pad that does not settle
Way = Literal["compiled", "plain"]


@dataclass(frozen=True, eq=False)
class Referee:
    """A pad's elements and physics, in SI units."""

    disc: Disc
    cushion: Cushion
    face: Face
    fan: Fan
    press_n: float
    config: RefereeConfig


@dataclass(frozen=True, eq=False)
class Seal:
    """A pad on a surface with the fan on.

    Attributes
    ----------
    surface
        What it is on.
    pressed
        The pad's shape and where it touches.
    vacuum
        Air under it.
    film_m
        Height of the gap, roughness among it, shape (n,) [m].
    touches
        Vertices that push on the object, shape (n,).
    pull_n
        The vacuum's force on the object along +z [N].
    hold
        What balances a load.
    """

    surface: Surface
    pressed: Pressed
    vacuum: Vacuum
    film_m: Float[np.ndarray, " n"]
    touches: Bool[np.ndarray, " n"]
    pull_n: float
    hold: Hold


@lru_cache(maxsize=64)
def referee_of(config: RefereeConfig, radius_m: float) -> Referee:
    """The pad of a radius r_G [m], in SI units."""
    disc = build_disc(radius_m, config.element_rg * radius_m)
    thickness_m = config.cushion_thickness_rg * radius_m
    tension = config.skin_modulus_pa * config.skin_thickness_rg * radius_m * config.skin_strain
    return Referee(
        disc=disc,
        cushion=Cushion(config.cushion_modulus_pa / thickness_m, tension),
        face=Face.of(config.open_share, config.discharge, config.grain_rg * radius_m, thickness_m),
        fan=Fan(config.fan_vacuum_pa, config.fan_flow_m_s * disc.area_m2, config.fan_exponent),
        press_n=config.press_pa * disc.area_m2,
        config=config,
    )


def seal(referee: Referee, surface: Surface, way: Way = "compiled") -> Seal:
    """Press the pad, draw the air, and let the vacuum draw the object in until nothing moves.

    Parameters
    ----------
    referee
        The pad.
    surface
        What is under it; at least one vertex over something.
    way
        "plain" solves by SciPy's sparse matrices; "compiled", ten times as fast, is held to it.

    Returns
    -------
    The pad's shape, the vacuum, and the wrenches that its contact can give.

    Raises
    ------
    ValueError
        There is no surface at all.
    """
    disc, force_n = referee.disc, referee.press_n
    pressed: Pressed | None = None
    for _ in range(MOST_DRAWS):
        pressed = _pressed(referee, surface, force_n, pressed, way)
        gap = np.where(np.isfinite(surface.height_m), pressed.face_m - surface.height_m, np.inf)
        film_m = np.maximum(gap, 0.0) + referee.config.roughness_m
        leak = film.leak if way == "plain" else compiled_leak.leak
        vacuum = leak(disc, film_m, surface.open_to_air, referee.face, referee.fan)
        wrench = suction_wrench(disc, vacuum.under_face_pa, surface.height_m, surface.on_target)
        if wrench[2] <= force_n * (1 + DRAWN_IN):
            break
        force_n = float(wrench[2])
    assert pressed is not None
    touches = pressed.touches & surface.on_target
    contact = contact_wrenches(
        disc, touches, surface.height_m, surface.normals, referee.config.friction
    )
    most_n = suction_along_normals_n(
        disc, vacuum.under_face_pa, surface.height_m, surface.on_target
    )
    hold = Hold(wrench, contact, disc.radius_m, most_n)
    return Seal(surface, pressed, vacuum, film_m, touches, float(wrench[2]), hold)


def _pressed(
    referee: Referee, surface: Surface, force_n: float, before: Pressed | None, way: Way
) -> Pressed:
    """The pad pressed with a force, either way; ``before`` with less."""
    if way == "plain":
        return foundation.press(referee.disc, referee.cushion, surface.height_m, force_n)
    return compiled_press.press(referee.disc, referee.cushion, surface.height_m, force_n, before)


def weight_borne_n(
    found: Seal,
    config: RefereeConfig,
    world_from_gripper: Float[np.ndarray, "4 4"],
    centre_of_mass_m: Float[np.ndarray, " 3"],
) -> float:
    """The largest weight at a centre of mass that may be lifted and moved to any side.

    Parameters
    ----------
    found
        The seal.
    config
        Accelerations of the lift.
    world_from_gripper
        The pad's pose, shape (4, 4); gravity is along -z of the world.
    centre_of_mass_m
        Of the object, shape (3,), in the world [m].

    Returns
    -------
    In newtons of weight at rest; 0 where it cannot be held.
    """
    rotation, origin = world_from_gripper[:3, :3], world_from_gripper[:3, 3]
    gripper_from_world = np.eye(4)
    gripper_from_world[:3, :3] = rotation.T
    gripper_from_world[:3, 3] = -rotation.T @ origin
    loads = weight_loads(
        gripper_from_world,
        centre_of_mass_m,
        GRAVITY_M_S2 + config.lift_acceleration_m_s2,
        config.side_acceleration_m_s2,
    )
    return GRAVITY_M_S2 * found.hold.largest_common_scale(loads)


def straight_pull_n(found: Seal) -> float:
    """The largest force along -z through the pad's centre [N]."""
    return found.hold.largest_scale(np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]))
