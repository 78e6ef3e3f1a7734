"""Pieces of what is drawn, whoever coded them -> payloads, each of which stands for itself.

A *piece* is a few ops that need the pen and the cursor in some state, and leave them in another
(protocol.md, section 7). Laying pieces out puts PEN, MOVE or SKIP before those that need it, and
makes a STEP that begins elsewhere a FROM. At the start of a payload nothing is left of the piece
before. Nothing here knows what a piece draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise

import numpy as np

from voxdisplay.wire import spec
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

ANY = -1  # a piece that does not care, or after which nobody knows


@dataclass(frozen=True)
class OpBlocks:
    """Pieces, in an order.

    Attributes
    ----------
    body : (bytes,) uint8 array
        Their ops, one piece after another.
    size : (n,) int64 array
        Bytes of each; at most `EncoderConfig.max_block_bytes`, or as much more as a PEN has if it
        needs no pen.
    pen, at : (n,) int64 arrays
        The pixel that the pen must be before, the index that the cursor must be; or `ANY`.
    pen_after, at_after : (n,) int64 arrays
        What they are afterwards; or `ANY`.
    is_chain : (n,) bool array
        Whether its first op is a STEP.

    """

    body: Bytes
    size: Ints
    pen: Ints
    cursor: Ints
    pen_after: Ints
    cursor_after: Ints
    starts_with_step: Bools

    def __len__(self) -> int:
        return len(self.size)

    def take(self, order: Ints) -> OpBlocks:
        """Give some of the pieces, in another order."""
        start = np.cumsum(self.size) - self.size
        body = self.body[concat_ranges(start[order], self.size[order])]
        rest = (getattr(self, field.name)[order] for field in fields(self)[1:])
        return OpBlocks(body, *rest)


def no_blocks() -> OpBlocks:
    """Give no pieces at all."""
    none = np.empty(0, dtype=np.int64)
    return OpBlocks(
        np.empty(0, dtype=np.uint8), none, none, none, none, none, np.empty(0, dtype=np.bool_)
    )


def concatenate_blocks(parts: Sequence[OpBlocks]) -> OpBlocks:
    """Give the pieces of all parts, one part after another."""
    if len(parts) == 1:
        return parts[0]
    names = [field.name for field in fields(OpBlocks)]
    return OpBlocks(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class PayloadLayout:
    """Pieces laid out in payloads, in their order: first counted, then made if they are wanted.

    Attributes
    ----------
    total : int
        Bytes of all payloads.

    """

    def __init__(self, blocks: OpBlocks, config: EncoderConfig) -> None:
        self._blocks = blocks
        self._config = config
        n = len(blocks)
        # What is left of the piece before; 0 and the full pixel at the start of a payload.
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
        return np.asarray((self._blocks.pen != ANY) & (self._blocks.pen != self._pen_before))

    def _cursor_ops(self) -> tuple[Bools, Bools, Bools]:
        """Tell which pieces need a SKIP, a MOVE, and a FROM."""
        blocks = self._blocks
        goes = (blocks.cursor != ANY) & (blocks.cursor != self._cursor_before)
        ahead = blocks.cursor - self._cursor_before
        # MOVE has an op byte of its own, FROM has not.
        least = self._config.position_bytes + np.where(blocks.starts_with_step, -1, 1)
        skips = (
            goes & (self._cursor_before != ANY) & (ahead > 0) & (counted_op_bytes(ahead) <= least)
        )
        moves = goes & ~skips
        return skips, moves & ~blocks.starts_with_step, moves & blocks.starts_with_step

    def _sizes(self) -> Ints:
        skips, moves, froms = self._cursor_ops()
        size: Ints = self._blocks.size + self._sets_pen() * self._config.pen_bytes
        size += (moves | froms) * self._config.position_bytes + moves
        size[skips] += counted_op_bytes(self._blocks.cursor[skips] - self._cursor_before[skips])
        return size

    @cached_property
    def payloads(self) -> list[bytes]:
        """The payloads, none of them empty."""
        blocks, config = self._blocks, self._config
        offset = np.cumsum(self._size) - self._size
        out = np.zeros(self.total_bytes, dtype=np.uint8)
        here = offset.copy()

        pens = np.flatnonzero(self._sets_pen())
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
        behind = froms[goes]  # the coordinates of a FROM stand behind its op byte
        out[(here[goes] + behind)[:, None] + np.arange(config.position_bytes)] = place
        here[goes] += config.position_bytes

        if len(goes) + len(pens) + len(ops):
            out[concat_ranges(here, blocks.size)] = blocks.body
        else:
            out[:] = blocks.body
        start = np.cumsum(blocks.size) - blocks.size
        op = blocks.body[start[froms]] + np.uint8(spec.OP_FROM - spec.OP_STEP)
        out[here[froms] - config.position_bytes] = op
        # The body's op byte lies where the last coordinate byte belongs.
        out[here[froms]] = place[behind, -1]

        data = out.tobytes()
        bounds = [*offset[self._payload_starts].tolist(), len(data)]
        return [data[begin:end] for begin, end in pairwise(bounds)]


def next_fit(first: Ints, following: Ints, limit: int) -> Ints:
    """Pack pieces into payloads, in order, each as full as it goes.

    Parameters
    ----------
    first, following : (n,) int64 arrays
        Bytes of each piece when it begins a payload, and when it goes on from the piece before.
    limit : int
        Bytes of a payload; no piece is longer.

    Returns
    -------
    (payloads,) int64 array
        The first piece of each payload.

    """
    total = np.concatenate(([0], np.cumsum(following)))
    heads = []
    begin = 0
    while begin < len(first):
        heads.append(begin)
        room = limit - first[begin] + total[begin + 1]
        begin = max(int(total.searchsorted(room, side="right")) - 1, begin + 1)
    return np.array(heads, dtype=np.int64)
