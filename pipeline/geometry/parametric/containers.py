"""Things that hold things: bottles, cups, bowls, plates, all with real walls."""

import math

import numpy as np

from pipeline.geometry.parametric.solids import (
    Outline,
    Solid,
    box,
    cylinder,
    revolve,
    rounded_box,
    sweep,
    union,
)


def water_bottle() -> Solid:
    """A closed bottle with shoulders and a cap."""
    return revolve(
        [
            *[(0, 0.003), (0.020, 0.0), (0.030, 0.0), (0.0325, 0.004), (0.0325, 0.100)],
            *[(0.031, 0.115), (0.024, 0.135), (0.015, 0.150), (0.0125, 0.158), (0.0125, 0.163)],
            *[(0.0145, 0.164), (0.0145, 0.180), (0.0135, 0.181), (0, 0.181)],
        ]
    )


def wine_bottle() -> Solid:
    """A closed bottle with a long neck."""
    return revolve(
        [
            *[(0, 0.010), (0.025, 0.0), (0.036, 0.0), (0.038, 0.004), (0.038, 0.170)],
            *[(0.035, 0.190), (0.022, 0.208), (0.0150, 0.222), (0.0138, 0.285), (0.0150, 0.286)],
            *[(0.0150, 0.298), (0, 0.298)],
        ]
    )


def mustard_bottle() -> Solid:
    """An oval squeeze bottle with a nozzle."""
    body = rounded_box(0.075, 0.075, 0.140, 0.022).scale((1.0, 0.62, 1.0))
    neck = cylinder(0.016, 0.012).translate((0, 0, 0.134))
    cap = cylinder(0.018, 0.016, 0.012).translate((0, 0, 0.146))
    return body + neck + cap + cylinder(0.007, 0.026, 0.003).translate((0, 0, 0.160))


def spray_bottle() -> Solid:
    """A bottle with a trigger head."""
    body = revolve(
        [
            *[(0, 0), (0.036, 0), (0.038, 0.003), (0.038, 0.105), (0.030, 0.125), (0.016, 0.145)],
            *[(0.014, 0.165), (0, 0.165)],
        ]
    )
    head = rounded_box(0.080, 0.026, 0.032, 0.006).translate((-0.014, 0, 0.158))
    nozzle = cylinder(0.008, 0.014).rotate((0, -90, 0)).translate((-0.050, 0, 0.178))
    bend = np.array(
        [[-0.036, 0, 0.164], [-0.041, 0, 0.152], [-0.040, 0, 0.138], [-0.034, 0, 0.122]]
    )
    return body + head + nozzle + sweep(bend, 0.0048, 16)


def milk_carton() -> Solid:
    """A gable-top carton."""
    body = box(0.070, 0.070, 0.135)
    base = np.array([(x, y, 0.135) for x in (-0.035, 0.035) for y in (-0.035, 0.035)])
    ridge = np.array(
        [(x, y, z) for x in (-0.035, 0.035) for y in (-0.001, 0.001) for z in (0.170,)]
    )
    gable = Solid.hull_points(np.concatenate([base, ridge]))
    return body + gable + box(0.070, 0.004, 0.014).translate((0, 0, 0.168))


def watering_jug() -> Solid:
    """A closed jug with a handle and a spout."""
    body = cylinder(0.045, 0.095, 0.038)
    angle = np.linspace(-math.pi / 2, math.pi / 2, 24)
    loop = np.column_stack(
        [0.036 + 0.034 * np.cos(angle), np.zeros(24), 0.050 + 0.030 * np.sin(angle)]
    )
    spout = np.array([[-0.030, 0, 0.030], [-0.060, 0, 0.060], [-0.082, 0, 0.098]])
    return body + sweep(loop, 0.0065, 20) + sweep(spout, 0.009, 20)


def _vessel(outer: Outline, wall: float) -> Solid:
    """A body of revolution hollowed to the given wall; outer: (radius, z) from bottom to rim."""
    inner = [(max(r - wall, 0.001), max(z, wall)) for r, z in outer]
    top = outer[-1][1]
    shell = revolve([(0.0, 0.0), *outer, (0.0, top)])
    hollow = [(0.0, wall), *[(r, z) for r, z in inner if z > wall], (inner[-1][0], top + 0.01)]
    first = (inner[0][0], wall)
    return shell - revolve([hollow[0], first, *hollow[1:], (0.0, top + 0.01)])


def mug() -> Solid:
    """A coffee mug with a handle."""
    cup = _vessel([(0.038, 0.0), (0.041, 0.004), (0.041, 0.095)], 0.0045)
    angle = np.linspace(-math.pi / 2, math.pi / 2, 28)
    loop = np.column_stack(
        [0.037 + 0.030 * np.cos(angle), np.zeros(28), 0.048 + 0.028 * np.sin(angle)]
    )
    handle = sweep(loop, 0.0055, 20) - cylinder(0.0380, 0.2)
    return cup + handle


def tea_cup() -> Solid:
    """A wide cup on a foot, with a small handle."""
    angle = np.linspace(0.1, math.pi / 2, 24)
    outer = [(0.018, 0.0), (0.018, 0.005)]
    outer += [
        (0.018 + 0.030 * float(np.sin(t)), 0.006 + 0.050 * (1 - float(np.cos(t)))) for t in angle
    ]
    cup = _vessel(outer, 0.0035)
    turn = np.linspace(-math.pi / 2, math.pi / 2, 24)
    loop = np.column_stack(
        [0.040 + 0.018 * np.cos(turn), np.zeros(24), 0.032 + 0.013 * np.sin(turn)]
    )
    return cup + (sweep(loop, 0.0035, 16) - _filled(outer, 0.002))


def _filled(outer: Outline, inset: float) -> Solid:
    return revolve([(0.0, 0.0), *[(r - inset, z) for r, z in outer], (0.0, outer[-1][1])])


def tumbler() -> Solid:
    """A plain thick-based glass."""
    shell = cylinder(0.031, 0.110, 0.038)
    return shell - cylinder(0.027, 0.110, 0.0352).translate((0, 0, 0.014))


def soup_bowl() -> Solid:
    """A round bowl on a foot."""
    angle = np.linspace(0.05, math.pi / 2, 28)
    outer = [(0.030, 0.0), (0.030, 0.006)]
    outer += [
        (0.030 + 0.045 * float(np.sin(t)), 0.007 + 0.050 * (1 - float(np.cos(t)))) for t in angle
    ]
    return _vessel(outer, 0.0040)


def dinner_plate() -> Solid:
    """A plate with a raised rim."""
    return revolve(
        [
            *[(0, 0.002), (0.048, 0.002), (0.049, 0), (0.052, 0), (0.054, 0.002), (0.068, 0.005)],
            *[(0.096, 0.014), (0.099, 0.0155), (0.098, 0.018), (0.068, 0.0095), (0.054, 0.0065)],
            (0, 0.0065),
        ]
    )


def flower_pot() -> Solid:
    """A conical pot with a collar and a drain hole."""
    pot = cylinder(0.034, 0.075, 0.047) + cylinder(0.052, 0.022, 0.053).translate((0, 0, 0.070))
    return pot - cylinder(0.028, 0.1, 0.046).translate((0, 0, 0.007)) - cylinder(0.006, 0.02)


def open_box() -> Solid:
    """A storage tray with two compartments."""
    tray = rounded_box(0.120, 0.080, 0.060, 0.006).trim_by_plane((0, 0, -1), -0.052)
    pocket = rounded_box(0.053, 0.072, 0.080, 0.005).translate((0, 0, 0.004))
    return tray - pocket.translate((-0.0285, 0, 0)) - pocket.translate((0.0285, 0, 0))


def bucket() -> Solid:
    """A bucket with a bail handle."""
    pail = cylinder(0.036, 0.085, 0.047) - cylinder(0.0325, 0.085, 0.0435).translate((0, 0, 0.004))
    rim = revolve([(0.044, 0.081), (0.0500, 0.081), (0.0500, 0.087), (0.044, 0.087)])
    angle = np.linspace(0, math.pi, 32)
    bail = np.column_stack([0.0485 * np.cos(angle), np.zeros(32), 0.083 + 0.056 * np.sin(angle)])
    return union([pail, rim, sweep(bail, 0.0028, 14)])


def egg_tray() -> Solid:
    """A block with six cups for eggs."""
    body = rounded_box(0.130, 0.090, 0.034, 0.006).trim_by_plane((0, 0, -1), -0.028)
    places = [(x * 0.040, y * 0.040) for x in (-1, 0, 1) for y in (-0.5, 0.5)]
    cups = [Solid.sphere(0.0178, 40).translate((x, y, 0.030)) for x, y in places]
    below = [
        cylinder(0.011, 0.012, 0.005, 20).translate((x * 0.040, 0, -0.0001)) for x in (-0.5, 0.5)
    ]
    return body - union(cups) - union(below)


def watering_funnel() -> Solid:
    """A funnel with a thin wall."""
    outside = revolve(
        [(0, 0), (0.0075, 0), (0.009, 0.045), (0.048, 0.095), (0.048, 0.102), (0, 0.102)]
    )
    inside = revolve(
        [
            (0, -0.001),
            (0.0050, -0.001),
            (0.0064, 0.046),
            (0.0450, 0.0955),
            (0.0450, 0.103),
            (0, 0.103),
        ]
    )
    return outside - inside
