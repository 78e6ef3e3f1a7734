"""Encoder of voxel sets: OCT, DOTS, BOX and STEP (protocol.md, sections 7.1, 7.3, 7.4).

Large flat areas become a BOX. An octree selects which nodes of the rest become bricks or chains,
and which voxels dots. Full bricks that make up a cuboid are merged to one BOX, and so are large
cuboids anywhere, if that takes fewer bytes. Must not know curves, nor an order of voxels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec
from voxdisplay.wire.chains import build_chains
from voxdisplay.wire.cuboids import merge_cuboids
from voxdisplay.wire.octree import (
    BRICK_SIDE,
    Level,
    build_leaves,
    build_levels,
    origins,
    select_ops,
)
from voxdisplay.wire.op_encoding import (
    Bools,
    Bytes,
    EncoderConfig,
    Ints,
    concat_ranges,
    encode_positions,
)
from voxdisplay.wire.payload_splitting import (
    ANY,
    OpBlocks,
    PayloadLayout,
    concatenate_blocks,
    no_blocks,
)

# A cuboid of so many voxels may pay as a BOX. They are searched if the rows of voxels are few or
# long.
_LARGE = 64
_MANY_ROWS, _LONG_ROW = 2000, 4
# Squares of four voxels in a cube of eight: their normal axis, and lower or upper half.
_SQUARES = [(axis, half) for axis in range(3) for half in range(2)]
_SQUARE_OF = np.full(256, -1)
for _number, (_axis, _half) in enumerate(_SQUARES):
    _SQUARE_OF[sum(1 << child for child in range(8) if child >> _axis & 1 == _half)] = _number


@dataclass(frozen=True)
class EncodedSet:
    """Encoded voxel set: bricks, dots, boxes and chains.

    Attributes
    ----------
    blocks : OpBlocks
        Sorted by pen.
    values : (k,) int64 array
        Pixel values that occur, ascending.
    bytes_per_value : (k,) int64 array
        Bytes of the voxels of each, without its PEN.

    """

    blocks: OpBlocks
    values: Ints
    bytes_per_value: Ints


def has_set_ops(config: EncoderConfig) -> bool:
    """Return whether the device has an op for sets."""
    return config.has(spec.FEATURE_OCT) or config.has(spec.FEATURE_DOTS)


def encode_set_payloads(
    index: Ints, values: NDArray[np.integer], config: EncoderConfig
) -> list[bytes]:
    """Return the payloads that draw a set of voxels; the device must have OCT or DOTS.

    Parameters
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once, n >= 1.
    values : (n,) integer array
        Pixel value of each.
    config : EncoderConfig

    Returns
    -------
    list of bytes
        At most ``config.max_payload`` bytes each.

    """
    return PayloadLayout(encode_set(index, values, config).blocks, config).payloads


def encode_set(index: Ints, values: NDArray[np.integer], config: EncoderConfig) -> EncodedSet:
    """Return a set of voxels encoded as bricks, dots, boxes and chains, whichever is cheapest."""
    bricks = _encode_by_octree(index, values, config)
    if not config.has(spec.FEATURE_BOX):
        return bricks
    with_boxes = _large_boxes(index, values, int(bricks.bytes_per_value.sum()), config)
    return bricks if with_boxes is None else with_boxes


def _encode_by_octree(
    index: Ints, values: NDArray[np.integer], config: EncoderConfig
) -> EncodedSet:
    pixels, rank = _rank_values(values)
    bricks_per_axis = [-(-side // BRICK_SIDE) for side in config.grid]
    key, mask = build_leaves(index, rank, len(pixels), bricks_per_axis, config)
    parts: list[OpBlocks] = []
    if config.has(spec.FEATURE_BOX):
        flats, others = _flat_boxes(key, mask, pixels, config, bricks_per_axis)
        parts.append(flats)
        key, mask = key[others], mask[others]
    if len(key):
        parts += _tree_blocks(build_levels(key, mask, config), pixels, config, bricks_per_axis)
    return _with_byte_counts(concatenate_blocks(parts), pixels, config)


def _tree_blocks(
    levels: list[Level], pixels: Ints, config: EncoderConfig, bricks_per_axis: list[int]
) -> list[OpBlocks]:
    roots, chains, dots = select_ops(levels, config)
    boxes, roots = _merge_full_bricks(levels, roots, pixels, config, bricks_per_axis)
    parts = [] if boxes is None else [boxes]
    for number, nodes in roots:
        if len(nodes):
            parts.append(_oct_blocks(levels, number, nodes, pixels, config, bricks_per_axis))
    if len(chains):
        voxels, rank = origins(chains, bricks_per_axis)
        parts.append(build_chains(voxels, pixels[rank], config).blocks)
    if len(dots):
        parts.append(_dot_blocks(dots, pixels, config, bricks_per_axis))
    return parts


def _with_byte_counts(blocks: OpBlocks, pixels: Ints, config: EncoderConfig) -> EncodedSet:
    blocks = blocks.take(np.argsort(blocks.pen, kind="stable"))
    # All bytes but the PEN count: the MOVE of a BOX, and what turns a STEP into a FROM.
    goes = blocks.cursor != ANY
    goes[1:] &= blocks.cursor[1:] != blocks.cursor_after[:-1]
    size = blocks.size + goes * (config.position_bytes + ~blocks.starts_with_step)
    bytes_of = np.bincount(np.searchsorted(pixels, blocks.pen), weights=size, minlength=len(pixels))
    return EncodedSet(blocks, pixels, bytes_of.astype(np.int64))


def _large_boxes(
    index: Ints, values: NDArray[np.integer], bytes_without: int, config: EncoderConfig
) -> EncodedSet | None:
    """Return the set with its large cuboids as BOX if that takes fewer bytes, else None."""
    edge = (np.diff(index) != 1) | (values[1:] != values[:-1]) | (index[1:] % config.grid.nx == 0)
    first = np.flatnonzero(np.concatenate(([True], edge)))
    if len(index) < _LARGE or len(first) > max(_MANY_ROWS, len(index) // _LONG_ROW):
        return None
    length = np.diff(first, append=len(index))
    low = config.grid.voxels_at(index[first]).astype(np.int64)
    high = low.copy()
    high[:, 0] += length - 1
    low, high, _, owner = merge_cuboids(low, values[first].astype(np.int64), high)
    large = (high - low + 1).prod(axis=1) >= _LARGE
    cost = int(large.sum()) * 2 * (1 + config.position_bytes)
    if not large.any() or cost >= bytes_without:
        return None
    pixel = np.empty(len(low), dtype=np.int64)
    pixel[owner] = values[first]
    rest = ~np.repeat(large[owner], length)
    parts = [box_blocks(low[large], high[large], pixel[large], config)]
    if rest.any():
        parts.append(_encode_by_octree(index[rest], values[rest], config).blocks)
    with_boxes = _with_byte_counts(
        concatenate_blocks(parts), np.unique(values).astype(np.int64), config
    )
    return with_boxes if with_boxes.bytes_per_value.sum() < bytes_without else None


def min_bytes(index: Ints, group: NDArray[np.integer], groups: int, config: EncoderConfig) -> Ints:
    """Return a lower bound of the bytes of each of several sets: (groups,); cheap to find.

    Every cube of two voxels a side that is not full costs a mask, or more.
    """
    x, y, z = (config.grid.voxels_at(index).T >> 1).astype(np.int64)
    half = [side // 2 + 1 for side in config.grid]
    cell = np.sort(x + half[0] * (y + half[1] * (z + half[2] * group.astype(np.int64))))
    first = np.flatnonzero(np.concatenate(([True], cell[1:] != cell[:-1])))
    partly = np.diff(first, append=len(cell)) < 8
    owner = cell[first][partly] // (half[0] * half[1] * half[2])
    return np.bincount(owner, minlength=groups)


def _rank_values(values: NDArray[np.integer]) -> tuple[Ints, Ints]:
    """Return the pixel values that occur, ascending, and the rank of each voxel's."""
    if (values == values[0]).all():
        return values[:1].astype(np.int64), np.zeros(len(values), dtype=np.int64)
    pixels, rank = np.unique(values, return_inverse=True)
    return pixels.astype(np.int64), rank.astype(np.int64)


def _oct_blocks(
    levels: list[Level],
    number: int,
    roots: Ints,
    pixels: Ints,
    config: EncoderConfig,
    bricks_per_axis: list[int],
) -> OpBlocks:
    """Return the OCT ops of bricks of one level."""
    none = np.zeros(len(roots), dtype=np.int64)
    size = 1 + config.position_bytes + (levels[number - 1].nodes[roots] if number else none)
    offset = np.cumsum(size) - size
    body = np.empty(int(size.sum()), dtype=np.uint8)
    origin, rank = origins(
        levels[number - 1].key[roots] << 3 * number if number else roots, bricks_per_axis
    )
    body[offset] = spec.OP_OCT | number
    place = encode_positions(origin >> number, config)
    body[offset[:, None] + 1 + np.arange(config.position_bytes)] = place
    at = offset + 1 + config.position_bytes
    # Masks level by level; a full node has no masks below it.
    seen, owner = roots, np.arange(len(roots))
    for depth in range(number, 0, -1):
        level = levels[depth - 1]
        count = np.bincount(owner, minlength=len(roots))
        body[concat_ranges(at, count)] = np.where(level.full[seen], np.uint8(0), level.mask[seen])
        at = at + count
        if depth > 1:
            partly = ~level.full[seen]
            edges = np.append(level.first, len(levels[depth - 2].key))
            begin = edges[seen[partly]]
            children = edges[seen[partly] + 1] - begin
            seen, owner = concat_ranges(begin, children), np.repeat(owner[partly], children)
    anywhere = np.full(len(roots), ANY)
    pen = pixels[rank]
    return OpBlocks(body, size, pen, anywhere, pen, anywhere, np.zeros(len(roots), dtype=np.bool_))


def _dot_blocks(
    key: Ints, pixels: Ints, config: EncoderConfig, bricks_per_axis: list[int]
) -> OpBlocks:
    """Return DOTS ops, each of one pen."""
    voxels, rank = origins(key, bricks_per_axis)
    most = min(spec.LIMIT_MAX_DOTS, (config.max_block_bytes - 2) // config.position_bytes)
    first = np.flatnonzero(np.concatenate(([True], rank[1:] != rank[:-1])))
    count = np.diff(first, append=len(rank))
    parts = -(-count // most)
    done = concat_ranges(np.zeros(len(count), dtype=np.int64), parts) * most
    first = np.repeat(first, parts) + done
    count = np.minimum(np.repeat(count, parts) - done, most)
    alone = (count == 1) & config.has(spec.FEATURE_OCT)  # OCT of level 0 is one byte shorter
    size = np.where(alone, 1, 2) + count * config.position_bytes
    offset = np.cumsum(size) - size
    body = np.empty(int(size.sum()), dtype=np.uint8)
    body[offset] = np.where(alone, spec.OP_OCT, spec.OP_DOTS)
    body[(offset + 1)[~alone]] = (count - 1)[~alone]
    data = encode_positions(voxels, config).reshape(-1)
    body[concat_ranges(offset + np.where(alone, 1, 2), count * config.position_bytes)] = data
    pen = pixels[rank[first]]
    last = config.grid.index_of(voxels[first + count - 1])
    anywhere = np.full(len(first), ANY)
    none = np.zeros(len(first), dtype=np.bool_)
    return OpBlocks(body, size, pen, anywhere, pen, np.where(alone, ANY, last), none)


def _merge_full_bricks(
    levels: list[Level],
    roots: list[tuple[int, Ints]],
    pixels: Ints,
    config: EncoderConfig,
    bricks_per_axis: list[int],
) -> tuple[OpBlocks | None, list[tuple[int, Ints]]]:
    """Return a BOX for each cuboid of full bricks, and the bricks that are left."""
    (number, top), *others = roots
    full = levels[number - 1].full[top]
    if not config.has(spec.FEATURE_BOX) or full.sum() < 2:
        return None, roots
    origin, rank = origins(levels[number - 1].key[top[full]] << 3 * number, bricks_per_axis)
    low, high, merged, owner = merge_cuboids(origin >> number, rank)
    worth = merged > 1
    kept = np.concatenate((top[~full], top[full][~worth[owner]]))
    if not worth.any():
        return None, roots
    low, high, rank = low[worth], high[worth], rank[np.unique(owner, return_index=True)[1]][worth]
    blocks = box_blocks(low << number, ((high + 1) << number) - 1, pixels[rank], config)
    return blocks, [(number, np.sort(kept)), *others]


def _flat_boxes(
    key: Ints, mask: Bytes, pixels: Ints, config: EncoderConfig, bricks_per_axis: list[int]
) -> tuple[OpBlocks, Bools]:
    """Return a BOX for each large flat area of squares, and which nodes of level 1 are left.

    Each square costs a mask in a brick, or more: as many squares as a BOX and its MOVE have bytes
    pay for them.
    """
    least = 2 * (1 + config.position_bytes)
    rest = np.ones(len(key), dtype=np.bool_)
    at = np.flatnonzero(_SQUARE_OF[mask] >= 0)
    if len(at) < least:
        return no_blocks(), rest
    origin, rank = origins(key[at] << 3, bricks_per_axis)
    square = _SQUARE_OF[mask[at]]
    axis, half = np.array(_SQUARES)[square].T
    # Squares in adjacent planes make no flat area: each plane is a group of its own.
    plane = np.take_along_axis(origin, axis[:, None], axis=1)[:, 0] + half
    group = (rank * len(_SQUARES) + square) << 32 | plane
    low, high, count, owner = merge_cuboids(origin >> 1, group)
    large = count >= least
    rest[at[large[owner]]] = False
    low, high = low[large] << 1, (high[large] << 1) + 1
    first = np.unique(owner, return_index=True)[1][large]
    row = np.arange(len(first))
    low[row, axis[first]] = high[row, axis[first]] = plane[first]
    return box_blocks(low, high, pixels[rank[first]], config), rest


def box_blocks(low: Ints, high: Ints, pen: Ints, config: EncoderConfig) -> OpBlocks:
    """Return BOX ops from corner to corner, (n, 3) each, both inclusive."""
    n = len(low)
    op = np.full((n, 1), spec.OP_BOX, dtype=np.uint8)
    body = np.concatenate((op, encode_positions(high, config)), axis=1)
    size = np.full(n, 1 + config.position_bytes)
    at, after = config.grid.index_of(low), config.grid.index_of(high)
    return OpBlocks(body.reshape(-1), size, pen, at, pen, after, np.zeros(n, dtype=np.bool_))
