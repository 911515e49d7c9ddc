"""Compact things: boxes, balls, wedges, packaging; mostly Basic."""

import math

import numpy as np

from pipeline.geometry.parametric.solids import (
    ROUND,
    Solid,
    around_z,
    box,
    cylinder,
    plate,
    revolve,
    rod,
    rounded_box,
    torus,
    union,
)


def tea_box() -> Solid:
    """A carton with slightly rounded edges."""
    return rounded_box(0.075, 0.060, 0.130, 0.002)


def cereal_box() -> Solid:
    """A slimmer carton."""
    return rounded_box(0.060, 0.120, 0.170, 0.003)


def soap_bar() -> Solid:
    """A bar with strongly rounded edges."""
    return rounded_box(0.085, 0.055, 0.035, 0.014)


def wooden_block() -> Solid:
    """A plain toy brick with chamfered edges."""
    return rounded_box(0.060, 0.060, 0.060, 0.004)


def die() -> Solid:
    """A die: a rounded cube with shallow pips."""
    body = rounded_box(0.050, 0.050, 0.050, 0.006).translate((0, 0, -0.025))
    pip = Solid.sphere(0.0045, 16).translate((0, 0, 0.0265))
    step = 0.013
    layouts: list[tuple[tuple[float, float, float], list[tuple[float, float]]]] = [
        ((0, 0, 0), [(0, 0)]),
        ((90, 0, 0), [(-1, -1), (1, 1)]),
        ((0, 90, 0), [(-1, -1), (0, 0), (1, 1)]),
        ((0, -90, 0), [(-1, -1), (-1, 1), (1, -1), (1, 1)]),
        ((-90, 0, 0), [(-1, -1), (-1, 1), (1, -1), (1, 1), (0, 0)]),
        ((180, 0, 0), [(-1, -1), (-1, 0), (-1, 1), (1, -1), (1, 0), (1, 1)]),
    ]
    pips = [
        pip.translate((x * step, y * step, 0)).rotate(turn)
        for turn, places in layouts
        for x, y in places
    ]
    return body - union(pips)


def ball() -> Solid:
    """A smooth ball."""
    return Solid.sphere(0.036, 72)


def golf_ball() -> Solid:
    """A ball with dimples on a spiral."""
    radius, count = 0.0214, 110
    height = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = math.pi * (3 - math.sqrt(5)) * np.arange(count)
    ring = np.sqrt(1 - height**2)
    centres = (radius + 0.0072) * np.column_stack(
        [ring * np.cos(turn), ring * np.sin(turn), height]
    )
    dimple = Solid.sphere(0.0080, 64)
    return Solid.sphere(radius, 72) - union([dimple.translate(tuple(c)) for c in centres.tolist()])


def egg() -> Solid:
    """A body of revolution, blunter below."""
    angle = np.linspace(-math.pi / 2, math.pi / 2, 40)
    radius = 0.024 * np.cos(angle) * (1 - 0.12 * np.sin(angle))
    outline = zip(np.maximum(radius, 0).tolist(), (0.031 * np.sin(angle)).tolist(), strict=True)
    return revolve([*outline])


def apple() -> Solid:
    """A fruit with a dented top and a short stalk."""
    angle = np.linspace(-math.pi / 2, math.pi / 2, 48)
    radius = 0.038 * np.cos(angle) ** 0.8
    height = 0.034 * np.sin(angle) - 0.012 * np.exp(-((radius / 0.012) ** 2)) * np.sign(angle)
    body = revolve([*zip(radius.tolist(), height.tolist(), strict=False)])
    return body + rod((0, 0, 0.018), (0.004, 0, 0.036), 0.0020, 12)


def lemon() -> Solid:
    """A fruit with two tips."""
    height = np.linspace(-1, 1, 60)
    radius = 0.027 * np.sqrt(np.maximum(1 - (height / 0.86) ** 2, 0)) + 0.0050 * np.sqrt(
        np.maximum(1 - height**2, 0)
    )
    return revolve([*zip(radius.tolist(), (0.042 * height).tolist(), strict=True)])


def soup_can() -> Solid:
    """A can with rims and a recessed lid."""
    return revolve(
        [
            *[(0, 0.002), (0.029, 0.002), (0.030, 0), (0.033, 0), (0.0335, 0.003), (0.0325, 0.005)],
            *[(0.0325, 0.096), (0.0335, 0.098), (0.033, 0.101), (0.030, 0.101), (0.029, 0.098)],
            (0, 0.098),
        ]
    )


def tuna_can() -> Solid:
    """A flat can with rims."""
    return revolve(
        [
            *[(0, 0.001), (0.039, 0.001), (0.040, 0), (0.0425, 0), (0.043, 0.003), (0.042, 0.005)],
            *[(0.042, 0.037), (0.043, 0.039), (0.0425, 0.042), (0.040, 0.042), (0.039, 0.040)],
            (0, 0.040),
        ]
    )


def pill_jar() -> Solid:
    """A closed jar with a ribbed lid."""
    body = cylinder(0.030, 0.062) + cylinder(0.030, 0.006, 0.026).translate((0, 0, 0.062))
    lid = cylinder(0.029, 0.020).translate((0, 0, 0.064))
    rib = box(0.0025, 0.0025, 0.018).translate((0.029, 0, 0.065))
    return body + lid + around_z(rib, 32)


def door_wedge() -> Solid:
    """A wedge of wood."""
    outline = [(0.0, 0.0), (0.110, 0.0), (0.110, 0.008), (0.0, 0.050)]
    return plate(outline, 0.055).rotate((90, 0, 0))


def cheese_wedge() -> Solid:
    """An eighth of a round cheese with holes."""
    arc = [
        (0.090 * math.cos(t), 0.090 * math.sin(t))
        for t in np.linspace(0, math.pi / 3.2, 24).tolist()
    ]
    wedge = plate([(0.0, 0.0), *arc], 0.050)
    holes = [
        *[(0.050, 0.010, 0.050, 0.009), (0.065, 0.040, 0.052, 0.008), (0.035, 0.022, 0.052, 0.006)],
        *[(0.060, 0.0, 0.022, 0.008), (0.030, 0.0, 0.030, 0.006), (0.085, 0.040, 0.025, 0.010)],
    ]
    return wedge - union([Solid.sphere(r, 24).translate((x, y, z)) for x, y, z, r in holes])


def hexagonal_prism() -> Solid:
    """A six-sided block, like a large pencil stub."""
    return cylinder(0.032, 0.075, segments=6)


def octahedral_toy() -> Solid:
    """A truncated octahedron."""
    shape = Solid.cube((0.07, 0.07, 0.07), center=True)
    for x in (-1, 1):
        for y in (-1, 1):
            for z in (-1, 1):
                shape = shape.trim_by_plane((-x, -y, -z), -0.052 / math.sqrt(3) * 1.0)
    return shape


def ring_doughnut() -> Solid:
    """A thick ring."""
    return torus(0.030, 0.018, ROUND)


def puzzle_cube() -> Solid:
    """Twenty-seven rounded cubelets grown into one cube with grooves."""
    side, step = 0.0200, 0.0190
    cubelet = rounded_box(side, side, side, 0.0022)
    cubelets = [
        cubelet.translate((x * step, y * step, z * step))
        for x in (-1, 0, 1)
        for y in (-1, 0, 1)
        for z in (-1, 0, 1)
    ]
    return union(cubelets)


def house() -> Solid:
    """A toy house: gable roof, chimney, windows and door in relief."""
    outline = [(-0.035, 0.0), (0.035, 0.0), (0.035, 0.045), (0.0, 0.078), (-0.035, 0.045)]
    body = plate(outline, 0.070).rotate((90, 0, 0)).translate((0, 0.035, 0))
    chimney = box(0.014, 0.014, 0.035).translate((0.018, 0.012, 0.050))
    door = box(0.016, 0.008, 0.028).translate((0.0, -0.035, 0.0))
    window = box(0.014, 0.008, 0.014)
    windows = union([window.translate((x, -0.035, 0.022)) for x in (-0.022, 0.022)])
    return body + chimney - door - windows
