"""Lissajous curves and torus knots: products of sines. Knows formulas only.

Both have exact derivatives and enclosures.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.orthonormal_basis import orthonormal_basis
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.trigonometric_intervals import cos, sin

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


# Lower frequencies are quickly sampled: they need no bound.
_SLOW = 100.0


class Lissajous(Curve):
    """P(t) = center + amplitude * sin(frequency * t + phase), 0 <= t <= 2 pi.

    Parameters
    ----------
    center, amplitude, frequency : (3,) array
        For x, y and z. Whole frequencies close the curve.
    phase : (3,) array, optional
        Radians.
    closed : bool, optional
        None: found from the end points.

    """

    t_range = (0.0, math.tau)
    always_defined = True
    thread_safe = True

    def __init__(
        self,
        center: ArrayLike,
        amplitude: ArrayLike,
        frequency: ArrayLike,
        phase: ArrayLike = (0, 0, 0),
        *,
        closed: bool | None = None,
    ) -> None:
        self.closed = closed
        self._center = arguments.vector("center", center)[:, None]
        self._amplitude = arguments.vector("amplitude", amplitude)[:, None]
        self._frequency = arguments.vector("frequency", frequency)[:, None]
        self._fastest = max(map(abs, self._frequency[:, 0].tolist()))
        self._phase = arguments.vector("phase", phase)[:, None]
        self._arguments = {
            "center": self._center[:, 0],
            "amplitude": self._amplitude[:, 0],
            "frequency": self._frequency[:, 0],
            "phase": self._phase[:, 0],
            "closed": closed,
        }

    @property
    def min_length(self) -> float:
        """Lower bound of the length in max norm: 4 amplitudes for each whole period of an axis."""
        if self._fastest < _SLOW:
            return 0.0
        with np.errstate(all="ignore"):
            periods = np.floor(np.abs(self._frequency))
            return float((4 * np.abs(self._amplitude) * periods).max())

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        return self._center + self._amplitude * np.sin(self._frequency * t + self._phase)

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats:
        """Return dP/dt at t, (n,), as a (3, n) float64 array."""
        rate = self._amplitude * self._frequency
        return np.asarray(rate * np.cos(self._frequency * t + self._phase))

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, (n,)."""
        angle = self._frequency * Interval(t_lo, t_hi) + self._phase
        box = self._center + self._amplitude * sin(angle)
        return box.lo, box.hi


class TorusKnot(Curve):
    """The (p, q) torus knot: p turns around the axis, q turns around the tube.

    Parameters
    ----------
    p, q : int
        Not 0 and without common divisor; (2, 3) is the trefoil.
    center : (3,) array
    major, minor : float
        Radius of the torus's middle circle, and of its tube.
    axis : (3,) array, optional
        Direction of the torus's axis, of any length.
    closed : bool, optional

    """

    t_range = (0.0, math.tau)
    always_defined = True
    thread_safe = True

    def __init__(
        self,
        p: float,
        q: float,
        center: ArrayLike,
        major: float,
        minor: float,
        axis: ArrayLike = (0, 0, 1),
        *,
        closed: bool = True,
    ) -> None:
        self._p, self._q = arguments.whole("p", p), arguments.whole("q", q)
        if math.gcd(self._p, self._q) != 1:
            raise arguments.ArgumentError(
                "p",
                f"= {self._p} and q = {self._q} make no knot",
                hint="they must have no common divisor: (2, 3) is a trefoil, (1, 5) a coil",
            )
        self.closed = closed
        self._center = arguments.vector("center", center)[:, None]
        self._major = arguments.positive("major", major)
        self._minor = arguments.positive("minor", minor)
        self._axes = np.stack(orthonormal_basis("axis", axis), axis=1)
        self._arguments = {
            "p": p,
            "q": q,
            "center": self._center[:, 0],
            "major": major,
            "minor": minor,
            "axis": axis,
        }

    @property
    def min_length(self) -> float:
        """Lower bound of the length in max norm: the speed is at least that along either circle."""
        longest = max(abs(self._p) * self._major, abs(self._q) * self._minor)
        return math.tau * longest / math.sqrt(3)

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        around, along = self._p * t, self._q * t
        reach = self._major + self._minor * np.cos(along)
        local = (reach * np.cos(around), reach * np.sin(around), self._minor * np.sin(along))
        return self._center + self._axes @ np.stack(local)

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats:
        """Return dP/dt at t, (n,), as a (3, n) float64 array."""
        around, along = self._p * t, self._q * t
        reach = self._major + self._minor * np.cos(along)
        widening = -self._q * self._minor * np.sin(along)
        local = (
            widening * np.cos(around) - self._p * reach * np.sin(around),
            widening * np.sin(around) + self._p * reach * np.cos(around),
            self._q * self._minor * np.cos(along),
        )
        return np.asarray(self._axes @ np.stack(local))

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, (n,)."""
        t = Interval(t_lo, t_hi)
        around, along = self._p * t, self._q * t
        reach = self._major + self._minor * cos(along)
        u, v, n = self._axes.T[:, :, None]
        box = self._center + u * (reach * cos(around))
        box = box + v * (reach * sin(around)) + n * (self._minor * sin(along))
        return box.lo, box.hi
