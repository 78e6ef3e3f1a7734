"""Bounds of piecewise polynomial curves (polylines and splines), span by span.

A polynomial between two parameters lies in the convex hull of the control points it has there
(Farin, *Curves and Surfaces for CAGD*, sections 4.3 and 5.2). Those are found here, with interval
arithmetic, so that rounding is accounted for. Must not know a particular curve.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.expressions.interval import Interval, interval

Box = tuple[Floats, Floats]


def enclose_spans(
    nodes: Floats, t_lo: Floats, t_hi: Floats, enclose: Callable[[Ints, Floats, Floats], Box]
) -> Box:
    """Return bounds of a curve of spans from t_lo to t_hi.

    Parameters
    ----------
    nodes : (k,) float64 array
        Ends of spans, ascending: span i goes from nodes[i] to nodes[i + 1].
    t_lo, t_hi : (n,) float64 arrays
        Parameters from nodes[0] to nodes[-1].
    enclose : callable
        ``(i, t_lo, t_hi)``, (m,) arrays with both parameters inside span i, to bounds, (3, m)
        each.

    Returns
    -------
    (3, n), (3, n) float64 arrays
        Nan for intervals that reach over more than two spans: the caller cuts them.

    """
    last = len(nodes) - 2
    begin = np.clip(np.searchsorted(nodes, t_lo, side="right") - 1, 0, last)
    end = np.maximum(np.clip(np.searchsorted(nodes, t_hi, side="left") - 1, 0, last), begin)
    low, high = enclose(begin, t_lo, np.minimum(t_hi, nodes[begin + 1]))
    low, high = np.array(low), np.array(high)
    on = np.flatnonzero(end > begin)
    if on.size:
        more_low, more_high = enclose(end[on], nodes[end[on]], t_hi[on])
        low[:, on] = np.minimum(low[:, on], more_low)
        high[:, on] = np.maximum(high[:, on], more_high)
        low[:, end > begin + 1] = high[:, end > begin + 1] = np.nan
    return low, high


def control_box(control: Interval, knots: Floats, t_lo: Floats, t_hi: Floats) -> Box:
    """Return bounds of a span of a B-spline from t_lo to t_hi, by its Bezier points there.

    With f the blossom (polar form) of the polynomial, de Boor's algorithm at t_lo leads from the
    span's points to f(t_lo, ... t_lo, u, u', ...) with fewer and fewer of the knots after it; these
    are control points of what begins at t_lo. From them, de Boor's algorithm at t_hi leads to
    f(t_lo, ... t_hi, ...), the Bezier points (Ramshaw, "Blossoms are polar forms", 1989).

    Parameters
    ----------
    control : Interval
        The span's points, (p + 1, d, n), or 1 in place of n.
    knots : (2 p, n) float64 array
        The p knots up to where the span begins, and the p from where it ends; or 1 in place of n.
    t_lo, t_hi : (n,) float64 arrays

    Returns
    -------
    (d, n), (d, n) float64 arrays

    """
    p = len(knots) // 2
    layer = Interval(*np.broadcast_arrays(control.lo, control.hi, t_lo)[:2])
    last = [layer]
    for r in range(1, p + 1):
        layer = _de_boor_round(layer, knots[r - 1 : p], knots[p : 2 * p + 1 - r], t_lo)
        last.append(layer)
    layer = Interval(*(np.stack([getattr(each, end)[-1] for each in last[::-1]]) for end in ENDS))
    low, high = layer.lo[0], layer.hi[0]
    for r in range(1, p + 1):
        layer = _de_boor_round(layer, t_lo, knots[p : 2 * p + 1 - r], t_hi)
        low, high = np.minimum(low, layer.lo[0]), np.maximum(high, layer.hi[0])
    return low, high


ENDS = ("lo", "hi")


def _de_boor_round(layer: Interval, low: Floats, high: Floats, t: Floats) -> Interval:
    """Return one round of de Boor's algorithm: points between neighbours, one less."""
    # Where low and high are equal, t is there too, and any share will do.
    share = (interval(t) - low) / (interval(np.where(high > low, high, low + 1.0)) - low)
    f = Interval(share.lo[:, None], share.hi[:, None])
    begin, end = (Interval(layer.lo[part], layer.hi[part]) for part in (np.s_[:-1], np.s_[1:]))
    return begin * (1.0 - f) + end * f
