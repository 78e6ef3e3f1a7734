"""From curves to sequences, in batches: sample, trace, thin, close, hand out.

This module only puts the steps in order; it must not know how they are done.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from time import perf_counter

import numpy as np

from voxdisplay.curves.curve import Curve
from voxdisplay.errors import CurveError
from voxdisplay.voxelize.batch import Batch, Bools, Ints, Samples
from voxdisplay.voxelize.events import Events, near
from voxdisplay.voxelize.grid_plane import trace
from voxdisplay.voxelize.knots import knots
from voxdisplay.voxelize.reduce import reduce
from voxdisplay.voxelize.seam import close_loop
from voxdisplay.voxelize.sequence import Sequence

# Curves handled at once: enough to forget what a batch costs, but not many if they are long.
CURVES = 1024
VOXELS = 2_000_000
# Ends this near to each other, in voxels, are one point, if the curve does not say.
TOUCH = 1e-3


def digitise(curves: Iterable[Curve]) -> list[Sequence]:
    """Find the voxels of curves, one sequence for each, by grid-plane intersection."""
    curves = list(curves)
    sequences: list[Sequence] = []
    size = 16
    while rest := curves[len(sequences) : len(sequences) + size]:
        fresh = list(_digitise(Batch(rest, len(sequences) if len(curves) > 1 else None)))
        sequences += fresh
        size = min(CURVES, VOXELS * len(fresh) // sum(map(len, fresh)) + 1)
    return sequences


def _digitise(batch: Batch) -> Iterator[Sequence]:
    begin = perf_counter()
    samples = knots(batch)
    events = reduce(trace(batch, samples))
    closed = _closed(batch, samples)
    starts = _starts(events)
    voxels, t = np.ascontiguousarray(events.voxels.T), events.t
    voxels.flags.writeable = t.flags.writeable = False
    # Curve i has the pieces of[i] to of[i + 1], which begin and end at these of the bounds.
    of = np.searchsorted(samples.curve[events.piece[starts]], np.arange(len(batch.curves) + 1))
    bounds = np.append(starts, len(voxels))
    seconds = (perf_counter() - begin) / len(voxels)
    for index, curve in enumerate(batch.curves):
        begin = perf_counter()
        own = slice(bounds[of[index]], bounds[of[index + 1]])
        own_starts = starts[of[index] : of[index + 1]] - own.start
        own_voxels, own_t = voxels[own], t[own]
        closes = bool(closed[index]) and own_starts.size == 1
        if closes:
            thin = events.take(np.arange(own.start, own.stop))
            loop = close_loop(thin, curve.position, batch.last[index])
            own_voxels, own_t = np.ascontiguousarray(loop.voxels.T), loop.t
            own_voxels.flags.writeable = own_t.flags.writeable = False
        spent = seconds * len(own_voxels) + perf_counter() - begin
        yield Sequence(own_voxels, closes, own_starts, own_t, curve, spent)


def _starts(events: Events) -> Ints:
    """Find where pieces begin. A gap that could not be bridged is a jump like any other."""
    here, there = events.voxels[:, :-1], events.voxels[:, 1:]
    return np.concatenate(([0], np.flatnonzero(~(events.joined & near(here, there))) + 1))


def _closed(batch: Batch, samples: Samples) -> Bools:
    """Tell which curves are closed, and stop at those that only say so."""
    first = np.searchsorted(samples.curve[samples.piece], np.arange(len(batch.curves)))
    last = np.append(first[1:], samples.t.size) - 1
    apart = np.abs(samples.points[:, first] - samples.points[:, last]).max(axis=0)
    way = np.abs(samples.points - samples.points[:, np.repeat(first, last + 1 - first)])
    extent = np.maximum.reduceat(way.max(axis=0), first)  # a mere point is not closed
    meet = near(
        np.floor(samples.points[:, first]).astype(np.int32),
        np.floor(samples.points[:, last]).astype(np.int32),
    )
    said = [curve.closed for curve in batch.curves]
    for index, claim in enumerate(said):
        if claim and not meet[index]:
            raise CurveError(
                f"{batch.name(index)}the curve is said to be closed, but its ends are "
                f"{apart[index]:.6g} voxels apart",
                hint="leave out `closed`, or complete the curve",
            )
    found = (apart <= TOUCH) & (extent > TOUCH)
    return np.array(
        [own if claim is None else claim for own, claim in zip(found, said, strict=True)]
    )
