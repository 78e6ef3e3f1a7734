"""Checked evaluation of many curves at once.

Parameters and points only; this module must not know what a voxel is. All arrays hold many curves
(or pieces of curves), one after the other, so that a thousand short curves cost at most a thousand
calls of ``Curve.position`` and nothing else a thousand times. Results for a curve never depend on
its neighbours in the batch: decisions are taken per interval, and positions computed per curve.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.curves.batch_evaluation import BatchEvaluator
from voxdisplay.curves.curve import NO_BREAKS, Curve
from voxdisplay.curves.short_repr import short_repr
from voxdisplay.curves.singular_points import complete, singular_points
from voxdisplay.errors import CurveError
from voxdisplay.voxelization.index_ranges import expand_ranges, insert_columns

AXES = "xyz"

# Coordinates are moved so far, in voxels, towards the centre of the curve's box, and by less within
# ``CORE`` of it. What would lie on a boundary between voxels lies on the inner side of it then:
# ties are settled in a way that knows neither axis nor sign nor direction.
TIE_SHIFT = 1e-7
CORE = 0.25
# Ends this near to each other, in voxels, are one point, if the curve does not say.
CLOSURE_TOLERANCE = 1e-3
# A closed curve that turns more than this, 45 degrees, between its last initial sample and its
# first ones has a corner where it begins.
MAX_SMOOTH_COSINE = 0.7
# A coordinate is on a face of voxels if it is this near to a whole number.
ON_FACE = 1e-9

# Voxel indices are int32, and sums and differences of a few of them must be as well.
MAX_COORDINATE = 2.0**30


@dataclass(frozen=True, slots=True)
class Samples:
    """Points along pieces of curves.

    Attributes
    ----------
    piece : (K,) int64 array
        The piece each point belongs to, ascending.
    t : (K,) float64 array
        Parameters, ascending within a piece.
    points : (3, K) float64 array
        P(t), rows x, y, z, in voxels.
    curve : (pieces,) int64 array
        The curve that each piece is a part of, ascending.

    """

    piece: Ints
    t: Floats
    points: Floats
    curve: Ints

    @property
    def joined(self) -> Bools:
        """True for those of the K - 1 steps that stay inside a piece."""
        return np.asarray(self.piece[1:] == self.piece[:-1])

    @property
    def bounds(self) -> Ints:
        """Index of the first sample of each piece, and K: (pieces + 1,)."""
        return self.piece.searchsorted(np.arange(self.curve.size + 1))

    def curve_starts(self, curves: int) -> Ints:
        """Return the index of the first sample of each of so many curves: (curves,)."""
        return self.bounds[self.curve.searchsorted(np.arange(curves))]


class CurveBatch:
    """Curves that are voxelised together.

    Parameters
    ----------
    curves : iterable of Curve
        Each with a finite range a < b.
    number : int, optional
        Number of the first curve in messages; without it they do not name the curve.

    Raises
    ------
    CurveError
        If a range is not finite or empty.

    """

    def __init__(self, curves: Iterable[Curve], number: int | None = None) -> None:
        self.curves = list(curves)
        self._number = number
        try:
            ends = chain.from_iterable([curve.t_range for curve in self.curves])
            ranges = np.fromiter(ends, dtype=float).reshape(len(self.curves), 2)
        except (TypeError, ValueError):
            raise self._range_error() from None
        self.first, self.last = ranges.T
        with np.errstate(all="ignore"):
            length = self.last - self.first  # which may be too long for a number
        good = np.isfinite(length) & (length > 0)
        if not good.all():
            index = int(np.argmin(good))
            raise CurveError(
                f"{self.message_prefix(index)}the range of t must be finite and ascending, "
                f"not {self.first[index]} to {self.last[index]}"
            )
        if not all(map(attrgetter("always_defined"), self.curves)):
            self.curves = [self._complete(*each) for each in enumerate(self.curves)]
        # The last position that was not finite: index of the curve, t.
        self._undefined: tuple[int, float] | None = None
        self._evaluator = BatchEvaluator(self.curves)
        self._centres: Floats | None = None  # of the curves' boxes, (3, curves)
        self._tie_shift = np.empty(0)
        # Parameters nearer to each other than this may be equal floats somewhere in the range.
        self.resolution = 2 * np.spacing(np.abs(ranges).max(axis=1))

    def _range_error(self) -> CurveError:
        """Return the error for the first curve whose range is not two numbers."""
        index = 0
        for index, curve in enumerate(self.curves):  # noqa: B007 - of the first that fails
            try:
                _, _ = map(float, curve.t_range)
            except (TypeError, ValueError):
                break
        found = short_repr(self.curves[index].t_range)
        return CurveError(
            f"{self.message_prefix(index)}t_range must be two numbers, (first, last), not {found}"
        )

    def _complete(self, index: int, curve: Curve, also: Iterable[float] = ()) -> Curve:
        try:
            return complete(curve, also)
        except CurveError as error:
            message = f"{self.message_prefix(index)}{error}"
            raise CurveError(message, axis=error.axis, hint=error.hint) from error.__cause__

    def complete_undefined(self) -> bool:
        """Complete the curve that was last found to have no point at a parameter.

        Returns
        -------
        bool
            True if that made it another curve, so that trying again has a sense.

        Raises
        ------
        CurveError
            If it has no limit there.

        """
        if self._undefined is None:
            return False
        (index, t), self._undefined = self._undefined, None
        before = self.curves[index]
        self.curves[index] = after = self._complete(index, before, (t,))
        self._evaluator = BatchEvaluator(self.curves)
        return len(singular_points(after)) > len(singular_points(before))

    @property
    def thread_safe(self) -> bool:
        """True if `evaluate` may be called from several threads at once."""
        return all(self._evaluator.map_curves(attrgetter("thread_safe")))

    @property
    def min_lengths(self) -> list[float]:
        """`Curve.min_length` of each curve."""
        return [curve.min_length for curve in self.curves]

    @cached_property
    def declared_closed(self) -> NDArray[np.int8]:
        """Closedness that each curve states: 1 if it is closed, 0 if not, -1 if it does not say."""
        said = [curve.closed for curve in self.curves]
        return np.array([-1 if each is None else bool(each) for each in said], dtype=np.int8)

    @property
    def degrees(self) -> list[int | None]:
        """`Curve.degree` of each curve."""
        return self._evaluator.map_curves(attrgetter("degree"))

    def message_prefix(self, index: int) -> str:
        """Return the beginning of a message about a curve: empty if it is the only one."""
        return "" if self._number is None else f"curve {self._number + index}: "

    @np.errstate(all="ignore")
    def evaluate(self, curve: Ints, t: Floats) -> Floats:
        """Return the points P(t), (3, n), of the curves with these ascending indices, (n,).

        Raises
        ------
        CurveError
            If a position is not finite, or too far out to have a voxel.

        """
        points = self._evaluator.positions(curve, t)
        # And so not where P is not a number: it would be least and greatest.
        near = points.min(initial=0) > -MAX_COORDINATE and points.max(initial=0) < MAX_COORDINATE
        if not near:
            at = int(np.argmin((np.abs(points) < MAX_COORDINATE).all(axis=0)))
            raise self._position_error(int(curve[at]), float(t[at]), points[:, at])
        return self._moved(curve, points)

    def corners(self, samples: Samples) -> Ints:
        """Return the indices of the samples at which a curve may turn sharply: at its breaks."""
        turns = self._turns
        if not turns.size:
            return np.empty(0, dtype=np.int64)
        here = samples.curve[samples.piece] + 1j * samples.t
        at = np.minimum(np.searchsorted(here, turns), here.size - 1)
        return np.asarray(at[here[at] == turns])

    @cached_property
    def _turns(self) -> NDArray[np.complex128]:
        """The breaks of all curves: curve + 1j * t, which is ordered by the curve, then by t."""
        breaks = [curve.breaks for curve in self.curves]
        if all(each is NO_BREAKS for each in breaks):
            return np.empty(0, dtype=np.complex128)
        of = np.repeat(np.arange(len(breaks)), [each.size for each in breaks])
        return np.asarray(of + 1j * np.concatenate(breaks))

    @np.errstate(under="ignore")
    def settle_ties(self, samples: Samples) -> Samples:
        """Move all points of the curves by ``TIE_SHIFT`` from now on, but for the ends.

        A curve of which a corner, or the end of an open curve, lies on a face of voxels stays
        where it is: which of two voxels holds a point of their face is a matter of definition, of
        [i, i + 1), and knows both axis and sign. So the mirror image of such a curve is not always
        its voxels' mirror image. A closed curve that begins on a face without a corner, as a
        circle does, is moved: of both voxels that hold its first point on their face, it begins
        with the inner one, and looks there as it does on its other sides. A straight diagonal
        halfway between voxels stays straight: both of its axes move alike.

        Parameters
        ----------
        samples : Samples
            One piece for each curve.

        Returns
        -------
        Samples
            The same, moved. The ends of open curves stay: which voxels hold them is a matter of
            definition.

        """
        if len(self.curves) == 1:
            first, last = np.array([0]), np.array([samples.t.size - 1])
            low, high = (
                bound(axis=1)[:, None] for bound in (samples.points.min, samples.points.max)
            )
        else:
            first = samples.bounds[:-1]
            last = samples.bounds[1:] - 1
            low = np.minimum.reduceat(samples.points, first, axis=1)
            high = np.maximum.reduceat(samples.points, first, axis=1)
        gap = samples.points.take(first, axis=1) - samples.points.take(last, axis=1)
        is_open = np.abs(gap).max(axis=0) > CLOSURE_TOLERANCE
        is_open |= (high - low).max(axis=0) <= CLOSURE_TOLERANCE  # a point, and no loop
        is_open |= self.declared_closed == 0
        ends = np.concatenate((first[is_open], last[is_open]))
        fixed = np.concatenate((ends, self.corners(samples), first[~is_open]))
        points = samples.points.take(fixed, axis=1)
        fixed = fixed[(np.abs(points - np.rint(points)) < ON_FACE).any(axis=0)]
        self._tie_shift = np.full(first.size, TIE_SHIFT / CORE)
        if fixed.size:
            begins = fixed == first[samples.piece[fixed]]
            smooth = begins & ~is_open[samples.piece[fixed]]
            smooth[smooth] = ~self._turns_at_start(samples, fixed[smooth])
            self._tie_shift[samples.piece[fixed[~smooth]]] = 0.0
        if not self._tie_shift.any():
            return samples
        self._centres = (low + high) / 2
        points = self._moved(samples.piece, samples.points)
        points[:, ends] = samples.points.take(ends, axis=1)
        return replace(samples, points=points)

    def _turns_at_start(self, samples: Samples, first: Ints) -> Bools:
        """Return which closed curves, by their first samples, turn sharply where they begin."""
        piece, points = samples.piece[first], samples.points
        last = samples.bounds[piece + 1] - 1
        begin = points.take(first + 1, axis=1) - points.take(first, axis=1)
        end = points.take(last, axis=1) - points.take(last - 1, axis=1)
        length = np.sqrt((begin * begin).sum(axis=0) * (end * end).sum(axis=0))
        turns = (begin * end).sum(axis=0) < MAX_SMOOTH_COSINE * length
        broken = [self.curves[index].breaks.size > 0 for index in piece.tolist()]
        return np.asarray(turns | np.array(broken, dtype=bool))

    def _moved(self, curve: Ints, points: Floats) -> Floats:
        if self._centres is None:
            return points
        alone = len(self.curves) == 1
        shift = (self._centres if alone else self._centres.take(curve, axis=1)) - points
        np.minimum(shift, CORE, out=shift)
        np.maximum(shift, -CORE, out=shift)
        shift *= self._tie_shift if alone else self._tie_shift[curve]
        shift += points
        return shift

    def _position_error(self, index: int, t: float, point: Floats) -> CurveError:
        row = int(np.argmin(np.abs(point) < MAX_COORDINATE))
        where = f"{self.message_prefix(index)}{AXES[row]} = {point[row]:.6g} at t = {t!r}"
        if not np.isfinite(point[row]):
            self._undefined = index, t
            hint = "shorten the range of t so that it keeps away from this parameter"
            return CurveError(f"{where} is not finite", axis=AXES[row], hint=hint)
        hint = "shorten the range of t, or scale the curve down"
        return CurveError(f"{where} is too far out to have a voxel", axis=AXES[row], hint=hint)

    def subdivide(self, samples: Samples, parts: Ints) -> Samples:
        """Return samples with steps cut into equal parts.

        Parameters
        ----------
        samples : Samples
            K of them.
        parts : (K - 1,) int64 array
            Into how many parts each step is cut; 1 leaves it as it is.

        """
        cut = (parts > 1).nonzero()[0]
        count = parts[cut] - 1
        left = cut.repeat(count)
        nth = expand_ranges(np.ones_like(count), count)
        t_left = samples.t[left]
        t_fresh = t_left + (samples.t[left + 1] - t_left) * (nth / parts[left])
        piece_fresh = samples.piece[left]

        points = self.evaluate(samples.curve[piece_fresh], t_fresh)
        mine = (samples.piece, samples.t, samples.points)
        piece, t, points = insert_columns(left + 1, mine, (piece_fresh, t_fresh, points))
        return Samples(piece, t, points, samples.curve)
