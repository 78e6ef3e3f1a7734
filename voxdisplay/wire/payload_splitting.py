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
    Coding,
    Ints,
    count_bytes,
    count_ops,
    little_endian,
    places,
    ranges,
)

ANY = -1  # a piece that does not care, or after which nobody knows


@dataclass(frozen=True)
class Pieces:
    """Pieces, in an order.

    Attributes
    ----------
    body : (bytes,) uint8 array
        Their ops, one piece after another.
    size : (n,) int64 array
        Bytes of each; at most `Coding.room`, or as much more as a PEN has if it needs no pen.
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
    at: Ints
    pen_after: Ints
    at_after: Ints
    is_chain: Bools

    def __len__(self) -> int:
        return len(self.size)

    def take(self, order: Ints) -> Pieces:
        """Give some of the pieces, in another order."""
        start = np.cumsum(self.size) - self.size
        body = self.body[ranges(start[order], self.size[order])]
        rest = (getattr(self, field.name)[order] for field in fields(self)[1:])
        return Pieces(body, *rest)


def no_pieces() -> Pieces:
    """Give no pieces at all."""
    none = np.empty(0, dtype=np.int64)
    return Pieces(
        np.empty(0, dtype=np.uint8), none, none, none, none, none, np.empty(0, dtype=np.bool_)
    )


def join(parts: Sequence[Pieces]) -> Pieces:
    """Give the pieces of all parts, one part after another."""
    if len(parts) == 1:
        return parts[0]
    names = [field.name for field in fields(Pieces)]
    return Pieces(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class Layout:
    """Pieces laid out in payloads, in their order: first counted, then made if they are wanted.

    Attributes
    ----------
    total : int
        Bytes of all payloads.

    """

    def __init__(self, pieces: Pieces, coding: Coding) -> None:
        self._pieces = pieces
        self._coding = coding
        n = len(pieces)
        # What is left of the piece before; 0 and the full pixel at the start of a payload.
        self._pen = np.full(n, coding.format.full)
        self._at = np.zeros(n, dtype=np.int64)
        first = self._sizes()
        self._pen[1:], self._at[1:] = pieces.pen_after[:-1], pieces.at_after[:-1]
        size = self._sizes()
        self._heads = fill(first, size, coding.max_payload)
        self._pen[self._heads], self._at[self._heads] = coding.format.full, 0
        size[self._heads] = first[self._heads]
        self._size = size
        self.total = int(size.sum())

    def _sets_pen(self) -> Bools:
        return np.asarray((self._pieces.pen != ANY) & (self._pieces.pen != self._pen))

    def _way(self) -> tuple[Bools, Bools, Bools]:
        """Tell which pieces need a SKIP, a MOVE, and a FROM."""
        pieces = self._pieces
        goes = (pieces.at != ANY) & (pieces.at != self._at)
        ahead = pieces.at - self._at
        # MOVE has an op byte of its own, FROM has not.
        least = self._coding.move_bytes + np.where(pieces.is_chain, -1, 1)
        skips = goes & (self._at != ANY) & (ahead > 0) & (count_bytes(ahead) <= least)
        moves = goes & ~skips
        return skips, moves & ~pieces.is_chain, moves & pieces.is_chain

    def _sizes(self) -> Ints:
        skips, moves, froms = self._way()
        size: Ints = self._pieces.size + self._sets_pen() * self._coding.pen_bytes
        size += (moves | froms) * self._coding.move_bytes + moves
        size[skips] += count_bytes(self._pieces.at[skips] - self._at[skips])
        return size

    @cached_property
    def payloads(self) -> list[bytes]:
        """The payloads, none of them empty."""
        pieces, coding = self._pieces, self._coding
        offset = np.cumsum(self._size) - self._size
        out = np.zeros(self.total, dtype=np.uint8)
        here = offset.copy()

        pens = np.flatnonzero(self._sets_pen())
        out[here[pens]] = spec.OP_PEN
        pixel = little_endian(pieces.pen[pens], coding.format.bytes)
        out[here[pens, None] + 1 + np.arange(coding.format.bytes)] = pixel
        here[pens] += coding.pen_bytes

        skips, moves, froms = self._way()
        ops, size = count_ops(spec.OP_SKIP, pieces.at[skips] - self._at[skips])
        out[ranges(here[skips], size)] = ops[np.arange(6) < size[:, None]]
        here[skips] += size
        out[here[moves]] = spec.OP_MOVE
        here[moves] += 1
        goes = np.flatnonzero(moves | froms)
        place = places(coding.grid.voxels_at(pieces.at[goes]), coding)
        behind = froms[goes]  # the coordinates of a FROM stand behind its op byte
        out[(here[goes] + behind)[:, None] + np.arange(coding.move_bytes)] = place
        here[goes] += coding.move_bytes

        if len(goes) + len(pens) + len(ops):
            out[ranges(here, pieces.size)] = pieces.body
        else:
            out[:] = pieces.body
        start = np.cumsum(pieces.size) - pieces.size
        op = pieces.body[start[froms]] + np.uint8(spec.OP_FROM - spec.OP_STEP)
        out[here[froms] - coding.move_bytes] = op
        # The body's op byte lies where the last coordinate byte belongs.
        out[here[froms]] = place[behind, -1]

        data = out.tobytes()
        bounds = [*offset[self._heads].tolist(), len(data)]
        return [data[begin:end] for begin, end in pairwise(bounds)]


def fill(first: Ints, following: Ints, limit: int) -> Ints:
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
