"""Sparse repetition: array entries, most of which are wanted once, each as often as wanted."""

from __future__ import annotations

from typing import Any, TypeVar

from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.voxelization.index_ranges import expand_ranges

Values = TypeVar("Values", bound=NDArray[Any])


class Repeats:
    """Counts of repetitions, each 1 or more: where all are 1, nothing is copied.

    Parameters
    ----------
    count : (n,) int64 array

    """

    def __init__(self, count: Ints) -> None:
        self._count = count
        self._once = bool((count == 1).all())

    def of(self, values: Values) -> Values:
        """Return values, (n,), each as often as its count says."""
        return values if self._once else values.repeat(self._count)  # type: ignore[return-value]

    def ranges(self, low: Ints) -> Ints:
        """Return low, low + 1, ... as many for each as its count says."""
        return low if self._once else expand_ranges(low, self._count)
