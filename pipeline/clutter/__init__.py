"""Clutter scenes of the nine levels: placement, settling, measured gaps."""
