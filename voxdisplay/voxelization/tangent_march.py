"""Tangent march: the paper's own voxelisation method, for comparison.

From a voxel, the signs of the curve's tangent give seven neighbours to go on to; the one nearest
to the curve is taken, until the last point's voxel is reached. Kept for comparison: nothing is
guaranteed. Where distances are searched for with steps that are long in voxels (variant 1 most of
all), wrong voxels win, and some curves are never left.

The paper says neither how finely distances are searched for nor where tangents are taken. The
readings here are those that give its tables II to IV, counts exactly. Of jumps and of parameters
without a value it says nothing: here each piece is marched along by itself, and limits are taken,
as by the other method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import choice, number
from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.curves import arguments
from voxdisplay.curves.curve import Curve
from voxdisplay.errors import CurveError
from voxdisplay.voxelization.adaptive_sampling import (
    check_estimate,
    check_lengths,
    initial_samples,
    refine_samples,
    split_at_jumps,
)
from voxdisplay.voxelization.curve_batch import MAX_COORDINATE, CurveBatch
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
    starts : (pieces,) int64 array
        Index of the first voxel of every piece; the first is 0. The curve jumps before each other.
    curve : Curve
        What was marched along: the curve, completed by its limits where it has no value.

    """

    voxels: NDArray[np.int32]
    t: Floats
    distances: Floats
    starts: Ints
    curve: Curve


@np.errstate(all="ignore")
def march(
    curve: Curve,
    variant: int = 3,
    *,
    tangent: str | None = None,
    pitch: float | None = None,
    reach: float | None = None,
    guess: ParameterEstimate | None = None,
    number: int | None = None,
) -> Sequence:
    """Voxelise a curve by the tangent march. Parameters are those of `follow`."""
    begin = perf_counter()
    trail = follow(
        curve, variant, tangent=tangent, pitch=pitch, reach=reach, guess=guess, number=number
    )
    return Sequence(
        voxels=trail.voxels,
        closed=False,
        starts=trail.starts,
        t=trail.t,
        curve=trail.curve,
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
    number: int | None = None,
) -> MarchTrace:
    """Return the march along a curve, piece by piece where it jumps.

    Parameters
    ----------
    curve : Curve
        If its parameter is the angle around an axis parallel to z, its position and derivative
        are asked for up to ``reach`` outside its range, as in the paper, if it has values there.
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
    number : int, optional
        Number of the curve in messages, where it is one of several.

    Returns
    -------
    MarchTrace

    Raises
    ------
    CurveError
        If the march does not reach the curve's end, or the curve cannot be evaluated.
    ValueError
        If there is no such variant or tangent, or no search of such a pitch and reach.

    """
    search = search_steps(variant, pitch, reach)
    while True:
        batch, sampled = CurveBatch([curve], number), CurveBatch([curve], number)
        marching_along = partial(_MarchingCurve, batch, variant, tangent, search, guess)
        try:
            pieces = [_follow_piece(marching_along(*span)) for span in _connected_spans(sampled)]
            break
        except CurveError:
            # Of which a singular parameter that nothing but its sampling shows is one.
            completed = [each for each in (batch, sampled) if each.complete_undefined()]
            if not completed:
                raise
            (curve,) = completed[0].curves
    voxels, t, distances = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    starts = np.cumsum([0, *[len(of_piece) for of_piece, _, _ in pieces[:-1]]])
    return MarchTrace(voxels.astype(np.int32), t, distances, starts, batch.curves[0])


def _connected_spans(batch: CurveBatch) -> list[tuple[float, float]]:
    """Return the ranges of t of a curve between its jumps; the batch cannot be used any more."""
    check_lengths(batch)
    check_estimate(batch, 0)
    samples = split_at_jumps(batch, refine_samples(batch, initial_samples(batch)))
    first, end = samples.bounds[:-1], samples.bounds[1:]
    return list(zip(samples.t[first].tolist(), samples.t[end - 1].tolist(), strict=True))


def _follow_piece(marching: _MarchingCurve) -> tuple[Floats, Floats, Floats]:
    """Return voxels, (n, 3), parameters and distances, (n,), of the march along a piece."""
    first, last = marching.span
    ends = np.floor(marching.position(np.array([first, last])))
    target = ends[:, 1]
    middle = (first + last) / 2

    voxel, t = ends[:, 0], first
    voxels, parameters = [voxel], [t]
    distances = [float(marching.distances(voxel[:, None], np.array([t]))[0])]
    for _ in range(marching.longest):
        # A closed curve begins in its last voxel, and a short one need not leave it.
        if t >= last or ((t > middle or marching.still) and bool((voxel == target).all())):
            return np.array(voxels), np.array(parameters), np.array(distances)
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
        f"{marching.message_prefix}the march does not reach the end of the curve: "
        f"it left it near t = {t:.6g}",
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
    """Positions, tangents and distance estimates of one piece of a curve for the march.

    Parameters
    ----------
    batch : CurveBatch
        Of the curve alone.
    variant, tangent, search, guess
        As for `follow`.
    first, last : float
        The piece's range of t.

    """

    def __init__(
        self,
        batch: CurveBatch,
        variant: int,
        tangent: str | None,
        search: tuple[float, float],
        guess: ParameterEstimate | None,
        first: float,
        last: float,
    ) -> None:
        self._batch = batch
        self._curve = curve = batch.curves[0]
        self.span = first, last
        self.message_prefix = batch.message_prefix(0)
        self._parabola = variant == 3
        has_derivative = curve.derivative(np.array([first])) is not None
        if tangent not in {"analytic", "difference", None}:
            raise ValueError(f"there is no tangent {tangent!r}: take 'analytic' or 'difference'")
        if tangent == "analytic" and not has_derivative:
            raise ValueError("this curve has no derivative: take tangent='difference'")
        self._analytic = has_derivative and tangent != "difference"

        t = np.linspace(first, last, 1025)
        points = self.position(t)
        length = np.abs(np.diff(points, axis=1)).sum(axis=1)
        self.longest = int(MAX_LENGTH_RATIO * length.sum()) + 16
        self.still = bool((np.floor(points) == np.floor(points[:, :1])).all())
        angle = azimuth_estimate(t, points)
        if angle is not None:
            self._pitch, reach = np.radians(search)
        else:
            typical = float(length.sum()) / max(last - first, np.finfo(float).tiny)
            per_voxel = 1 / max(typical, 1e-9)
            self._pitch, reach = (each * per_voxel for each in search)
        self._steps = np.arange(-round(reach / self._pitch), round(reach / self._pitch) + 1)
        # Between these, positions are asked for: nothing is looked for across a jump.
        low, high = (float(end) for end in curve.t_range)
        outside = self._pitch * np.arange(1, self._steps.size // 2 + 1)
        go_on = [
            angle is not None and end == own and bool(self._exists(beyond).all())
            for end, own, beyond in ((first, low, low - outside), (last, high, high + outside))
        ]
        self._low, self._high = -np.inf if go_on[0] else first, np.inf if go_on[1] else last
        self.guess = guess or angle or self._foot_on_tangent

    def position(self, t: Floats) -> Floats:
        """Return the points at t, (3, n); outside of the range, those of its ends if need be."""
        first, last = self._curve.t_range
        within = np.clip(t, first, last)
        points = self._batch.evaluate(np.zeros(t.size, dtype=np.int64), within)
        outside = (within != t).nonzero()[0]
        if outside.size:
            beyond = self._beyond(t[outside])
            there = (np.abs(beyond) < MAX_COORDINATE).all(axis=0)
            points = points.copy()
            points[:, outside[there]] = beyond[:, there]
        return points

    def _exists(self, t: Floats) -> NDArray[np.bool_]:
        return np.asarray((np.abs(self._beyond(t)) < MAX_COORDINATE).all(axis=0))

    def _beyond(self, t: Floats) -> Floats:
        """Return the points outside of the curve's range, (3, n), nan where it has none."""
        try:
            points = self._curve.position(t.copy())
            return arguments.curve_points(self._curve.position.__qualname__, points, t.size)
        except (ArithmeticError, LookupError, ValueError):  # a curve need not have any there
            return np.full((3, t.size), np.nan)

    def tangent(self, t: float) -> Floats:
        if self._analytic:
            derivative = self._curve.derivative(np.array([min(max(t, self._low), self._high)]))
            if derivative is not None and np.isfinite(derivative).all():
                return np.asarray(derivative[:, 0])
        here = max(min(t, self._high - self._pitch), self._low)
        points = self.position(np.array([here, min(here + self._pitch, self._high)]))
        return np.asarray((points[:, 1] - points[:, 0]) / self._pitch)

    def _foot_on_tangent(self, points: Floats, t: float) -> Floats:
        along = self.tangent(t)
        here = self.position(np.array([t]))
        return np.asarray(t + along @ (points - here) / max(float(along @ along), 1e-300))

    def distances(self, voxels: Floats, t: Floats) -> Floats:
        """Return the distances, (n,), of voxels, (3, n), from the curve around t, (n,)."""
        tests = np.clip(t[:, None] + self._pitch * self._steps, self._low, self._high)
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
