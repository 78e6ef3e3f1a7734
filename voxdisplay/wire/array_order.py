"""Classification of voxel arrays: whether their order is worth sending, or they are sets.

An array of voxels may follow a curve, or list the voxels of a surface or solid in any order. Bytes
of chains and of sets are estimated from counts of neighbours. Must not encode.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.raster.display_list import DrawnVoxels, Kind
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import Bools, EncoderConfig, Ints
from voxdisplay.wire.voxel_sets import has_set_ops, min_bytes

_STEPS_PER_BYTE = 4
# Bytes of a set for each byte of its lower bound: those of the upper levels of an octree, amply.
_SET_FACTOR = 2
_VALUE_BITS = 32
_SMALL = 256  # voxels of an item: with fewer, both encodings are tried soon enough


def items_that_are_sets(drawn: DrawnVoxels, config: EncoderConfig) -> Bools:
    """Return which items are arrays that surely take fewer bytes as sets: (items,)."""
    arrays = drawn.kinds == Kind.ARRAY
    arrays &= np.bincount(drawn.item, minlength=len(arrays)) > _SMALL
    if not arrays.any() or not has_set_ops(config):
        return np.zeros(len(drawn.kinds), dtype=np.bool_)
    drawn = drawn.select(arrays[drawn.item])
    as_set = _SET_FACTOR * _least_set_bytes(drawn, config)
    return np.asarray(arrays & (as_set < _least_chain_bytes(drawn, config)))


def _least_chain_bytes(drawn: DrawnVoxels, config: EncoderConfig) -> Ints:
    """Return a lower bound of the bytes of items as chains: one segment for each run."""
    x, y, z = config.grid.voxels_at(drawn.index).T
    new = drawn.values[1:] != drawn.values[:-1]
    pens = np.append(True, new)
    for axis in (x, y, z):
        new |= np.abs(axis[1:] - axis[:-1]) > 1
    first = np.flatnonzero(np.append(True, new | (drawn.item[1:] != drawn.item[:-1])))
    steps = np.diff(first, append=len(drawn)) - 1
    size = 2 + config.position_bytes - (-steps // _STEPS_PER_BYTE)
    if config.has(spec.FEATURE_LINE):
        size = np.minimum(size, 2 * (1 + config.position_bytes))
    size += pens[first] * config.pen_bytes
    return np.bincount(drawn.item[first], size, minlength=len(drawn.kinds)).astype(np.int64)


def _least_set_bytes(drawn: DrawnVoxels, config: EncoderConfig) -> Ints:
    """Return a lower bound of the bytes of items as sets, each pixel value by itself."""
    items = len(drawn.kinds)
    if (drawn.values == drawn.values[0]).all():
        return min_bytes(drawn.index, drawn.item, items, config) + config.position_bytes
    key = drawn.item.astype(np.int64) << _VALUE_BITS | drawn.values
    sets, group = np.unique(key, return_inverse=True)
    size = min_bytes(drawn.index, group, len(sets), config)
    size += config.position_bytes + config.pen_bytes
    return np.bincount(sets >> _VALUE_BITS, size, minlength=items).astype(np.int64)
