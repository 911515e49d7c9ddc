"""Machine parts: brackets, pipes, gears, wheels, springs."""

import math

import numpy as np

from pipeline.geometry.parametric.solids import (
    Solid,
    around_z,
    box,
    circle_points,
    cylinder,
    plate,
    revolve,
    rounded_box,
    sweep,
    torus,
    union,
)


def angle_bracket() -> Solid:
    """An L of thick plate with a gusset and four holes."""
    foot = box(0.090, 0.060, 0.012)
    wall = box(0.012, 0.060, 0.080).translate((-0.039, 0, 0))
    gusset = plate([(-0.035, 0.010), (0.020, 0.010), (-0.035, 0.060)], 0.010)
    gusset = gusset.rotate((90, 0, 0)).translate((0, 0.005, 0))
    down = cylinder(0.005, 0.05, segments=24).translate((0, 0, -0.01))
    holes = [down.translate((0.025, y, 0)) for y in (-0.018, 0.018)]
    across = cylinder(0.005, 0.05, segments=24).rotate((0, 90, 0)).translate((-0.06, 0, 0.060))
    holes += [across.translate((0, y, 0)) for y in (-0.018, 0.018)]
    return union([foot, wall, gusset]) - union(holes)


def t_beam() -> Solid:
    """A short length of T profile."""
    outline = [(-0.040, 0.0), (0.040, 0.0), (0.040, 0.014), (0.009, 0.014), (0.009, 0.060)]
    outline += [(-0.009, 0.060), (-0.009, 0.014), (-0.040, 0.014)]
    return plate(outline, 0.095).rotate((90, 0, 0)).translate((0, 0.0475, 0))


def i_beam() -> Solid:
    """A short length of I profile."""
    outline = [(-0.030, 0.0), (0.030, 0.0), (0.030, 0.010), (0.007, 0.010), (0.007, 0.060)]
    outline += [(0.030, 0.060), (0.030, 0.070), (-0.030, 0.070), (-0.030, 0.060)]
    outline += [(-0.007, 0.060), (-0.007, 0.010), (-0.030, 0.010)]
    return plate(outline, 0.110).rotate((90, 0, 0)).translate((0, 0.055, 0))


def pipe_elbow() -> Solid:
    """A quarter bend with flanges, hollow."""
    angle = np.linspace(0, math.pi / 2, 20)
    path = np.column_stack([0.050 * np.cos(angle), np.zeros(20), 0.050 * np.sin(angle)])
    longer = np.vstack([path[0] + [0, 0, -0.012], path, path[-1] + [-0.012, 0, 0]])
    beyond = np.vstack([path[0] + [0, 0, -0.03], path, path[-1] + [-0.03, 0, 0]])
    flange = cylinder(0.028, 0.008)
    flanges = [
        flange.translate((0.050, 0, -0.016)),
        flange.rotate((0, 90, 0)).translate((-0.016, 0, 0.050)),
    ]
    return union([sweep(longer, 0.020, 48), *flanges]) - sweep(beyond, 0.0130, 48)


def pipe_tee() -> Solid:
    """A tee fitting, hollow, with collars."""
    run = cylinder(0.018, 0.100).translate((0, 0, -0.050))
    branch = cylinder(0.018, 0.050).rotate((0, 90, 0))
    collar = cylinder(0.0225, 0.016)
    collars = [
        *[collar.translate((0, 0, z)) for z in (-0.050, 0.034)],
        collar.rotate((0, 90, 0)).translate((0.034, 0, 0)),
    ]
    bore = cylinder(0.012, 0.2).translate((0, 0, -0.1))
    side = cylinder(0.012, 0.1).rotate((0, 90, 0))
    return union([run, branch, *collars]) - bore - side


def tape_roll() -> Solid:
    """A roll of parcel tape."""
    return cylinder(0.050, 0.048) - cylinder(0.034, 0.1).translate((0, 0, -0.02))


def hexagonal_nut() -> Solid:
    """A large nut with chamfered corners."""
    body = cylinder(0.036, 0.030, segments=6)
    cone = revolve(
        [(0, -0.006), (0.0255, -0.006), (0.0375, 0.004), (0.0375, 0.026), (0.0255, 0.036)]
        + [(0, 0.036)]
    )
    return (body ^ cone) - cylinder(0.0190, 0.1).translate((0, 0, -0.02))


def carriage_bolt() -> Solid:
    """A bolt with a hexagonal head and rings for a thread."""
    head = cylinder(0.025, 0.018, segments=6)
    shank = [(0.0, 0.016), (0.0125, 0.016), (0.0125, 0.036)]
    for k in range(13):
        z = 0.036 + 0.004 * k
        shank += [(0.0112, z + 0.001), (0.0130, z + 0.003)]
    return head + revolve([*shank, (0.010, 0.092), (0.0, 0.092)], 48)


def spur_gear() -> Solid:
    """A gear of eighteen teeth with a hub and a bore."""
    outline = _teeth(18, 0.040, 0.050)
    gear = plate(outline, 0.016) + cylinder(0.018, 0.026)
    return gear - cylinder(0.008, 0.1).translate((0, 0, -0.02)) - box(0.005, 0.022, 0.1)


def spoked_gear() -> Solid:
    """A larger, thinner gear whose web is cut by six windows."""
    gear = plate(_teeth(28, 0.054, 0.062), 0.010)
    window = cylinder(0.0120, 0.1, segments=32).translate((0.031, 0, -0.02))
    return gear + cylinder(0.013, 0.018) - around_z(window, 6) - cylinder(0.006, 0.1)


def _teeth(count: int, root: float, tip: float) -> list[tuple[float, float]]:
    outline = []
    for k in range(count):
        for share, radius in ((0.0, root), (0.28, root), (0.42, tip), (0.86 - 0.02, tip)):
            turn = 2 * math.pi * (k + share) / count
            outline.append((radius * math.cos(turn), radius * math.sin(turn)))
    return outline


def cart_wheel() -> Solid:
    """A rim, a hub and eight spokes."""
    rim = revolve([(0.048, -0.010), (0.058, -0.010), (0.058, 0.010), (0.048, 0.010)])
    hub = cylinder(0.014, 0.026).translate((0, 0, -0.013)) - cylinder(0.006, 0.1).translate(
        (0, 0, -0.05)
    )
    spoke = cylinder(0.0038, 0.042, segments=16).rotate((0, 90, 0)).translate((0.0105, 0, 0))
    return union([rim, hub, around_z(spoke, 8)])


def caster_wheel() -> Solid:
    """A tyre with a dished disc and a fork plate."""
    tyre = torus(0.034, 0.012, 64).scale((1, 1, 0.9))
    disc = cylinder(0.032, 0.009).translate((0, 0, -0.0045))
    hub = cylinder(0.011, 0.030).translate((0, 0, -0.015))
    return union([tyre, disc, hub]) - cylinder(0.0045, 0.1).translate((0, 0, -0.05))


def coil_spring() -> Solid:
    """A compression spring of five turns."""
    turn = np.linspace(0, 2 * math.pi * 5, 220)
    path = np.column_stack([0.024 * np.cos(turn), 0.024 * np.sin(turn), 0.0022 * turn])
    return sweep(path, 0.0040, 16)


def heat_sink() -> Solid:
    """A base with ten fins."""
    base = box(0.080, 0.080, 0.010)
    fin = box(0.0032, 0.080, 0.042)
    places = np.linspace(-0.0384, 0.0384, 10).tolist()
    return base + union([fin.translate((x, 0, 0.005)) for x in places])


def fan_rotor() -> Solid:
    """Seven pitched blades in a ring."""
    hub = cylinder(0.016, 0.024).translate((0, 0, -0.012))
    blade = box(0.038, 0.0034, 0.026).translate((0.031, 0, -0.013)).rotate((50, 0, 0))
    ring = revolve([(0.047, -0.012), (0.051, -0.012), (0.051, 0.012), (0.047, 0.012)])
    return union([hub, around_z(blade, 7), ring])


def pulley() -> Solid:
    """A solid pulley with a V groove."""
    profile = [(0.006, 0.0), (0.042, 0.0), (0.042, 0.006), (0.026, 0.015), (0.042, 0.024)]
    profile += [(0.042, 0.030), (0.006, 0.030)]
    return revolve(profile)


def flanged_bushing() -> Solid:
    """A sleeve with a square flange and four holes."""
    flange = rounded_box(0.084, 0.084, 0.014, 0.004)
    sleeve = cylinder(0.026, 0.060)
    bore = cylinder(0.0175, 0.1).translate((0, 0, -0.02))
    hole = cylinder(0.0055, 0.1, segments=24).translate((0.0, 0, -0.02))
    holes = [hole.translate((x, y, 0)) for x, y in circle_points(4, 0.045, math.pi / 4).tolist()]
    return flange + sleeve - bore - union(holes)


def crank() -> Solid:
    """A crank arm with a shaft and a knob on opposite sides."""
    arm = Solid.batch_hull(
        [cylinder(0.020, 0.014), cylinder(0.013, 0.014).translate((0.080, 0, 0))]
    )
    shaft = cylinder(0.0125, 0.045).translate((0, 0, -0.040))
    knob = cylinder(0.010, 0.052, 0.0125).translate((0.080, 0, 0.010))
    return arm + shaft + knob


def chain_links() -> Solid:
    """Three fused chain links."""
    angle = np.linspace(0, 2 * math.pi, 64, endpoint=False)
    oval = np.column_stack(
        [0.012 * np.cos(angle), 0.013 * np.sin(angle), np.zeros(64)]
    ) + np.column_stack([np.zeros(64), 0.012 * np.tanh(4 * np.sin(angle)), np.zeros(64)])
    link = sweep(oval, 0.0046, 16, closed=True)
    turned = link.rotate((0, 90, 0))
    return union([link, turned.translate((0, 0.041, 0)), link.translate((0, 0.082, 0))])
