"""Evaluating many curves at once.

Curves of one family have one formula and differ in its numbers only: thousands of short ones are
then a few array operations, where they would be thousands of calls. Each gets the very points that
its own ``position`` gives, to the last bit. Knows no formulas: those are the curves' own.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import TypeVar

import numpy as np

from voxdisplay.compute import parallel
from voxdisplay.compute.array_types import Evaluate, Floats, Ints
from voxdisplay.curves.curve import Curve

Common = TypeVar("Common")

# Points per call: what is computed for so many stays in a core's cache.
CALL = 1 << 14
# So many calls are worth threads.
MANY = 8
# Smaller families are not worth the arrays that hold them.
SMALLEST = 4


class Curves:
    """Curves that are evaluated together.

    Parameters
    ----------
    curves : sequence of Curve

    """

    def __init__(self, curves: Sequence[Curve]) -> None:
        self._curves = curves
        # Those that are alike, by the first of them: one formula, one degree.
        self._kinds = _kinds(curves)
        self._evaluate: list[Evaluate] = []
        self._family = np.full(len(curves), -1)  # which of these; -1: none
        self._member = np.zeros(len(curves), dtype=np.int64)  # which of its curves
        for first, members in self._kinds:
            if first.family is not None and len(members) >= SMALLEST:
                self._family[members] = len(self._evaluate)
                self._member[members] = np.arange(len(members))
                self._evaluate.append(first.together([curves[index] for index in members]))

        self._alike = len(self._evaluate) == 1 and bool((self._family == 0).all())

    def of_each(self, get: Callable[[Curve], Common]) -> list[Common]:
        """Give something of each curve that those of a family have in common."""
        if len(self._kinds) == 1:
            return [get(self._kinds[0][0])] * len(self._curves)
        found = {}
        for first, members in self._kinds:
            found.update(dict.fromkeys(members, get(first)))
        return [found[index] for index in range(len(self._curves))]

    def positions(self, curve: Ints, t: Floats) -> Floats:
        """Give the points P(t), (3, n), of the curves with these (ascending) indices, (n,)."""
        if not self._evaluate:
            return self._one_by_one(curve, t)
        points = np.empty((3, t.size))
        if self._alike:
            for low in range(0, t.size, CALL):
                high = low + CALL
                points[:, low:high] = self._evaluate[0](curve[low:high], t[low:high])
            return points
        family = self._family[curve]
        for number, evaluate in enumerate(self._evaluate):
            mine = np.flatnonzero(family == number)
            for low in range(0, mine.size, CALL):
                some = mine[low : low + CALL]
                points[:, some] = evaluate(self._member[curve[some]], t[some])
        alone = np.flatnonzero(family < 0)
        points[:, alone] = self._one_by_one(curve[alone], t[alone])
        return points

    def _one_by_one(self, curve: Ints, t: Floats) -> Floats:
        if 0 < t.size <= CALL and curve[0] == curve[-1]:
            alone = self._curves[int(curve[0])]
            if alone.reentrant:  # one of ours: what it gives is as it should be, and nobody else's
                return alone.position(t)
        points = np.empty((3, t.size))
        if not t.size:
            return points
        edges = np.flatnonzero(curve[1:] != curve[:-1]) + 1 if curve[0] < curve[-1] else curve[:0]
        for start, stop in pairwise([0, *edges.tolist(), t.size]):
            own = self._curves[curve[start]]
            fill = partial(_fill, own, t[start:stop], points[:, start:stop])
            parts = range(0, stop - start, CALL)
            apart = len(parts) >= MANY and own.reentrant
            for _ in (parallel.in_order if apart else map)(fill, parts):
                pass
        return points


def _kinds(curves: Sequence[Curve]) -> list[tuple[Curve, Sequence[int]]]:
    """Give the curves that are one family, by the first of them, and those that are of none."""
    classes, families = list(map(type, curves)), [curve.family for curve in curves]
    everyone = range(len(curves))
    if len(set(classes)) == 1 and len(set(families)) == 1 and families[0] is not None:
        return [(curves[0], everyone)]
    kinds = defaultdict(list)
    for index in everyone:
        family = families[index]
        kinds[classes[index], index if family is None else (family,)].append(index)
    return [(curves[members[0]], members) for members in kinds.values()]


def _fill(curve: Curve, t: Floats, points: Floats, low: int) -> None:
    high = low + CALL
    points[:, low:high] = curve.position(t[low:high])
