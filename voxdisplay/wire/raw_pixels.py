"""Raw encoding of pages: literal pixels (LIT) and skipped gaps (protocol.md, section 7.2).

For lines that carry pixels faster than a shorter encoding is found. Lit pixels are copied from the
raster, narrow dark gaps included; wide gaps are skipped. Must not know how fast a line is.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.pixel_format import PixelFormat, Pixels, is_lit
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import (
    Bools,
    EncoderConfig,
    Ints,
    concat_ranges,
    counted_op_bytes,
    counted_ops,
)
from voxdisplay.wire.payload_splitting import next_fit

# Gaps of up to so many bytes are written: skipping them saves nothing.
_NARROW = 3
# Voxels encoded at once: fewer waste partly filled payloads, more keep the line waiting.
_SLAB_VOXELS = 1 << 19
# A large page is sampled at every seventh block. The distance of samples is no multiple of usual
# grid sides, so that they are spread over the page.
_BLOCK, _EACH = 1000, 7
# With more colours, adjacent voxels are rarely alike by chance.
_MANY_COLORS = 16
_SOME = 4096  # voxels of the sample in which colours are counted
# Changes per byte of eight pixels above which runs are no shorter.
_MANY_CHANGES = 3


def is_incompressible(page: Pixels, config: EncoderConfig) -> bool:
    """Return whether few voxels are like the next, so that there is little to be saved.

    Parameters
    ----------
    page : ndarray
        The display's memory in scan order: (V,), or (V, 3) for rgb888.
    config : EncoderConfig

    """
    if len(page) > _BLOCK * _EACH:
        whole = len(page) // _BLOCK
        blocks = page[: whole * _BLOCK].reshape(whole, _BLOCK, *page.shape[1:])[::_EACH]
        page = blocks.reshape(-1, *page.shape[1:])
    same = page[1:] == page[:-1]
    if page.ndim == 2:
        same = same[:, 0] & same[:, 1] & same[:, 2]
    alike = int(np.count_nonzero(same))
    if config.format is PixelFormat.MONO1:
        written = int(np.count_nonzero(np.packbits(page)))
        return len(same) - alike > _MANY_CHANGES * written
    on = is_lit(page)
    if 2 * (alike - int(np.count_nonzero(same & ~on[1:]))) >= np.count_nonzero(on):
        return False
    places = np.flatnonzero(on)
    sample = page[places[:: -(-len(places) // _SOME)]]
    return len(np.unique(sample, axis=0)) > _MANY_COLORS


def encode_raw(page: Pixels, config: EncoderConfig) -> Iterator[list[bytes]]:
    """Yield the payloads that draw a page over a dark one, a few at a time.

    Parameters
    ----------
    page, config
        As of `is_incompressible`.

    Yields
    ------
    list of bytes
        At most ``config.max_payload`` bytes each, none of them empty.

    """
    units, per_unit = page, 1
    if config.format is PixelFormat.MONO1:  # a pixel run begins at a byte, so all are aligned
        units, per_unit = np.packbits(page, bitorder="little"), 8
    elif config.format is PixelFormat.RGB565:
        units = page.astype("<u2", copy=False)
    size = config.format.bytes
    memory = units.view(f"V{size}").reshape(-1) if units.ndim == 2 else units
    for low in range(0, len(page), _SLAB_VOXELS):
        at = low // per_unit
        slab = slice(at, at + _SLAB_VOXELS // per_unit)
        yield _encode_slab(
            is_lit(units[slab]), memory[slab], low, len(page) - low, per_unit, config
        )


def _encode_slab(
    on: Bools,
    memory: NDArray[np.generic],
    low: int,
    voxels: int,
    per_unit: int,
    config: EncoderConfig,
) -> list[bytes]:
    """Return the payloads of one slab.

    Parameters
    ----------
    on : (n,) bool array
        Units that are lit.
    memory : (n,) array
        All units as they go over the wire.
    low, voxels : int
        Index of the first voxel, and number of voxels from there to the end of the page.
    per_unit : int
        Voxels of a unit; the last of a page may have fewer.
    config : EncoderConfig

    """
    if not on.any():
        return []
    size = memory.itemsize
    edges = np.flatnonzero(np.diff(on, prepend=False, append=False))
    wide = np.flatnonzero(edges[2::2] - edges[1:-1:2] > _NARROW // size)
    begin, end = edges[np.append(0, 2 * wide + 2)], edges[np.append(2 * wide + 1, -1)]
    # No LIT is longer than a payload, wherever it begins.
    skip_bytes, op = counted_op_bytes(np.array([low + voxels, 8 * config.max_payload])).tolist()
    most = (config.max_payload - skip_bytes - op) // size
    parts = -(-(end - begin) // most)
    done = concat_ranges(np.zeros(len(parts), dtype=np.int64), parts) * most
    start = np.repeat(begin, parts) + done
    count = np.minimum(np.repeat(end - begin, parts) - done, most)

    pixels = np.minimum(count * per_unit, voxels - start * per_unit)
    place = low + start * per_unit
    gap = place - np.append(0, (place + pixels)[:-1])
    following = _op_bytes(gap) + counted_op_bytes(pixels) + count * size
    first = following + _op_bytes(place) - _op_bytes(gap)
    heads = next_fit(first, following, config.max_payload)
    gap[heads], following[heads] = place[heads], first[heads]

    out = np.empty(int(following.sum()), dtype=np.uint8)
    here = np.cumsum(following) - following
    offset = here[heads].tolist()
    for op, counts in ((spec.OP_SKIP, gap), (spec.OP_LIT, pixels)):
        ops, op_bytes = counted_ops(op, counts)
        op_bytes[counts == 0] = 0
        out[concat_ranges(here, op_bytes)] = ops[np.arange(ops.shape[1]) < op_bytes[:, None]]
        here += op_bytes
    written = memory[_mask(begin, end, len(on))]
    out[_mask(here, here + count * size, len(out))] = written.view(np.uint8)
    data = out.tobytes()
    return [data[a:b] for a, b in pairwise([*offset, len(data)])]


def _op_bytes(counts: Ints) -> Ints:
    """Return the bytes of ops with counts; 0 for a count of 0."""
    return np.where(counts > 0, counted_op_bytes(counts), 0)


def _mask(begin: Ints, end: Ints, size: int) -> Bools:
    """Return a mask, (size,), that is set inside ascending ranges."""
    edges = np.stack((begin, end), axis=1).reshape(-1)
    lengths = np.diff(edges, prepend=0, append=size)
    return np.repeat(np.arange(len(lengths)) % 2 == 1, lengths)
