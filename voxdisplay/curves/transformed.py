"""A curve, scaled and moved."""

from __future__ import annotations

from typing import TYPE_CHECKING

from voxdisplay.curves import checks
from voxdisplay.curves.curve import Curve, Floats

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Transformed(Curve):
    """scale * P(t) + offset, for a curve P.

    Parameters
    ----------
    curve : Curve
    scale : float
    offset : (3,) array, optional
        In voxels.

    """

    def __init__(self, curve: Curve, scale: float = 1.0, offset: ArrayLike = (0, 0, 0)) -> None:
        self.curve = curve
        self.scale = checks.positive("scale", scale)
        self.offset = checks.vector("offset", offset)
        self.t_range = curve.t_range
        self.closed = curve.closed
        self.breaks = curve.breaks

    def position(self, t: Floats) -> Floats:
        """Give the points at t, (n,), as a (3, n) float64 array."""
        return self.scale * self.curve.position(t) + self.offset[:, None]

    def derivative(self, t: Floats) -> Floats | None:
        """Give dP/dt at t, (n,), as a (3, n) float64 array, or None when it is not known."""
        slope = self.curve.derivative(t)
        return None if slope is None else self.scale * slope
