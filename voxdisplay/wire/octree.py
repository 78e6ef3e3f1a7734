"""Sets of voxels without an order -> nodes of octrees, and how each costs least.

Voxels of one pixel are sorted so that those of a node follow each other. From the leaves up, each
node finds how its voxels cost least: as a brick of its own, as dots, as one chain if they are one,
or in whatever way its children do; a brick that no payload holds is never among them. All nodes of
a level are done at once, by arrays. This module counts bytes (protocol.md, section 7), and makes
none.
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
# Where the bits of a coordinate inside a brick go, so that x, y and z take turns.
_SPREAD = np.array(
    [sum((c >> bit & 1) << 3 * bit for bit in range(TOP_LEVEL)) for c in range(BRICK_SIDE)]
)
_BITS = np.array([mask.bit_count() for mask in range(256)])
# Where one voxel of so many is lit, the whole page is looked at.
_CROWDED = 16
_AS_BRICK, _AS_DOTS, _AS_CHILDREN, _AS_CHAIN = range(4)
_STEPS_PER_BYTE = 4
# In nodes of lower levels a chain saves a byte or two; to look for them takes longest there.
_MIN_CHAIN_LEVEL = 3


@dataclass(frozen=True)
class Level:
    """The nodes of one level, 1 or higher, in the order of their keys."""

    key: Ints
    first: Ints  # their first child on the level below; meaningless on level 1
    mask: Bytes  # of all children, also where it is not sent
    full: Bools
    nodes: Ints  # masks of a brick that begins here
    voxels: Ints  # how many
    min_bytes: Ints  # bytes of the cheapest way
    choice: NDArray[np.int8]


def build_leaves(
    index: Ints, rank: Ints, ranks: int, bricks_per_axis: list[int], config: EncoderConfig
) -> tuple[Ints, Bytes]:
    """Give keys and masks of the nodes of level 1, in the order of the keys.

    A key is the pixel, the brick, and the way down to the node in it, three bits a level.
    """
    if ranks == 1 and _CROWDED * len(index) > config.grid.voxels:
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
    """Do as `leaves` for many voxels of one pixel: as a whole page nothing needs to be sorted."""
    nx, ny, nz = config.grid
    bx, by, bz = bricks_per_axis
    page = np.zeros((bz * BRICK_SIDE, by * BRICK_SIDE, bx * BRICK_SIDE), dtype=np.uint8)
    inside = np.zeros(config.grid.voxels, dtype=np.uint8)
    inside[index] = 1
    page[:nz, :ny, :nx] = inside.reshape(config.grid.array_shape)
    mask = np.zeros([side // 2 for side in page.shape], dtype=np.uint8)
    for child in range(8):
        mask |= page[child >> 2 :: 2, child >> 1 & 1 :: 2, child & 1 :: 2] << np.uint8(child)
    halves = [2] * (TOP_LEVEL - 1)
    parts = mask.reshape(bz, *halves, by, *halves, bx, *halves)
    # Bricks first, then level by level: z, y and x take turns.
    axes = np.arange(3 * TOP_LEVEL).reshape(3, TOP_LEVEL).T.reshape(-1)
    ordered = parts.transpose(axes).reshape(-1)
    key = np.flatnonzero(ordered)
    return key, ordered[key]


def build_levels(key: Ints, mask: Bytes, config: EncoderConfig) -> list[Level]:
    """Build the levels from 1 up, each node with the cheapest way to draw it."""
    header, dot = _op_costs(config)
    voxels = _BITS[mask]
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
    """Find out which nodes of a level, by their keys, are one chain that rises on some axis.

    Returns
    -------
    keys : (n,) int64 array
        Their voxels, each chain in its order.
    main : (nodes,) int64 array
        The axis, or -1.
    owner : (n,) int64 array
        Which node each voxel belongs to.

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
        # What goes on on this axis, and does not turn round on another.
        up, down = (_nodes_with(inner & (step * way > 0), owner, len(nodes)) for way in (1, -1))
        found = (
            ~_nodes_with(far[None], owner, len(nodes))[0] & ~(up & down).any(axis=0) & (main < 0)
        )
        main[found] = axis
        order = np.where(found[owner], along, order)
    return key[order], main, owner


def _nodes_with(steps: Bools, owner: Ints, nodes: int) -> Bools:
    """Tell of each row which nodes have such a step: (rows, nodes)."""
    found = np.zeros((len(steps), nodes), dtype=np.bool_)
    row, at = np.nonzero(steps)
    found[row, owner[at]] = True
    return found


def _op_costs(config: EncoderConfig) -> tuple[int, int]:
    """Give the bytes of a brick but for its masks, and of a dot."""
    header = 1 + config.position_bytes if config.has(spec.FEATURE_OCT) else _NEVER
    return header, config.position_bytes if config.has(spec.FEATURE_DOTS) else _NEVER


def _cheapest(costs: Ints) -> NDArray[np.int8]:
    return np.asarray(costs.argmin(axis=0), dtype=np.int8)


def select_ops(
    levels: list[Level], config: EncoderConfig
) -> tuple[list[tuple[int, Ints]], Ints, Ints]:
    """Go down from the top: the bricks of each level, the keys of chains' voxels, and of dots.

    Bricks are nodes of their level; those of level 0 are keys, too. Voxels of a chain are in its
    order, one chain after another.
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
    """Give the descendants of nodes on a lower level, 1 or higher."""
    begin, end = nodes, nodes + 1
    for level in range(number, to, -1):
        edges = np.append(levels[level - 1].first, len(levels[level - 2].key))
        begin, end = edges[begin], edges[end]
    return concat_ranges(begin, end - begin)


def _voxel_keys(levels: list[Level], nodes: Ints) -> Ints:
    """Give the keys of the voxels of nodes of level 1."""
    leaves = levels[0]
    lit = np.unpackbits(leaves.mask[nodes, None], axis=1, bitorder="little") != 0
    return np.asarray((leaves.key[nodes, None] << 3 | np.arange(8))[lit])


def origins(key: Ints, bricks_per_axis: list[int]) -> tuple[Ints, Ints]:
    """Give the voxels, (n, 3), of keys of level 0, and the ranks of their pixels."""
    bx, by, bz = bricks_per_axis
    block, x = np.divmod(key >> _LEAF_BITS, bx)
    block, y = np.divmod(block, by)
    rank, z = np.divmod(block, bz)
    corner = np.stack((x, y, z), axis=1) << TOP_LEVEL
    for bit in range(TOP_LEVEL):
        corner += (key[:, None] >> (3 * bit + np.arange(3)) & 1) << bit
    return corner, rank
