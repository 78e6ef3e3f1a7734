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
    of_start = samples.curve[events.piece[starts]]
    bounds = np.append(starts, events.t.size)[
        np.searchsorted(of_start, np.arange(len(batch.curves) + 1))
    ]
    voxels = np.ascontiguousarray(events.voxels.T)
    seconds = (perf_counter() - begin) / max(len(voxels), 1)
    for index, curve in enumerate(batch.curves):
        begin = perf_counter()
        own = slice(bounds[index], bounds[index + 1])
        own_voxels, t = voxels[own], events.t[own]
        own_starts = starts[np.searchsorted(starts, own.start) : np.searchsorted(starts, own.stop)]
        closes = bool(closed[index]) and own_starts.size == 1
        if closes:
            loop = close_loop(
                events.take(np.arange(own.start, own.stop)), curve.position, batch.last[index]
            )
            own_voxels, t = np.ascontiguousarray(loop.voxels.T), loop.t
        own_voxels.flags.writeable = t.flags.writeable = False
        yield Sequence(
            voxels=own_voxels,
            closed=closes,
            starts=own_starts - own.start,
            t=t,
            curve=curve,
            seconds=seconds * len(own_voxels) + perf_counter() - begin,
        )


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
