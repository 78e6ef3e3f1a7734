"""Polylines that follow curves within a tolerance. Must not know what is drawn about them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.curves import checked_methods
from voxdisplay.curves.curve import Curve
from voxdisplay.errors import BodyError

TOLERANCE = 0.01
"""Greatest distance of the middle of a part from the curve, in voxels."""
MAX_POINTS = 1 << 17
_FIRST = 64
_LONGEST = 4.0  # voxels
_HALVINGS = 40


class Samples(NamedTuple):
    """Points along a curve.

    Attributes
    ----------
    t : (n,) float64 array
        Ascending.
    points : (n, 3) float64 array
    s : (n,) float64 array
        Share of the length up to each point, 0 to 1, without jumps.
    first : (m,) int64 array
        Points that are joined with the next; the curve does not jump between them.

    """

    t: Floats
    points: Floats
    s: Floats
    first: Ints

    def runs(self) -> Iterator[Floats]:
        """Yield polylines of points that are joined, (k, 3)."""
        for part in np.split(self.first, np.flatnonzero(np.diff(self.first) != 1) + 1):
            if part.size:
                yield self.points[part[0] : part[-1] + 2]


def sample_curve(curve: Curve, low: Floats, high: Floats) -> Samples:
    """Return a polyline within `TOLERANCE` of what of a curve is in a box.

    Parameters
    ----------
    curve : Curve
    low, high : (3,) float64 array
        Corners of the box; parts outside are left out.

    Raises
    ------
    BodyError
        If the curve has no point somewhere, or more than `MAX_POINTS` are needed.

    """
    checked_methods.check_curve(curve)
    a, b = curve.t_range
    t = np.unique(np.concatenate((np.linspace(a, b, _FIRST + 1), curve.breaks)))
    points = _points(curve, t)
    open_ = np.ones(t.size - 1, dtype=bool)
    with np.errstate(all="ignore"):
        for level in range(_HALVINGS):
            which = np.flatnonzero(open_)
            begin, end = points[which], points[which + 1]
            at = t[which] + (t[which + 1] - t[which]) / 2
            middle = _points(curve, at)
            length = np.linalg.norm(end - begin, axis=1)
            off = np.linalg.norm(middle - (begin + end) / 2, axis=1)
            reach = (length + 2 * off + 1)[:, None]
            outside = (np.minimum(begin, end) > high + reach) | (
                np.maximum(begin, end) < low - reach
            )
            halved = (off > TOLERANCE) | (length > _LONGEST) | (level < 3)
            halved &= ~outside.any(axis=1) & (at > t[which]) & (at < t[which + 1])
            open_[which] = halved
            if not halved.any():
                break
            if t.size + int(halved.sum()) > MAX_POINTS:
                raise BodyError(
                    f"{curve} is too long or too rough: more than {MAX_POINTS} points are needed",
                    hint="narrow its range, or scale it down",
                )
            place = which[halved] + 1
            t = np.insert(t, place, at[halved])
            points = np.insert(points, place, middle[halved], axis=0)
            both = np.insert(open_, place, True)
            open_ = both
        near = np.ones(t.size - 1, dtype=bool)
        lower = np.minimum(points[:-1], points[1:]) > high
        near &= ~(lower | (np.maximum(points[:-1], points[1:]) < low)).any(axis=1)
    near &= ~open_  # what stays long jumps
    lengths = np.where(open_, 0.0, np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)))
    s = np.append(0.0, np.cumsum(lengths))
    return Samples(t, points, s / (s[-1] or 1.0), np.flatnonzero(near))


def _points(curve: Curve, t: Floats) -> Floats:
    points = curve.position(t.copy()).T
    finite = np.isfinite(points)
    if not finite.all():
        row, axis = np.argwhere(~finite)[0].tolist()
        raise BodyError(
            f"{curve}: {'xyz'[axis]} is not finite at t = {t[row]:g}",
            hint="the curve must have a point for each t of its range",
        )
    return np.asarray(points, dtype=np.float64)
