"""A curve, scaled and moved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Evaluate, Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.curve import Curve
from voxdisplay.expressions.interval import Interval

if TYPE_CHECKING:
    from collections.abc import Sequence

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
        self.scale = arguments.positive("scale", scale)
        self.offset = arguments.vector("offset", offset)
        self.t_range = curve.t_range
        self.closed = curve.closed
        self.breaks = curve.breaks
        if curve.family is not None:
            self.family = (type(curve).together, curve.family)

    @property
    def degree(self) -> int | None:
        """That of the curve inside, see `Curve.degree`."""
        return self.curve.degree

    @property
    def reentrant(self) -> bool:
        """Whether the curve inside is, see `Curve.reentrant`."""
        return self.curve.reentrant

    def position(self, t: Floats) -> Floats:
        """Give the points at t, (n,), as a (3, n) float64 array."""
        return self.scale * self.curve.position(t) + self.offset[:, None]

    def derivative(self, t: Floats) -> Floats | None:
        """Give dP/dt at t, (n,), as a (3, n) float64 array, or None when it is not known."""
        slope = self.curve.derivative(t)
        return None if slope is None else self.scale * slope

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:
        """Give boxes that hold the curve from t_lo to t_hi, (n,): (3, n), (3, n), or None."""
        inner = self.curve.enclosure(t_lo, t_hi)
        if inner is None:
            return None
        outer = self.scale * Interval(*inner) + self.offset[:, None]
        return outer.lo, outer.hi

    @staticmethod
    def together(curves: Sequence[Transformed]) -> Evaluate:
        """Prepare to evaluate transformed curves of one family at once, see `Curve.together`."""
        inner = type(curves[0].curve).together([curve.curve for curve in curves])
        scale = np.array([curve.scale for curve in curves])
        offset = np.stack([curve.offset for curve in curves], axis=1)
        return lambda which, t: scale[which] * inner(which, t) + offset[:, which]
