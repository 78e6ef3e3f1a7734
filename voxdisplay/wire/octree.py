"""Octree over a set of voxels, with the cheapest op for each node.

Voxels of one pixel value are sorted in Morton order, so that those of a node are contiguous. From
the leaves up, each node takes the cheapest of: a brick (OCT) of its own, DOTS, one chain if its
voxels are one, or the sum of its children; a brick that exceeds a payload is never taken. All nodes
of a level are processed at once, by arrays. Must not encode: it counts bytes (protocol.md, section
7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import Bools, Bytes, EncoderConfig, Ints, concat_ranges

TOP_LEVEL = spec.LIMIT_MAX_LEVEL
BRICK_SIDE = 1 << TOP_LEVEL
_LEAF_BITS = 3 * TOP_LEVEL
_NEVER = 1 << 40
# Bits of a coordinate inside a brick, spread for interleaving with the others (Morton order).
_SPREAD = np.array(
    [sum((c >> bit & 1) << 3 * bit for bit in range(TOP_LEVEL)) for c in range(BRICK_SIDE)]
)
_POPCOUNT = np.array([mask.bit_count() for mask in range(256)])
# A set denser than one voxel in so many is sorted as a whole page.
_DENSE_RATIO = 16
_AS_BRICK, _AS_DOTS, _AS_CHILDREN, _AS_CHAIN = range(4)
_STEPS_PER_BYTE = 4
# In nodes of lower levels a chain saves a byte or two, and searching takes longest.
_MIN_CHAIN_LEVEL = 3


@dataclass(frozen=True)
class Level:
    """Nodes of one level, 1 or higher, in the order of their keys."""

    key: Ints
    first: Ints  # their first child on the level below; meaningless on level 1
    mask: Bytes  # of all children, also where a full node sends 00
    full: Bools
    nodes: Ints  # masks of a brick whose root is this node
    voxels: Ints  # number
    min_bytes: Ints  # of the cheapest choice
    choice: NDArray[np.int8]


def build_leaves(
    index: Ints, rank: Ints, ranks: int, bricks_per_axis: list[int], config: EncoderConfig
) -> tuple[Ints, Bytes]:
    """Return keys and masks of the nodes of level 1, in the order of the keys.

    A key is, from the highest digit: rank of the pixel value, brick of the top level in scan order,
    and the path to the node inside it, three bits a level.
    """
    bricks = BRICK_SIDE * config.grid.nx * config.grid.ny
    layers = int(index[-1]) // bricks - int(index[0]) // bricks + 1
    if ranks == 1 and _DENSE_RATIO * len(index) > layers * bricks:
        return _leaves_of_page(index, bricks_per_axis, config)
    x, y, z = config.grid.voxels_at(index).T
    bx, by, bz = bricks_per_axis
    block = rank * bz + (z >> TOP_LEVEL)
    block = (block * by + (y >> TOP_LEVEL)) * bx + (x >> TOP_LEVEL)
    low = BRICK_SIDE - 1
    inner = _SPREAD[x & low] | _SPREAD[y & low] << 1 | _SPREAD[z & low] << 2
    key = np.sort(block << _LEAF_BITS | inner)
    parent = key >> 3
    first = np.flatnonzero(np.concatenate(([True], parent[1:] != parent[:-1])))
    bits = (1 << (key & 7)).astype(np.uint8)
    return parent[first], np.add.reduceat(bits, first, dtype=np.uint8)


def _leaves_of_page(
    index: Ints, bricks_per_axis: list[int], config: EncoderConfig
) -> tuple[Ints, Bytes]:
    """Return as `build_leaves` for a dense set of one pixel value: by a page, without sorting."""
    nx, ny, _ = config.grid
    bx, by, _ = bricks_per_axis
    layer = nx * ny
    low, high = int(index[0]) // (layer * BRICK_SIDE), int(index[-1]) // (layer * BRICK_SIDE) + 1
    page = np.zeros(((high - low) * BRICK_SIDE, by * BRICK_SIDE, bx * BRICK_SIDE), dtype=np.uint8)
    layers = min((high - low) * BRICK_SIDE, config.grid.nz - low * BRICK_SIDE)
    inside = np.zeros(layers * layer, dtype=np.uint8)
    inside[index - low * layer * BRICK_SIDE] = 1
    page[:layers, :ny, :nx] = inside.reshape(layers, ny, nx)
    mask = np.zeros([side // 2 for side in page.shape], dtype=np.uint8)
    for child in range(8):
        mask |= page[child >> 2 :: 2, child >> 1 & 1 :: 2, child & 1 :: 2] << np.uint8(child)
    halves = [2] * (TOP_LEVEL - 1)
    parts = mask.reshape(high - low, *halves, by, *halves, bx, *halves)
    # Axes of bricks first, then of each level: z, y, x.
    axes = np.arange(3 * TOP_LEVEL).reshape(3, TOP_LEVEL).T.reshape(-1)
    ordered = parts.transpose(axes).reshape(-1)
    key = np.flatnonzero(ordered)
    return key + (low * by * bx << _LEAF_BITS - 3), ordered[key]


def build_levels(key: Ints, mask: Bytes, config: EncoderConfig) -> list[Level]:
    """Return the levels from 1 up, each node with the cheapest way to draw it."""
    header, dot = _op_costs(config)
    voxels = _POPCOUNT[mask]
    nodes = np.ones(len(key), dtype=np.int64)
    costs = np.stack((nodes + header, voxels * dot, voxels * min(header, dot)))
    levels = [
        Level(key, key, mask, mask == 255, nodes, voxels, costs.min(axis=0), _cheapest(costs))
    ]
    for number in range(1, TOP_LEVEL):
        below = levels[-1]
        parent = below.key >> 3
        first = np.flatnonzero(np.concatenate(([True], parent[1:] != parent[:-1])))
        bits = (1 << (below.key & 7)).astype(np.uint8)
        mask = np.add.reduceat(bits, first, dtype=np.uint8)
        full = (mask == 255) & (np.add.reduceat(below.full.astype(np.int64), first) == 8)
        voxels = np.add.reduceat(below.voxels, first)
        nodes = 1 + np.where(full, 0, np.add.reduceat(below.nodes, first))
        own = nodes + header
        own[own > config.max_block_bytes] = _NEVER
        key, by_child = parent[first], np.add.reduceat(below.min_bytes, first)
        costs = np.stack((own, voxels * dot, by_child, np.full(len(key), _NEVER)))
        if number + 1 >= _MIN_CHAIN_LEVEL:
            chain = 2 + config.position_bytes + -(-(voxels - 1) // _STEPS_PER_BYTE)
            maybe = np.flatnonzero((voxels <= 2 << number) & (chain < costs.min(axis=0)))
            is_chain = maybe[_find_chains(levels, number + 1, key[maybe])[1] >= 0]
            costs[_AS_CHAIN, is_chain] = chain[is_chain]
        levels.append(
            Level(key, first, mask, full, nodes, voxels, costs.min(axis=0), _cheapest(costs))
        )
    return levels


def _find_chains(levels: list[Level], number: int, nodes: Ints) -> tuple[Ints, Ints, Ints]:
    """Return which nodes of a level, given by their keys, are one chain along some axis.

    Returns
    -------
    keys : (n,) int64 array
        Keys of their voxels, each chain in its order.
    main : (nodes,) int64 array
        The axis; -1 if the node is no chain.
    owner : (n,) int64 array
        Node of each voxel.

    """
    inside = 3 * (number - 1)
    if not len(nodes):
        return nodes, nodes, nodes
    begin, end = np.searchsorted(levels[0].key, (nodes << inside, nodes + 1 << inside))
    key = _voxel_keys(levels, concat_ranges(begin, end - begin))
    owner = np.searchsorted(nodes, key >> inside + 3)
    spot = np.zeros((3, len(key)), dtype=np.int64)
    for bit in range(number):
        spot |= (key >> 3 * bit + np.arange(3)[:, None] & 1) << bit
    main = np.full(len(nodes), -1)
    order = np.arange(len(key))
    for axis in range(3):
        along = np.argsort(owner << TOP_LEVEL | spot[axis], kind="stable")
        step = np.diff(spot[:, along])
        inner = owner[1:] == owner[:-1]
        far = inner & ((step[axis] != 1) | (np.abs(step) > 1).any(axis=0))
        # A chain advances by one on this axis and never reverses on another.
        up, down = (_nodes_with(inner & (step * sign > 0), owner, len(nodes)) for sign in (1, -1))
        found = (
            ~_nodes_with(far[None], owner, len(nodes))[0] & ~(up & down).any(axis=0) & (main < 0)
        )
        main[found] = axis
        order = np.where(found[owner], along, order)
    return key[order], main, owner


def _nodes_with(steps: Bools, owner: Ints, nodes: int) -> Bools:
    """Return for each row which nodes contain a step that is set: (rows, nodes)."""
    found = np.zeros((len(steps), nodes), dtype=np.bool_)
    row, at = np.nonzero(steps)
    found[row, owner[at]] = True
    return found


def _op_costs(config: EncoderConfig) -> tuple[int, int]:
    """Return the bytes of a brick without its masks, and of one dot."""
    header = 1 + config.position_bytes if config.has(spec.FEATURE_OCT) else _NEVER
    return header, config.position_bytes if config.has(spec.FEATURE_DOTS) else _NEVER


def _cheapest(costs: Ints) -> NDArray[np.int8]:
    return np.asarray(costs.argmin(axis=0), dtype=np.int8)


def select_ops(
    levels: list[Level], config: EncoderConfig
) -> tuple[list[tuple[int, Ints]], Ints, Ints]:
    """Return the cheapest cover of the tree: bricks by level, keys of chain voxels, keys of dots.

    Bricks are indices of nodes of their level; those of level 0 are keys. Voxels of a chain are in
    its order, one chain after another.
    """
    roots: list[tuple[int, Ints]] = []
    dots: list[Ints] = []
    chains: list[Ints] = []
    open_ = np.arange(len(levels[-1].key))
    for number in range(TOP_LEVEL, 0, -1):
        level = levels[number - 1]
        choice = level.choice[open_]
        roots.append((number, open_[choice == _AS_BRICK]))
        dots.append(_voxel_keys(levels, _descendants(levels, number, open_[choice == _AS_DOTS], 1)))
        chains.append(_find_chains(levels, number, level.key[open_[choice == _AS_CHAIN]])[0])
        open_ = open_[choice == _AS_CHILDREN]
        if number > 1:
            open_ = _descendants(levels, number, open_, number - 1)
    alone = _voxel_keys(levels, open_)
    header, dot = _op_costs(config)
    if header < dot:
        roots.append((0, alone))
    else:
        dots.append(alone)
    return roots, np.concatenate(chains), np.sort(np.concatenate(dots))


def _descendants(levels: list[Level], number: int, nodes: Ints, to: int) -> Ints:
    """Return the descendants of nodes on a lower level, 1 or higher."""
    begin, end = nodes, nodes + 1
    for level in range(number, to, -1):
        edges = np.append(levels[level - 1].first, len(levels[level - 2].key))
        begin, end = edges[begin], edges[end]
    return concat_ranges(begin, end - begin)


def _voxel_keys(levels: list[Level], nodes: Ints) -> Ints:
    """Return the keys of the voxels of nodes of level 1."""
    leaves = levels[0]
    lit = np.unpackbits(leaves.mask[nodes, None], axis=1, bitorder="little") != 0
    return np.asarray((leaves.key[nodes, None] << 3 | np.arange(8))[lit])


def origins(key: Ints, bricks_per_axis: list[int]) -> tuple[Ints, Ints]:
    """Return the voxels, (n, 3), of keys of level 0, and the ranks of their pixel values."""
    bx, by, bz = bricks_per_axis
    block, x = np.divmod(key >> _LEAF_BITS, bx)
    block, y = np.divmod(block, by)
    rank, z = np.divmod(block, bz)
    corner = np.stack((x, y, z), axis=1) << TOP_LEVEL
    for bit in range(TOP_LEVEL):
        corner += (key[:, None] >> (3 * bit + np.arange(3)) & 1) << bit
    return corner, rank
