"""What the network's input holds, and the lengths that it is made with; see ``canonical``.

Training makes the input with tensors (``canonical``), control with compiled code
(``control_input``): both take these values, and control never imports PyTorch for them.
"""

from pipeline.config.grasps import CELL_SIDE

# What the input's channels hold, in order; pairs that turn with the cloud stand first.
Channels = tuple[str, ...]
CHANNELS: Channels = (
    *("x", "y", "x_in_cell", "y_in_cell"),
    *("z", "z_fine", "radius", "seen", "pad_gap", "pad_contact"),
)
# Networks of version 0.1.0 were trained on these.
CHANNELS_0_1: Channels = ("x", "y", "z", "z_fine", "radius", "seen", "gap", "contact")
KNOWN_CHANNELS = (CHANNELS, CHANNELS_0_1)

# H / r_G of Table I: the pad reaches no further down than its altitude, so what lies deeper is
# deep and nothing more.
Z_LIMIT = 1.2
# A seal is lost to steps of a few millimetres, Delta_d of Table I: the finer channel spreads
# +-0.16 r_G = +-4 mm over [-1, 1] so that the first convolution need not.
Z_FINE_LIMIT = 0.16
# The pad ends at r_G. What a cell beyond it holds, by its measured place, holds no pad up.
PAD_RADIUS = 1.0
# A cell this near the draped pad counts as in contact: half a millimetre, what noise leaves of the
# label's 0.1 mm.
CONTACT_GAP = 0.02
# The reference height is taken over the middle third of the grid.
REFERENCE_PART = 3

SYMMETRIES = 8  # of a square: four turns, mirrored or not

# H / r_G of Table I.
REACH = 1.2
SWEEPS = round(REACH / CELL_SIDE)
# Lower than any height that matters, finite so that sums of it stay comparable.
NOTHING = -1e3
