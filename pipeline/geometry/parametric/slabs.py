"""Flat and long things of everyday use, mostly Typical."""

from pipeline.geometry.parametric.solids import Solid, box, cylinder, revolve, rounded_box, union


def book() -> Solid:
    """A hardback: two covers around a block of pages."""
    pages = box(0.136, 0.196, 0.020).translate((0.002, 0, 0.002))
    covers = union([box(0.14, 0.20, 0.002).translate((0, 0, z)) for z in (0.0, 0.022)])
    return union([pages, covers, box(0.002, 0.20, 0.024).translate((-0.069, 0, 0))])


def telephone() -> Solid:
    """A flat telephone with rounded edges."""
    return rounded_box(0.150, 0.072, 0.012, 0.004)


def tile() -> Solid:
    """A square tile."""
    return box(0.10, 0.10, 0.010)


def chocolate_bar() -> Solid:
    """A bar of twelve pieces on a plate."""
    pieces = [
        rounded_box(0.030, 0.022, 0.010, 0.002).translate((x, y, 0.002))
        for x in (-0.048, -0.016, 0.016, 0.048)
        for y in (-0.024, 0.0, 0.024)
    ]
    return union([box(0.13, 0.075, 0.006), *pieces])


def remote_control() -> Solid:
    """A long handset with a field of buttons."""
    buttons = [
        cylinder(0.004, 0.004).translate((x, y, 0.017))
        for x in (-0.05, -0.03, -0.01, 0.01)
        for y in (-0.012, 0.0, 0.012)
    ]
    return union([rounded_box(0.17, 0.045, 0.018, 0.005), *buttons])


def marker_pen() -> Solid:
    """A thick pen with a cap."""
    profile = [(0.0, 0.0), (0.009, 0.0), (0.009, 0.09), (0.0105, 0.09), (0.0105, 0.14), (0.0, 0.14)]
    return revolve(profile).rotate((0, 90, 0))


def cutting_board() -> Solid:
    """A board with a hole to hang it by."""
    return box(0.22, 0.14, 0.018) - cylinder(0.012, 0.05).translate((0.09, 0, -0.01))


def brick() -> Solid:
    """A brick with three holes."""
    holes = union([cylinder(0.015, 0.1).translate((x, 0, -0.02)) for x in (-0.055, 0.0, 0.055)])
    return box(0.215, 0.10, 0.045) - holes


def domino() -> Solid:
    """A domino with two pips."""
    pips = union([cylinder(0.004, 0.01).translate((x, 0, 0.006)) for x in (-0.012, 0.012)])
    return rounded_box(0.048, 0.024, 0.007, 0.0015) - pips


def puck() -> Solid:
    """A flat disk with a chamfer."""
    return revolve([(0, 0), (0.036, 0), (0.038, 0.002), (0.038, 0.012), (0.036, 0.014), (0, 0.014)])


def plank() -> Solid:
    """A short plank."""
    return box(0.20, 0.05, 0.020)


def stapler() -> Solid:
    """A base, an arm and a hinge."""
    arm = rounded_box(0.13, 0.024, 0.018, 0.004).translate((0, 0, 0.016))
    return union([box(0.14, 0.028, 0.008), arm, box(0.02, 0.022, 0.03).translate((-0.055, 0, 0))])


def tape_roll() -> Solid:
    """A wide roll of tape."""
    return cylinder(0.055, 0.048) - cylinder(0.030, 0.1).translate((0, 0, -0.02))


def clothes_brush() -> Solid:
    """A handle on a slab of bristles."""
    return union(
        [rounded_box(0.17, 0.035, 0.014, 0.005).translate((0, 0, 0.018)), box(0.09, 0.032, 0.02)]
    )
