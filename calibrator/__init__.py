"""Calibrate the particle parameters of a discrete element model with YADE."""

__version__ = "0.1.0"
