"""Sets of voxels without an order -> OCT, DOTS, BOX and STEP (protocol.md, 7.1, 7.3, 7.4).

What is flat and large becomes a BOX. An octree says which nodes of the rest become bricks or
chains, and which voxels dots. Full bricks that make up a cuboid become one BOX, and so do large
cuboids that lie anywhere, if that takes fewer bytes. What the voxels mean was settled before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec
from voxdisplay.wire.chains import chain
from voxdisplay.wire.cuboids import cuboids
from voxdisplay.wire.octree import SIDE, Level, chosen, leaves, origins, tree
from voxdisplay.wire.op_encoding import Bools, Bytes, Coding, Ints, places, ranges
from voxdisplay.wire.payload_splitting import ANY, Layout, Pieces, join, no_pieces

# A cuboid of so many voxels may be worth a BOX of its own; the rows of voxels must be few, or long.
_LARGE = 64
_MANY_ROWS, _LONG_ROW = 2000, 4
# A square of four voxels in a cube of eight: across which axis, and whether in its upper half.
_SQUARES = [(axis, half) for axis in range(3) for half in range(2)]
_SQUARE_OF = np.full(256, -1)
for _number, (_axis, _half) in enumerate(_SQUARES):
    _SQUARE_OF[sum(1 << child for child in range(8) if child >> _axis & 1 == _half)] = _number


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
    blocks = [-(-side // SIDE) for side in coding.grid]
    key, mask = leaves(index, rank, len(pixels), blocks, coding)
    parts: list[Pieces] = []
    if coding.has(spec.FEATURE_BOX):
        flats, others = _flats(key, mask, pixels, coding, blocks)
        parts.append(flats)
        key, mask = key[others], mask[others]
    if len(key):
        parts += _of_tree(tree(key, mask, coding), pixels, coding, blocks)
    return _counted(join(parts), pixels, coding)


def _of_tree(levels: list[Level], pixels: Ints, coding: Coding, blocks: list[int]) -> list[Pieces]:
    roots, walks, dots = chosen(levels, coding)
    boxes, roots = _boxes(levels, roots, pixels, coding, blocks)
    parts = [] if boxes is None else [boxes]
    for number, nodes in roots:
        if len(nodes):
            parts.append(_oct(levels, number, nodes, pixels, coding, blocks))
    if len(walks):
        voxels, rank = origins(walks, blocks)
        parts.append(chain(voxels, pixels[rank], coding).pieces)
    if len(dots):
        parts.append(_dots(dots, pixels, coding, blocks))
    return parts


def _counted(pieces: Pieces, pixels: Ints, coding: Coding) -> Bricks:
    pieces = pieces.take(np.argsort(pieces.pen, kind="stable"))
    # Everything of a pen counts, the MOVE of a BOX included, and what makes a STEP a FROM.
    goes = pieces.at != ANY
    goes[1:] &= pieces.at[1:] != pieces.at_after[:-1]
    size = pieces.size + goes * (coding.move_bytes + ~pieces.is_chain)
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


def _oct(
    levels: list[Level],
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
    origin, rank = origins(levels[number - 1].key[roots] << 3 * number if number else roots, blocks)
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
    voxels, rank = origins(key, blocks)
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
    levels: list[Level],
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
    origin, rank = origins(levels[number - 1].key[top[full]] << 3 * number, blocks)
    low, high, merged, owner = cuboids(origin >> number, rank)
    worth = merged > 1
    kept = np.concatenate((top[~full], top[full][~worth[owner]]))
    if not worth.any():
        return None, roots
    low, high, rank = low[worth], high[worth], rank[np.unique(owner, return_index=True)[1]][worth]
    pieces = box_pieces(low << number, ((high + 1) << number) - 1, pixels[rank], coding)
    return pieces, [(number, np.sort(kept)), *others]


def _flats(
    key: Ints, mask: Bytes, pixels: Ints, coding: Coding, blocks: list[int]
) -> tuple[Pieces, Bools]:
    """Make a BOX of squares that lie side by side; tell which nodes of level 1 are left.

    Each of them takes a mask in a brick, or more elsewhere: as many as a BOX and its MOVE have
    bytes are worth one.
    """
    least = 2 * (1 + coding.move_bytes)
    rest = np.ones(len(key), dtype=np.bool_)
    at = np.flatnonzero(_SQUARE_OF[mask] >= 0)
    if len(at) < least:
        return no_pieces(), rest
    origin, rank = origins(key[at] << 3, blocks)
    square = _SQUARE_OF[mask[at]]
    axis, half = np.array(_SQUARES)[square].T
    # Squares one above the other are no cuboid: each plane is a group of its own.
    plane = np.take_along_axis(origin, axis[:, None], axis=1)[:, 0] + half
    group = (rank * len(_SQUARES) + square) << 32 | plane
    low, high, count, owner = cuboids(origin >> 1, group)
    large = count >= least
    rest[at[large[owner]]] = False
    low, high = low[large] << 1, (high[large] << 1) + 1
    first = np.unique(owner, return_index=True)[1][large]
    row = np.arange(len(first))
    low[row, axis[first]] = high[row, axis[first]] = plane[first]
    return box_pieces(low, high, pixels[rank[first]], coding), rest


def box_pieces(low: Ints, high: Ints, pen: Ints, coding: Coding) -> Pieces:
    """Give BOX ops from one corner to the other, both (n, 3) and included."""
    n = len(low)
    op = np.full((n, 1), spec.OP_BOX, dtype=np.uint8)
    body = np.concatenate((op, places(high, coding)), axis=1)
    size = np.full(n, 1 + coding.move_bytes)
    at, after = coding.grid.index_of(low), coding.grid.index_of(high)
    return Pieces(body.reshape(-1), size, pen, at, pen, after, np.zeros(n, dtype=np.bool_))
