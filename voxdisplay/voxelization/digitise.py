"""Digitisation pipeline: curves to sequences, in batches.

Sample, find crossings, trace, thin, close, prove. This module only orders the steps; it must not
know how they are done.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from itertools import pairwise
from operator import attrgetter
from time import perf_counter

import numpy as np

from voxdisplay.compute import kernel_backend, parallel
from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.compute.garbage_collection import garbage_collection_paused
from voxdisplay.curves.curve import Curve
from voxdisplay.errors import CurveError
from voxdisplay.voxelization.adaptive_sampling import (
    check_total,
    initial_samples,
    refine_samples,
    split_at_jumps,
)
from voxdisplay.voxelization.curve_batch import CLOSURE_TOLERANCE, CurveBatch, Samples
from voxdisplay.voxelization.grid_plane import trace_curves
from voxdisplay.voxelization.plane_crossings import dominant_crossings
from voxdisplay.voxelization.sequence import Sequence
from voxdisplay.voxelization.thinning import thin_events
from voxdisplay.voxelization.voxel_events import VoxelEvents

# Curves handled at once: enough to make the cost of a batch negligible, but fewer if they are long:
# all processors together hold at most so many voxels.
MAX_BATCH_CURVES = 2048
MAX_BATCH_VOXELS = 2_000_000
# Batches for each processor before their size is adapted again to the length of the curves.
BATCHES_PER_PROCESSOR = 4

ONE_PIECE = np.zeros(1, dtype=np.int64)
ONE_PIECE.flags.writeable = False
NO_CORNERS = np.empty(0, dtype=np.int64)


def digitise(curves: Iterable[Curve], *, certified: bool = False) -> Iterator[list[Sequence]]:
    """Yield the sequences of curves, in order, by grid-plane intersection digitisation.

    They come in batches, so that what is done with one needs no memory when the next one comes.
    """
    curves = list(curves)

    @np.errstate(all="ignore")
    def one_batch(low: int, size: int) -> list[Sequence]:
        batch = CurveBatch(curves[low : low + size], low if len(curves) > 1 else None)
        ahead = (len(curves) - low) / len(batch.curves)
        while True:
            try:
                return _digitise_batch(batch, ahead, certified=certified)
            except CurveError:  # of which a singular parameter that bounds do not show is one
                if not batch.complete_undefined():
                    raise

    size, batches, total, begin = 16, 1, 0, 0
    while begin < len(curves):
        end = min(begin + size * batches, len(curves))
        # Many short array operations in numpy would only wait for each other.
        apart = kernel_backend.enabled() and all(map(attrgetter("thread_safe"), curves[begin:end]))
        do = parallel.ordered_map if apart else map
        voxels = 0
        for fresh in do(partial(one_batch, size=size), range(begin, end, size)):
            voxels += sum([len(sequence.voxels) for sequence in fresh])
            yield fresh
        total += voxels
        check_total(total)
        at_once = parallel.cpu_count()
        batches = at_once * (BATCHES_PER_PROCESSOR if apart else 1)
        size = min(MAX_BATCH_CURVES, MAX_BATCH_VOXELS // at_once * (end - begin) // voxels + 1)
        begin = end


def _digitise_batch(batch: CurveBatch, ahead: float, *, certified: bool) -> list[Sequence]:
    begin = perf_counter()
    samples = refine_samples(batch, initial_samples(batch))
    kernel_backend.enable_if_worthwhile(samples.t.size, ahead)
    if certified:
        from voxdisplay.voxelization.coverage_proof import enclose, prove  # noqa: PLC0415 - on request

        boxes, samples = enclose(batch, samples)
    samples = split_at_jumps(batch, samples)
    closed = _closed(batch, samples)
    crossings, parts = dominant_crossings(batch, samples), samples
    some_closed = bool(closed.any())
    if some_closed:
        from voxdisplay.voxelization.loop_closing import close_loops, loops_of  # noqa: PLC0415
        from voxdisplay.voxelization.loop_corners import (  # noqa: PLC0415 - many are open
            join_at_corners,
            split_at_corners,
        )

        crossings, parts, whole = split_at_corners(batch, crossings, samples, closed)
    traced = trace_curves(batch, crossings, parts)
    events = thin_events(traced, parts, keep_tips=certified)
    corners = NO_CORNERS
    if some_closed and parts is not samples:
        events, corners = join_at_corners(events, whole)
        traced, _ = join_at_corners(traced, whole)
    starts = _starts(events)
    voxels, t = np.ascontiguousarray(events.voxels.T), events.t
    voxels.flags.writeable = t.flags.writeable = False
    # Curve i has the pieces of[i] to of[i + 1], which begin and end at these of the bounds.
    of = np.searchsorted(samples.curve[events.piece[starts]], np.arange(len(batch.curves) + 1))
    bounds = np.append(starts, len(voxels))[of]
    single = np.diff(of) == 1
    ends, changed = bounds[1:].copy(), {}
    if some_closed:
        closed &= single
        index = closed.nonzero()[0]
        loops = loops_of(events, index, bounds[index], bounds[index + 1])
        ends[index] = loops.begin + loops.size
        changed = close_loops(batch, events, loops, corners)
    seconds = (perf_counter() - begin) / len(voxels)
    begins = bounds[:-1].tolist()
    listed = begins, ends.tolist(), closed.tolist()
    with garbage_collection_paused():
        if single.all():  # as most are
            sequences = [
                Sequence(voxels[a:b], loop, ONE_PIECE, t[a:b], curve, seconds * (b - a))
                for curve, a, b, loop in zip(batch.curves, *listed, strict=True)
            ]
        else:
            own_starts = [starts[i:j] - starts[i] for i, j in pairwise(of.tolist())]
            sequences = [
                Sequence(voxels[a:b], loop, own, t[a:b], curve, seconds * (b - a))
                for curve, a, b, loop, own in zip(batch.curves, *listed, own_starts, strict=True)
            ]
    for number, (own_voxels, own_t) in changed.items():
        curve, spent = batch.curves[number], seconds * len(own_voxels)
        sequences[number] = Sequence(own_voxels, True, ONE_PIECE, own_t, curve, spent)
    return [*prove(batch, sequences, boxes, bounds, events, traced)] if certified else sequences


def _starts(events: VoxelEvents) -> Ints:
    """Return where pieces begin. A gap that could not be bridged counts as a jump."""
    ends = np.flatnonzero(events.piece[1:] != events.piece[:-1])
    gaps = events.gaps()
    ends = np.sort(np.concatenate((ends, gaps))) if gaps.size else ends
    return np.concatenate(([0], ends + 1))


def _closed(batch: CurveBatch, samples: Samples) -> Bools:
    """Return which curves are closed; raise CurveError if one is declared so but is not."""
    first = samples.curve_starts(len(batch.curves))
    last = np.append(first[1:], samples.t.size) - 1
    ends = samples.points.take(first, axis=1), samples.points.take(last, axis=1)
    apart = np.abs(ends[0] - ends[1]).max(axis=0)
    closed = np.asarray(apart <= CLOSURE_TOLERANCE)
    if closed.any():
        # A curve that stays in one point is not closed.
        extent = np.maximum.reduceat(samples.points, first, axis=1)
        extent -= np.minimum.reduceat(samples.points, first, axis=1)
        closed &= extent.max(axis=0) > CLOSURE_TOLERANCE
    declared = batch.declared_closed
    closed = np.where(declared < 0, closed, declared > 0)
    far = (np.abs(np.floor(ends[0]) - np.floor(ends[1])) > 1).any(axis=0) & (declared > 0)
    if far.any():
        index = int(far.argmax())
        raise CurveError(
            f"{batch.message_prefix(index)}the curve is said to be closed, but its ends are "
            f"{apart[index]:.6g} voxels apart",
            hint="leave out `closed`, or complete the curve",
        )
    return closed
