"""Cells of rectangles of two parameters, over which functions are bounded. Knows no bodies."""

from __future__ import annotations

import numpy as np

from voxdisplay.expressions.interval import Interval

_CELLS = 64  # along each parameter


def parameter_cells(u: tuple[float, float], v: tuple[float, float]) -> tuple[Interval, Interval]:
    """Return the cells of a grid over two ranges as intervals of (n,) arrays."""
    edges = [np.linspace(*ends, _CELLS + 1) for ends in (u, v)]
    low = np.meshgrid(*(each[:-1] for each in edges))
    high = np.meshgrid(*(each[1:] for each in edges))
    one, two = (Interval(a.reshape(-1), b.reshape(-1)) for a, b in zip(low, high, strict=True))
    return one, two
