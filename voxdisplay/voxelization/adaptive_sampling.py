"""Adaptive sampling of curves, with detection of jumps.

Between two samples a curve is taken to be nearly straight. Curves that cannot be drawn are refused
here, before they cost time and memory. This module must not know what a voxel sequence is.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.curves.curve import NO_BREAKS
from voxdisplay.errors import CurveError
from voxdisplay.voxelization.curve_batch import AXES, CurveBatch, Samples
from voxdisplay.voxelization.length_estimate import estimated_min_length

# A longer curve is a mistake, not a picture: 256^3 has 17 million voxels in all.
MAX_VOXELS = 10_000_000
MAX_SAMPLES = 4_000_000
# All curves of a call together: their voxels, in all, and samples and jumps of those at work.
MAX_TOTAL_VOXELS = 4 * MAX_VOXELS
MAX_TOTAL_SAMPLES = 3 * MAX_SAMPLES
# Each jump takes some 200 samples to be found.
MAX_JUMPS = 1 << 14
MAX_TOTAL_JUMPS = 4 * MAX_JUMPS
# A curve with chords shorter than this, in voxels, all along, oscillates: see `check_estimate`.
WIDE = 100.0
# A step is still beside a jump if it is shorter than this share of the longest that need no split.
JUMP_CONTRAST = 1e-2
# From so many samples of a curve on, its length is estimated before it gets more.
MANY_SAMPLES = 1 << 13
# A step between samples may be this long (voxels, along its longest axis) and bend this far off its
# chord (voxels). No guarantee rests on these: they only decide how small a feature is found.
MAX_CHORD = 3.0
MAX_SAG = 0.05
# A step is cut into at most so many parts at once.
MAX_PARTS = 16
# Steps are cut so much finer than they seem to need: parts that just failed would take one more
# pass over everything, which takes longer than a few more samples.
OVERSPLIT = 1.3
# A step between neighbouring parameters that is longer than this, in voxels, is a jump; a shorter
# one cannot be told from a step between adjacent voxels.
MIN_JUMP = 1.0

# Number of steps of the initial sampling. A polynomial turns so rarely that fewer will do.
INITIAL_STEPS = 64
INITIAL_STEPS_PER_COEFFICIENT = 4


@cache
def _initial_shares(degree: int | None) -> Floats:
    """Return the parameters of the initial samples, as shares of the range.

    They are spread evenly but for a jitter (multiples of the golden ratio, modulo 1), so that no
    oscillation can hide between them by having their period.
    """
    steps = (
        INITIAL_STEPS
        if degree is None
        else min(INITIAL_STEPS_PER_COEFFICIENT * (degree + 1), INITIAL_STEPS)
    )
    # Symmetric about the middle, so that a curve and its reverse are sampled at the same points.
    inner = np.arange(1, (steps + 1) // 2)
    jitter = (inner * (5**0.5 - 1) / 2 % 1 - 0.5) * 0.6
    shares = np.linspace(0.0, 1.0, steps + 1)
    shares[inner] += jitter / steps
    shares[steps - inner] -= jitter / steps
    return shares


def refine_samples(batch: CurveBatch, samples: Samples) -> Samples:
    """Return samples that resolve the features of curves.

    Steps are split until none is longer than ``MAX_CHORD`` or bends more than ``MAX_SAG``; the bend
    h^2 |P''| / 8 is taken from second divided differences.

    Parameters
    ----------
    batch : CurveBatch
        The curves.
    samples : Samples
        One piece for each curve.

    Raises
    ------
    CurveError
        If a curve runs off, does not settle, or would need too many voxels, or all together.

    """
    estimated: set[int] = set()
    while True:
        parts, chord = subdivision_counts(samples, batch.resolution)
        if not (parts > 1).any():
            return samples
        if parts.sum() > MANY_SAMPLES:
            _check_estimates(batch, samples, parts, estimated)
            _check_jumps(batch, samples, chord)
        _check_limits(batch, samples, parts, chord)
        samples = batch.subdivide(samples, parts)


@np.errstate(all="ignore")  # between pieces, a step has no meaning and may be of any size
def limit_chords(batch: CurveBatch, samples: Samples, longest: float) -> Samples:
    """Split steps until none is longer than ``longest`` voxels in max norm, if t can be split."""
    while True:
        chord = np.abs(samples.points[:, 1:] - samples.points[:, :-1]).max(axis=0)
        curve = samples.curve[samples.piece[:-1]]
        possible = np.floor((samples.t[1:] - samples.t[:-1]) / batch.resolution[curve])
        wanted = np.minimum(np.ceil(chord / longest), np.minimum(possible, MAX_PARTS))
        parts = np.maximum(wanted, 1).astype(np.int64)
        parts[~samples.joined] = 1
        if not (parts > 1).any():
            return samples
        count = np.bincount(curve, parts * samples.joined, len(batch.curves))
        if (count > MAX_SAMPLES).any():
            raise _roughness_error(batch, int(np.argmax(count)))
        samples = batch.subdivide(samples, parts)


def initial_samples(batch: CurveBatch) -> Samples:
    """Return the initial samples of curves, one piece for each."""
    check_lengths(batch)
    degrees = batch.degrees
    index = np.arange(len(degrees))
    if degrees.count(degrees[0]) == len(degrees):  # as most often, and it takes half the time
        look = np.tile(_initial_shares(degrees[0]), len(degrees))
        piece = index.repeat(look.size // len(degrees))
    else:
        looks = list(map(_initial_shares, degrees))
        look = np.concatenate(looks)
        piece = index.repeat([each.size for each in looks])
    t = batch.first[piece] + (batch.last - batch.first)[piece] * look
    t[np.append(piece[1:] != piece[:-1], True)] = batch.last
    breaks = [curve.breaks for curve in batch.curves]
    if any(each.size for each in breaks if each is not NO_BREAKS):
        piece, t = _insert_breaks(batch, piece, t, breaks)
    fresh = np.append(True, (piece[1:] != piece[:-1]) | (t[1:] != t[:-1]))
    if not fresh.all():  # a break was there, or a range has fewer parameters than it has looks
        piece, t = piece[fresh], t[fresh]
    return batch.settle_ties(Samples(piece, t, batch.evaluate(piece, t), index))


def _insert_breaks(
    batch: CurveBatch, piece: Ints, t: Floats, breaks: list[Floats]
) -> tuple[Ints, Floats]:
    """Insert the parameters at which curves may turn sharply."""
    of = np.repeat(np.arange(len(breaks)), [each.size for each in breaks])
    turn = np.concatenate(breaks)
    inside = (turn > batch.first[of]) & (turn < batch.last[of])
    piece, t = np.append(piece, of[inside]), np.append(t, turn[inside])
    order = np.lexsort((t, piece))
    return piece[order], t[order]


@with_kernel
@np.errstate(all="ignore")
def subdivision_counts(samples: Samples, resolution: Floats) -> tuple[Ints, Floats]:
    """Return into how many parts each step should be cut, and its length in max norm."""
    joined = samples.joined
    h = np.where(joined, samples.t[1:] - samples.t[:-1], 1.0)
    step = samples.points[:, 1:] - samples.points[:, :-1]
    chord = np.abs(step).max(axis=0)
    chord[~joined] = 0.0
    velocity = step / h
    turn = np.abs(velocity[:, 1:] - velocity[:, :-1]).max(axis=0) / (h[1:] + h[:-1])
    turn[~(joined[1:] & joined[:-1])] = 0.0
    second = np.zeros(h.size)  # |P''| / 2 over a step: the larger of its two ends
    second[1:] = turn
    second[:-1] = np.maximum(second[:-1], turn)
    bend = h * h * second / 4
    wanted = np.maximum(chord / MAX_CHORD, np.sqrt(bend / MAX_SAG))
    parts = np.ones(h.size, dtype=np.int64)
    cut = (joined & (wanted > 1)).nonzero()[0]  # not where the bend is not a number
    if cut.size:
        # Parts must stay distinct parameters.
        possible = np.floor(h[cut] / resolution[samples.curve[samples.piece[cut]]])
        ample = np.ceil(OVERSPLIT * wanted[cut])
        parts[cut] = np.maximum(np.minimum(np.minimum(ample, possible), MAX_PARTS), 1)
    return parts, chord


def _check_estimates(batch: CurveBatch, samples: Samples, parts: Ints, estimated: set[int]) -> None:
    """Raise CurveError if a curve that needs many samples is too long; check each once."""
    count = np.add.reduceat(parts * samples.joined, samples.bounds[:-1])
    for index in np.flatnonzero(count > MANY_SAMPLES).tolist():
        if index not in estimated:
            estimated.add(index)
            check_estimate(batch, index)


def check_estimate(batch: CurveBatch, index: int) -> None:
    """Raise CurveError if a curve is too long by an estimate of its length from below."""
    length, step = estimated_min_length(batch.curves[index])
    if length > MAX_VOXELS and step < MIN_JUMP / 2:
        raise _roughness_error(batch, index)
    if length > MAX_VOXELS:
        raise _length_error(batch, index, length)
    if 0 < step < WIDE:
        # An oscillation as wide as this bends as an arc of this radius does, or more, all along.
        samples = 2 * length / min(MAX_CHORD, (8 * MAX_SAG * step) ** 0.5)
        if samples > MAX_SAMPLES or _wriggles(samples, length):
            raise _roughness_error(batch, index)


def _wriggles(samples: float, length: float) -> bool:
    """Return whether a curve needs many samples for few voxels: it wriggles within a voxel."""
    return samples > MAX_SAMPLES // 16 + 3 * length


def _check_jumps(batch: CurveBatch, samples: Samples, chord: Floats) -> None:
    """Stop at curves that jump all along: at long steps whose neighbours hardly move."""
    still = chord < JUMP_CONTRAST * MAX_CHORD
    leaps = (chord[1:-1] > MAX_CHORD) & still[:-2] & still[2:]
    count = np.bincount(samples.piece[1:-2][leaps], minlength=len(batch.curves))
    if (count > MAX_JUMPS).any():
        index = int(np.argmax(count > MAX_JUMPS))
        raise CurveError(
            f"{batch.message_prefix(index)}the curve jumps at {count[index]} parameters or more, "
            f"and {MAX_JUMPS} is the limit",
            hint="shorten the range of t, or have it jump less often",
        )
    if count.sum() > MAX_TOTAL_JUMPS:
        raise CurveError(
            f"the curves jump at {count.sum()} parameters or more in all, "
            f"and {MAX_TOTAL_JUMPS} is the limit",
            hint="draw fewer of them, or have them jump less often",
        )


def check_lengths(batch: CurveBatch) -> None:
    """Raise CurveError if a curve is too long by the bound that its formula has."""
    lengths = batch.min_lengths
    if max(lengths) > MAX_VOXELS:
        index = int(np.argmax(np.array(lengths) > MAX_VOXELS))
        raise _length_error(batch, index, lengths[index])
    check_total(sum(lengths))


def check_total(length: float) -> None:
    """Raise CurveError if curves are too long together, in voxels."""
    if length > MAX_TOTAL_VOXELS:
        raise CurveError(
            f"the curves are too long together: {length:.3g} voxels at least, "
            f"and {MAX_TOTAL_VOXELS} is the limit",
            hint="draw fewer of them, shorten their ranges of t, or scale them down",
        )


def _length_error(batch: CurveBatch, index: int, length: float) -> CurveError:
    return CurveError(
        f"{batch.message_prefix(index)}the curve is too long: "
        f"{length:.3g} voxels at least, and {MAX_VOXELS} is the limit",
        hint="shorten the range of t, scale the curve down, or slow its oscillation",
    )


def _check_limits(batch: CurveBatch, samples: Samples, parts: Ints, chord: Floats) -> None:
    """Raise CurveError before a curve takes too many samples; ``parts`` are the next ones."""
    total = int(parts.sum())
    if total <= MAX_SAMPLES // 16 and chord.sum() <= MAX_VOXELS:
        return
    starts = samples.bounds[:-1]
    length = np.add.reduceat(chord, starts)
    count = np.add.reduceat(parts * samples.joined, starts)
    count -= [8 * len(each.breaks) for each in batch.curves]  # these may need some each
    wriggles = count > MAX_SAMPLES // 16 + 3 * length  # as `_wriggles`
    grows = np.maximum.reduceat(parts, starts) > 1  # others are done, and no concern of these
    over = grows & ((length > MAX_VOXELS) | (count > MAX_SAMPLES) | wriggles)
    excess = over.nonzero()[0]
    if not excess.size:
        check_total(float(length.sum()))
        if total > MAX_TOTAL_SAMPLES:
            raise CurveError(
                "the curves are too rough together: however finely they are sampled, they do not "
                "settle",
                hint="draw fewer of them, slow their oscillation, or shorten their ranges of t",
            )
        return
    index = int(excess[0])
    worst = int(np.argmax(np.where(samples.piece[:-1] == index, chord, -1.0)))
    if chord[worst] > max(0.1 * length[index], 1e3):
        raise _divergence_error(batch, index, samples, worst)
    if length[index] > MAX_VOXELS:
        raise _length_error(batch, index, float(length[index]))
    raise _roughness_error(batch, index)


def _roughness_error(batch: CurveBatch, index: int) -> CurveError:
    return CurveError(
        f"{batch.message_prefix(index)}the curve is too rough: "
        "however finely it is sampled, it does not settle",
        hint="slow its oscillation, or shorten the range of t",
    )


def _divergence_error(batch: CurveBatch, index: int, samples: Samples, at: int) -> CurveError:
    """Return the error that names the axis, and the t, that leaps in the step after ``at``."""
    t, points = samples.t[at : at + 2], samples.points[:, at : at + 2]
    row = int(np.argmax(np.abs(points[:, 1] - points[:, 0])))
    while t[1] - t[0] > batch.resolution[index]:
        t = np.linspace(t[0], t[1], MAX_PARTS + 1)
        points = batch.evaluate(np.full(t.size, index), t)  # raises where it is not finite
        leap = int(np.argmax(np.abs(np.diff(points[row]))))
        t, points = t[leap : leap + 2], points[:, leap : leap + 2]
    return CurveError(
        f"{batch.message_prefix(index)}{AXES[row]} does not settle near t = {float(t[0])!r}: "
        f"it leaps from {points[row, 0]:.6g} to {points[row, 1]:.6g}",
        axis=AXES[row],
        hint="shorten the range of t so that it keeps away from this parameter",
    )


def split_at_jumps(batch: CurveBatch, samples: Samples) -> Samples:
    """Split refined samples into pieces where curves jump.

    A step that is still wider than ``MIN_JUMP`` where parameters cannot be told apart any more is
    a jump. There is at least one sample per piece, and one piece per curve.
    """
    finest = samples.t[1:] - samples.t[:-1] < 2 * batch.resolution[samples.piece[:-1]]
    finest &= samples.joined
    if not finest.any():
        return samples
    chord = np.abs(np.diff(samples.points, axis=1)).max(axis=0)
    torn = finest & (chord > MIN_JUMP)
    if not torn.any():
        return samples
    # A jump tears one step, or two if a knot sits right on it. Where whole stretches are torn
    # the curve is a pole, or noise at the finest scale there is.
    stretch = torn[2:] & torn[1:-1] & torn[:-2]
    if stretch.any():
        at = int(np.argmax(np.where(stretch, chord[1:-1], -1.0))) + 1
        raise _divergence_error(batch, int(samples.piece[at]), samples, at)
    # A value between the sides, at a single parameter, is on neither: sign(t) is 0 at 0.
    kept = np.ones(samples.t.size, dtype=bool)
    kept[1:-1] = ~(torn[1:] & torn[:-1])
    opens = np.concatenate(([True], torn | ~samples.joined))[kept]
    curve = samples.piece[kept][opens]
    return Samples(np.cumsum(opens) - 1, samples.t[kept], samples.points[:, kept], curve)
