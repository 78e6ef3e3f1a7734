"""Encoder of palette entries: COLORS and RAMP (protocol.md, 7.6 and 7.9). Must not know voxels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.palette import Colors, Palette, Ramp
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import EncoderConfig, Ints
from voxdisplay.wire.payload_splitting import ANY, OpBlocks, concatenate_blocks, no_blocks

_OP_BYTES, _COLOR_BYTES = 3, 3


def color_blocks(entries: Ints, palette: NDArray[np.uint8], config: EncoderConfig) -> OpBlocks:
    """Return the op blocks that set some entries of a palette.

    Parameters
    ----------
    entries : (n,) int64 array
        Their numbers, ascending.
    palette : (256, 3) uint8 array
        Red, green and blue of all entries.
    config : EncoderConfig

    """
    most = min(spec.LIMIT_MAX_COLORS, (config.max_block_bytes - _OP_BYTES) // _COLOR_BYTES)
    ops = []
    for run in _runs(entries.tolist()):
        for first in range(run.start, run.stop, most):
            stop = min(run.stop, first + most)
            head = bytes((spec.OP_COLORS, first, stop - first - 1))
            ops.append(head + palette[first:stop].tobytes())
    return _blocks_of(ops) if ops else no_blocks()


def _blocks_of(ops: Sequence[bytes]) -> OpBlocks:
    """Return ops that neither need nor change pen and cursor as blocks."""
    anything = np.full(len(ops), ANY)
    size = np.array([len(op) for op in ops], dtype=np.int64)
    body = np.frombuffer(b"".join(ops), dtype=np.uint8)
    no_chains = np.zeros(len(ops), dtype=np.bool_)
    return OpBlocks(body, size, anything, anything, anything, anything, no_chains)


def changed_color_blocks(
    palette: Palette | None, old: Colors, config: EncoderConfig
) -> OpBlocks | None:
    """Return the op blocks that set the entries which differ from other colours, or None."""
    if palette is None or not len(entries := palette.entries_differing(old)):
        return None
    parts = []
    for ramp in palette.ramps if config.has(spec.FEATURE_FADE) else ():
        inside = (entries >= ramp.first) & (entries < ramp.first + ramp.count)
        op = _ramp_op(ramp)
        if len(op) < _COLOR_BYTES * np.count_nonzero(inside) and len(op) <= config.max_block_bytes:
            parts.append(_blocks_of([op]))
            entries = entries[~inside]
    parts.append(color_blocks(entries, palette.colors, config))
    return concatenate_blocks(parts)


def _ramp_op(ramp: Ramp) -> bytes:
    head = bytes((spec.OP_RAMP, ramp.first, ramp.count - 1, len(ramp.stops) - 1))
    return head + ramp.stops.tobytes()


def _runs(entries: list[int]) -> list[range]:
    """Return entries as ranges; a gap of one entry is included, since a second op costs as much."""
    runs: list[range] = []
    for entry in entries:
        if runs and entry <= runs[-1].stop + 1:
            runs[-1] = range(runs[-1].start, entry + 1)
        else:
            runs.append(range(entry, entry + 1))
    return runs
