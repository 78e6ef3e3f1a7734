"""Evaluation of many curves in one call.

Curves of one family share a formula and differ in its numbers only: a thousand short ones take a
few array operations instead of a thousand calls. Each gets the very points that its own
``position`` returns, to the last bit. Must not know formulas: those are the curves' own.
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
from voxdisplay.curves import arguments
from voxdisplay.curves.curve import Curve

Value = TypeVar("Value")

# Points per call, so that intermediate arrays stay in a core's cache.
BLOCK_SIZE = 1 << 14
# Fewer blocks are not worth threads.
MIN_PARALLEL_BLOCKS = 8
# Smaller families are not worth the arrays that hold them.
MIN_FAMILY_SIZE = 4


class BatchEvaluator:
    """Evaluator of a list of curves, grouped by family.

    Parameters
    ----------
    curves : sequence of Curve

    """

    def __init__(self, curves: Sequence[Curve]) -> None:
        self._curves = curves
        self._groups = _group_by_family(curves)
        self._evaluate: list[Evaluate] = []
        self._family = np.full(len(curves), -1)  # index into _evaluate; -1: evaluated alone
        self._member = np.zeros(len(curves), dtype=np.int64)  # index within the family
        for first, members in self._groups:
            if first.family is not None and len(members) >= MIN_FAMILY_SIZE:
                self._family[members] = len(self._evaluate)
                self._member[members] = np.arange(len(members))
                self._evaluate.append(first.batch_evaluator([curves[index] for index in members]))

        self._one_family = len(self._evaluate) == 1 and bool((self._family == 0).all())

    def map_curves(self, get: Callable[[Curve], Value]) -> list[Value]:
        """Return ``get(curve)`` for each curve, called once per family: all members share it."""
        if len(self._groups) == 1:
            return [get(self._groups[0][0])] * len(self._curves)
        found = {}
        for first, members in self._groups:
            found.update(dict.fromkeys(members, get(first)))
        return [found[index] for index in range(len(self._curves))]

    def positions(self, curve: Ints, t: Floats) -> Floats:
        """Return the points P(t), (3, n), of the curves with these (ascending) indices, (n,)."""
        if not self._evaluate:
            return self._one_by_one(curve, t)
        points = np.empty((3, t.size))
        if self._one_family:
            for low in range(0, t.size, BLOCK_SIZE):
                high = low + BLOCK_SIZE
                points[:, low:high] = self._evaluate[0](curve[low:high], t[low:high])
            return points
        family = self._family[curve]
        for number, evaluate in enumerate(self._evaluate):
            own = np.flatnonzero(family == number)
            for low in range(0, own.size, BLOCK_SIZE):
                block = own[low : low + BLOCK_SIZE]
                points[:, block] = evaluate(self._member[curve[block]], t[block])
        alone = np.flatnonzero(family < 0)
        points[:, alone] = self._one_by_one(curve[alone], t[alone])
        return points

    def _one_by_one(self, curve: Ints, t: Floats) -> Floats:
        if 0 < t.size <= BLOCK_SIZE and curve[0] == curve[-1]:
            single = self._curves[int(curve[0])]
            if single.thread_safe:  # of this package: its result is a fresh array of this shape
                return single.position(t)
        points = np.empty((3, t.size))
        if not t.size:
            return points
        edges = np.flatnonzero(curve[1:] != curve[:-1]) + 1 if curve[0] < curve[-1] else curve[:0]
        for start, stop in pairwise([0, *edges.tolist(), t.size]):
            own = self._curves[curve[start]]
            fill = partial(_evaluate_block, own, t[start:stop], points[:, start:stop])
            blocks = range(0, stop - start, BLOCK_SIZE)
            in_threads = len(blocks) >= MIN_PARALLEL_BLOCKS and own.thread_safe
            for _ in (parallel.ordered_map if in_threads else map)(fill, blocks):
                pass
        return points


def _group_by_family(curves: Sequence[Curve]) -> list[tuple[Curve, Sequence[int]]]:
    """Return groups of curves of one class and family, by their first; others stand alone."""
    classes, families = list(map(type, curves)), [curve.family for curve in curves]
    everyone = range(len(curves))
    if len(set(classes)) == 1 and len(set(families)) == 1 and families[0] is not None:
        return [(curves[0], everyone)]
    groups = defaultdict(list)
    for index in everyone:
        family = families[index]
        groups[classes[index], index if family is None else (family,)].append(index)
    return [(curves[members[0]], members) for members in groups.values()]


def _evaluate_block(curve: Curve, t: Floats, points: Floats, low: int) -> None:
    high = low + BLOCK_SIZE
    block = t[low:high]
    if curve.thread_safe:
        points[:, low:high] = curve.position(block)
        return
    # A curve of somebody else's may work in place: it gets an array of its own.
    found = curve.position(block.copy())
    points[:, low:high] = arguments.curve_points(curve.position.__qualname__, found, block.size)
