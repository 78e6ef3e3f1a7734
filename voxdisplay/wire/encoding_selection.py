"""Selection of encodings: the encoder that draws a page update in the fewest bytes.

Ordered voxels are encoded as chains, sets of voxels as bricks, dots and boxes, or as spans in scan
order. Each candidate is laid out and its bytes are counted, unless a lower bound rules it out.
Range coding is slow: for a fast link it is left out of the features (`features`). Each voxel has
one pixel value here, so that op blocks may come in any order; for a fast line dense sets are
encoded in independent parts, so that the first can be sent at once. Must not know frames or links.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.display_list import DrawnVoxels, Kind
from voxdisplay.raster.pixel_map import contains
from voxdisplay.wire import spans, spec, voxel_sets
from voxdisplay.wire.array_order import items_that_are_sets
from voxdisplay.wire.chains import Chains, build_chains
from voxdisplay.wire.fades import FADED, FadedRows
from voxdisplay.wire.incremental_work import Incremental, run_to_end
from voxdisplay.wire.op_encoding import Bools, EncoderConfig, Ints, concat_ranges
from voxdisplay.wire.page_update import PageUpdate, is_incompressible, partition
from voxdisplay.wire.payload_splitting import OpBlocks, PayloadLayout, concatenate_blocks, no_blocks

# Line rate, bytes/s, from which chains are sent without trying whether sets are shorter.
_CHAINS_FROM = 800_000
_LONE_FRACTION = 16  # unless one voxel in so many is isolated
# Bits of a range-coded step, at least: curves were seen to take 1.1, surfaces in any order 4.
_LEAST_STEP_BITS, _LEAST_SET_STEP_BITS = 0.5, 2.0
# Pixel values that may get slabs of their own, in packets of their own: each costs so many bytes.
_MANY_PENS = 16
_PACKET_BYTES = 9
# Bytes of a typical set for each byte of its lower bound.
_TYPICAL_FACTOR = 1.5


def encode_update(
    update: PageUpdate, config: EncoderConfig, first: OpBlocks | None = None
) -> Iterator[list[bytes]]:
    """Yield the payloads that draw an update, in whatever order they arrive.

    Encoding continues while they are taken. An empty list is a pause, in which the caller may serve
    the link.

    Parameters
    ----------
    update : PageUpdate
    config : EncoderConfig
    first : OpBlocks, optional
        Blocks to be sent as well, such as palette entries.

    Yields
    ------
    list of bytes
        At most ``config.max_payload`` bytes each, none of them empty.

    """
    range_coded = config.has(spec.FEATURE_SLABS) or config.has(spec.FEATURE_VALUES)
    known = _with_known_order(update, config) if range_coded else update
    if range_coded and len(known.unordered):
        yield from _encode_with_slabs(update, known, config, first)
    else:
        yield from _encode_parts(update, config, first)


def _encode_with_slabs(
    update: PageUpdate, known: PageUpdate, config: EncoderConfig, first: OpBlocks | None
) -> Iterator[list[bytes]]:
    """Yield the payloads of an update, its sets range-coded if that takes fewer bytes on the wire.

    All ways are counted before anything is yielded: range coding is for slow lines.
    """
    best = yield from _collect(update, config, first)
    yield []
    in_slabs, index = _encode_sets(known, config)
    yield []
    ways = [(in_slabs, index)] if in_slabs else []
    if config.has(spec.FEATURE_VALUES):
        for before, some in (([], known.unordered), (in_slabs, index))[: 2 if in_slabs else 1]:
            of_values, left = _encode_values(some, known, best, config)
            ways += [(before + of_values, left)] if of_values else []
            yield []
    for coded, left in ways:
        if _wire_bytes(coded) < _wire_bytes(best):
            rest = PageUpdate(known.ordered, left, known.pixels_at)
            whole = coded + (yield from _collect(rest, config, first))
            best = min(best, whole, key=_wire_bytes)
    yield best


def _collect(
    update: PageUpdate, config: EncoderConfig, first: OpBlocks | None
) -> Generator[list[bytes], None, list[bytes]]:
    """Return the payloads of an update without range-coded sets, incrementally."""
    payloads: list[bytes] = []
    for portion in _encode_parts(update, config, first):
        payloads += portion
        yield []
    return payloads


def _encode_values(
    index: Ints, update: PageUpdate, best: list[bytes], config: EncoderConfig
) -> tuple[list[bytes], Ints]:
    """Return voxels range-coded with their values, if that may be the shortest, and the others."""
    from voxdisplay.wire import slabs  # noqa: PLC0415 - for slow lines

    values = update.pixels_at(index)
    lit = values > 0
    some, of_some = index[lit], values[lit]
    if not len(some) or (config.has(spec.FEATURE_SLABS) and (of_some == of_some[0]).all()):
        return [], index  # SLABS codes what has one value
    if slabs.are_too_sparse(some, config):
        return [], index
    return slabs.encode_values_best(some, of_some, _wire_bytes(best), config), index[~lit]


def _wire_bytes(payloads: list[bytes]) -> int:
    """Return the bytes of payloads on the wire, about."""
    return sum(map(len, payloads)) + _PACKET_BYTES * len(payloads)


def _encode_sets(update: PageUpdate, config: EncoderConfig) -> tuple[list[bytes], Ints]:
    """Return range-coded slabs of the pixel values that take fewer bytes so, and the other voxels.

    An op has one pen: of many values the most frequent are tried.
    """
    from voxdisplay.wire import slabs  # noqa: PLC0415 - for slow lines

    index, values = update.unordered, update.pixels_at(update.unordered)
    if not config.has(spec.FEATURE_SLABS) or is_incompressible(index, values):
        return [], index
    pens, rank, counts = np.unique(values, return_inverse=True, return_counts=True)
    bytes_as_set = counts
    if voxel_sets.has_set_ops(config) and len(pens) > 1:
        bytes_as_set = voxel_sets.encode_set(index, values, config).bytes_per_value
    payloads: list[bytes] = []
    rest = np.ones(len(index), dtype=np.bool_)
    for number in np.argsort(-counts, kind="stable")[:_MANY_PENS].tolist():
        rows = rank == number
        if slabs.are_too_sparse(index[rows], config):
            continue
        coded = slabs.encode_slabs(index[rows], int(pens[number]), config)
        if len(pens) == 1 or _wire_bytes(coded) < bytes_as_set[number]:
            payloads += coded
            rest &= ~rows
    return payloads, index[rest]


def _encode_parts(
    update: PageUpdate, config: EncoderConfig, first: OpBlocks | None
) -> Iterator[list[bytes]]:
    """Yield the payloads of an update without range-coded slabs, part after part."""
    chained = None if len(update.unordered) else update.ordered
    update = _with_known_order(update, config)
    for part in partition(update, config):
        best = _BestLayout(config, first or no_blocks())
        first = None
        yield from _with_pauses(_offer_encodings(best, part))
        if part is not update:
            chained = None if len(part.unordered) else part.ordered
        if chained and config.bytes_per_s < _CHAINS_FROM:
            _offer_range_coded(best, chained, len(part.unordered) / max(1, len(chained)))
        yield best.payloads


def _with_known_order(update: PageUpdate, config: EncoderConfig) -> PageUpdate:
    """Return an update in which arrays that are sets are unordered."""
    ordered, index = update.ordered, update.unordered
    if ordered is None or not len(ordered):
        return replace(update, ordered=None)
    are_sets = items_that_are_sets(ordered, config)
    if not are_sets.any():
        return update
    rows = are_sets[ordered.item]
    rest, sets = ordered.select(~rows), ordered.index[rows]
    if len(rest):  # what two items drew with one value is sent once
        sets = sets[~contains(np.sort(rest.index), sets)]
    return PageUpdate(rest if len(rest) else None, _union(sets, index), update.pixels_at)


def _offer_encodings(best: _BestLayout, update: PageUpdate) -> Incremental[None]:
    """Offer each encoding of an update but range coding, incrementally."""
    config, ordered, pixels_at = best.config, update.ordered, update.pixels_at
    if ordered is None:
        if len(update.unordered):
            yield from _offer_set_encodings(best, no_blocks(), update.unordered, pixels_at)
        return
    ordered = _without_repeats(ordered)
    chains = _shortest_chains(ordered, config)
    yield
    if not len(update.unordered):
        best.offer(chains.blocks)
        if (ordered.values != ordered.values[0]).any():
            best.offer(_sorted_by_pen(chains.blocks))
        if config.bytes_per_s >= _CHAINS_FROM and _are_curves(ordered, chains):
            return
    yield
    as_set, tried = _cheaper_as_set(chains, ordered, pixels_at, config)
    if as_set.any() or len(update.unordered):
        index = _union(ordered.index[_voxel_rows(chains, as_set)], update.unordered)
        kept = _sorted_by_pen(chains.blocks.take(np.flatnonzero(~as_set)))
        yield from _offer_set_encodings(best, kept, index, pixels_at, tried)
        yield
    if config.bytes_per_s >= _CHAINS_FROM:
        return
    index = _union(ordered.index, update.unordered)
    if spans.min_bytes(index, config) < best.total_bytes:
        best.offer(run_to_end(spans.encode_span_set(index, pixels_at(index), pixels_at, config)))


def _offer_range_coded(best: _BestLayout, drawn: DrawnVoxels, sets: float) -> None:
    """Offer range-coded chains if the device has them and they may win.

    Parameters
    ----------
    best : _BestLayout
    drawn : DrawnVoxels
        All that is to be drawn.
    sets : float
        Share of the voxels that belong to arrays which are sets.

    """
    config = best.config
    first, second = config.has(spec.FEATURE_ARC), config.has(spec.FEATURE_ARC2)
    if not (first or second) or not len(drawn):
        return
    from voxdisplay.wire import range_coded_chains, sorted_chains  # noqa: PLC0415 - for slow lines

    drawn = _without_repeats(drawn)
    second &= not first or sorted_chains.may_gain(drawn, config)
    voxels = config.grid.voxels_at(drawn.index)
    step_bits = _LEAST_STEP_BITS * (1 - sets) + _LEAST_SET_STEP_BITS * sets
    if second:
        if sorted_chains.least_bytes(drawn, step_bits, config) < best.total_bytes:
            best.offer_payloads(sorted_chains.encode_sorted_chains(drawn, config))
        return
    least = range_coded_chains.least_bytes(voxels, drawn.values, step_bits, config)
    if least < best.total_bytes:
        best.offer_payloads(range_coded_chains.encode_range_coded(voxels, drawn.values, config))


def _without_repeats(ordered: DrawnVoxels) -> DrawnVoxels:
    """Return voxels without those that repeat the one before: they would end a chain."""
    return ordered.select(np.append(True, ordered.index[1:] != ordered.index[:-1]))


def _are_curves(ordered: DrawnVoxels, chains: Chains) -> bool:
    """Return whether all items follow curves, and few of their voxels are isolated."""
    lone = int(np.count_nonzero(chains.count == 0))
    return _LONE_FRACTION * lone < len(ordered) and not (ordered.kinds == Kind.ARRAY).any()


def _with_pauses(steps: Incremental[None]) -> Iterator[list[bytes]]:
    """Yield a pause for each step of incremental work."""
    for _ in steps:
        yield []


def _union(index: Ints, others: Ints) -> Ints:
    """Return the union of indices, ascending."""
    together = np.sort(np.concatenate((index, others)) if len(others) else index)
    return together[np.concatenate(([True], together[1:] != together[:-1]))]


class _BestLayout:
    """The layout with the fewest bytes of all candidates offered."""

    def __init__(self, config: EncoderConfig, first: OpBlocks) -> None:
        self.config = config
        self._first = first
        self._layout: PayloadLayout | None = None
        self._others: list[bytes] = []

    @property
    def total_bytes(self) -> float:
        """Bytes of the best candidate; infinite without one."""
        others = sum(map(len, self._others))
        return self._layout.total_bytes + others if self._layout else np.inf

    @property
    def payloads(self) -> list[bytes]:
        """Payloads of the best candidate."""
        if self._layout is None:
            self.offer(no_blocks())
        return self._layout.payloads + self._others if self._layout else []

    def offer(self, *parts: OpBlocks) -> None:
        """Keep blocks if their layout takes fewer bytes than the best so far."""
        blocks = (
            concatenate_blocks([self._first, *parts])
            if len(self._first)
            else concatenate_blocks(parts)
        )
        layout = PayloadLayout(blocks, self.config)
        if layout.total_bytes < self.total_bytes:
            self._layout, self._others = layout, []

    def offer_payloads(self, payloads: list[bytes]) -> None:
        """Keep finished payloads if, with the blocks sent first, they take fewer bytes."""
        first = PayloadLayout(self._first, self.config)
        if first.total_bytes + sum(map(len, payloads)) < self.total_bytes:
            self._layout, self._others = first, payloads


def _shortest_chains(ordered: DrawnVoxels, config: EncoderConfig) -> Chains:
    """Return the chains of voxels, under fades if that takes fewer bytes."""
    voxels, index = config.grid.voxels_at(ordered.index), ordered.index
    chains = build_chains(voxels, ordered.values, config, ordered.corners, index)
    fades = FadedRows.of(ordered, config)
    if fades is None:
        return chains
    faded = build_chains(voxels, ordered.values, config, ordered.corners, index, fades)
    return min(chains, faded, key=lambda each: _layout_bytes(each, config))


def _layout_bytes(chains: Chains, config: EncoderConfig) -> int:
    return PayloadLayout(chains.blocks, config).total_bytes


def _sorted_by_pen(blocks: OpBlocks) -> OpBlocks:
    """Return blocks sorted by pen, stably, so that each pen is set once."""
    if len(blocks) == 0 or (blocks.pen == blocks.pen[0]).all():
        return blocks
    return blocks.take(np.argsort(blocks.pen, kind="stable"))


def _voxel_rows(chains: Chains, which: Bools) -> Ints:
    """Return the rows of the voxels of selected segments, concatenated."""
    return concat_ranges(chains.begin[which], chains.count[which] + 1)


@dataclass(frozen=True)
class _TriedSet:
    """A set of voxels, by scan-order indices, that was encoded for comparison."""

    index: Ints
    encoded: voxel_sets.EncodedSet


def _cheaper_as_set(
    chains: Chains, ordered: DrawnVoxels, pixels_at: spans.PixelLookup, config: EncoderConfig
) -> tuple[Bools, _TriedSet | None]:
    """Return which segments are cheaper as a set of their voxels, (segments,), and what was tried.

    Those of an item are if a lower bound admits it and all such segments of their pen together take
    fewer bytes as a set. A lone voxel always is. For a fast line, curves are not tried.
    """
    blocks = chains.blocks
    as_set: Bools = chains.count == 0
    tried = np.ones(len(ordered.kinds), dtype=np.bool_)
    if config.bytes_per_s >= _CHAINS_FROM:
        tried = ordered.kinds == Kind.ARRAY
    if not voxel_sets.has_set_ops(config) or not tried.any():
        return as_set, None
    goes = np.concatenate(([True], blocks.cursor[1:] != blocks.cursor_after[:-1]))
    cost = blocks.size + goes * (config.position_bytes + ~blocks.starts_with_step)
    item = ordered.item[chains.begin]
    items = len(ordered.kinds)  # a segment may go on into the next item, where none begins
    as_chain = np.bincount(item, weights=cost, minlength=items)
    least = voxel_sets.min_bytes(ordered.index, ordered.item, items, config)
    factor = _TYPICAL_FACTOR if config.bytes_per_s >= _CHAINS_FROM else 1
    maybe = (tried & (factor * least < as_chain))[item] & (blocks.pen < FADED)
    if not maybe.any():
        return as_set, None
    voxels = _union(ordered.index[_voxel_rows(chains, maybe)], ordered.index[:0])
    encoded = voxel_sets.encode_set(voxels, pixels_at(voxels), config)
    rank = np.searchsorted(encoded.values, blocks.pen[maybe])
    as_chains = np.bincount(rank, weights=cost[maybe], minlength=len(encoded.values))
    as_set[maybe] |= (encoded.bytes_per_value < as_chains)[rank]
    return as_set, _TriedSet(voxels, encoded)


def _offer_set_encodings(
    best: _BestLayout,
    kept: OpBlocks,
    index: Ints,
    pixels_at: spans.PixelLookup,
    tried: _TriedSet | None = None,
) -> Incremental[None]:
    """Offer blocks together with each encoding of a set of voxels, n >= 1; incrementally."""
    config, values = best.config, pixels_at(index)
    if voxel_sets.has_set_ops(config) and not is_incompressible(index, values):
        if tried and np.array_equal(tried.index, index):
            encoded = tried.encoded
        else:
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


def _cheaper_as_spans(
    index: Ints, values: NDArray[np.integer], encoded: voxel_sets.EncodedSet, config: EncoderConfig
) -> Bools:
    """Estimate which pixel values take fewer bytes as spans than as bricks: (values,)."""
    row = np.concatenate(([True], (np.diff(index) != 1) | (values[1:] != values[:-1])))
    rows = np.bincount(np.searchsorted(encoded.values, values[row]), minlength=len(encoded.values))
    # Per row: SKIP with a count of two bytes, and LIT of one pixel.
    return rows * (3 + config.format.bytes) < encoded.bytes_per_value + config.pen_bytes
