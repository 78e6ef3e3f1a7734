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
from voxdisplay.wire.chains import Chains, build_chains
from voxdisplay.wire.incremental import Incremental, run_to_end
from voxdisplay.wire.op_encoding import Bools, EncoderConfig, Ints, concat_ranges
from voxdisplay.wire.payload_splitting import OpBlocks, PayloadLayout, concatenate_blocks, no_blocks
from voxdisplay.wire.range_coded_chains import encode_range_coded
from voxdisplay.wire.raw_pixels import encode_raw, is_incompressible

# Of many colours, voxels that mostly have other neighbours in their row make no bricks.
_MANY_COLORS = 16
_SAMPLE = 512  # voxels, which mostly show already that there are as many
# More voxels without an order are cut: into slabs of whole bricks, each of so many voxels or a few.
_LARGE_SET = 1 << 16
_SLAB_VOXELS = 1 << 18
_PARSED_VOXELS = 1 << 17
# Bytes a second of a line that might run dry while all is coded in one piece, which is shorter.
_SLABS_FROM = 100_000
# Bytes a second of a line on which chains are sent before it is known whether sets were shorter.
_CHAINS_FROM = 800_000
_LONE_FRACTION = 16  # where one voxel of so many is alone, sets are tried all the same
# Bytes a second of a line that carries pixels of many colours sooner than they are parsed.
_RAW_FROM = 2_400_000


@dataclass(frozen=True)
class OrderedVoxels:
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
    item: Ints
    corners: Bools

    def __len__(self) -> int:
        return len(self.values)

    def select(self, kept: Bools) -> OrderedVoxels:
        """Give some of the voxels."""
        if kept.all():
            return self
        return OrderedVoxels(*(getattr(self, field.name)[kept] for field in fields(self)))


def concatenate_ordered(parts: Sequence[OrderedVoxels]) -> OrderedVoxels:
    """Give the items of all parts, n >= 1, one part after another, and number them anew."""
    if len(parts) == 1:
        return parts[0]
    voxels, index, values, _, corners = (
        np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(OrderedVoxels)
    )
    # Those that were joined before have numbers from 0.
    items = [int(part.item[-1]) + 1 if len(part) else 0 for part in parts]
    first = np.cumsum(items) - items
    owner = np.concatenate([part.item + n for part, n in zip(parts, first, strict=True)])
    return OrderedVoxels(voxels, index, values, owner, corners)


@dataclass(frozen=True)
class PageUpdate:
    """All that is to be drawn.

    Attributes
    ----------
    items : Items or None
    index : (n,) int64 array
        Voxels without an order, besides: scan-order indices, ascending, each once.
    look : Look
        Gives the pixel values of voxels as they are to be in the end, by their indices.

    """

    ordered: OrderedVoxels | None
    unordered: Ints
    pixels_at: spans.PixelLookup


def encode_update(
    content: PageUpdate, config: EncoderConfig, first: OpBlocks | None = None
) -> Iterator[list[bytes]]:
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
    items, index = content.ordered, content.unordered
    if len(index) > _LARGE_SET and config.bytes_per_s >= _SLABS_FROM:
        for slab in _slabs(index, content.pixels_at, config):
            yield from _encode(
                PageUpdate(None, slab, content.pixels_at), config, first or no_blocks()
            )
            first = None
        if not items:
            return
        index = index[:0]
    yield from _encode(PageUpdate(items, index, content.pixels_at), config, first or no_blocks())


def encode_raw_if_faster(
    page: Pixels, config: EncoderConfig, first: OpBlocks | None = None
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
    if config.bytes_per_s < _RAW_FROM or not is_incompressible(page, config):
        return None
    before = PayloadLayout(first, config).payloads if first else []
    return in_turn([before], encode_raw(page, config))


def _slabs(index: Ints, pixels_at: spans.PixelLookup, config: EncoderConfig) -> Iterator[Ints]:
    """Cut voxels into slabs along z, where bricks end; and those that make no bricks, further."""
    layer = config.grid.nx * config.grid.ny
    side = 1 << spec.LIMIT_MAX_LEVEL
    thick = max(1, _SLAB_VOXELS // (layer * side)) * side
    cuts = np.arange(thick, config.grid.nz, thick) * layer
    for slab in np.split(index, np.searchsorted(index, cuts)):
        parsed = len(slab) and _is_incompressible(slab, pixels_at(slab))
        for part in np.array_split(slab, -(-len(slab) // _PARSED_VOXELS)) if parsed else [slab]:
            if len(part):
                yield part


def _encode(content: PageUpdate, config: EncoderConfig, first: OpBlocks) -> Iterator[list[bytes]]:
    best = _BestLayout(config, first)
    items, pixels_at = content.ordered, content.pixels_at
    if items is None or not len(items):
        if len(content.unordered):
            yield from _with_pauses(
                _offer_set_encodings(best, no_blocks(), content.unordered, pixels_at)
            )
        yield best.payloads
        return
    # A voxel that follows itself would end a chain.
    items = items.select(np.concatenate(([True], items.index[1:] != items.index[:-1])))
    chains = build_chains(items.voxels, items.values, config, items.corners)
    yield []
    if not len(content.unordered):
        best.offer(chains.blocks)
        if (items.values != items.values[0]).any():
            best.offer(_sorted_by_pen(chains.blocks))
    lone = int(np.count_nonzero(chains.count == 0))
    if (
        config.bytes_per_s >= _CHAINS_FROM
        and _LONE_FRACTION * lone < len(items)
        and not len(content.unordered)
    ):
        yield best.payloads
        return
    yield []
    apart = _cheaper_as_set(chains, items, pixels_at, config)
    if apart.any() or len(content.unordered):
        index = _union(items.index[_voxel_rows(chains, apart)], content.unordered)
        kept = _sorted_by_pen(chains.blocks.take(np.flatnonzero(~apart)))
        yield from _with_pauses(_offer_set_encodings(best, kept, index, pixels_at))
        yield []
    if config.bytes_per_s >= _CHAINS_FROM:
        yield best.payloads
        return
    index = _union(items.index, content.unordered)
    if spans.min_bytes(index, config) < best.total_bytes:
        best.offer(run_to_end(spans.encode_span_set(index, pixels_at(index), pixels_at, config)))
    if config.has(spec.FEATURE_ARC) and not len(content.unordered):
        best.offer_payloads(encode_range_coded(items.voxels, items.values, config))
    yield best.payloads


def _with_pauses(steps: Incremental[None]) -> Iterator[list[bytes]]:
    """Do steps, with nothing to be sent in between."""
    for _ in steps:
        yield []


def _union(index: Ints, others: Ints) -> Ints:
    """Give the indices of both, ascending, each once."""
    together = np.sort(np.concatenate((index, others)) if len(others) else index)
    return together[np.concatenate(([True], together[1:] != together[:-1]))]


class _BestLayout:
    """The layout of the fewest bytes among those that were offered."""

    def __init__(self, config: EncoderConfig, first: OpBlocks) -> None:
        self.config = config
        self._first = first
        self._layout: PayloadLayout | None = None
        self._others: list[bytes] = []

    @property
    def total_bytes(self) -> float:
        """Its bytes; without any, more than there can be."""
        others = sum(map(len, self._others))
        return self._layout.total_bytes + others if self._layout else np.inf

    @property
    def payloads(self) -> list[bytes]:
        """Its payloads."""
        if self._layout is None:
            self.offer(no_blocks())
        return self._layout.payloads + self._others if self._layout else []

    def offer(self, *parts: OpBlocks) -> None:
        """Take pieces, if they take fewer bytes."""
        blocks = (
            concatenate_blocks([self._first, *parts])
            if len(self._first)
            else concatenate_blocks(parts)
        )
        layout = PayloadLayout(blocks, self.config)
        if layout.total_bytes < self.total_bytes:
            self._layout, self._others = layout, []

    def offer_payloads(self, payloads: list[bytes]) -> None:
        """Take what is payloads already, if with what comes first they take fewer bytes."""
        first = PayloadLayout(self._first, self.config)
        if first.total_bytes + sum(map(len, payloads)) < self.total_bytes:
            self._layout, self._others = first, payloads


def _sorted_by_pen(blocks: OpBlocks) -> OpBlocks:
    """Order pieces so that a pen is set once; pieces that go on from another stay behind it."""
    if len(blocks) == 0 or (blocks.pen == blocks.pen[0]).all():
        return blocks
    return blocks.take(np.argsort(blocks.pen, kind="stable"))


def _voxel_rows(chains: Chains, which: Bools) -> Ints:
    """Give the places of the voxels of some pieces, one piece after another."""
    return concat_ranges(chains.begin[which], chains.count[which] + 1)


def _cheaper_as_set(
    chains: Chains, items: OrderedVoxels, pixels_at: spans.PixelLookup, config: EncoderConfig
) -> Bools:
    """Tell which pieces of chains better go as a set of their voxels: (pieces,).

    An item does if a lower bound does not speak against it, and if all such pieces of its pen
    together take fewer bytes. A lone voxel always does.
    """
    blocks = chains.blocks
    apart: Bools = chains.count == 0
    if not voxel_sets.has_set_ops(config) or config.bytes_per_s >= _CHAINS_FROM:
        return apart
    goes = np.concatenate(([True], blocks.cursor[1:] != blocks.cursor_after[:-1]))
    cost = blocks.size + goes * (config.position_bytes + ~blocks.starts_with_step)
    item = items.item[chains.begin]
    as_chain = np.bincount(item, weights=cost)
    least = voxel_sets.min_bytes(items.index, items.item, len(as_chain), config)
    maybe = (least < as_chain)[item]
    if not maybe.any():
        return apart
    voxels = _union(items.index[_voxel_rows(chains, maybe)], items.index[:0])
    encoded = voxel_sets.encode_set(voxels, pixels_at(voxels), config)
    rank = np.searchsorted(encoded.values, blocks.pen[maybe])
    as_chains = np.bincount(rank, weights=cost[maybe], minlength=len(encoded.values))
    apart[maybe] |= (encoded.bytes_per_value < as_chains)[rank]
    return apart


def _offer_set_encodings(
    best: _BestLayout, kept: OpBlocks, index: Ints, pixels_at: spans.PixelLookup
) -> Incremental[None]:
    """Offer pieces together with a set of voxels, n >= 1, coded in each way; in steps."""
    config, values = best.config, pixels_at(index)
    if voxel_sets.has_set_ops(config) and not _is_incompressible(index, values):
        encoded = voxel_sets.encode_set(index, values, config)
        yield
        best.offer(kept, encoded.blocks)
        in_spans = _cheaper_as_spans(index, values, encoded, config)
        if in_spans.any() and not in_spans.all():
            there = in_spans[np.searchsorted(encoded.values, values)]
            brick_pieces = np.searchsorted(encoded.values, encoded.blocks.pen)
            in_bricks = encoded.blocks.take(np.flatnonzero(~in_spans[brick_pieces]))
            rest = yield from spans.encode_span_set(index[there], values[there], pixels_at, config)
            best.offer(kept, in_bricks, rest)
    if spans.min_bytes(index, config) < best.total_bytes - int(kept.size.sum()):
        rows = yield from spans.encode_span_set(index, values, pixels_at, config)
        yield
        best.offer(kept, rows)


def _is_incompressible(index: Ints, values: NDArray[np.integer]) -> bool:
    """Tell whether bricks cannot be worth trying: many colours, and few voxels like the next."""
    alike = (index[1:] - index[:-1] == 1) & (values[1:] == values[:-1])
    if 2 * int(np.count_nonzero(alike)) >= len(index):
        return False
    some = values[:: -(-len(values) // _SAMPLE)]
    return len(np.unique(some)) > _MANY_COLORS or len(np.unique(values)) > _MANY_COLORS


def _cheaper_as_spans(
    index: Ints, values: NDArray[np.integer], encoded: voxel_sets.EncodedSet, config: EncoderConfig
) -> Bools:
    """Guess which pixels take fewer bytes in scan order than as bricks: (pixels,)."""
    row = np.concatenate(([True], (np.diff(index) != 1) | (values[1:] != values[:-1])))
    rows = np.bincount(np.searchsorted(encoded.values, values[row]), minlength=len(encoded.values))
    # SKIP with a count of two bytes, and LIT of one pixel.
    return rows * (3 + config.format.bytes) < encoded.bytes_per_value + config.pen_bytes
