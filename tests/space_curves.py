"""Curves for tests: any function of t, the paper's curve, and random ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from voxdisplay.curves.curve import Curve

Floats = NDArray[np.float64]


class Function(Curve):
    """The curve of a function that gives x, y and z; plain numbers are constant coordinates."""

    def __init__(
        self,
        function: Callable[[Floats], tuple[Floats | float, Floats | float, Floats | float]],
        first: float = 0.0,
        last: float = 1.0,
        *,
        closed: bool | None = None,
    ) -> None:
        self.function = function
        self.t_range = (first, last)
        self.closed = closed

    def position(self, t: Floats) -> Floats:
        return np.stack([np.broadcast_to(row, t.shape) for row in self.function(t)])


def paper_curve(radius: float, frequency: float, offset: float) -> Function:
    """Equation 9 with A = R, from -170 to 170 degrees; the centre of a voxel is at + 1/2."""
    middle = offset + 0.5
    return Function(
        lambda t: (
            middle + radius * np.cos(t),
            middle + radius * np.sin(t),
            middle + radius * (1 - np.cos(frequency * t)),
        ),
        np.radians(-170),
        np.radians(170),
    )


def fourier_curve(seed: int, kind: str, *, closed: bool) -> Function:
    """Random harmonics: ``smooth``, ``rough`` with hairpins and cusps, or ``tiny`` in a voxel."""
    rng = np.random.default_rng(seed)
    harmonics, size, decay = {"smooth": (4, 30, 1), "rough": (40, 12, 0.7), "tiny": (12, 0.6, 1)}[
        kind
    ]
    order = np.arange(1, harmonics + 1)
    weight = rng.normal(size=(3, harmonics)) * size / order**decay
    phase = rng.uniform(0, 2 * np.pi, (3, harmonics))
    middle = rng.uniform(-50, 50, 3)
    drift = np.zeros(3) if closed else rng.normal(size=3) * size / 10
    speed = order if closed else order * rng.uniform(0.5, 0.99)

    def function(t: Floats) -> tuple[Floats, Floats, Floats]:
        rows = middle[:, None] + drift[:, None] * t
        for k in range(harmonics):  # sum() would add in an order that depends on how many t
            rows += weight[:, k, None] * np.cos(speed[k] * t + phase[:, k, None])
        return rows[0], rows[1], rows[2]

    return Function(function, 0.0, 2 * np.pi)


def chain(vertices: Floats) -> Function:
    """Return the polyline through points, (n, 3)."""
    nodes = np.arange(len(vertices), dtype=float)
    return Function(
        lambda t: (
            np.interp(t, nodes, vertices[:, 0]),
            np.interp(t, nodes, vertices[:, 1]),
            np.interp(t, nodes, vertices[:, 2]),
        ),
        0.0,
        nodes[-1],
    )


def moved(curve: Curve, shift: tuple[int, int, int]) -> Function:
    """Return the curve moved by whole voxels."""
    return Function(lambda t: tuple(curve.position(t) + np.array(shift)[:, None]), *curve.t_range)


def turned(curve: Curve, axes: tuple[int, ...]) -> Function:
    """Return the curve with its axes in another order."""
    return Function(lambda t: tuple(curve.position(t)[list(axes)]), *curve.t_range)


def backwards(curve: Curve) -> Function:
    """Return the curve from its end to its beginning."""
    first, last = curve.t_range
    return Function(lambda t: tuple(curve.position(first + last - t)), first, last)
