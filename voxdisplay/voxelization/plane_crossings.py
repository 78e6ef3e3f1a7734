"""Crossings of curves with the mid-planes of their dominant axis, and the voxels at them.

Most of the computing time is spent here, in blocks, a constant number of array operations each.
Nothing in this module compares two crossings: `grid_plane` keeps their voxels connected.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute import parallel
from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.curve_batch import CurveBatch, Samples
from voxdisplay.voxelization.index_ranges import expand_ranges, split_blocks
from voxdisplay.voxelization.root_finding import TOLERANCE, find_roots
from voxdisplay.voxelization.voxel_events import VoxelEvents, Voxels

# Steps handled at once: enough to make the cost of a call negligible, few enough for the arrays to
# stay in cache.
BLOCK = 1 << 15
# With so many blocks threads pay.
MIN_PARALLEL_BLOCKS = 8
# So much nearer (in voxels) or longer (relatively) counts as equal. Ties must not be decided by the
# last bit, or lines along edges and diagonals waver.
TIE_TOLERANCE = 1e-10
# A corner must be better by this much, in square voxels, to be preferred to the nearest one.
MIN_GAIN = 1e-8
# How far along the tangent a plane may be from the point found near it, in voxels; and how far, in
# square voxels, the corner nearest to the point on the plane may be from the point found.
MAX_PROJECTION = 1e-2
MAX_SQUARE = 0.50005

Ends = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True)
class Crossings:
    """Crossings of dominant mid-planes: nearest corners in ``events``, others in ``better``.

    ``gain``, (M,), is by how much, in square voxels, the corner in ``better``, (3, M), is nearer
    to the tangent; infinite where there is no better one.
    """

    events: VoxelEvents
    better: Voxels
    gain: Floats


class Slopes(NamedTuple):
    """Estimates of dP/dt at samples, (3, K) each; they differ where the curve has a corner."""

    arriving: Floats  # at the end of the step before a sample
    leaving: Floats  # at the beginning of the step after it


class CrossingGuesses(NamedTuple):
    """Estimated crossings of the planes of the dominant axis, one entry per plane."""

    sample: Ints  # the last before it
    axis: NDArray[np.int8]
    descends: NDArray[np.bool_]
    level: Floats  # of the plane: i + 1/2
    tau: Floats  # where it is crossed, in steps between samples
    t: Floats  # the parameter there


class CornerChoices(NamedTuple):
    """Corners of the faces crossed, as voxels: see `rank_corners`."""

    nearest: Voxels
    better: Voxels
    gain: Floats
    foot: Floats


def dominant_crossings(batch: CurveBatch, samples: Samples) -> Crossings:
    """Return all crossings, between samples, of planes of the dominant axis.

    Their events are connected only where one axis stays dominant.
    """
    slopes = _slopes_between_corners(batch, samples)

    def crossings_of(block: tuple[int, int]) -> Crossings:
        return _block_crossings(batch, samples, slopes, guess_crossings(samples, slopes, *block))

    parts = [(0, samples.t.size)]
    if samples.t.size > BLOCK:
        parts = list(split_blocks(samples.curve_starts(len(batch.curves)), samples.t.size, BLOCK))
    apart = len(parts) >= MIN_PARALLEL_BLOCKS and batch.thread_safe
    found = list((parallel.ordered_map if apart else map)(crossings_of, parts))
    crossings = found[0]
    if len(found) > 1:
        events = VoxelEvents(
            np.concatenate([part.events.piece for part in found]),
            np.concatenate([part.events.t for part in found]),
            np.concatenate([part.events.voxels for part in found], axis=1),
            np.concatenate([part.events.heading for part in found]),
        )
        better = np.concatenate([part.better for part in found], axis=1)
        crossings = Crossings(events, better, np.concatenate([part.gain for part in found]))
    events = crossings.events
    # Several crossings of one plane are found in any order.
    if ((events.t[1:] < events.t[:-1]) & events.joined).any():
        order = np.lexsort((events.t, events.piece))
        better = crossings.better.take(order, axis=1)
        return Crossings(events.take(order), better, crossings.gain[order])
    return crossings


def _slopes_between_corners(batch: CurveBatch, samples: Samples) -> Slopes:
    """Estimate dP/dt before and after each sample: different at corners only."""
    corners = batch.corners(samples)
    if not corners.size:
        slopes = slopes_at(samples)
        return Slopes(slopes, slopes)
    # Each corner ends one piece and begins another.
    count = np.ones(samples.t.size, dtype=np.int64)
    count[corners] = 2
    twice = np.arange(count.size).repeat(count)
    second = np.append(False, twice[1:] == twice[:-1])
    opens = second | np.append(True, samples.piece[twice[1:]] != samples.piece[twice[:-1]])
    piece = np.cumsum(opens) - 1
    points = samples.points.take(twice, axis=1)
    parts = Samples(piece, samples.t[twice], points, samples.curve[samples.piece[twice[opens]]])
    slopes = slopes_at(parts)
    before_second = np.append(second[1:], False)
    return Slopes(slopes[:, ~second], slopes[:, ~before_second])


@with_kernel
@np.errstate(all="ignore")
def slopes_at(samples: Samples) -> Floats:
    """Return estimates of dP/dt at the samples, (3, K), from parabolas through three of them."""
    joined = samples.joined
    h = np.where(joined, samples.t[1:] - samples.t[:-1], 1.0)
    slopes = np.zeros_like(samples.points)
    velocity = (samples.points[:, 1:] - samples.points[:, :-1]) / h
    slopes[:, 1:-1] = (velocity[:, :-1] * h[1:] + velocity[:, 1:] * h[:-1]) / (h[1:] + h[:-1])
    inner = np.zeros(samples.t.size, dtype=bool)
    inner[1:-1] = joined[1:] & joined[:-1]
    bounds = samples.bounds
    first, last = bounds[:-1], bounds[1:] - 1
    alone = first == last
    if alone.any():
        slopes[:, first[alone]] = 0.0
        first, last = first[~alone], last[~alone]
    end, other = np.concatenate((first, last)), np.concatenate((first + 1, last - 1))
    step = velocity.take(np.concatenate((first, last - 1)), axis=1)
    # On a parabola the slopes at both ends of a step average to its velocity.
    slopes[:, end] = np.where(inner[other], 2 * step - slopes.take(other, axis=1), step)
    return slopes


@with_kernel
@np.errstate(all="ignore")
def guess_crossings(samples: Samples, slopes: Slopes, low: int, high: int) -> CrossingGuesses:
    """Estimate, by cubics, where the steps from samples low..high-1 cross dominant planes."""
    stop = min(high + 1, samples.t.size)
    points = samples.points[:, low:stop]
    cells = np.floor(points - 0.5)
    length = np.abs(points[:, 1:] - points[:, :-1])
    length[0] *= 1 + TIE_TOLERANCE
    length[2] *= 1 - TIE_TOLERANCE
    axis = np.where(
        (length[0] >= length[1]) & (length[0] >= length[2]), 0, 2 - (length[1] >= length[2])
    ).astype(np.int8)
    passed = _select_axis(cells[:, 1:] - cells[:, :-1], axis)
    step = (
        (passed != 0) & (samples.piece[low + 1 : stop] == samples.piece[low : stop - 1])
    ).nonzero()[0]
    axis, passed = axis[step], passed[step]
    left = low + step
    at = axis.astype(np.int64) * samples.t.size + left  # of flat rows
    h = samples.t[left + 1] - samples.t[left]
    begin = samples.points.take(at)
    length = samples.points.take(at + 1) - begin
    m_left = length / (slopes.leaving.take(at) * h)
    m_right = length / (slopes.arriving.take(at + 1) * h)
    # Within (0, 3) the cubic is monotone (Fritsch and Carlson 1980).
    m_left[~((m_left > 0) & (m_left < 3))] = 1.0
    m_right[~((m_right > 0) & (m_right < 3))] = 1.0

    # Plane i is passed upwards on leaving the cell below it, downwards on reaching it.
    first = np.floor(begin - 0.5) + np.where(passed > 0, 1.5, 0.5)
    planes = np.abs(passed).astype(np.int64)
    # From here on everything is per crossing.
    of = np.repeat(np.arange(left.size), planes)
    nth = expand_ranges(np.zeros_like(planes), planes)
    level: Floats = first[of] + np.sign(passed)[of] * nth
    u = (level - begin[of]) / length[of]
    rest = 1.0 - u
    tau = u * (u * (3 - 2 * u) + rest * (m_left[of] * rest - m_right[of] * u))
    sample = left[of]
    t_left = samples.t[sample]
    t = np.minimum(np.maximum(t_left + tau * h[of], t_left), samples.t[sample + 1])
    return CrossingGuesses(sample, axis[of], passed[of] < 0, level, tau, t)


def _block_crossings(
    batch: CurveBatch, samples: Samples, slopes: Slopes, guesses: CrossingGuesses
) -> Crossings:
    guesses, points = _refine_crossings(batch, samples, guesses)
    piece, t = samples.piece[guesses.sample], guesses.t
    curve = samples.curve[piece]
    nearest, better, gain, foot = rank_corners(samples, slopes, guesses, points)
    check = np.isfinite(foot).nonzero()[0]
    if check.size:  # at the foot of the perpendicular the curve must be near enough
        left = guesses.sample[check]
        t_foot = np.clip(
            t[check] + foot[check] * (samples.t[left + 1] - samples.t[left]),
            batch.first[curve[check]],
            batch.last[curve[check]],
        )
        apart = better[:, check] + 0.5 - batch.evaluate(curve[check], t_foot)
        far = check[(apart * apart).sum(axis=0) > 0.5]
        gain[far] = np.inf

    heading = (2 * guesses.axis + guesses.descends).astype(np.int8)
    return Crossings(VoxelEvents(piece.astype(np.int32), t, nearest, heading), better, gain)


def _refine_crossings(
    batch: CurveBatch, samples: Samples, guesses: CrossingGuesses
) -> tuple[CrossingGuesses, Floats]:
    """Return refined crossings and their points, without planes that are jumped over."""
    curve = samples.curve[samples.piece[guesses.sample]]
    points = batch.evaluate(curve, guesses.t)
    residual = _select_axis(points, guesses.axis) - guesses.level
    off = (np.abs(residual) > TOLERANCE).nonzero()[0]
    if not off.size:
        return guesses, points
    bracket, ends = _brackets(samples, guesses, residual, off)
    axis = guesses.axis[off].astype(np.int64)
    guesses.t[off], points[:, off], found = find_roots(
        batch, curve[off], axis, guesses.level[off], bracket, ends
    )
    hit = off[found]
    left = guesses.sample[hit]
    guesses.tau[hit] = (guesses.t[hit] - samples.t[left]) / (samples.t[left + 1] - samples.t[left])
    if found.all():
        return guesses, points
    kept = np.ones(guesses.t.size, dtype=bool)
    kept[off] = found
    return CrossingGuesses._make(each[kept] for each in guesses), points[:, kept]


def _brackets(
    samples: Samples, guesses: CrossingGuesses, residual: Floats, off: Ints
) -> tuple[Ends, Ends]:
    """Return brackets of the crossings, from steps and guesses that are off by ``residual``."""
    left, axis, t, level = (
        guesses.sample[off],
        guesses.axis[off],
        guesses.t[off],
        guesses.level[off],
    )
    begin = _select_axis(samples.points[:, left], axis)
    length = _select_axis(samples.points[:, left + 1], axis) - begin
    h = samples.t[left + 1] - samples.t[left]
    low, high = samples.t[left], samples.t[left] + h
    at_low, at_high = begin - level, begin + length - level
    after = (residual[off] < 0) == (at_low < 0)  # the crossing comes after the guess
    bracket = np.where(after, t, low), np.where(after, high, t)
    return bracket, (
        np.where(after, residual[off], at_low),
        np.where(after, at_high, residual[off]),
    )


@with_kernel
@np.errstate(all="ignore")
def rank_corners(
    samples: Samples, slopes: Slopes, guesses: CrossingGuesses, points: Floats
) -> CornerChoices:
    """Return the corners of the crossed faces that are nearest to the points and the tangents.

    For a line, and up to the second order for a curve, that is the best voxel among all with
    this coordinate on the dominant axis.

    Parameters
    ----------
    samples : Samples
        Along the curves.
    slopes : Slopes
        At the samples.
    guesses : Aims
        Which planes are crossed, where.
    points : (3, n) float64 array
        The crossings.

    Returns
    -------
    nearest, better : (3, n) int32 arrays
        The corner nearest to the crossing, and the one nearest to the tangent.
    gain : (n,) float64 array
        How much nearer to the tangent that is than ``nearest``, in square voxels; infinite where
        ``nearest`` is the best.
    foot : (n,) float64 array
        Where the better corner is further than sqrt(1/2) from the crossing: the way to the foot of
        the perpendicular along the tangent, in steps between samples. Infinite elsewhere.

    """
    left, axis, tau = guesses.sample, guesses.axis, guesses.tau
    h = samples.t[left + 1] - samples.t[left]
    tangent = slopes.leaving.take(left, axis=1) * h  # per step, not per t
    after = slopes.arriving.take(left + 1, axis=1) * h
    tangent += tau * (after - tangent)

    length = np.maximum(np.sqrt((tangent * tangent).sum(axis=0)), np.finfo(float).tiny)
    along = tangent / length
    # The curve is found near the plane, and followed to the plane itself along its tangent.
    at = np.multiply(axis, axis.size, dtype=np.int64) + np.arange(axis.size)  # of flat rows
    off_plane = (points.take(at) - guesses.level) / along.take(at)
    lost = ~(np.abs(off_plane) < MAX_PROJECTION)
    if lost.any():
        off_plane[lost] = 0.0
        along[:, lost & ~np.isfinite(along).all(axis=0)] = 0.0
    on_plane = points - off_plane * along
    nearest = np.floor(on_plane + TIE_TOLERANCE)
    plane = guesses.level - 0.5
    nearest.reshape(-1)[at] = plane
    apart = nearest + 0.5 - on_plane
    project = (apart * along).sum(axis=0)
    # Offsets from the plane's point are at most sqrt(1/2): few can be too long from the other one.
    more = off_plane * (off_plane - 2.0 * project)
    far = (more > MAX_SQUARE - 0.500001).nonzero()[0]
    if far.size:
        square = (apart[:, far] * apart[:, far]).sum(axis=0) + more[far]
        far = far[square > MAX_SQUARE]
        nearest[:, far] = np.floor(points[:, far] + TIE_TOLERANCE)
        nearest[axis[far], far] = plane[far]
        apart[:, far] = nearest[:, far] + 0.5 - points[:, far]
        project[far] = (apart[:, far] * along[:, far]).sum(axis=0)
    # The other corner along axis b is a unit step e_b away, towards the crossing. With w the
    # tangent's direction, D = ``apart``, that changes |D|^2 - (D.w)^2 by 1 - 2|D_b| - (2 p + s) s
    # with p = D.w and s = w.e_b. Two such steps change it by the sum of both minus 2 s s'.
    changes, shifts = [], []
    for off, way in zip(_other_axes(apart, axis), _other_axes(along, axis), strict=True):
        shift = np.where(off > 0, -way, way)
        shifts.append(shift)
        changes.append(1.0 - 2.0 * np.abs(off) - (2.0 * project + shift) * shift)
    best = np.where(changes[0] < -MIN_GAIN, changes[0], 0.0)
    other = changes[1] < best - MIN_GAIN
    best = np.where(other, changes[1], best)
    total = changes[0] + changes[1] - 2.0 * shifts[0] * shifts[1]
    both = total < best - MIN_GAIN
    best = np.where(both, total, best)

    nearest = nearest.astype(np.int32)
    better, gain, foot = nearest.copy(), np.full(axis.size, np.inf), np.full(axis.size, np.inf)
    moved = (best < 0).nonzero()[0]
    gain[moved] = -best[moved]
    axis, both, other = axis[moved], both[moved], other[moved]
    apart, along = apart.take(moved, axis=1), along.take(moved, axis=1)
    each = np.arange(moved.size)
    first, second = np.where(axis == 0, 1, 0), np.where(axis == 2, 1, 2)
    for across, moves in ((first, both | ~other), (second, both | other)):
        better[across, moved] += np.where(apart[across, each] > 0, -1, 1) * moves
    apart = better.take(moved, axis=1) + 0.5 - points.take(moved, axis=1)
    far = ((apart * apart).sum(axis=0) > 0.5).nonzero()[0]
    foot[moved[far]] = (apart[:, far] * along[:, far]).sum(axis=0) / length[moved[far]]
    return CornerChoices(nearest, better, gain, foot)


def _other_axes(rows: Floats, axis: NDArray[np.int8]) -> tuple[Floats, Floats]:
    """Return the two of three rows, (3, n), other than ``axis``, (n,), in order."""
    return np.where(axis == 0, rows[1], rows[0]), np.where(axis == 2, rows[1], rows[2])


def _select_axis(rows: Floats, axis: NDArray[np.int8]) -> Floats:
    """Return of three rows, (3, n), the one of ``axis``, (n,)."""
    return np.asarray(np.where(axis == 0, rows[0], np.where(axis == 1, rows[1], rows[2])))
