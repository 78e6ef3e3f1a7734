"""Encoder of palette entries: COLORS (protocol.md, section 7.6). Must not know voxels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.palette import Colors, Palette
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import EncoderConfig, Ints
from voxdisplay.wire.payload_splitting import ANY, OpBlocks, no_blocks

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
    if not ops:
        return no_blocks()
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
    return color_blocks(entries, palette.colors, config)


def _runs(entries: list[int]) -> list[range]:
    """Return entries as ranges; a gap of one entry is included, since a second op costs as much."""
    runs: list[range] = []
    for entry in entries:
        if runs and entry <= runs[-1].stop + 1:
            runs[-1] = range(runs[-1].start, entry + 1)
        else:
            runs.append(range(entry, entry + 1))
    return runs
