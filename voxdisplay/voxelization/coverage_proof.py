"""Proofs that sequences cover their curves: enclose, certify, and restore voxels where need be.

Must not know how curves are traced, but that all crossings with grid planes can be had again.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from time import perf_counter

import numpy as np

from voxdisplay.compute.array_types import Ints
from voxdisplay.voxelization.adaptive_sampling import refine_samples
from voxdisplay.voxelization.certify import Certificate, certify
from voxdisplay.voxelization.curve_batch import CurveBatch, Samples
from voxdisplay.voxelization.enclosing_boxes import Boxes, enclose_curves, sample_overlooked
from voxdisplay.voxelization.grid_plane import trace_all_planes
from voxdisplay.voxelization.restoring import restore_coverage
from voxdisplay.voxelization.sequence import Sequence
from voxdisplay.voxelization.thinning import thin_events
from voxdisplay.voxelization.voxel_events import VoxelEvents


def enclose(batch: CurveBatch, samples: Samples) -> tuple[Boxes, Samples]:
    """Return boxes that enclose the curves of a batch, and the samples with those they reveal."""
    boxes = enclose_curves(batch, samples)
    return boxes, refine_samples(batch, sample_overlooked(batch, samples, boxes))


def prove(
    batch: CurveBatch,
    sequences: Iterable[Sequence],
    boxes: Boxes,
    bounds: Ints,
    thin: VoxelEvents,
    traced: VoxelEvents,
) -> Iterator[Sequence]:
    """Yield sequences with their proofs, restored if need be, or with the reasons why not.

    Parameters
    ----------
    batch : CurveBatch
    sequences : iterable of Sequence
        One for each curve of the batch.
    boxes : Boxes
        Of `enclose`.
    bounds : (n + 1,) int array
        Curve i has the voxels ``bounds[i]`` to ``bounds[i + 1]`` of ``thin``.
    thin, traced : VoxelEvents
        The voxels after and before thinning.

    """
    for number, sequence in enumerate(sequences):
        begin = perf_counter()
        own = thin.take(np.arange(bounds[number], bounds[number + 1]))
        proven = _with_proof(batch, sequence, boxes, number, own, traced)
        spent = sequence.seconds * len(proven) / len(sequence) + perf_counter() - begin
        yield replace(proven, seconds=spent)


def _with_proof(
    batch: CurveBatch,
    sequence: Sequence,
    boxes: Boxes,
    index: int,
    thin: VoxelEvents,
    traced: VoxelEvents,
) -> Sequence:
    """Return the sequence with its proof, restored if need be, or with the reason why not."""
    if index in boxes.obstacles:
        return replace(sequence, proof=boxes.obstacles[index])
    if len(sequence.starts) > 1:
        return replace(sequence, proof="the curve jumps")
    own = boxes.of_curve(index)
    ends = boxes.t_lo[own], boxes.t_hi[own]
    box = boxes.low[:, own], boxes.high[:, own]
    curve, closed = sequence.curve, sequence.closed
    proof = certify(curve, ends, box, sequence.voxels, sequence.t, closed=closed)
    for again in (False, True):
        if isinstance(proof, Certificate):
            break
        if again:
            t = np.append(ends[0], ends[1][-1])
            of = np.full(t.size, index)
            points = batch.evaluate(of, t)
            samples = Samples(np.zeros_like(of), t, points, np.array([index]))
            full = trace_all_planes(batch, samples)
            thin = thin_events(full, samples, keep_tips=True)
        else:
            full = traced.take(traced.piece == thin.piece[0])
        restored = restore_coverage(thin, full, ends, box, closed=closed)
        voxels = np.ascontiguousarray(restored.voxels.T)
        voxels.flags.writeable = restored.t.flags.writeable = False
        second = certify(curve, ends, box, voxels, restored.t, closed=closed)
        if isinstance(second, Certificate):
            return replace(sequence, voxels=voxels, t=restored.t, proof=second)
    return replace(sequence, proof=proof)
