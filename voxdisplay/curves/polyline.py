"""Straight lines: segments, polylines, ordered points. Knows formulas only."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Evaluate, Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.columns import are_moderate, from_columns
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.span_bounds import Box, enclose_spans
from voxdisplay.expressions.interval import interval

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from voxdisplay.compute.array_types import Ints


class Polyline(Curve):
    """Straight lines from point to point; vertex i is at t = i.

    Parameters
    ----------
    points : (n, 3) array
        The vertices, n >= 2.
    closed : bool, optional
        True adds the line back to the first point, if that is not the last one already.

    """

    degree = 1
    always_defined = True
    thread_safe = True
    _min_points = 2

    def __init__(self, points: ArrayLike, *, closed: bool | None = None) -> None:
        vertices = arguments.points("points", points, least=self._min_points)
        self._arguments = {"points": vertices, "closed": closed}
        if (closed and not np.array_equal(vertices[0], vertices[-1])) or len(vertices) == 1:
            vertices = np.concatenate((vertices, vertices[:1]))
        self.closed = closed
        self.t_range = (0.0, len(vertices) - 1.0)
        if len(vertices) > 2:
            self.breaks = np.arange(1.0, len(vertices) - 1)
        self.family = len(vertices)
        self._vertices = vertices.T.copy()

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        i = self._segment_index(t)
        f = t - i
        return self._vertices[:, i] * (1 - f) + self._vertices[:, i + 1] * f

    @staticmethod
    def batch_evaluator(curves: Sequence[Polyline]) -> Evaluate:
        """Return an evaluator of polylines of equally many points: see `Curve.batch_evaluator`."""
        vertices = np.concatenate([curve._vertices for curve in curves], axis=1)
        size = curves[0]._vertices.shape[1]

        @np.errstate(all="ignore")
        def evaluate(which: Ints, t: Floats) -> Floats:
            i = curves[0]._segment_index(t)
            f = t - i
            at = which * size + i
            return np.asarray(vertices[:, at] * (1 - f) + vertices[:, at + 1] * f)

        return evaluate

    def derivative(self, t: Floats) -> Floats:
        """Return dP/dt at t, (n,), as (3, n); at a vertex, of the line that begins there."""
        i = self._segment_index(t)
        return self._vertices[:, i + 1] - self._vertices[:, i]

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> Box:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, (n,)."""
        return enclose_spans(np.arange(self.t_range[1] + 1), t_lo, t_hi, self._segment_box)

    def _segment_box(self, i: Ints, t_lo: Floats, t_hi: Floats) -> Box:
        ends = []
        for t in (t_lo, t_hi):
            f = interval(t) - i
            ends.append(self._vertices[:, i] * (1 - f) + self._vertices[:, i + 1] * f)
        return np.minimum(ends[0].lo, ends[1].lo), np.maximum(ends[0].hi, ends[1].hi)

    def _segment_index(self, t: Floats) -> NDArray[np.intp]:
        return np.clip(np.floor(t), 0, self._vertices.shape[1] - 2).astype(np.intp)


class Points(Polyline):
    """Ordered points, joined by straight lines; a single point is a curve that stays there.

    Parameters
    ----------
    points : (n, 3) array
        n >= 1.
    closed : bool, optional
        As of `Polyline`.

    """

    _min_points = 1

    def __init__(self, points: ArrayLike, *, closed: bool | None = None) -> None:
        super().__init__(points, closed=closed)
        self.point_count = len(np.asarray(points))


class Segment(Polyline):
    """The straight line from start (t = 0) to end (t = 1).

    Parameters
    ----------
    start, end : (3,) array
    closed : bool, optional

    """

    family = 2
    t_range = (0.0, 1.0)

    def __init__(self, start: ArrayLike, end: ArrayLike, *, closed: bool | None = None) -> None:
        begin, stop = arguments.vector("start", start), arguments.vector("end", end)
        self.closed = closed
        self._vertices = np.stack((begin, stop), axis=1)

    @cached_property
    def _arguments(self) -> Mapping[str, object]:  # type: ignore[override]  # made when it is shown
        start, end = self._vertices.T
        return {"start": start, "end": end, "closed": self.closed}

    @classmethod
    def many(
        cls, start: Floats, end: Floats, closed: Sequence[bool | None]
    ) -> list[Segment | None]:
        """Return many segments, which cost less than one by one; None where an argument is wrong.

        Parameters
        ----------
        start, end : (n, 3) float64 array
        closed : sequence of bool or None

        """
        vertices = np.stack((start, end), axis=2)
        return from_columns(cls, are_moderate(vertices), _vertices=vertices, closed=closed)
