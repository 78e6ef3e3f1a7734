"""Sets of voxels without an order -> OCT, DOTS and BOX (protocol.md, sections 7.3 and 7.4).

Voxels of one pixel are sorted so that those of a node of an octree follow each other. From the
leaves up, each node finds how its voxels cost least: as a brick of its own, as dots, or in whatever
way its children do; a brick that no payload holds is never among them. Full bricks that make up a
cuboid become one BOX. All levels are done by arrays. What the voxels mean was settled before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec
from voxdisplay.wire.boxes import cuboids
from voxdisplay.wire.ops import Bools, Bytes, Coding, Ints, places, ranges
from voxdisplay.wire.pieces import ANY, Layout, Pieces, join

_TOP = spec.LIMIT_MAX_LEVEL
_SIDE = 1 << _TOP
_LEAF_BITS = 3 * _TOP
_NEVER = 1 << 40
# Where the bits of a coordinate inside a brick go, so that x, y and z take turns.
_SPREAD = np.array([sum((c >> bit & 1) << 3 * bit for bit in range(_TOP)) for c in range(_SIDE)])
# A cuboid of so many voxels may be worth a BOX of its own; the rows of voxels must be few, or long.
_LARGE = 64
_MANY_ROWS, _LONG_ROW = 2000, 4
_BITS = np.array([mask.bit_count() for mask in range(256)])
# Where one voxel of so many is lit, the whole page is looked at.
_CROWDED = 16
_HOW_BRICK, _HOW_DOTS, _HOW_CHILDREN = range(3)


@dataclass(frozen=True)
class Bricks:
    """Voxels of a set as bricks, dots and boxes.

    Attributes
    ----------
    pieces : Pieces
        Ordered by pen.
    values : (k,) int64 array
        The pixels that there are, ascending.
    bytes_of : (k,) int64 array
        Bytes that the voxels of each take, its PEN not included.

    """

    pieces: Pieces
    values: Ints
    bytes_of: Ints


@dataclass(frozen=True)
class _Level:
    """The nodes of one level, 1 or higher, in the order of their keys."""

    key: Ints
    first: Ints  # their first child on the level below; meaningless on level 1
    mask: Bytes  # of all children, also where it is not sent
    full: Bools
    nodes: Ints  # masks of a brick that begins here
    voxels: Ints  # how many
    least: Ints  # bytes of the cheapest way
    how: NDArray[np.int8]


def can_code(coding: Coding) -> bool:
    """Tell whether the device has an op for sets."""
    return coding.has(spec.FEATURE_OCT) or coding.has(spec.FEATURE_DOTS)


def encode_bricks(index: Ints, values: NDArray[np.integer], coding: Coding) -> list[bytes]:
    """Give the payloads that draw a set of voxels; the device must have OCT or DOTS.

    Parameters
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once, n >= 1.
    values : (n,) integer array
        Pixel value of each.
    coding : Coding

    Returns
    -------
    list of bytes
        At most ``coding.max_payload`` bytes each.

    """
    return Layout(brick(index, values, coding).pieces, coding).payloads


def brick(index: Ints, values: NDArray[np.integer], coding: Coding) -> Bricks:
    """Make a set of voxels bricks, dots and boxes, whichever is cheapest where."""
    bricks = _brick(index, values, coding)
    if not coding.has(spec.FEATURE_BOX):
        return bricks
    boxed = _large_boxes(index, values, int(bricks.bytes_of.sum()), coding)
    return bricks if boxed is None else boxed


def _brick(index: Ints, values: NDArray[np.integer], coding: Coding) -> Bricks:
    pixels, rank = _ranked(values)
    blocks = [-(-side // _SIDE) for side in coding.grid]
    levels = _tree(*_leaves(index, rank, len(pixels), blocks, coding), coding)
    roots, dots = _chosen(levels, coding)
    parts: list[Pieces] = []
    boxes, roots = _boxes(levels, roots, pixels, coding, blocks)
    if boxes is not None:
        parts.append(boxes)
    for number, chosen in roots:
        if len(chosen):
            parts.append(_oct(levels, number, chosen, pixels, coding, blocks))
    if len(dots):
        parts.append(_dots(dots, pixels, coding, blocks))
    return _counted(join(parts), pixels, coding)


def _counted(pieces: Pieces, pixels: Ints, coding: Coding) -> Bricks:
    pieces = pieces.take(np.argsort(pieces.pen, kind="stable"))
    # Everything of a pen counts, the MOVE of a BOX included.
    size = pieces.size + (pieces.at != ANY) * (1 + coding.move_bytes)
    bytes_of = np.bincount(np.searchsorted(pixels, pieces.pen), weights=size, minlength=len(pixels))
    return Bricks(pieces, pixels, bytes_of.astype(np.int64))


def _large_boxes(
    index: Ints, values: NDArray[np.integer], bytes_without: int, coding: Coding
) -> Bricks | None:
    """Give the set with its large cuboids, wherever they lie, as BOX, if that takes fewer bytes."""
    edge = (np.diff(index) != 1) | (values[1:] != values[:-1]) | (index[1:] % coding.grid.nx == 0)
    first = np.flatnonzero(np.concatenate(([True], edge)))
    if len(index) < _LARGE or len(first) > max(_MANY_ROWS, len(index) // _LONG_ROW):
        return None
    length = np.diff(first, append=len(index))
    low = coding.grid.voxels_at(index[first]).astype(np.int64)
    high = low.copy()
    high[:, 0] += length - 1
    low, high, _, owner = cuboids(low, values[first].astype(np.int64), high)
    large = (high - low + 1).prod(axis=1) >= _LARGE
    cost = int(large.sum()) * 2 * (1 + coding.move_bytes)
    if not large.any() or cost >= bytes_without:
        return None
    pixel = np.empty(len(low), dtype=np.int64)
    pixel[owner] = values[first]
    rest = ~np.repeat(large[owner], length)
    parts = [box_pieces(low[large], high[large], pixel[large], coding)]
    if rest.any():
        parts.append(_brick(index[rest], values[rest], coding).pieces)
    boxed = _counted(join(parts), np.unique(values).astype(np.int64), coding)
    return boxed if boxed.bytes_of.sum() < bytes_without else None


def least_bytes(index: Ints, group: Ints, groups: int, coding: Coding) -> Ints:
    """Give a lower bound of the bytes of each of some sets, quickly: (groups,).

    A cube of two voxels a side that is not full has a mask of its own, or costs more.
    """
    x, y, z = (coding.grid.voxels_at(index).T >> 1).astype(np.int64)
    half = [side // 2 + 1 for side in coding.grid]
    cell = np.sort(x + half[0] * (y + half[1] * (z + half[2] * group)))
    first = np.flatnonzero(np.concatenate(([True], cell[1:] != cell[:-1])))
    partly = np.diff(first, append=len(cell)) < 8
    owner = cell[first][partly] // (half[0] * half[1] * half[2])
    return np.bincount(owner, minlength=groups)


def _ranked(values: NDArray[np.integer]) -> tuple[Ints, Ints]:
    """Give the pixels that there are, and the number of that of each voxel."""
    if (values == values[0]).all():
        return values[:1].astype(np.int64), np.zeros(len(values), dtype=np.int64)
    pixels, rank = np.unique(values, return_inverse=True)
    return pixels.astype(np.int64), rank.astype(np.int64)


def _leaves(
    index: Ints, rank: Ints, ranks: int, blocks: list[int], coding: Coding
) -> tuple[Ints, Bytes]:
    """Give keys and masks of the nodes of level 1, in the order of the keys.

    A key is the pixel, the brick, and the way down to the node in it, three bits a level.
    """
    if ranks == 1 and _CROWDED * len(index) > coding.grid.voxels:
        return _leaves_of_page(index, blocks, coding)
    x, y, z = coding.grid.voxels_at(index).T
    bx, by, bz = blocks
    block = rank * bz + (z >> _TOP)
    block = (block * by + (y >> _TOP)) * bx + (x >> _TOP)
    low = _SIDE - 1
    inner = _SPREAD[x & low] | _SPREAD[y & low] << 1 | _SPREAD[z & low] << 2
    key = np.sort(block << _LEAF_BITS | inner)
    parent = key >> 3
    first = np.flatnonzero(np.concatenate(([True], parent[1:] != parent[:-1])))
    bits = (1 << (key & 7)).astype(np.uint8)
    return parent[first], np.add.reduceat(bits, first, dtype=np.uint8)


def _leaves_of_page(index: Ints, blocks: list[int], coding: Coding) -> tuple[Ints, Bytes]:
    """Do as `_leaves` for many voxels of one pixel: as a whole page nothing needs to be sorted."""
    nx, ny, nz = coding.grid
    bx, by, bz = blocks
    page = np.zeros((bz * _SIDE, by * _SIDE, bx * _SIDE), dtype=np.uint8)
    inside = np.zeros(coding.grid.voxels, dtype=np.uint8)
    inside[index] = 1
    page[:nz, :ny, :nx] = inside.reshape(coding.grid.array_shape)
    mask = np.zeros([side // 2 for side in page.shape], dtype=np.uint8)
    for child in range(8):
        mask |= page[child >> 2 :: 2, child >> 1 & 1 :: 2, child & 1 :: 2] << np.uint8(child)
    halves = [2] * (_TOP - 1)
    parts = mask.reshape(bz, *halves, by, *halves, bx, *halves)
    # Bricks first, then level by level: z, y and x take turns.
    axes = np.arange(3 * _TOP).reshape(3, _TOP).T.reshape(-1)
    ordered = parts.transpose(axes).reshape(-1)
    key = np.flatnonzero(ordered)
    return key, ordered[key]


def _origins(key: Ints, blocks: list[int]) -> tuple[Ints, Ints]:
    """Give the voxels, (n, 3), of keys of level 0, and the ranks of their pixels."""
    bx, by, bz = blocks
    block, x = np.divmod(key >> _LEAF_BITS, bx)
    block, y = np.divmod(block, by)
    rank, z = np.divmod(block, bz)
    corner = np.stack((x, y, z), axis=1) << _TOP
    for bit in range(_TOP):
        corner += (key[:, None] >> (3 * bit + np.arange(3)) & 1) << bit
    return corner, rank


def _tree(key: Ints, mask: Bytes, coding: Coding) -> list[_Level]:
    """Build the levels from 1 up, each node with the cheapest way to draw it."""
    header, dot = _prices(coding)
    voxels = _BITS[mask]
    nodes = np.ones(len(key), dtype=np.int64)
    ways = np.stack((nodes + header, voxels * dot, voxels * min(header, dot)))
    levels = [_Level(key, key, mask, mask == 255, nodes, voxels, ways.min(axis=0), _least(ways))]
    for _ in range(1, _TOP):
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
            _Level(parent[first], first, mask, full, nodes, voxels, ways.min(axis=0), _least(ways))
        )
    return levels


def _prices(coding: Coding) -> tuple[int, int]:
    """Give the bytes of a brick but for its masks, and of a dot."""
    header = 1 + coding.move_bytes if coding.has(spec.FEATURE_OCT) else _NEVER
    return header, coding.move_bytes if coding.has(spec.FEATURE_DOTS) else _NEVER


def _least(ways: Ints) -> NDArray[np.int8]:
    return np.asarray(ways.argmin(axis=0), dtype=np.int8)


def _chosen(levels: list[_Level], coding: Coding) -> tuple[list[tuple[int, Ints]], Ints]:
    """Go down from the top: the bricks of each level, and the keys of voxels that are dots.

    Bricks are nodes of their level; those of level 0 are keys, too.
    """
    roots: list[tuple[int, Ints]] = []
    dots: list[Ints] = []
    open_ = np.arange(len(levels[-1].key))
    for number in range(_TOP, 0, -1):
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


def _below(levels: list[_Level], number: int, nodes: Ints, to: int) -> Ints:
    """Give the descendants of nodes on a lower level, 1 or higher."""
    begin, end = nodes, nodes + 1
    for level in range(number, to, -1):
        edges = np.append(levels[level - 1].first, len(levels[level - 2].key))
        begin, end = edges[begin], edges[end]
    return ranges(begin, end - begin)


def _voxels(levels: list[_Level], nodes: Ints) -> Ints:
    """Give the keys of the voxels of nodes of level 1."""
    leaves = levels[0]
    lit = np.unpackbits(leaves.mask[nodes, None], axis=1, bitorder="little") != 0
    return np.asarray((leaves.key[nodes, None] << 3 | np.arange(8))[lit])


def _oct(
    levels: list[_Level],
    number: int,
    roots: Ints,
    pixels: Ints,
    coding: Coding,
    blocks: list[int],
) -> Pieces:
    """Give the OCT ops of bricks of one level."""
    none = np.zeros(len(roots), dtype=np.int64)
    size = 1 + coding.move_bytes + (levels[number - 1].nodes[roots] if number else none)
    offset = np.cumsum(size) - size
    body = np.empty(int(size.sum()), dtype=np.uint8)
    origin, rank = _origins(
        levels[number - 1].key[roots] << 3 * number if number else roots, blocks
    )
    body[offset] = spec.OP_OCT | number
    place = places(origin >> number, coding)
    body[offset[:, None] + 1 + np.arange(coding.move_bytes)] = place
    at = offset + 1 + coding.move_bytes
    # Level by level; below a full node there is nothing.
    seen, owner = roots, np.arange(len(roots))
    for depth in range(number, 0, -1):
        level = levels[depth - 1]
        count = np.bincount(owner, minlength=len(roots))
        body[ranges(at, count)] = np.where(level.full[seen], np.uint8(0), level.mask[seen])
        at = at + count
        if depth > 1:
            partly = ~level.full[seen]
            edges = np.append(level.first, len(levels[depth - 2].key))
            begin = edges[seen[partly]]
            children = edges[seen[partly] + 1] - begin
            seen, owner = ranges(begin, children), np.repeat(owner[partly], children)
    anywhere = np.full(len(roots), ANY)
    pen = pixels[rank]
    return Pieces(body, size, pen, anywhere, pen, anywhere, np.zeros(len(roots), dtype=np.bool_))


def _dots(key: Ints, pixels: Ints, coding: Coding, blocks: list[int]) -> Pieces:
    """Give DOTS ops, each with voxels of one pen."""
    voxels, rank = _origins(key, blocks)
    most = min(spec.LIMIT_MAX_DOTS, (coding.room - 2) // coding.move_bytes)
    first = np.flatnonzero(np.concatenate(([True], rank[1:] != rank[:-1])))
    count = np.diff(first, append=len(rank))
    parts = -(-count // most)
    done = ranges(np.zeros(len(count), dtype=np.int64), parts) * most
    first = np.repeat(first, parts) + done
    count = np.minimum(np.repeat(count, parts) - done, most)
    alone = (count == 1) & coding.has(spec.FEATURE_OCT)  # a brick of level 0 is a byte shorter
    size = np.where(alone, 1, 2) + count * coding.move_bytes
    offset = np.cumsum(size) - size
    body = np.empty(int(size.sum()), dtype=np.uint8)
    body[offset] = np.where(alone, spec.OP_OCT, spec.OP_DOTS)
    body[(offset + 1)[~alone]] = (count - 1)[~alone]
    data = places(voxels, coding).reshape(-1)
    body[ranges(offset + np.where(alone, 1, 2), count * coding.move_bytes)] = data
    pen = pixels[rank[first]]
    last = coding.grid.index_of(voxels[first + count - 1])
    anywhere = np.full(len(first), ANY)
    none = np.zeros(len(first), dtype=np.bool_)
    return Pieces(body, size, pen, anywhere, pen, np.where(alone, ANY, last), none)


def _boxes(
    levels: list[_Level],
    roots: list[tuple[int, Ints]],
    pixels: Ints,
    coding: Coding,
    blocks: list[int],
) -> tuple[Pieces | None, list[tuple[int, Ints]]]:
    """Make a BOX of full bricks that stand together; give it, and the bricks that are left."""
    (number, top), *others = roots
    full = levels[number - 1].full[top]
    if not coding.has(spec.FEATURE_BOX) or full.sum() < 2:
        return None, roots
    origin, rank = _origins(levels[number - 1].key[top[full]] << 3 * number, blocks)
    low, high, merged, owner = cuboids(origin >> number, rank)
    worth = merged > 1
    kept = np.concatenate((top[~full], top[full][~worth[owner]]))
    if not worth.any():
        return None, roots
    low, high, rank = low[worth], high[worth], rank[np.unique(owner, return_index=True)[1]][worth]
    pieces = box_pieces(low << number, ((high + 1) << number) - 1, pixels[rank], coding)
    return pieces, [(number, np.sort(kept)), *others]


def box_pieces(low: Ints, high: Ints, pen: Ints, coding: Coding) -> Pieces:
    """Give BOX ops from one corner to the other, both (n, 3) and included."""
    n = len(low)
    op = np.full((n, 1), spec.OP_BOX, dtype=np.uint8)
    body = np.concatenate((op, places(high, coding)), axis=1)
    size = np.full(n, 1 + coding.move_bytes)
    at, after = coding.grid.index_of(low), coding.grid.index_of(high)
    return Pieces(body.reshape(-1), size, pen, at, pen, after, np.zeros(n, dtype=np.bool_))
