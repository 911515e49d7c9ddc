"""Things with a handle: tools, cutlery, brushes."""

import math

import numpy as np

from pipeline.geometry.parametric.solids import (
    Outline,
    Solid,
    around_z,
    box,
    circle_points,
    cylinder,
    plate,
    revolve,
    rod,
    rounded_box,
    sweep,
    torus,
    union,
)


def hammer() -> Solid:
    """A claw-less hammer with a thick handle."""
    handle = rod((-0.085, 0, 0), (0.040, 0, 0), 0.0125)
    head = rounded_box(0.030, 0.090, 0.032, 0.005).translate((0.052, 0, -0.016))
    face = cylinder(0.0185, 0.016).rotate((90, 0, 0)).translate((0.052, -0.040, 0))
    return handle + head + face


def mallet() -> Solid:
    """A wooden mallet."""
    handle = cylinder(0.012, 0.110, 0.010)
    head = cylinder(0.030, 0.085).rotate((90, 0, 0)).translate((0, 0.0425, 0.120))
    return handle + head


def screwdriver() -> Solid:
    """A fluted handle with a steel blade."""
    handle = revolve(
        [(0, 0), (0.012, 0.0), (0.016, 0.005), (0.016, 0.060), (0.011, 0.072), (0.013, 0.082)]
        + [(0.010, 0.088), (0, 0.088)]
    )
    flute = cylinder(0.0045, 0.060, segments=16).translate((0.0185, 0, -0.002))
    blade = cylinder(0.0042, 0.055, segments=24).translate((0, 0, 0.085))
    tip = box(0.010, 0.0020, 0.012).translate((0, 0, 0.138))
    return (handle - around_z(flute, 6)) + blade + tip


def open_end_wrench() -> Solid:
    """A flat wrench, open at one end and a ring at the other."""
    shaft = box(0.120, 0.016, 0.009)
    jaw = cylinder(0.021, 0.011).translate((0.066, 0, -0.001))
    slot = box(0.036, 0.018, 0.05).rotate((0, 0, 15)).translate((0.081, 0.004, -0.02))
    ring = cylinder(0.018, 0.011).translate((-0.066, 0, -0.001))
    hole = cylinder(0.0105, 0.05, segments=12).translate((-0.066, 0, -0.02))
    return shaft + jaw + ring - slot - hole


def spatula() -> Solid:
    """A slotted turner."""
    blade = rounded_box(0.080, 0.066, 0.0050, 0.0024).translate((0.055, 0, 0))
    slot = rounded_box(0.052, 0.006, 0.030, 0.0025).translate((0.058, 0, -0.015))
    slots = union([slot.translate((0, y, 0)) for y in (-0.020, 0.0, 0.020)])
    path = np.array(
        [[0.020, 0, 0.0025], [-0.005, 0, 0.010], [-0.030, 0, 0.022], [-0.110, 0, 0.034]]
    )
    return (blade - slots) + sweep(path, 0.0060, 20)


def wooden_spoon() -> Solid:
    """A spoon with a shallow bowl and a round handle."""
    head = Solid.sphere(0.028, 48).scale((1.25, 0.9, 0.42))
    bowl = Solid.sphere(0.026, 48).scale((1.15, 0.82, 0.36)).translate((0, 0, 0.009))
    return (head - bowl) + rod((0.028, 0, 0), (0.120, 0, 0.004), 0.0060)


def ladle() -> Solid:
    """A hemispherical ladle with a hooked handle."""
    cup = (Solid.sphere(0.034, 56) - Solid.sphere(0.0305, 56)).trim_by_plane((0, 0, -1), 0.0)
    path = np.array(
        [[0.0322, 0, -0.004], [0.036, 0, 0.030], [0.036, 0, 0.095], [0.028, 0, 0.108]]
        + [[0.016, 0, 0.108], [0.011, 0, 0.098]]
    )
    return cup + sweep(path, 0.0038, 16)


def dinner_fork() -> Solid:
    """Four tines, a neck and a broad handle, sturdy as in plastic."""
    handle = rounded_box(0.085, 0.017, 0.0065, 0.003).translate((-0.075, 0, 0))
    neck = rod((-0.042, 0, 0.0033), (0.008, 0, 0.0033), 0.0042)
    root = rounded_box(0.022, 0.030, 0.0060, 0.0026).translate((0.014, 0, 0))
    tines = [rod((0.018, y, 0.003), (0.062, y, 0.005), 0.0026, 16) for y in (-12, -4, 4, 12)]
    tines = [
        rod((0.018, y / 1e3, 0.003), (0.062, y / 1e3, 0.005), 0.0026, 16) for y in (-12, -4, 4, 12)
    ]
    return union([handle, neck, root, *tines])


def comb() -> Solid:
    """A comb with a strong back."""
    back = rounded_box(0.120, 0.014, 0.0070, 0.003).translate((0, 0.016, 0))
    places = np.linspace(-0.056, 0.056, 24).tolist()
    tooth = box(0.0026, 0.030, 0.0050).translate((0, 0, 0.001))
    return back + union([tooth.translate((x, 0.0, 0)) for x in places])


def paint_brush() -> Solid:
    """A flat brush with a shaped handle."""
    bristles = box(0.050, 0.014, 0.036).translate((0, 0, 0.062))
    ferrule = box(0.053, 0.017, 0.026).translate((0, 0, 0.040))
    outline = [(-0.0260, 0.042), (0.0260, 0.042), (0.022, 0.026), (0.011, 0.010), (0.010, -0.030)]
    outline += [(0.013, -0.052), (0.008, -0.064), (-0.008, -0.064), (-0.013, -0.052)]
    outline += [(-0.010, -0.030), (-0.011, 0.010), (-0.022, 0.026)]
    handle = plate(outline, 0.014).rotate((90, 0, 0)).translate((0, 0.007, 0))
    hole = cylinder(0.0035, 0.1, segments=20).rotate((90, 0, 0)).translate((0, 0.05, -0.052))
    return union([bristles, ferrule, handle]) - hole


def rolling_pin() -> Solid:
    """A roller with turned handles."""
    half = [(0.0, 0.0), (0.021, 0.0), (0.021, 0.050), (0.019, 0.053), (0.009, 0.055)]
    half += [(0.0085, 0.062), (0.0120, 0.074), (0.0105, 0.088), (0.0, 0.092)]
    side = revolve(half, 48)
    return side + side.mirror((0, 0, 1))


def dumbbell() -> Solid:
    """Two hexagonal heads on a grip."""
    head = cylinder(0.032, 0.036, segments=6)
    grip = cylinder(0.0125, 0.080)
    return union([head, grip.translate((0, 0, 0.026)), head.translate((0, 0, 0.096))])


def key() -> Solid:
    """An oversized door key."""
    bow = torus(0.020, 0.0062, 48).scale((1.2, 1.0, 1.0))
    shank = rod((0.022, 0, 0), (0.098, 0, 0), 0.0058)
    bits = [box(0.010, 0.024, 0.0065).translate((x, -0.014, -0.00325)) for x in (0.074, 0.091)]
    collar = torus(0.0060, 0.0035, 32).rotate((0, 90, 0)).translate((0.036, 0, 0))
    return union([bow, shank, collar, *bits])


def magnifier() -> Solid:
    """A reading glass: a solid lens in a ring, with a handle."""
    ring = torus(0.036, 0.0055, 64)
    lens = Solid.sphere(0.110, 128).translate((0, 0, -0.1035)) ^ cylinder(0.036, 0.02).translate(
        (0, 0, -0.003)
    )
    return ring + lens + rod((0.040, 0, 0), (0.115, 0, 0), 0.0085)


def flashlight() -> Solid:
    """A torch with a ribbed body and a flared head."""
    body = [(0.0, 0.0), (0.0130, 0.0), (0.0145, 0.002)]
    for k in range(9):
        z = 0.012 + 0.008 * k
        body += [(0.0145, z), (0.0130, z + 0.001), (0.0130, z + 0.003), (0.0145, z + 0.004)]
    body += [(0.0145, 0.094), (0.023, 0.110), (0.024, 0.130), (0.021, 0.130), (0.019, 0.124)]
    return revolve([*body, (0.0, 0.124)], 48)


def light_bulb() -> Solid:
    """A bulb with a screw base."""
    base = [(0.0, 0.0), (0.006, 0.0), (0.0125, 0.006)]
    for k in range(4):
        z = 0.008 + 0.005 * k
        base += [(0.0125, z), (0.0138, z + 0.0015), (0.0125, z + 0.003)]
    angle = np.linspace(-1.05, math.pi / 2, 36)
    glass = zip(
        (0.030 * np.cos(angle)).tolist(), (0.060 + 0.030 * np.sin(angle)).tolist(), strict=True
    )
    top: Outline = [(max(r, 0.0), z) for r, z in glass]
    return revolve([*base, (0.0125, 0.028), *top], 56)


def scissors_handle() -> Solid:
    """Closed scissors with two finger rings."""
    blade = plate([(0.0, -0.008), (0.072, -0.001), (0.072, 0.001), (0.0, 0.008)], 0.004)
    rings = [
        torus(0.0145, 0.0042, 40).scale((1.3, 1.0, 1.0)).translate((-0.058, y, 0.003))
        for y in (-0.019, 0.019)
    ]
    arms = [rod((0.004, 0, 0.003), (-0.042, y, 0.003), 0.0042, 20) for y in (-0.012, 0.012)]
    pivot = cylinder(0.008, 0.009, segments=32).translate((0.002, 0, -0.001))
    return union([blade, pivot, *rings, *arms])


def whisk() -> Solid:
    """A balloon whisk of eight wires."""
    handle = rod((0, 0, -0.075), (0, 0, -0.002), 0.0085)
    angle = np.linspace(0, math.pi, 36)
    wires = []
    for k in range(4):
        turn = math.pi * k / 4
        reach = 0.006 + 0.026 * np.sin(angle) ** 0.9
        side = np.where(angle <= math.pi / 2, 1.0, -1.0) * reach * np.abs(np.cos(angle)) ** 0.45
        path = np.column_stack(
            [side * math.cos(turn), side * math.sin(turn), -0.006 + 0.085 * np.sin(angle)]
        )
        wires.append(sweep(path, 0.0017, 10))
    return union([handle, *wires])


def coat_hook() -> Solid:
    """A wall hook: a plate with two bent arms."""
    back = rounded_box(0.036, 0.010, 0.090, 0.003)
    arms = [
        np.array(
            [[0, 0.002, z], [0, 0.028, z - 0.006], [0, 0.044, z + 0.004], [0, 0.046, z + 0.022]]
        )
        for z in (0.030, 0.062)
    ]
    return union([back, *[sweep(arm, 0.0062, 20) for arm in arms]])


def toy_airplane() -> Solid:
    """A plane with wings, tail and propeller hub."""
    fuselage = rod((-0.050, 0, 0), (0.045, 0, 0), 0.0150)
    wing = rounded_box(0.032, 0.150, 0.009, 0.004).translate((0.008, 0, -0.004))
    tail = rounded_box(0.020, 0.056, 0.007, 0.003).translate((-0.052, 0, 0.000))
    fin = rounded_box(0.022, 0.007, 0.030, 0.003).translate((-0.052, 0, 0.004))
    hub = cylinder(0.006, 0.016, 0.003, 24).rotate((0, 90, 0)).translate((0.058, 0, 0))
    return union([fuselage, wing, tail, fin, hub])


def hand_bell() -> Solid:
    """A bell with a solid body and a turned handle."""
    profile = [(0.0, 0.0), (0.038, 0.0), (0.037, 0.006), (0.029, 0.020), (0.025, 0.045)]
    profile += [(0.017, 0.057), (0.007, 0.062), (0.006, 0.070), (0.011, 0.082), (0.008, 0.108)]
    return revolve([*profile, (0.0, 0.112)], 56) - Solid.sphere(0.027, 48).translate((0, 0, -0.004))


def starfish() -> Solid:
    """A five-armed toy star, thick in the middle."""
    tips = circle_points(5, 0.055)
    arms = [
        Solid.batch_hull(
            [
                Solid.sphere(0.0185, 32).scale((1, 1, 0.7)),
                Solid.sphere(0.0070, 24).translate((x, y, 0)),
            ]
        )
        for x, y in tips.tolist()
    ]
    return union(arms)
