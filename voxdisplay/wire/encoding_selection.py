"""Which coder draws what in the fewest bytes: counted before anything is sent.

Ordered items go as chains, sets of voxels as bricks, dots and boxes, or as spans in scan order;
what is best is found out by laying out pieces and counting. A lower bound, where one is cheap,
saves the trouble. Range coding takes long: whoever has a fast link leaves ARC out of the features.
Painter's order was settled before: no voxel has two pixels, so pieces may come in any order, and
for a fast line what is dense is coded in slabs, each by itself: it need not wait for all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from itertools import chain as in_turn

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.pixel_format import Pixels
from voxdisplay.wire import spans, spec, voxel_sets
from voxdisplay.wire.chains import Chains, chain
from voxdisplay.wire.incremental import Steps, at_once
from voxdisplay.wire.op_encoding import Bools, Coding, Ints, ranges
from voxdisplay.wire.payload_splitting import Layout, Pieces, join, no_pieces
from voxdisplay.wire.range_coded_chains import encode_arcs
from voxdisplay.wire.raw_pixels import encode_plain, is_noise

# Of many colours, voxels that mostly have other neighbours in their row make no bricks.
_MANY_COLORS = 16
_A_FEW = 512  # voxels, which mostly show already that there are as many
# More voxels without an order are cut: into slabs of whole bricks, each of so many voxels or a few.
_LARGE_SET = 1 << 16
_SLAB_VOXELS = 1 << 18
_PARSED_VOXELS = 1 << 17
# Bytes a second of a line that might run dry while all is coded in one piece, which is shorter.
_SLABS_FROM = 100_000
# Bytes a second of a line on which chains are sent before it is known whether sets were shorter.
_CHAINS_FROM = 800_000
_LONE = 16  # where one voxel of so many is alone, sets are tried all the same
# Bytes a second of a line that carries pixels of many colours sooner than they are parsed.
_PLAIN_FROM = 2_400_000


@dataclass(frozen=True)
class Items:
    """Voxels in an order, all on the grid: those of one item, or of several, one after another.

    Attributes
    ----------
    voxels : (n, 3) integer array
        Columns x, y, z.
    index : (n,) int64 array
        Their scan-order indices.
    values : (n,) integer array
        Their pixel values.
    owner : (n,) int64 array
        Number of the item that each belongs to, ascending.
    corners : (n,) bool array
        Where a straight line may end and another begin.

    """

    voxels: NDArray[np.integer]
    index: Ints
    values: NDArray[np.integer]
    owner: Ints
    corners: Bools

    def __len__(self) -> int:
        return len(self.values)

    def only(self, kept: Bools) -> Items:
        """Give some of the voxels."""
        if kept.all():
            return self
        return Items(*(getattr(self, field.name)[kept] for field in fields(self)))


def join_items(parts: Sequence[Items]) -> Items:
    """Give the items of all parts, n >= 1, one part after another, and number them anew."""
    if len(parts) == 1:
        return parts[0]
    voxels, index, values, _, corners = (
        np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Items)
    )
    # Those that were joined before have numbers from 0.
    items = [int(part.owner[-1]) + 1 if len(part) else 0 for part in parts]
    first = np.cumsum(items) - items
    owner = np.concatenate([part.owner + n for part, n in zip(parts, first, strict=True)])
    return Items(voxels, index, values, owner, corners)


@dataclass(frozen=True)
class Content:
    """All that is to be drawn.

    Attributes
    ----------
    items : Items or None
    index : (n,) int64 array
        Voxels without an order, besides: scan-order indices, ascending, each once.
    look : Look
        Gives the pixel values of voxels as they are to be in the end, by their indices.

    """

    items: Items | None
    index: Ints
    look: spans.Look


def encode(content: Content, coding: Coding, first: Pieces | None = None) -> Iterator[list[bytes]]:
    """Give the payloads that draw the content, in whatever order they arrive, bit by bit.

    Coding goes on while they are taken. An empty list means that some of the work is done: whoever
    has something else to do may do it now.

    Parameters
    ----------
    content : Content
    coding : Coding
    first : Pieces, optional
        What is to be sent besides.

    Yields
    ------
    list of bytes
        At most ``coding.max_payload`` bytes each, none of them empty.

    """
    items, index = content.items, content.index
    if len(index) > _LARGE_SET and coding.bytes_per_s >= _SLABS_FROM:
        for slab in _slabs(index, content.look, coding):
            yield from _encode(Content(None, slab, content.look), coding, first or no_pieces())
            first = None
        if not items:
            return
        index = index[:0]
    yield from _encode(Content(items, index, content.look), coding, first or no_pieces())


def encode_page(
    page: Pixels, coding: Coding, first: Pieces | None = None
) -> Iterator[list[bytes]] | None:
    """Give payloads that draw a page as it is, if a shorter coding would take longer than they.

    Parameters
    ----------
    page : ndarray
        The display's memory in scan order: (V,), or (V, 3) for rgb888.
    coding, first
        As of `encode`.

    Returns
    -------
    iterator or None
        As of `encode`; None if that should draw what is lit.

    """
    if coding.bytes_per_s < _PLAIN_FROM or not is_noise(page, coding):
        return None
    before = Layout(first, coding).payloads if first else []
    return in_turn([before], encode_plain(page, coding))


def _slabs(index: Ints, look: spans.Look, coding: Coding) -> Iterator[Ints]:
    """Cut voxels into slabs along z, where bricks end; and those that make no bricks, further."""
    layer = coding.grid.nx * coding.grid.ny
    side = 1 << spec.LIMIT_MAX_LEVEL
    thick = max(1, _SLAB_VOXELS // (layer * side)) * side
    cuts = np.arange(thick, coding.grid.nz, thick) * layer
    for slab in np.split(index, np.searchsorted(index, cuts)):
        parsed = len(slab) and _is_noise(slab, look(slab))
        for part in np.array_split(slab, -(-len(slab) // _PARSED_VOXELS)) if parsed else [slab]:
            if len(part):
                yield part


def _encode(content: Content, coding: Coding, first: Pieces) -> Iterator[list[bytes]]:
    best = _Cheapest(coding, first)
    items, look = content.items, content.look
    if items is None or not len(items):
        if len(content.index):
            yield from _pauses(_offer_sets(best, no_pieces(), content.index, look))
        yield best.payloads
        return
    # A voxel that follows itself would end a chain.
    items = items.only(np.concatenate(([True], items.index[1:] != items.index[:-1])))
    chains = chain(items.voxels, items.values, coding, items.corners)
    yield []
    if not len(content.index):
        best.offer(chains.pieces)
        if (items.values != items.values[0]).any():
            best.offer(_by_pen(chains.pieces))
    lone = int(np.count_nonzero(chains.count == 0))
    if coding.bytes_per_s >= _CHAINS_FROM and _LONE * lone < len(items) and not len(content.index):
        yield best.payloads
        return
    yield []
    apart = _cheaper_as_set(chains, items, look, coding)
    if apart.any() or len(content.index):
        index = _united(items.index[_voxels_of(chains, apart)], content.index)
        kept = _by_pen(chains.pieces.take(np.flatnonzero(~apart)))
        yield from _pauses(_offer_sets(best, kept, index, look))
        yield []
    if coding.bytes_per_s >= _CHAINS_FROM:
        yield best.payloads
        return
    index = _united(items.index, content.index)
    if spans.least_bytes(index, coding) < best.total:
        best.offer(at_once(spans.span_set(index, look(index), look, coding)))
    if coding.has(spec.FEATURE_ARC) and not len(content.index):
        best.offer_payloads(encode_arcs(items.voxels, items.values, coding))
    yield best.payloads


def _pauses(steps: Steps[None]) -> Iterator[list[bytes]]:
    """Do steps, with nothing to be sent in between."""
    for _ in steps:
        yield []


def _united(index: Ints, others: Ints) -> Ints:
    """Give the indices of both, ascending, each once."""
    together = np.sort(np.concatenate((index, others)) if len(others) else index)
    return together[np.concatenate(([True], together[1:] != together[:-1]))]


class _Cheapest:
    """The layout of the fewest bytes among those that were offered."""

    def __init__(self, coding: Coding, first: Pieces) -> None:
        self.coding = coding
        self._first = first
        self._layout: Layout | None = None
        self._others: list[bytes] = []

    @property
    def total(self) -> float:
        """Its bytes; without any, more than there can be."""
        others = sum(map(len, self._others))
        return self._layout.total + others if self._layout else np.inf

    @property
    def payloads(self) -> list[bytes]:
        """Its payloads."""
        if self._layout is None:
            self.offer(no_pieces())
        return self._layout.payloads + self._others if self._layout else []

    def offer(self, *parts: Pieces) -> None:
        """Take pieces, if they take fewer bytes."""
        pieces = join([self._first, *parts]) if len(self._first) else join(parts)
        layout = Layout(pieces, self.coding)
        if layout.total < self.total:
            self._layout, self._others = layout, []

    def offer_payloads(self, payloads: list[bytes]) -> None:
        """Take what is payloads already, if with what comes first they take fewer bytes."""
        first = Layout(self._first, self.coding)
        if first.total + sum(map(len, payloads)) < self.total:
            self._layout, self._others = first, payloads


def _by_pen(pieces: Pieces) -> Pieces:
    """Order pieces so that a pen is set once; pieces that go on from another stay behind it."""
    if len(pieces) == 0 or (pieces.pen == pieces.pen[0]).all():
        return pieces
    return pieces.take(np.argsort(pieces.pen, kind="stable"))


def _voxels_of(chains: Chains, which: Bools) -> Ints:
    """Give the places of the voxels of some pieces, one piece after another."""
    return ranges(chains.begin[which], chains.count[which] + 1)


def _cheaper_as_set(chains: Chains, items: Items, look: spans.Look, coding: Coding) -> Bools:
    """Tell which pieces of chains better go as a set of their voxels: (pieces,).

    An item does if a lower bound does not speak against it, and if all such pieces of its pen
    together take fewer bytes. A lone voxel always does.
    """
    pieces = chains.pieces
    apart: Bools = chains.count == 0
    if not voxel_sets.can_code(coding) or coding.bytes_per_s >= _CHAINS_FROM:
        return apart
    goes = np.concatenate(([True], pieces.at[1:] != pieces.at_after[:-1]))
    cost = pieces.size + goes * (coding.move_bytes + ~pieces.is_chain)
    item = items.owner[chains.begin]
    as_chain = np.bincount(item, weights=cost)
    least = voxel_sets.least_bytes(items.index, items.owner, len(as_chain), coding)
    maybe = (least < as_chain)[item]
    if not maybe.any():
        return apart
    voxels = _united(items.index[_voxels_of(chains, maybe)], items.index[:0])
    made = voxel_sets.brick(voxels, look(voxels), coding)
    rank = np.searchsorted(made.values, pieces.pen[maybe])
    as_chains = np.bincount(rank, weights=cost[maybe], minlength=len(made.values))
    apart[maybe] |= (made.bytes_of < as_chains)[rank]
    return apart


def _offer_sets(best: _Cheapest, kept: Pieces, index: Ints, look: spans.Look) -> Steps[None]:
    """Offer pieces together with a set of voxels, n >= 1, coded in each way; in steps."""
    coding, values = best.coding, look(index)
    if voxel_sets.can_code(coding) and not _is_noise(index, values):
        made = voxel_sets.brick(index, values, coding)
        yield
        best.offer(kept, made.pieces)
        in_spans = _cheaper_as_spans(index, values, made, coding)
        if in_spans.any() and not in_spans.all():
            there = in_spans[np.searchsorted(made.values, values)]
            brick_pieces = np.searchsorted(made.values, made.pieces.pen)
            in_bricks = made.pieces.take(np.flatnonzero(~in_spans[brick_pieces]))
            rest = yield from spans.span_set(index[there], values[there], look, coding)
            best.offer(kept, in_bricks, rest)
    if spans.least_bytes(index, coding) < best.total - int(kept.size.sum()):
        rows = yield from spans.span_set(index, values, look, coding)
        yield
        best.offer(kept, rows)


def _is_noise(index: Ints, values: NDArray[np.integer]) -> bool:
    """Tell whether bricks cannot be worth trying: many colours, and few voxels like the next."""
    alike = (index[1:] - index[:-1] == 1) & (values[1:] == values[:-1])
    if 2 * int(np.count_nonzero(alike)) >= len(index):
        return False
    some = values[:: -(-len(values) // _A_FEW)]
    return len(np.unique(some)) > _MANY_COLORS or len(np.unique(values)) > _MANY_COLORS


def _cheaper_as_spans(
    index: Ints, values: NDArray[np.integer], made: voxel_sets.Bricks, coding: Coding
) -> Bools:
    """Guess which pixels take fewer bytes in scan order than as bricks: (pixels,)."""
    row = np.concatenate(([True], (np.diff(index) != 1) | (values[1:] != values[:-1])))
    rows = np.bincount(np.searchsorted(made.values, values[row]), minlength=len(made.values))
    # SKIP with a count of two bytes, and LIT of one pixel.
    return rows * (3 + coding.format.bytes) < made.bytes_of + coding.pen_bytes
