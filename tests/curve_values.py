"""Positions and derivatives of curves as rounded lists."""

from __future__ import annotations

import numpy as np

from voxdisplay.curves import Curve


def at(curve: Curve, *t: float) -> list[list[float]]:
    return curve.position(np.array(t)).T.round(12).tolist()


def slope_at(curve: Curve, *t: float) -> list[list[float]]:
    slope = curve.derivative(np.array(t))
    assert slope is not None
    return slope.T.round(12).tolist()
