"""Voxels that are to be drawn, and their partition into parts that are encoded one by one.

A large set is cut into slabs and long chains into pieces: for a fast line, so that the first can be
sent at once; on any line, so that memory is bounded. Must not encode.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.display_list import DrawnVoxels
from voxdisplay.wire import spans, spec
from voxdisplay.wire.op_encoding import EncoderConfig, Ints

# With more colours, voxels that mostly differ from the next in their row make no bricks.
_MANY_COLORS = 16
_SAMPLE = 512  # voxels in which colours are counted first
# Larger sets are cut into slabs of whole bricks with at most about so many voxels each, and at
# least so large a part of that; incompressible slabs further, into parts for the parser.
_LARGE_SET = 1 << 16
_SLAB_VOXELS = 1 << 18
_LEAST_PART = 8
_PARSED_VOXELS = 1 << 17
# Line rate, bytes/s, from which sets are cut: in one piece, which is shorter, the line would idle.
_SLABS_FROM = 100_000
# On a slow line, sets are cut for the sake of memory: those of which few voxels follow another in
# its row, and which take several times as much for each, into slabs of so many.
_HUGE_SET = 1 << 20
_ISOLATED_SET, _ISOLATED_SLAB, _FEW_ROWS = 1 << 17, 1 << 16, 8
# Chains are cut into pieces of so many voxels if they have twice as many.
_CHAINED_VOXELS = 1 << 18


@dataclass(frozen=True)
class PageUpdate:
    """Voxels to be drawn.

    Attributes
    ----------
    ordered : DrawnVoxels or None
        Voxels with a drawing order.
    unordered : (n,) int64 array
        Scan-order indices of all others, ascending, each once.
    pixels_at : PixelLookup
        Function from indices to the pixel values of the finished page.

    """

    ordered: DrawnVoxels | None
    unordered: Ints
    pixels_at: spans.PixelLookup


def partition(update: PageUpdate, config: EncoderConfig) -> Iterator[PageUpdate]:
    """Yield the parts of an update; itself if it is not large."""
    ordered, index = update.ordered, update.unordered
    slab_voxels = _slab_voxels(index, config)
    if slab_voxels:
        for slab in _slabs(index, update.pixels_at, config, slab_voxels):
            yield PageUpdate(None, slab, update.pixels_at)
        if ordered is None:
            return
        update = replace(update, unordered=index[:0])
    if ordered is not None and len(ordered) > 2 * _CHAINED_VOXELS:
        for begin in range(_CHAINED_VOXELS, len(ordered), _CHAINED_VOXELS):
            piece = ordered.part(begin - _CHAINED_VOXELS, begin)
            yield PageUpdate(piece, index[:0], update.pixels_at)
        update = replace(update, ordered=ordered.part(begin, len(ordered)))
    yield update


def _slab_voxels(index: Ints, config: EncoderConfig) -> int:
    """Return how many voxels, at least, the slabs have into which a set is cut; 0: it is not."""
    if config.bytes_per_s >= _SLABS_FROM:
        return _SLAB_VOXELS // _LEAST_PART if len(index) > _LARGE_SET else 0
    if len(index) > _ISOLATED_SET:
        in_rows = int(np.count_nonzero(index[1:] - index[:-1] == 1))
        if _FEW_ROWS * in_rows < len(index):
            return _ISOLATED_SLAB
    return _SLAB_VOXELS if len(index) > _HUGE_SET else 0


def _slabs(
    index: Ints, pixels_at: spans.PixelLookup, config: EncoderConfig, least: int
) -> Iterator[Ints]:
    """Yield slabs of voxels, cut along z between bricks; incompressible ones are cut further."""
    layer = config.grid.nx * config.grid.ny
    side = 1 << spec.LIMIT_MAX_LEVEL
    most = min(_SLAB_VOXELS, _LEAST_PART * least)
    thick = max(1, most // (layer * side)) * side
    at = np.searchsorted(index, np.arange(thick, config.grid.nz, thick) * layer).tolist()
    begin = 0
    for end in [*at, len(index)]:
        if end == begin or (end - begin < least and end < len(index)):
            continue  # what is sparse is cut at greater distances
        slab = index[begin:end]
        begin = end
        parsed = is_incompressible(slab, pixels_at(slab))
        yield from np.array_split(slab, -(-len(slab) // _PARSED_VOXELS)) if parsed else [slab]


def is_incompressible(index: Ints, values: NDArray[np.integer]) -> bool:
    """Return whether bricks cannot pay: many colours, and few voxels that equal the next."""
    alike = (index[1:] - index[:-1] == 1) & (values[1:] == values[:-1])
    if 2 * int(np.count_nonzero(alike)) >= len(index):
        return False
    sample = values[:: -(-len(values) // _SAMPLE)]
    return _has_many(sample) or _has_many(values)


def _has_many(values: NDArray[np.integer]) -> bool:
    """Return whether there are many colours; np.unique would import numpy.ma, which takes long."""
    ordered = np.sort(values)
    return int(np.count_nonzero(ordered[1:] != ordered[:-1])) >= _MANY_COLORS
