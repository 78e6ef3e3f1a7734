"""A curve, scaled and moved. Knows nothing of the curve inside but `Curve`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Bools, Evaluate, Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.curve import Curve
from voxdisplay.expressions.interval import Interval

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from voxdisplay.compute.array_types import Ints


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
        self.point_count = curve.point_count
        if curve.family is not None:
            self.family = (type(curve).batch_evaluator, curve.family)
        self._arguments = {"curve": curve, "scale": self.scale, "offset": self.offset}

    @property
    def degree(self) -> int | None:
        """`Curve.degree` of the curve inside."""
        return self.curve.degree

    @property
    def min_length(self) -> float:
        """`Curve.min_length` of the curve inside, scaled."""
        return self.scale * self.curve.min_length

    @property
    def always_defined(self) -> bool:
        """`Curve.always_defined` of the curve inside."""
        return self.curve.always_defined

    @property
    def thread_safe(self) -> bool:
        """`Curve.thread_safe` of the curve inside."""
        return self.curve.thread_safe

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        return self.scale * self.curve.position(t) + self.offset[:, None]

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats | None:
        """Return dP/dt at t, (n,), as a (3, n) float64 array, or None when it is not known."""
        slope = self.curve.derivative(t)
        return None if slope is None else self.scale * slope

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, or None."""
        inner = self.curve.enclosure(t_lo, t_hi)
        if inner is None:
            return None
        outer = self.scale * Interval(*inner) + self.offset[:, None]
        return outer.lo, outer.hi

    def unbounded(self, t_lo: Floats, t_hi: Floats) -> Bools | None:
        """`Curve.unbounded` of the curve inside."""
        return self.curve.unbounded(t_lo, t_hi)

    @staticmethod
    def batch_evaluator(curves: Sequence[Transformed]) -> Evaluate:
        """Return an evaluator of transformed curves of one family: see `Curve.batch_evaluator`."""
        inner = type(curves[0].curve).batch_evaluator([curve.curve for curve in curves])
        scale = np.array([curve.scale for curve in curves])
        offset = np.stack([curve.offset for curve in curves], axis=1)

        @np.errstate(all="ignore")
        def evaluate(which: Ints, t: Floats) -> Floats:
            return np.asarray(scale[which] * inner(which, t) + offset[:, which])

        return evaluate
