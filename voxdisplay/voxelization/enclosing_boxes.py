"""Boxes that provably enclose curves, and samples of the features they reveal.

Samples prove nothing about a curve between them, however many there are; bounds of its formula
do. The range of t is cut until each interval's part of the curve is proven to be in a small box
(`Curve.enclosure`). This module must not know voxels, nor how bounds are computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.curves.singular_points import singular_points
from voxdisplay.voxelization.curve_batch import AXES, CurveBatch, Samples
from voxdisplay.voxelization.index_ranges import expand_ranges

# Boxes are narrower than this on every axis, in voxels.
WIDTH = 1.0
# A part of the curve that may be further than this from the chord between two samples, in voxels
# along an axis, was overlooked: samples are inserted.
MAX_DEVIATION = 0.5
# Boxes for one curve, at most.
MAX_BOXES = 2_000_000
# Intervals of which nothing is known lie around single parameters; as many as these, beside those
# that a curve has to begin with, are a stretch without values, which cutting cannot settle.
MAX_UNBOUNDED = 4096
# An interval is cut into at most so many parts at once.
MAX_PARTS = 16
# Intervals whose bounds are found at once: what is computed stays in a core's cache.
INTERVALS_PER_CALL = 1 << 12


@dataclass(frozen=True, slots=True)
class Boxes:
    """Boxes that hold curves, each from one parameter to another.

    Attributes
    ----------
    curve : (n,) int64 array
        Index of the curve, ascending.
    step : (n,) int64 array
        The sample before each.
    t_lo, t_hi : (n,) float64 arrays
        Ascending along a curve; without a gap if it is not among ``obstacles``.
    low, high : (3, n) float64 arrays
        Bounds of P(t), t_lo <= t <= t_hi, in voxels.
    doubts : dict of int to str
        The curves of which not all is in boxes: why.

    """

    curve: Ints
    step: Ints
    t_lo: Floats
    t_hi: Floats
    low: Floats
    high: Floats
    obstacles: dict[int, str]

    def of_curve(self, index: int) -> slice:
        """Return the slice of a curve's boxes."""
        return slice(*np.searchsorted(self.curve, (index, index + 1)))


def enclose_curves(batch: CurveBatch, samples: Samples) -> Boxes:
    """Return boxes narrower than ``WIDTH`` that enclose curves.

    Parameters
    ----------
    batch : CurveBatch
        The curves.
    samples : Samples
        Where to cut first; not yet cut at jumps, so that pieces are curves.

    """
    doubts = {
        index: "the curve is a function whose inside is not known"
        for index, curve in enumerate(batch.curves)
        if curve.enclosure(batch.first[index : index + 1], batch.first[index : index + 1]) is None
    }
    step = np.flatnonzero(samples.joined)
    step = step[_provable(samples.piece[step], doubts)]
    chord = np.abs(samples.points[:, step + 1] - samples.points[:, step]).max(axis=0, initial=0.0)
    # As long as bounds are tight, that many boxes are needed.
    parts = np.clip(np.ceil(1.05 * chord / WIDTH), 1, MAX_PARTS).astype(np.int64)
    step, t_lo, t_hi = _subdivide(step, samples.t[step], samples.t[step + 1], parts)
    settled = []
    most_unknown = np.bincount(samples.piece[step], minlength=len(batch.curves)) + MAX_UNBOUNDED
    count = np.zeros(len(batch.curves), dtype=np.int64)
    while step.size:
        curve = samples.piece[step]
        low, high = _bounds(batch, curve, t_lo, t_hi)
        with np.errstate(all="ignore"):
            width = (high - low).max(axis=0)
        good = width < WIDTH  # and so not where nothing is known
        settled.append((step[good], t_lo[good], t_hi[good], low[:, good], high[:, good]))
        count += np.bincount(curve[good], minlength=count.size)
        possible = np.floor((t_hi - t_lo) / batch.resolution[curve])
        stuck = ~good & (possible < 2)
        for at in np.flatnonzero(stuck)[::-1].tolist():  # of several, the first is named
            axis = AXES[int(np.argmin(high[:, at] - low[:, at] < WIDTH))]
            doubts[int(curve[at])] = (
                f"{axis} may jump, or have no value, near t = {float(t_lo[at])!r}"
            )
        left = ~good & _provable(curve, doubts)
        parts = np.where(np.isnan(width), 2, np.clip(1.1 * width / WIDTH, 2, MAX_PARTS))
        parts = np.minimum(np.ceil(parts), possible)[left].astype(np.int64)
        count_next = count + np.bincount(curve[left], parts, count.size).astype(np.int64)
        for index in np.flatnonzero(count_next > MAX_BOXES).tolist():
            doubts[index] = f"more than {MAX_BOXES} boxes would be needed"
        unknown = np.bincount(curve[left], np.isnan(width[left]), count.size)
        for index in np.flatnonzero(unknown > most_unknown).tolist():
            near = float(t_lo[left][(curve[left] == index) & np.isnan(width[left])][0])
            doubts[index] = f"there may be no curve at all near t = {near!r}"
        on = _provable(curve[left], doubts)
        step, t_lo, t_hi = _subdivide(step[left][on], t_lo[left][on], t_hi[left][on], parts[on])
    for index in doubts:
        if points := singular_points(batch.curves[index]):
            doubts[index] = f"{points[0]}; that rests on a numerical limit, which proves nothing"
    if not settled:
        nothing = np.empty(0)
        rows = np.empty((3, 0))
        return Boxes(step, step, nothing, nothing, rows, rows, doubts)
    step, t_lo, t_hi = (np.concatenate([found[i] for found in settled]) for i in (0, 1, 2))
    low, high = (np.concatenate([found[i] for found in settled], axis=1) for i in (3, 4))
    order = np.lexsort((t_lo, step))
    step = step[order]
    return Boxes(
        samples.piece[step], step, t_lo[order], t_hi[order], low[:, order], high[:, order], doubts
    )


def _provable(curve: Ints, doubts: dict[int, str]) -> Bools:
    return ~np.isin(curve, list(doubts)) if doubts else np.ones(curve.size, dtype=bool)


def _subdivide(step: Ints, t_lo: Floats, t_hi: Floats, parts: Ints) -> tuple[Ints, Floats, Floats]:
    """Return intervals cut into equal parts, which share their ends to the last bit."""
    nth = expand_ranges(np.zeros_like(parts), parts)
    step, t_lo, t_hi = np.repeat(step, parts), np.repeat(t_lo, parts), np.repeat(t_hi, parts)
    parts = np.repeat(parts, parts)
    begin = t_lo + (t_hi - t_lo) * (nth / parts)
    end = np.where(nth + 1 == parts, t_hi, t_lo + (t_hi - t_lo) * ((nth + 1) / parts))
    return step, begin, end


def _bounds(batch: CurveBatch, curve: Ints, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
    low, high = np.empty((3, t_lo.size)), np.empty((3, t_lo.size))
    order = np.argsort(curve, kind="stable")
    edges = np.flatnonzero(np.diff(curve[order])) + 1
    with np.errstate(all="ignore"):
        for start, stop in pairwise([0, *edges.tolist(), curve.size]):
            enclosure = batch.curves[curve[order[start]]].enclosure
            for begin in range(start, stop, INTERVALS_PER_CALL):
                some = order[begin : min(begin + INTERVALS_PER_CALL, stop)]
                box = enclosure(t_lo[some], t_hi[some])
                if box is not None:
                    low[:, some], high[:, some] = box
    return low, high


def sample_overlooked(batch: CurveBatch, samples: Samples, boxes: Boxes) -> Samples:
    """Return samples with more where a curve may leave the chords of those there are.

    Parameters
    ----------
    batch : CurveBatch
        The curves.
    samples : Samples
        Those that the boxes were made with.
    boxes : Boxes

    Returns
    -------
    Samples
        The same, with the box ends of every step of which a box lies more than ``MAX_DEVIATION``
        off its chord. Between two of them the curve moves by less than ``WIDTH``.

    """
    before, after = boxes.step, boxes.step + 1
    begin, chord = samples.points[:, before], np.diff(samples.points, axis=1)[:, before]
    t, h = samples.t[before], samples.t[after] - samples.t[before]
    ends = [begin + chord * ((each - t) / h) for each in (boxes.t_lo, boxes.t_hi)]
    under = np.minimum(*ends) - boxes.low
    over = boxes.high - np.maximum(*ends)
    deviates = np.maximum(under, over).max(axis=0) > MAX_DEVIATION
    resampled = np.zeros(samples.t.size, dtype=bool)
    resampled[before[deviates]] = True
    inserted = np.flatnonzero(resampled[before] & (boxes.t_lo > t))
    if not inserted.size:
        return samples
    at, t_fresh, curve = after[inserted], boxes.t_lo[inserted], boxes.curve[inserted]
    return Samples(
        np.insert(samples.piece, at, curve),
        np.insert(samples.t, at, t_fresh),
        np.insert(samples.points, at, batch.evaluate(curve, t_fresh), axis=1),
        samples.curve,
    )
