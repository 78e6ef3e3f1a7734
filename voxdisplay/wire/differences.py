"""Encoding of the difference between two pages: chains of changed parts, sets of the rest.

Items keep their order where only a part of them changed; what vanished has the order in which it
had been drawn. Must not know frames.
"""

from __future__ import annotations

from itertools import chain

import numpy as np

from voxdisplay.raster.display_list import DrawnVoxels, concatenate_drawn
from voxdisplay.raster.pixel_map import contains, without
from voxdisplay.raster.sparse_raster import SparseRaster
from voxdisplay.wire import spec
from voxdisplay.wire.encoding_selection import encode_update
from voxdisplay.wire.op_encoding import Bools, EncoderConfig, Ints, concat_ranges
from voxdisplay.wire.page_update import PageUpdate
from voxdisplay.wire.payload_splitting import OpBlocks

_STEPS_PER_BYTE = 4
# Whole items are tried beside their changed parts if they have at most so many times the voxels.
_WHOLE_FACTOR = 2


def encode_difference(
    new: SparseRaster, old: SparseRaster, config: EncoderConfig, first: OpBlocks | None = None
) -> list[bytes]:
    """Return the payloads that turn one page into another, in whatever order they arrive.

    Parameters
    ----------
    new, old : SparseRaster
        What is to be shown, and what is.
    config : EncoderConfig
    first : OpBlocks, optional
        Blocks to be sent as well, such as palette entries.

    """
    changed, pixels_at = new.differing(old), new.at
    drawn, parts, rest = _items_with(changed, new.ordered), None, changed
    if drawn is not None:
        parts = _changed_parts(drawn, changed, config)
        rest = changed[without(changed, parts.index)]
    best = _encode(PageUpdate(parts, rest, pixels_at), config, first)
    vanished = _items_with(rest, old.ordered)
    if vanished is not None:
        gone = _changed_parts(vanished.recolored(pixels_at(vanished.index)), rest, config)
        chained = gone if parts is None else concatenate_drawn([parts, gone])
        left = rest[without(rest, gone.index)]
        best = min(best, _encode(PageUpdate(chained, left, pixels_at), config, first), key=_size)
    if drawn is not None and parts is not None and _may_pay(drawn, parts, best, config):
        rest = changed[without(changed, drawn.index)]
        best = min(best, _encode(PageUpdate(drawn, rest, pixels_at), config, first), key=_size)
    return best


def _encode(update: PageUpdate, config: EncoderConfig, first: OpBlocks | None) -> list[bytes]:
    return list(chain.from_iterable(encode_update(update, config, first)))


def _size(payloads: list[bytes]) -> int:
    return sum(map(len, payloads))


def _items_with(changed: Ints, drawn: DrawnVoxels | None) -> DrawnVoxels | None:
    """Return the items that have a changed voxel; None if there are none."""
    if drawn is None:
        return None
    touched = np.bincount(drawn.item, contains(changed, drawn.index), len(drawn.kinds)) > 0
    return drawn.select(touched[drawn.item]) if touched.any() else None


def _changed_parts(drawn: DrawnVoxels, changed: Ints, config: EncoderConfig) -> DrawnVoxels:
    """Return the changed voxels of items, and those between that cost less than another start."""
    kept = contains(changed, drawn.index)
    row = np.flatnonzero(kept)
    steps = np.diff(row)
    short = (steps > 1) & (steps <= _STEPS_PER_BYTE * (1 + config.position_bytes))
    row, steps = row[:-1][short], steps[short]
    if len(row):
        before = concat_ranges(row, steps)
        breaks = _ends_chain(drawn, before, config)
        whole = ~np.logical_or.reduceat(breaks, np.cumsum(steps) - steps)
        kept[concat_ranges(row[whole], steps[whole])] = True
    return drawn.select(kept)


def _ends_chain(drawn: DrawnVoxels, row: Ints, config: EncoderConfig) -> Bools:
    """Return whether the chains of rows, (n,), end there: the next is none of their neighbours."""
    ends = (drawn.item[row + 1] != drawn.item[row]) | (drawn.values[row + 1] != drawn.values[row])
    here, there = (config.grid.voxels_at(drawn.index[each]) for each in (row, row + 1))
    return np.asarray(ends | (np.abs(there - here).max(axis=1) > 1))


def _may_pay(
    whole: DrawnVoxels, parts: DrawnVoxels, best: list[bytes], config: EncoderConfig
) -> bool:
    """Return whether whole items may take fewer bytes than their changed parts.

    They may if little is left out, or if they are straight lines, each drawn by a MOVE and a LINE.
    """
    if len(whole) == len(parts):
        return False
    if len(whole) <= _WHOLE_FACTOR * len(parts):
        return True
    items = np.count_nonzero(np.bincount(whole.item))
    lines = items * 2 * (1 + config.position_bytes)
    return config.has(spec.FEATURE_LINE) and int(lines) < _size(best)
