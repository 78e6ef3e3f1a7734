"""Tangent march: the paper's own voxelisation method, for comparison.

From a voxel, the signs of the curve's tangent give seven neighbours to go on to; the one nearest
to the curve is taken, until the last point's voxel is reached. Kept for comparison: nothing is
guaranteed. Where distances are searched for with steps that are long in voxels (variant 1 most of
all), wrong voxels win, and some curves are never left.

The paper says neither how finely distances are searched for nor where tangents are taken. The
readings here are those that give its tables II to IV, counts exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import choice, number
from voxdisplay.compute.array_types import Floats
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.singular_points import complete
from voxdisplay.errors import CurveError
from voxdisplay.voxelization.adaptive_sampling import check_estimate, check_lengths
from voxdisplay.voxelization.curve_batch import CurveBatch
from voxdisplay.voxelization.sequence import Sequence

# Estimates the parameters, (n,), at which a curve is near points, (3, n); the second argument is
# the parameter found for the voxel before.
ParameterEstimate = Callable[[Floats, float], Floats]

# Pitch of the search for the nearest point, by variant, and how far it goes to either side, if not
# said otherwise: see `follow` for the units.
PITCHES = {1: 0.5, 2: 0.25, 3: 0.25}
REACH = 2.0
# A search to this many pitches on either side is no search for a *local* minimum any more.
MOST_TESTS = 1000

# The matrix M of the paper without the signs: one step along one, two or three axes.
MOVES = np.array(sorted(product((0, 1), repeat=3), key=sum)[1:]).T
# A march this many times as long as its curve has left it.
MAX_LENGTH_RATIO = 4


@dataclass(frozen=True, eq=False)
class MarchTrace:
    """Voxels, parameters and distances of a march, as the paper reports them.

    Attributes
    ----------
    voxels : (N, 3) int32 array
        Columns x, y, z.
    t : (N,) float64 array
        The parameter guessed for each voxel; not ascending where the march leaves the curve.
    distances : (N,) float64 array
        The variant's own estimate of the distance from the curve, in voxels.

    """

    voxels: NDArray[np.int32]
    t: Floats
    distances: Floats


@np.errstate(all="ignore")
def march(
    curve: Curve,
    variant: int = 3,
    *,
    tangent: str | None = None,
    pitch: float | None = None,
    reach: float | None = None,
    guess: ParameterEstimate | None = None,
) -> Sequence:
    """Voxelise a curve by the tangent march. Parameters are those of `follow`."""
    begin = perf_counter()
    curve = complete(curve)
    trail = follow(curve, variant, tangent=tangent, pitch=pitch, reach=reach, guess=guess)
    return Sequence(
        voxels=trail.voxels,
        closed=False,
        starts=np.zeros(1, dtype=np.int64),
        t=trail.t,
        curve=curve,
        seconds=perf_counter() - begin,
    )


@np.errstate(all="ignore")
def follow(
    curve: Curve,
    variant: int = 3,
    *,
    tangent: str | None = None,
    pitch: float | None = None,
    reach: float | None = None,
    guess: ParameterEstimate | None = None,
) -> MarchTrace:
    """Return the march along a curve.

    Parameters
    ----------
    curve : Curve
        One connected piece. If its parameter is the angle around an axis parallel to z, its
        position and derivative are asked for up to ``reach`` outside its range, as in the paper.
    variant : {1, 2, 3}
        How distances are found around the guessed parameter: by a coarse search, by one twice as
        fine, or by the parabola through its least three.
    tangent : {"analytic", "difference"}, optional
        From the curve's derivative, or from the first right difference, over one pitch. The first
        if there is one.
    pitch : float, optional
        The step of the search for the point nearest to a voxel (the paper's delta phi): in degrees
        if the parameter is an angle around an axis parallel to z, as it is of the paper's curves;
        else in voxels, along the curve. By default 0.5 for variant 1, 0.25 for the others.
    reach : float, optional
        How far the search goes to either side of the guessed parameter (the paper's phi_d), in the
        same unit, rounded to whole pitches; from 1 to 1000 of them. By default 2.
    guess : callable, optional
        Estimates the parameters for points: (3, n) points and the last parameter -> (n,). By
        default equation 11 where the parameter is such an angle, else feet on the last tangent.

    Returns
    -------
    Trail

    Raises
    ------
    CurveError
        If the march does not reach the curve's end, or the curve cannot be evaluated.
    ValueError
        If there is no such variant or tangent, or no search of such a pitch and reach.

    """
    pitch, reach = search_steps(variant, pitch, reach)
    curve = complete(curve)
    marching = _MarchingCurve(curve, variant, tangent, (pitch, reach), guess)
    first, last = curve.t_range
    ends = np.floor(marching.position(np.array([first, last])))
    target = ends[:, 1]
    middle = (first + last) / 2

    voxel, t = ends[:, 0], first
    voxels, parameters = [voxel], [t]
    distances = [float(marching.distances(voxel[:, None], np.array([t]))[0])]
    for _ in range(marching.longest):
        # A closed curve begins in its last voxel, and a short one need not leave it.
        if t >= last or ((t > middle or marching.still) and bool((voxel == target).all())):
            return MarchTrace(
                np.array(voxels).astype(np.int32), np.array(parameters), np.array(distances)
            )
        sign = np.where(marching.tangent(t) < 0, -1.0, 1.0)
        trials = voxel[:, None] + sign[:, None] * MOVES
        guesses = marching.guess(trials + 0.5, t)
        distance = marching.distances(trials, guesses)
        best = int(np.argmin(distance))
        voxel, t = trials[:, best], float(guesses[best])
        voxels.append(voxel)
        parameters.append(t)
        distances.append(float(distance[best]))
    raise CurveError(
        f"the march does not reach the end of the curve: it left it near t = {t:.6g}",
        hint="use the method 'grid-plane', or a finer variant",
    )


def search_steps(variant: int, pitch: float | None, reach: float | None) -> tuple[float, float]:
    """Return checked pitch and reach of a variant's search; defaults for those that are None."""
    choice("variant", variant, tuple(PITCHES))
    pitch = PITCHES[variant] if pitch is None else number("pitch", pitch)
    reach = REACH if reach is None else number("reach", reach)
    for name, value in (("pitch", pitch), ("reach", reach)):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive and finite, not {value:g}")
    if reach < pitch:
        raise ValueError(f"reach must be one pitch, {pitch:g}, at least, not {reach:g}")
    if reach > MOST_TESTS * pitch:
        raise ValueError(
            f"reach must be {MOST_TESTS} pitches of {pitch:g} at most, not {reach:g}: "
            "take a larger pitch or a shorter reach"
        )
    return pitch, reach


class _MarchingCurve:
    """Positions, tangents and distance estimates of one curve for the march."""

    def __init__(
        self,
        curve: Curve,
        variant: int,
        tangent: str | None,
        search: tuple[float, float],
        guess: ParameterEstimate | None,
    ) -> None:
        self._batch = CurveBatch([curve])
        check_lengths(self._batch)
        check_estimate(self._batch, 0)
        self._curve = curve
        self._parabola = variant == 3
        has_derivative = curve.derivative(np.array(curve.t_range[:1])) is not None
        if tangent not in {"analytic", "difference", None}:
            raise ValueError(f"there is no tangent {tangent!r}: take 'analytic' or 'difference'")
        if tangent == "analytic" and not has_derivative:
            raise ValueError("this curve has no derivative: take tangent='difference'")
        self._analytic = has_derivative and tangent != "difference"

        t = np.linspace(*curve.t_range, 1025)
        points = self.position(t)
        length = np.abs(np.diff(points, axis=1)).sum(axis=1)
        self.longest = int(MAX_LENGTH_RATIO * length.sum()) + 16
        self.still = bool((np.floor(points) == np.floor(points[:, :1])).all())
        angle = azimuth_estimate(t, points)
        self._cylinder = angle is not None
        if self._cylinder:
            self._pitch, reach = np.radians(search)
        else:
            typical = float(length.sum()) / (curve.t_range[1] - curve.t_range[0])
            per_voxel = 1 / max(typical, 1e-9)
            self._pitch, reach = (each * per_voxel for each in search)
        self._steps = np.arange(-round(reach / self._pitch), round(reach / self._pitch) + 1)
        self.guess = guess or angle or self._foot_on_tangent

    def position(self, t: Floats) -> Floats:
        return self._batch.evaluate(np.zeros(t.size, dtype=np.int64), t)

    def tangent(self, t: float) -> Floats:
        if self._analytic:
            derivative = self._curve.derivative(np.array([t]))
            if derivative is not None:
                return np.asarray(derivative[:, 0])
        ahead = t + self._pitch
        if not self._cylinder:
            t = min(t, self._curve.t_range[1] - self._pitch)
            ahead = t + self._pitch
        here, there = self.position(np.array([t, ahead])).T
        return np.asarray((there - here) / self._pitch)

    def _foot_on_tangent(self, points: Floats, t: float) -> Floats:
        along = self.tangent(t)
        here = self.position(np.array([t]))
        return np.asarray(t + along @ (points - here) / max(float(along @ along), 1e-300))

    def distances(self, voxels: Floats, t: Floats) -> Floats:
        """Return the distances, (n,), of voxels, (3, n), from the curve around t, (n,)."""
        tests = t[:, None] + self._pitch * self._steps
        if not self._cylinder:
            tests = np.clip(tests, *self._curve.t_range)
        points = self.position(tests.ravel()).reshape(3, *tests.shape)
        distance = np.sqrt(((points - (voxels + 0.5)[:, :, None]) ** 2).sum(axis=0))
        least = np.argmin(distance, axis=1)
        row = np.arange(t.size)
        if not self._parabola:
            return np.asarray(distance[row, least])
        middle = np.clip(least, 1, self._steps.size - 2)
        before, at, after = (distance[row, middle + k] for k in (-1, 0, 1))
        # The vertex of the parabola through three equidistant values, and its value.
        bend = before - 2 * at + after
        with np.errstate(all="ignore"):
            vertex = at - (after - before) ** 2 / (8 * bend)
        inside = (least == middle) & (bend > 0)
        return np.asarray(np.where(inside, vertex, distance[row, least]))


def azimuth_estimate(t: Floats, points: Floats) -> ParameterEstimate | None:
    """Return equation 11 if these points are on a curve x0 + R cos t, y0 + R sin t, z(t)."""
    cosine, sine = np.cos(t), np.sin(t)
    one, none = np.ones(t.size), np.zeros(t.size)
    unknowns = np.concatenate((np.stack((one, none, cosine)), np.stack((none, one, sine))), axis=1)
    (x, y, radius), *_ = np.linalg.lstsq(unknowns.T, points[:2].ravel(), rcond=None)
    off = np.abs(points[:2] - np.stack((x + radius * cosine, y + radius * sine))).max()
    if radius <= 0 or off > 1e-6 or t[0] < -np.pi or t[-1] > np.pi:
        return None
    return lambda centres, _: np.arctan2(centres[1] - y, centres[0] - x)
