"""Open structures: racks, crates, frames, lattices; Complex by their many surfaces."""

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
    rod,
    rounded_box,
    sweep,
    torus,
    union,
)


def bottle_crate() -> Solid:
    """A crate of three by two cells with grip holes."""
    crate = rounded_box(0.130, 0.090, 0.075, 0.005).trim_by_plane((0, 0, -1), -0.066)
    cell = rounded_box(0.0375, 0.0375, 0.100, 0.005).translate((0, 0, 0.005))
    cells = [cell.translate((x * 0.041, y * 0.041, 0)) for x in (-1, 0, 1) for y in (-0.5, 0.5)]
    grip = rounded_box(0.300, 0.030, 0.013, 0.005).translate((0, 0, 0.044))
    return crate - union(cells) - grip


def toast_rack() -> Solid:
    """A tray with six arches."""
    tray = rounded_box(0.120, 0.062, 0.009, 0.004)
    angle = np.linspace(0, math.pi, 28)
    arch = np.column_stack([np.zeros(28), 0.025 * np.cos(angle), 0.005 + 0.056 * np.sin(angle)])
    places = np.linspace(-0.050, 0.050, 6).tolist()
    return tray + union([sweep(arch, 0.0030, 14).translate((x, 0, 0)) for x in places])


def wire_cube() -> Solid:
    """The edges of a cube with balls on its corners."""
    reach = 0.036
    corners = [(x, y, z) for x in (-reach, reach) for y in (-reach, reach) for z in (-reach, reach)]
    rods = [
        rod(a, b, 0.0048)
        for i, a in enumerate(corners)
        for b in corners[i + 1 :]
        if sum(p != q for p, q in zip(a, b, strict=True)) == 1
    ]
    return union([*rods, *[Solid.sphere(0.0100, 24).translate(corner) for corner in corners]])


def lattice_block() -> Solid:
    """A cube pierced by a grid of square channels in all directions."""
    block = Solid.cube((0.075, 0.075, 0.075), center=True)
    channel = Solid.cube((0.2, 0.0165, 0.0165), center=True)
    places = (-0.0225, 0.0, 0.0225)
    channels = union([channel.translate((0, y, z)) for y in places for z in places])
    return block - channels - channels.rotate((0, 0, 90)) - channels.rotate((0, 90, 0))


def honeycomb_panel() -> Solid:
    """A panel of hexagonal cells on a thin back."""
    panel = rounded_box(0.120, 0.090, 0.018, 0.003)
    hexagon = cylinder(0.0105, 0.1, segments=6).translate((0, 0, 0.0045))
    pitch = 0.0208
    cells = [
        hexagon.translate((x * pitch * math.sqrt(3) / 2, (y + 0.5 * (x % 2)) * pitch - 0.005, 0))
        for x in range(-2, 3)
        for y in range(-1, 2)
    ]
    return panel - union(cells)


def pen_holder() -> Solid:
    """A cup with a wall of round windows."""
    cup = cylinder(0.037, 0.095) - cylinder(0.0335, 0.1).translate((0, 0, 0.005))
    window = cylinder(0.0078, 0.06, segments=24).rotate((0, 90, 0))
    rows = [
        window.rotate((0, 0, 36 * k + 18 * row)).translate((0, 0, 0.020 + 0.0185 * row))
        for k in range(10)
        for row in range(4)
    ]
    return cup - union(rows)


def fruit_basket() -> Solid:
    """A bowl of ribs between two rings on a solid base."""
    base = cylinder(0.032, 0.006)
    rim = torus(0.060, 0.0045, 64).translate((0, 0, 0.055))
    middle = torus(0.0515, 0.0030, 64).translate((0, 0, 0.030))
    angle = np.linspace(0, math.pi / 2, 14)
    rib = np.column_stack(
        [0.028 + 0.032 * np.sin(angle), np.zeros(14), 0.004 + 0.051 * (1 - np.cos(angle))]
    )
    return union([base, rim, middle, around_z(sweep(rib, 0.0028, 12), 16)])


def stool() -> Solid:
    """A toy stool: a round seat, four legs and stretchers."""
    seat = cylinder(0.038, 0.010).translate((0, 0, 0.080))
    top, foot = circle_points(4, 0.026), circle_points(4, 0.038)
    legs = [
        rod((a[0], a[1], 0.084), (b[0], b[1], 0.004), 0.0046)
        for a, b in zip(top.tolist(), foot.tolist(), strict=True)
    ]
    mid = circle_points(4, 0.0335).tolist()
    bars = [rod((*mid[k], 0.034), (*mid[(k + 1) % 4], 0.034), 0.0034, 16) for k in range(4)]
    return union([seat, *legs, *bars])


def chair() -> Solid:
    """A toy chair with a slatted back."""
    seat = rounded_box(0.056, 0.056, 0.007, 0.003).translate((0, 0, 0.045))
    legs = [
        box(0.0075, 0.0075, 0.047).translate((x, y, 0))
        for x in (-0.022, 0.022)
        for y in (-0.022, 0.022)
    ]
    posts = [box(0.0075, 0.0075, 0.060).translate((-0.022, y, 0.050)) for y in (-0.022, 0.022)]
    slats = [box(0.0055, 0.046, 0.010).translate((-0.022, 0, z)) for z in (0.064, 0.081, 0.099)]
    return union([seat, *legs, *posts, *slats])


def shelf() -> Solid:
    """A small shelf of four boards between two sides."""
    sides = [box(0.045, 0.005, 0.120).translate((0, y, 0)) for y in (-0.040, 0.040)]
    boards = [box(0.045, 0.084, 0.005).translate((0, 0, z)) for z in (0.004, 0.040, 0.076, 0.112)]
    return union([*sides, *boards])


def pallet() -> Solid:
    """A model pallet: slats on three runners."""
    runners = [box(0.120, 0.012, 0.011).translate((0, y, 0.005)) for y in (-0.039, 0, 0.039)]
    top = [
        box(0.016, 0.090, 0.0055).translate((x, 0, 0.015)) for x in np.linspace(-0.052, 0.052, 6)
    ]
    below = [box(0.016, 0.090, 0.0055).translate((x, 0, 0)) for x in (-0.052, 0, 0.052)]
    return union([*runners, *top, *below])


def spool() -> Solid:
    """A thread spool with thin, wide flanges."""
    profile = [(0.010, 0.0), (0.040, 0.0), (0.040, 0.004), (0.013, 0.0055), (0.013, 0.0645)]
    profile += [(0.040, 0.066), (0.040, 0.070), (0.010, 0.070)]
    return revolve(profile)


def snowflake() -> Solid:
    """A six-armed flat ornament."""
    arm = box(0.058, 0.0070, 0.008).translate((0.029, 0, 0))
    twigs = [
        box(0.020, 0.0055, 0.008).translate((0.010, 0, 0)).rotate((0, 0, turn)).translate((x, 0, 0))
        for x in (0.024, 0.040)
        for turn in (-60, 60)
    ]
    return around_z(union([arm, *twigs]), 6) + cylinder(0.012, 0.008, segments=6)


def caltrop_toy() -> Solid:
    """A jack: six arms with balls, along three axes."""
    arms, balls = [], []
    for axis in np.eye(3):
        tip = tuple((0.032 * axis).tolist())
        tail = tuple((-0.032 * axis).tolist())
        arms.append(rod((tail[0], tail[1], tail[2]), (tip[0], tip[1], tip[2]), 0.0052))
        balls += [Solid.sphere(0.0105, 32).translate(end) for end in (tip, tail)]
    return union([*arms, *balls])


def book_end() -> Solid:
    """A thin bent sheet with a window."""
    foot = box(0.085, 0.080, 0.004)
    wall = box(0.004, 0.080, 0.100).translate((-0.0405, 0, 0))
    window = plate([(-0.024, 0.022), (0.024, 0.022), (0.0, 0.078)], 0.05)
    window = window.rotate((90, 0, 90)).translate((-0.06, 0, 0))
    return union([foot, wall]) - window


def soap_dish() -> Solid:
    """A slotted dish on four feet."""
    dish = rounded_box(0.115, 0.080, 0.022, 0.007).trim_by_plane((0, 0, -1), -0.017)
    hollow = rounded_box(0.107, 0.072, 0.040, 0.005).translate((0, 0, 0.005))
    slot = rounded_box(0.056, 0.006, 0.05, 0.0025).translate((0, 0, -0.02))
    slots = union([slot.translate((0, y, 0)) for y in (-0.024, -0.012, 0.0, 0.012, 0.024)])
    feet = [
        cylinder(0.006, 0.010, segments=24).translate((x, y, -0.008))
        for x in (-0.042, 0.042)
        for y in (-0.026, 0.026)
    ]
    return union([dish - hollow - slots, *feet])
