"""Encoder of range-coded chains with fades and near starts: ARC2 (protocol.md, section 7.10).

Curves are sorted by the Morton index at which they begin: no voxel has two pixel values here, so
that their order does not show. Must not know curves, nor which voxels are covered by later ones.
"""

from __future__ import annotations

from functools import cached_property, partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.display_list import DrawnVoxels
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.fades import FADED, FadedRows, runs_of_pens, spread_at
from voxdisplay.wire.op_encoding import EncoderConfig, Ints, concat_ranges
from voxdisplay.wire.range_coded_chains import (
    LONGEST_PIECE,
    Window,
    encode_range_coded,
    number_bits,
    plain_bits,
)

_STOP_BITS = 4  # of the number of a fade's colours
_SIDE_BITS = 10
_COUNT_BITS = 3  # of the length of a difference, once the models know it
_FEW = 32  # curves, whose starts are few bytes in either order
# Bits of a start that is near, as seen for a thousand curves; for a lower bound.
_NEAR_START_BITS = 8


def encode_sorted_chains(drawn: DrawnVoxels, config: EncoderConfig) -> list[bytes]:
    """Return the payloads that draw voxels, in any order; each is one ARC2.

    Parameters
    ----------
    drawn : DrawnVoxels
        None of which is that of the voxel before.
    config : EncoderConfig

    Returns
    -------
    list of bytes
        At most ``config.max_payload`` bytes each.

    """
    voxels = config.grid.voxels_at(drawn.index)
    fades = FadedRows.of(drawn, config, **_LIMITS)
    pens = drawn.values.astype(np.int64) if fades is None else fades.pens
    order = _sorted_rows(voxels, pens)
    spreads = () if fades is None else fades.spreads
    return encode_range_coded(
        voxels[order], pens[order], config, partial(NearWindow.of, spreads=spreads)
    )


def may_gain(drawn: DrawnVoxels, config: EncoderConfig) -> bool:
    """Return whether ARC2 has anything to say that ARC has not: fades, or many starts."""
    if FadedRows.of(drawn, config, **_LIMITS) is not None:
        return True
    return int(np.count_nonzero(~_joined(config.grid.voxels_at(drawn.index)))) + 1 >= _FEW


def least_bytes(drawn: DrawnVoxels, step_bits: float, config: EncoderConfig) -> float:
    """Return about the fewest bytes that `encode_sorted_chains` can take: cheap to find.

    Parameters
    ----------
    drawn, config
        As of `encode_sorted_chains`, n >= 1.
    step_bits : float
        Bits of a step.

    """
    voxels = config.grid.voxels_at(drawn.index)
    fades = FadedRows.of(drawn, config, **_LIMITS)
    pens = drawn.values.astype(np.int64) if fades is None else runs_of_pens(fades.pens)
    far = int(np.count_nonzero(~_joined(voxels)))
    pens_set = len(np.unique(pens)) - 1
    bits = (far + 1) * _NEAR_START_BITS + pens_set * config.format.full.bit_length()
    return (bits + step_bits * (len(voxels) - 1 - far)) / 8


_LIMITS = {
    "most_stops": 1 << _STOP_BITS,
    "most_voxels": LONGEST_PIECE + 1,
    "feature": spec.FEATURE_ARC2,
}


def _joined(voxels: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Return which voxels are neighbours of the one after them: (n - 1,)."""
    steps = np.abs(np.diff(voxels.astype(np.int64), axis=0))
    return np.asarray(steps.max(axis=1, initial=0) == 1)


def morton_index(voxels: NDArray[np.integer]) -> Ints:
    """Return the Morton indices of voxels, (n, 3), on a grid whose sides do not exceed 1024."""
    places = voxels.astype(np.int64)
    index = np.zeros(len(places), dtype=np.int64)
    for bit in range(_SIDE_BITS):
        for axis in range(3):
            index |= (places[:, axis] >> bit & 1) << (3 * bit + axis)
    return index


def _sorted_rows(voxels: NDArray[np.integer], pens: Ints) -> Ints:
    """Return the rows of voxels, curve by curve, in the order in which they are sent.

    Curves of one pen stand together, by the Morton index at which they begin; each begins at the
    end with the lower index, unless its pen is a fade. A few curves stay as they are.
    """
    first = np.flatnonzero(np.append(True, ~_joined(voxels)))
    if len(first) < _FEW:
        return np.arange(len(voxels))
    count = np.diff(first, append=len(voxels))
    last = first + count - 1
    morton = morton_index(voxels)
    # A curve that is a fade in one place keeps its direction.
    faded = np.logical_or.reduceat(pens >= FADED, first)
    turned = (morton[last] < morton[first]) & ~faded
    start = np.where(turned, last, first)
    order = np.lexsort((morton[start], pens[start]))
    way = np.where(turned, -1, 1)[order]
    within = concat_ranges(np.zeros_like(count), count[order])
    rows = np.repeat(start[order], count[order]) + within * np.repeat(way, count[order])
    return np.asarray(rows)


class NearWindow(Window):
    """Window of voxels that may fill an ARC2."""

    op: ClassVar[int] = spec.OP_ARC2

    @cached_property
    def _morton(self) -> list[int]:
        """Morton index of each voxel; empty where the grid has none."""
        if max(self.config.grid) > spec.ARC2_MAX_SIDE:
            return []
        found: list[int] = morton_index(np.array(self.voxels)).tolist()
        return found

    @cached_property
    def _start_before(self) -> list[int]:
        """For each voxel, the latest before it at which a piece begins anywhere."""
        starts = np.append(True, ~np.array(self.joined, dtype=np.bool_))[: len(self.voxels)]
        latest = np.maximum.accumulate(np.where(starts, np.arange(len(starts)), 0))
        return [0, *latest[:-1].tolist()]

    @cached_property
    def _longest_delta(self) -> int:
        """Longest difference that is sent: each of its bits is counted by a model, and plain.

        A few starts do not teach the models.
        """
        if len(set(self._start_before)) < _FEW:
            return -1
        plain = sum((side - 1).bit_length() for side in self.config.grid)
        return plain - _COUNT_BITS

    def start(self, begin: int) -> list[tuple[int, int]]:
        """See `Window.start`."""
        plain = super().start(begin)
        if not self._morton or not begin:
            return plain
        delta = self._morton[begin] - self._morton[self._start_before[begin]]
        k = (delta + 1).bit_length() - 1
        if delta < 0 or k > self._longest_delta:
            return [(spec.ARC2_NEAR, 0), *plain]
        length = [*((spec.ARC2_DELTA + i, 1) for i in range(k)), (spec.ARC2_DELTA + k, 0)]
        return [(spec.ARC2_NEAR, 1), *length, *plain_bits(delta + 1 - (1 << k), k)]

    def ink(self, pen: int) -> list[tuple[int, int]]:
        """See `Window.ink`."""
        if self.config.format is PixelFormat.MONO1:
            return super().ink(pen)
        if pen < FADED:
            return [(spec.ARC2_FADE, 0), *super().ink(pen)]
        spread, place = spread_at(pen, self.spreads)
        bits = [(spec.ARC2_FADE, 1), *plain_bits(len(spread.stops) - 1, _STOP_BITS)]
        bits += number_bits(spread.count - 1) + number_bits(place)
        for channel in spread.stops.tobytes():
            bits += plain_bits(channel, 8)
        return bits
