"""Frames: pictures of a display, drawn on and encoded."""

from voxdisplay.frame.drawing import Drawing
from voxdisplay.frame.frame import FITS, Drawable, Fit, Frame

__all__ = ["FITS", "Drawable", "Drawing", "Fit", "Frame"]
