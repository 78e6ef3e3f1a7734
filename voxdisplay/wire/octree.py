"""Sets of voxels without an order -> nodes of octrees, and how each costs least.

Voxels of one pixel are sorted so that those of a node follow each other. From the leaves up, each
node finds how its voxels cost least: as a brick of its own, as dots, or in whatever way its
children do; a brick that no payload holds is never among them. All nodes of a level are done at
once, by arrays. This module counts bytes (protocol.md, 7.3 and 7.4), and makes none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec
from voxdisplay.wire.ops import Bools, Bytes, Coding, Ints, ranges

TOP = spec.LIMIT_MAX_LEVEL
SIDE = 1 << TOP
_LEAF_BITS = 3 * TOP
_NEVER = 1 << 40
# Where the bits of a coordinate inside a brick go, so that x, y and z take turns.
_SPREAD = np.array([sum((c >> bit & 1) << 3 * bit for bit in range(TOP)) for c in range(SIDE)])
_BITS = np.array([mask.bit_count() for mask in range(256)])
# Where one voxel of so many is lit, the whole page is looked at.
_CROWDED = 16
_HOW_BRICK, _HOW_DOTS, _HOW_CHILDREN = range(3)


@dataclass(frozen=True)
class Level:
    """The nodes of one level, 1 or higher, in the order of their keys."""

    key: Ints
    first: Ints  # their first child on the level below; meaningless on level 1
    mask: Bytes  # of all children, also where it is not sent
    full: Bools
    nodes: Ints  # masks of a brick that begins here
    voxels: Ints  # how many
    least: Ints  # bytes of the cheapest way
    how: NDArray[np.int8]


def leaves(
    index: Ints, rank: Ints, ranks: int, blocks: list[int], coding: Coding
) -> tuple[Ints, Bytes]:
    """Give keys and masks of the nodes of level 1, in the order of the keys.

    A key is the pixel, the brick, and the way down to the node in it, three bits a level.
    """
    if ranks == 1 and _CROWDED * len(index) > coding.grid.voxels:
        return _leaves_of_page(index, blocks, coding)
    x, y, z = coding.grid.voxels_at(index).T
    bx, by, bz = blocks
    block = rank * bz + (z >> TOP)
    block = (block * by + (y >> TOP)) * bx + (x >> TOP)
    low = SIDE - 1
    inner = _SPREAD[x & low] | _SPREAD[y & low] << 1 | _SPREAD[z & low] << 2
    key = np.sort(block << _LEAF_BITS | inner)
    parent = key >> 3
    first = np.flatnonzero(np.concatenate(([True], parent[1:] != parent[:-1])))
    bits = (1 << (key & 7)).astype(np.uint8)
    return parent[first], np.add.reduceat(bits, first, dtype=np.uint8)


def _leaves_of_page(index: Ints, blocks: list[int], coding: Coding) -> tuple[Ints, Bytes]:
    """Do as `leaves` for many voxels of one pixel: as a whole page nothing needs to be sorted."""
    nx, ny, nz = coding.grid
    bx, by, bz = blocks
    page = np.zeros((bz * SIDE, by * SIDE, bx * SIDE), dtype=np.uint8)
    inside = np.zeros(coding.grid.voxels, dtype=np.uint8)
    inside[index] = 1
    page[:nz, :ny, :nx] = inside.reshape(coding.grid.array_shape)
    mask = np.zeros([side // 2 for side in page.shape], dtype=np.uint8)
    for child in range(8):
        mask |= page[child >> 2 :: 2, child >> 1 & 1 :: 2, child & 1 :: 2] << np.uint8(child)
    halves = [2] * (TOP - 1)
    parts = mask.reshape(bz, *halves, by, *halves, bx, *halves)
    # Bricks first, then level by level: z, y and x take turns.
    axes = np.arange(3 * TOP).reshape(3, TOP).T.reshape(-1)
    ordered = parts.transpose(axes).reshape(-1)
    key = np.flatnonzero(ordered)
    return key, ordered[key]


def tree(key: Ints, mask: Bytes, coding: Coding) -> list[Level]:
    """Build the levels from 1 up, each node with the cheapest way to draw it."""
    header, dot = _prices(coding)
    voxels = _BITS[mask]
    nodes = np.ones(len(key), dtype=np.int64)
    ways = np.stack((nodes + header, voxels * dot, voxels * min(header, dot)))
    levels = [Level(key, key, mask, mask == 255, nodes, voxels, ways.min(axis=0), _least(ways))]
    for _ in range(1, TOP):
        below = levels[-1]
        parent = below.key >> 3
        first = np.flatnonzero(np.concatenate(([True], parent[1:] != parent[:-1])))
        bits = (1 << (below.key & 7)).astype(np.uint8)
        mask = np.add.reduceat(bits, first, dtype=np.uint8)
        full = (mask == 255) & (np.add.reduceat(below.full.astype(np.int64), first) == 8)
        voxels = np.add.reduceat(below.voxels, first)
        nodes = 1 + np.where(full, 0, np.add.reduceat(below.nodes, first))
        own = nodes + header
        own[own > coding.room] = _NEVER
        ways = np.stack((own, voxels * dot, np.add.reduceat(below.least, first)))
        levels.append(
            Level(parent[first], first, mask, full, nodes, voxels, ways.min(axis=0), _least(ways))
        )
    return levels


def _prices(coding: Coding) -> tuple[int, int]:
    """Give the bytes of a brick but for its masks, and of a dot."""
    header = 1 + coding.move_bytes if coding.has(spec.FEATURE_OCT) else _NEVER
    return header, coding.move_bytes if coding.has(spec.FEATURE_DOTS) else _NEVER


def _least(ways: Ints) -> NDArray[np.int8]:
    return np.asarray(ways.argmin(axis=0), dtype=np.int8)


def chosen(levels: list[Level], coding: Coding) -> tuple[list[tuple[int, Ints]], Ints]:
    """Go down from the top: the bricks of each level, and the keys of voxels that are dots.

    Bricks are nodes of their level; those of level 0 are keys, too.
    """
    roots: list[tuple[int, Ints]] = []
    dots: list[Ints] = []
    open_ = np.arange(len(levels[-1].key))
    for number in range(TOP, 0, -1):
        how = levels[number - 1].how[open_]
        roots.append((number, open_[how == _HOW_BRICK]))
        dots.append(_voxels(levels, _below(levels, number, open_[how == _HOW_DOTS], 1)))
        open_ = open_[how == _HOW_CHILDREN]
        if number > 1:
            open_ = _below(levels, number, open_, number - 1)
    alone = _voxels(levels, open_)
    header, dot = _prices(coding)
    if header < dot:
        roots.append((0, alone))
    else:
        dots.append(alone)
    return roots, np.sort(np.concatenate(dots))


def _below(levels: list[Level], number: int, nodes: Ints, to: int) -> Ints:
    """Give the descendants of nodes on a lower level, 1 or higher."""
    begin, end = nodes, nodes + 1
    for level in range(number, to, -1):
        edges = np.append(levels[level - 1].first, len(levels[level - 2].key))
        begin, end = edges[begin], edges[end]
    return ranges(begin, end - begin)


def _voxels(levels: list[Level], nodes: Ints) -> Ints:
    """Give the keys of the voxels of nodes of level 1."""
    leaves = levels[0]
    lit = np.unpackbits(leaves.mask[nodes, None], axis=1, bitorder="little") != 0
    return np.asarray((leaves.key[nodes, None] << 3 | np.arange(8))[lit])


def origins(key: Ints, blocks: list[int]) -> tuple[Ints, Ints]:
    """Give the voxels, (n, 3), of keys of level 0, and the ranks of their pixels."""
    bx, by, bz = blocks
    block, x = np.divmod(key >> _LEAF_BITS, bx)
    block, y = np.divmod(block, by)
    rank, z = np.divmod(block, bz)
    corner = np.stack((x, y, z), axis=1) << TOP
    for bit in range(TOP):
        corner += (key[:, None] >> (3 * bit + np.arange(3)) & 1) << bit
    return corner, rank
