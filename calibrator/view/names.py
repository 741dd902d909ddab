"""How many frames an animation may have; nothing heavy, as the command line needs them."""

FRAMES = 40
"""Frames of an animation unless another number is asked for."""

FEWEST, MOST = 4, 200
"""Frames that may be asked for."""
