"""Splitting of op blocks into self-contained payloads.

An *op block* is a few ops that require a state of pen and cursor, and leave another (protocol.md,
section 7), like a basic block of a compiler. The layout inserts PEN, MOVE or SKIP where the state
differs, and turns a STEP that begins elsewhere into a FROM. Each payload begins with the initial
state. Must not know what a block draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise

import numpy as np

from voxdisplay.raster.display_list import Spread
from voxdisplay.wire import spec
from voxdisplay.wire.fades import FADED, fade_op_bytes, faded_op
from voxdisplay.wire.op_encoding import (
    Bools,
    Bytes,
    EncoderConfig,
    Ints,
    concat_ranges,
    counted_op_bytes,
    counted_ops,
    encode_positions,
    little_endian,
)

ANY = -1  # no required state before a block, or an unknown one after it


@dataclass(frozen=True)
class OpBlocks:
    """Op blocks in the order in which they are sent.

    Attributes
    ----------
    body : (bytes,) uint8 array
        Their ops, concatenated.
    size : (n,) int64 array
        Bytes of each; at most `EncoderConfig.max_block_bytes`, plus those of a PEN if it requires
        no pen.
    pen, cursor : (n,) int64 arrays
        Required pixel value of the pen, and index of the cursor; or `ANY`.
    pen_after, cursor_after : (n,) int64 arrays
        Pen and cursor afterwards; or `ANY`.
    starts_with_step : (n,) bool array
        True if its first op is a STEP.
    spreads : tuple of Spread
        What pens from `FADED` on refer to: (number of the spread + 1) << 32 | place. Such a block
        begins with a STEP or LINE, whose first voxel has that place, and a pen afterwards has the
        place after it.

    """

    body: Bytes
    size: Ints
    pen: Ints
    cursor: Ints
    pen_after: Ints
    cursor_after: Ints
    starts_with_step: Bools
    spreads: tuple[Spread, ...] = ()

    def __len__(self) -> int:
        return len(self.size)

    def take(self, order: Ints) -> OpBlocks:
        """Return blocks by their numbers, in that order."""
        start = np.cumsum(self.size) - self.size
        body = self.body[concat_ranges(start[order], self.size[order])]
        rest = {name: getattr(self, name)[order] for name in _ARRAYS[1:]}
        return OpBlocks(body=body, spreads=self.spreads, **rest)


_ARRAYS = tuple(field.name for field in fields(OpBlocks) if field.name != "spreads")


def no_blocks() -> OpBlocks:
    """Return an empty list of blocks."""
    none = np.empty(0, dtype=np.int64)
    return OpBlocks(
        np.empty(0, dtype=np.uint8), none, none, none, none, none, np.empty(0, dtype=np.bool_)
    )


def concatenate_blocks(parts: Sequence[OpBlocks]) -> OpBlocks:
    """Return the blocks of all parts, one part after another; one of them may have spreads."""
    if len(parts) == 1:
        return parts[0]
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    spreads = next((part.spreads for part in parts if part.spreads), ())
    return OpBlocks(**arrays, spreads=spreads)


class PayloadLayout:
    """Layout of op blocks in payloads: sizes are counted first, bytes made on request.

    Attributes
    ----------
    total : int
        Bytes of all payloads.

    """

    def __init__(self, blocks: OpBlocks, config: EncoderConfig) -> None:
        self._blocks = blocks
        self._config = config
        n = len(blocks)
        # State left by the block before; at the start of a payload the full pixel, and index 0.
        self._pen_before = np.full(n, config.format.full)
        self._cursor_before = np.zeros(n, dtype=np.int64)
        first = self._sizes()
        self._pen_before[1:], self._cursor_before[1:] = (
            blocks.pen_after[:-1],
            blocks.cursor_after[:-1],
        )
        size = self._sizes()
        self._payload_starts = next_fit(first, size, config.max_payload)
        self._pen_before[self._payload_starts], self._cursor_before[self._payload_starts] = (
            config.format.full,
            0,
        )
        size[self._payload_starts] = first[self._payload_starts]
        self._size = size
        self.total_bytes = int(size.sum())

    def _sets_pen(self) -> Bools:
        blocks = self._blocks
        sets = np.asarray((blocks.pen != ANY) & (blocks.pen != self._pen_before))
        if blocks.spreads:
            # The first voxel of a STEP that goes on is written again, and not counted.
            goes_on = blocks.cursor == self._cursor_before
            fits = np.where(goes_on, self._pen_before - 1, self._pen_before) == blocks.pen
            sets = np.where(blocks.pen >= FADED, ~fits, sets)
        return sets

    def _pen_sizes(self) -> Ints | int:
        """Return the bytes of the op that sets the pen of each block."""
        blocks = self._blocks
        if not blocks.spreads:
            return self._config.pen_bytes
        return np.where(
            blocks.pen >= FADED,
            fade_op_bytes(blocks.pen, blocks.spreads),
            self._config.pen_bytes,
        )

    def _cursor_ops(self) -> tuple[Bools, Bools, Bools]:
        """Return which blocks need a SKIP, a MOVE, and a FROM."""
        blocks = self._blocks
        goes = (blocks.cursor != ANY) & (blocks.cursor != self._cursor_before)
        ahead = blocks.cursor - self._cursor_before
        # MOVE has an op byte of its own; FROM replaces the STEP.
        least = self._config.position_bytes + np.where(blocks.starts_with_step, -1, 1)
        skips = (
            goes & (self._cursor_before != ANY) & (ahead > 0) & (counted_op_bytes(ahead) <= least)
        )
        moves = goes & ~skips
        return skips, moves & ~blocks.starts_with_step, moves & blocks.starts_with_step

    def _sizes(self) -> Ints:
        skips, moves, froms = self._cursor_ops()
        size: Ints = self._blocks.size + self._sets_pen() * self._pen_sizes()
        size += (moves | froms) * self._config.position_bytes + moves
        size[skips] += counted_op_bytes(self._blocks.cursor[skips] - self._cursor_before[skips])
        return size

    @cached_property
    def payloads(self) -> list[bytes]:
        """Payloads, none of them empty."""
        blocks, config = self._blocks, self._config
        offset = np.cumsum(self._size) - self._size
        out = np.zeros(self.total_bytes, dtype=np.uint8)
        here = offset.copy()

        sets_pen = self._sets_pen()
        for block in np.flatnonzero(sets_pen & (blocks.pen >= FADED)).tolist():
            op = faded_op(int(blocks.pen[block]), blocks.spreads)
            out[here[block] : here[block] + len(op)] = np.frombuffer(op, dtype=np.uint8)
            here[block] += len(op)
        pens = np.flatnonzero(sets_pen & (blocks.pen < FADED))
        out[here[pens]] = spec.OP_PEN
        pixel = little_endian(blocks.pen[pens], config.format.bytes)
        out[here[pens, None] + 1 + np.arange(config.format.bytes)] = pixel
        here[pens] += config.pen_bytes

        skips, moves, froms = self._cursor_ops()
        ops, size = counted_ops(spec.OP_SKIP, blocks.cursor[skips] - self._cursor_before[skips])
        out[concat_ranges(here[skips], size)] = ops[np.arange(6) < size[:, None]]
        here[skips] += size
        out[here[moves]] = spec.OP_MOVE
        here[moves] += 1
        goes = np.flatnonzero(moves | froms)
        place = encode_positions(config.grid.voxels_at(blocks.cursor[goes]), config)
        behind = froms[goes]  # the coordinates of a FROM follow its op byte
        out[(here[goes] + behind)[:, None] + np.arange(config.position_bytes)] = place
        here[goes] += config.position_bytes

        if len(goes) + len(ops) or sets_pen.any():
            out[concat_ranges(here, blocks.size)] = blocks.body
        else:
            out[:] = blocks.body
        start = np.cumsum(blocks.size) - blocks.size
        op = blocks.body[start[froms]] + np.uint8(spec.OP_FROM - spec.OP_STEP)
        out[here[froms] - config.position_bytes] = op
        # The op byte of the body was copied to the place of the last coordinate byte.
        out[here[froms]] = place[behind, -1]

        data = out.tobytes()
        bounds = [*offset[self._payload_starts].tolist(), len(data)]
        return [data[begin:end] for begin, end in pairwise(bounds)]


def next_fit(first: Ints, following: Ints, limit: int) -> Ints:
    """Return the starts of payloads by next-fit packing: blocks in order, each payload filled.

    Parameters
    ----------
    first, following : (n,) int64 arrays
        Bytes of each block when it begins a payload, and when it follows another.
    limit : int
        Bytes of a payload; no block is longer.

    Returns
    -------
    (payloads,) int64 array
        The first block of each payload.

    """
    total = np.concatenate(([0], np.cumsum(following)))
    heads = []
    begin = 0
    while begin < len(first):
        heads.append(begin)
        room = limit - first[begin] + total[begin + 1]
        begin = max(int(total.searchsorted(room, side="right")) - 1, begin + 1)
    return np.array(heads, dtype=np.int64)
