"""A curve under an affine map. Knows nothing of the curve inside but `Curve`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Bools, Evaluate, Floats
from voxdisplay.curves import arguments, checked_methods
from voxdisplay.curves.curve import Curve
from voxdisplay.expressions.interval import Interval, interval

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from voxdisplay.compute.array_types import Ints


_NEARLY_FLAT = 1e6  # condition of a matrix whose inverse is not exact enough


class Transformed(Curve):
    """matrix @ P(t) + offset, for a curve P.

    Parameters
    ----------
    curve : Curve
    matrix : float or (3, 3) array
        A positive factor, or any matrix: it may turn, stretch, shear, mirror and flatten.
    offset : (3,) array, optional
        In voxels.

    """

    def __init__(
        self, curve: Curve, matrix: ArrayLike = 1.0, offset: ArrayLike = (0, 0, 0)
    ) -> None:
        checked_methods.check_curve(curve)
        self.curve = curve
        self._scale: float | None = None
        self._columns: tuple[tuple[int, ...], ...] = ((0,), (1,), (2,))
        if isinstance(matrix, float | int) or np.ndim(matrix) == 0:
            self._scale = arguments.positive("matrix", matrix)  # type: ignore[arg-type]
            self.matrix = np.diag((self._scale,) * 3)
        else:
            self.matrix = arguments.array("matrix", matrix, (3, 3))
            # A coordinate without influence has none where it is infinite, either.
            self._columns = tuple(tuple(np.flatnonzero(row).tolist()) for row in self.matrix)
        self.offset = arguments.vector("offset", offset)
        self.t_range = curve.t_range
        self.closed = curve.closed
        self.breaks = curve.breaks
        self.point_count = curve.point_count
        if curve.family is not None:
            self.family = (type(curve).batch_evaluator, curve.family, self._columns)
        shown = self.matrix if self._scale is None else self._scale
        self._arguments = {"curve": curve, "matrix": shown, "offset": self.offset}

    @property
    def degree(self) -> int | None:
        """`Curve.degree` of the curve inside."""
        return self.curve.degree

    @property
    def min_length(self) -> float:
        """`Curve.min_length` of the curve inside, by the least that the map makes of a length."""
        inner = self.curve.min_length
        if self._scale is not None or not inner:
            return (self._scale or 0.0) * inner
        if np.linalg.cond(self.matrix) > _NEARLY_FLAT:
            return 0.0
        # In max norm, the inverse makes a length at most so many times as long.
        shrinks = np.abs(np.linalg.inv(self.matrix)).sum(axis=1).max()
        return float(inner / shrinks) * (1 - 1e-9)

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
        return self._combine(self.curve.position(t), self.offset)

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats | None:
        """Return dP/dt at t, (n,), as a (3, n) float64 array, or None when it is not known."""
        slope = self.curve.derivative(t)
        return None if slope is None else self._combine(slope, np.zeros(3))

    def _combine(self, points: Floats, offset: Floats) -> Floats:
        if self._scale is not None:
            return np.asarray(self._scale * points + offset[:, None])
        out = np.empty(points.shape)
        for i, columns in enumerate(self._columns):
            out[i] = sum((self.matrix[i, j] * points[j] for j in columns), start=0.0) + offset[i]
        return out

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, or None."""
        inner = self.curve.enclosure(t_lo, t_hi)
        if inner is None:
            return None
        axes = [Interval(inner[0][j], inner[1][j]) for j in range(3)]
        nothing = interval(np.zeros(t_lo.shape))
        low, high = np.empty(inner[0].shape), np.empty(inner[0].shape)
        for i, columns in enumerate(self._columns):
            parts = [float(self.matrix[i, j]) * axes[j] for j in columns]
            row = sum(parts[1:], start=parts[0] if parts else nothing) + float(self.offset[i])
            low[i], high[i] = row.lo, row.hi
        return low, high

    def unbounded(self, t_lo: Floats, t_hi: Floats) -> Bools | None:
        """`Curve.unbounded` of the curve inside."""
        return self.curve.unbounded(t_lo, t_hi)

    @staticmethod
    def batch_evaluator(curves: Sequence[Transformed]) -> Evaluate:
        """Return an evaluator of transformed curves of one family: see `Curve.batch_evaluator`."""
        inner = type(curves[0].curve).batch_evaluator([curve.curve for curve in curves])
        columns_of = curves[0]._columns  # noqa: SLF001 - those of all, by their family
        matrix = np.stack([curve.matrix for curve in curves], axis=-1)
        offset = np.stack([curve.offset for curve in curves], axis=-1)

        @np.errstate(all="ignore")
        def evaluate(which: Ints, t: Floats) -> Floats:
            points = inner(which, t)
            out = np.empty(points.shape)
            for i, columns in enumerate(columns_of):
                terms = (matrix[i, j][which] * points[j] for j in columns)
                out[i] = sum(terms, start=0.0) + offset[i][which]
            return out

        return evaluate
