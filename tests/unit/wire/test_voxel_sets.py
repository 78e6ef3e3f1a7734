"""Encoder of voxel sets (protocol.md, 7.3 and 7.4), drawn by the plain decoder."""

import numpy as np
import pytest
from drawing import decode_plainly

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.cuboids import merge_cuboids
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.voxel_sets import encode_set, encode_set_payloads, min_bytes

FORMATS = pytest.mark.parametrize("format_", PixelFormat)
OCT, DOTS, BOX = (1 << bit for bit in (spec.FEATURE_OCT, spec.FEATURE_DOTS, spec.FEATURE_BOX))
GRID = Grid(40, 33, 20)  # no side is a multiple of 16, nor like another


def box_of_voxels(low, high):
    """All voxels of a cuboid, both corners included."""
    sides = [np.arange(a, b + 1) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)


def encode(voxels, features, values=None, *, grid=GRID, format_=PixelFormat.MONO1, most=1024):
    index = grid.index_of(np.asarray(voxels))
    order = np.argsort(index)
    values = np.full(len(index), format_.full) if values is None else np.asarray(values)
    return encode_set_payloads(
        index[order], values[order], EncoderConfig(grid, format_, most, features)
    )


def assert_draws(payloads, voxels, values=None, *, grid=GRID, format_=PixelFormat.MONO1):
    meant = np.zeros(grid.voxels, dtype=int)
    meant[grid.index_of(np.asarray(voxels))] = format_.full if values is None else values
    drawn = decode_plainly(payloads, grid, format_)
    assert drawn.page == meant.tolist()
    return drawn.ops


@pytest.mark.parametrize(
    ("voxels", "ops"),
    [
        ([(5, 7, 11)], "60 05 07 0B"),
        ([(4, 6, 10), (5, 7, 11)], "61 02 03 05 81"),
        (box_of_voxels((4, 6, 10), (5, 7, 11)), "61 02 03 05 00"),
        (box_of_voxels((16, 0, 0), (31, 15, 15)), "64 01 00 00 00"),
        ([*box_of_voxels((0, 0, 0), (1, 1, 1)), (2, 2, 2)], "62 00 00 00 81 00 01"),
        ([(0, 0, 0), (31, 15, 15)], "60 00 00 00 60 1F 0F 0F"),
    ],
)
def test_bricks_by_hand(voxels, ops):
    """7.4: a brick is as small as what is in it."""
    (payload,) = encode(voxels, OCT)
    assert payload == bytes.fromhex(ops)
    assert_draws([payload], voxels)


def test_dots_by_hand():
    voxels = [(5, 7, 11), (39, 32, 19), (0, 0, 0)]
    (payload,) = encode(voxels, DOTS)
    assert payload == bytes.fromhex("05 02 00 00 00 05 07 0B 27 20 13")


def test_a_dot_that_is_alone_is_a_brick_where_there_are_bricks():
    voxels, values = [(5, 7, 11), (39, 32, 19), (0, 0, 0)], [7, 9, 7]
    payloads = encode(voxels, OCT | DOTS, values, format_=PixelFormat.INDEX8)
    ops = assert_draws(payloads, voxels, values, format_=PixelFormat.INDEX8)
    assert ops == ["PEN", "DOTS", "PEN", "OCT"]


@pytest.mark.parametrize("most", [64, 65, 1024])
@pytest.mark.parametrize("count", [1, 2, 17, 256, 257, 600])
@FORMATS
def test_a_dots_op_has_at_most_256_voxels_and_fits(format_, count, most):
    """14: MAX_DOTS."""
    grid = Grid(300, 4, 3)
    index = np.sort(np.random.default_rng(1).permutation(grid.voxels)[:count])
    value = max(1, format_.full - 1)
    config = EncoderConfig(grid, format_, most, DOTS)
    made = encode_set(index, np.full(count, value), config)
    assert made.blocks.size.max() <= config.max_block_bytes
    payloads = encode_set_payloads(index, np.full(count, value), config)
    assert max(map(len, payloads)) <= most
    drawn = decode_plainly(payloads, grid, format_)
    assert np.flatnonzero(drawn.page).tolist() == index.tolist()


@pytest.mark.parametrize("most", [64, 65, 100, 300, 1024])
@FORMATS
def test_a_brick_that_fits_no_payload_is_made_of_smaller_ones(format_, most):
    """A chequered brick of 16 has 4096 / 8 + 73 masks."""
    voxels = box_of_voxels((0, 0, 0), (39, 32, 19))
    voxels = voxels[voxels.sum(axis=1) % 2 == 0]
    payloads = encode(voxels, OCT, format_=format_, most=most)
    assert max(map(len, payloads)) <= most
    assert_draws(payloads, voxels, format_=format_)
    levels = {op & 31 for op in payloads[0][:1] + payloads[-1][:1] if op & 0xE0 == 0x60}
    assert levels <= {0, 1, 2, 3, 4}
    if most == 1024:
        assert payloads[0][0] == spec.OP_OCT | spec.LIMIT_MAX_LEVEL


@pytest.mark.parametrize("grid", [Grid(1, 1, 1), Grid(3, 5, 7), Grid(300, 4, 3), Grid(17, 64, 40)])
@pytest.mark.parametrize("features", [OCT, DOTS, OCT | DOTS, OCT | DOTS | BOX])
def test_a_page_that_is_full(grid, features):
    """7.4: "A brick may reach beyond the grid; what it writes may not"."""
    voxels = grid.voxels_at(np.arange(grid.voxels))
    payloads = encode(voxels, features, grid=grid)
    ops = assert_draws(payloads, voxels, grid=grid)
    if grid == (17, 64, 40) and features & BOX:
        assert payloads == [bytes.fromhex("04 10 3F 27")]
        assert ops == ["BOX"]


def test_full_bricks_that_stand_together_are_a_box():
    """And what is uneven around them is none."""
    grid = Grid(64, 48, 40)
    solid = box_of_voxels((0, 0, 0), (47, 31, 31))
    chequered = box_of_voxels((48, 32, 32), (63, 47, 39))
    voxels = np.concatenate((solid, chequered[chequered.sum(axis=1) % 2 == 0]))
    ops = assert_draws(encode(voxels, OCT | BOX, grid=grid), voxels, grid=grid)
    assert ops.count("BOX") == 1
    assert ops.count("OCT") >= 1


def test_full_bricks_that_stand_apart_are_bricks():
    grid = Grid(64, 48, 40)
    voxels = np.concatenate(
        (box_of_voxels((0, 0, 0), (15, 15, 15)), box_of_voxels((32, 16, 16), (47, 31, 31)))
    )
    (payload,) = encode(voxels, OCT | BOX, grid=grid)
    assert payload == bytes.fromhex("64 00 00 00 00 64 02 01 01 00")
    assert_draws([payload], voxels, grid=grid)


def test_a_cuboid_anywhere_is_a_box():
    voxels = box_of_voxels((3, 5, 2), (30, 9, 17))
    (payload,) = encode(voxels, OCT | DOTS | BOX)
    assert payload[-4:] == bytes.fromhex("04 1E 09 11")
    assert assert_draws([payload], voxels)[-1] == "BOX"
    assert "BOX" not in assert_draws(encode(voxels, OCT | DOTS), voxels)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("half", range(2))
def test_what_is_flat_is_a_box(axis, half):
    """A plate, and beside it enough that is uneven for bricks to be worth it."""
    low, high = [6, 4, 2], [35, 27, 19]
    low[axis] = high[axis] = 8 + half
    plate = box_of_voxels(low, high)
    above = plate[np.random.default_rng(1).random(len(plate)) < 0.1]
    above[:, axis] += 1
    voxels = np.concatenate((plate, above))
    with_box = encode(voxels, OCT | DOTS | BOX)
    ops = assert_draws(with_box, voxels)
    assert ops.count("BOX") == 1
    without = encode(voxels, OCT | DOTS)
    assert_draws(without, voxels)
    assert sum(map(len, with_box)) < sum(map(len, without))


def test_plates_one_above_the_other_are_boxes_of_their_own():
    voxels = np.concatenate([box_of_voxels((0, 0, z), (31, 31, z)) for z in (0, 2, 4)])
    values = np.where(voxels[:, 1] < 16, 5, 9)
    ops = assert_draws(
        encode(voxels, OCT | BOX, values, format_=PixelFormat.INDEX8),
        voxels,
        values,
        format_=PixelFormat.INDEX8,
    )
    assert ops.count("BOX") == 6


@pytest.mark.parametrize("main", range(3))
@pytest.mark.parametrize("falls", range(4))
def test_what_is_thin_is_a_chain(main, falls):
    """7.1: six steps are two bytes of crumbs; a brick of them has six masks and more."""
    voxels = np.tile((8, 16, 0), (7, 1))
    k = np.arange(7)
    voxels[:, main] += k
    voxels[:, (main + 1) % 3] += 6 - k // 2 if falls & 1 else k // 2
    voxels[:, (main + 2) % 3] += 5 - k * 2 // 3 if falls & 2 else k * 2 // 3
    (payload,) = encode(voxels, OCT)
    assert len(payload) == 7
    assert assert_draws([payload], voxels) == ["FROM"]


@pytest.mark.parametrize(
    "voxels",
    [
        [(0, 0, 0), (1, 1, 0), (2, 0, 0), (3, 1, 0), (4, 2, 0)],  # turns round
        [(0, 0, 0), (1, 2, 0), (2, 3, 0), (3, 4, 0), (4, 5, 0)],  # jumps aside
        [(0, 0, 0), (2, 1, 0), (3, 2, 0), (4, 3, 0), (5, 4, 0)],  # leaves one out
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 0), (3, 2, 0)],  # two beside each other
    ],
)
def test_what_is_no_chain(voxels):
    assert "FROM" not in assert_draws(encode(voxels, OCT), voxels)


def test_a_chain_of_each_pixel():
    voxels = [(x, y, 3) for y in (0, 8) for x in range(8)]
    values = [5] * 8 + [9] * 8
    made = encode_set(np.sort(GRID.index_of(np.array(voxels))), np.array(values),
                 EncoderConfig(GRID, PixelFormat.INDEX8, 1024, OCT))  # fmt: skip
    assert made.bytes_per_value.tolist() == [7, 7]
    payloads = encode(voxels, OCT, values, format_=PixelFormat.INDEX8)
    ops = assert_draws(payloads, voxels, values, format_=PixelFormat.INDEX8)
    assert ops[1::2] in (["STEP", "FROM"], ["FROM", "FROM"])


def test_cuboids_and_a_rest():
    voxels = np.concatenate((box_of_voxels((3, 5, 2), (30, 9, 17)), [(35, 30, 3), (37, 32, 5)]))
    values = np.where(voxels[:, 0] < 17, 5, 9)
    format_ = PixelFormat.RGB565
    payloads = encode(voxels, OCT | DOTS | BOX, values, format_=format_)
    ops = assert_draws(payloads, voxels, values, format_=format_)
    assert ops.count("BOX") == 2


def test_cells_are_merged_to_cuboids():
    cells = np.concatenate(
        (box_of_voxels((2, 3, 4), (5, 7, 9)), box_of_voxels((6, 3, 4), (6, 6, 9)), [(0, 0, 0)])
    )
    order = np.random.default_rng(1).permutation(len(cells))
    group = (cells[:, 2] > 6).astype(int)
    low, high, count, owner = merge_cuboids(cells[order], group[order])
    assert (high - low + 1).prod(axis=1).sum() == len(cells)
    assert np.bincount(owner).tolist() == (high - low + 1).prod(axis=1).tolist() == count.tolist()
    for at, mine in zip(cells[order], owner, strict=True):
        assert (low[mine] <= at).all()
        assert (at <= high[mine]).all()
    assert len(low) <= 7


def test_the_bound_is_one():
    rng = np.random.default_rng(3)
    config = EncoderConfig(GRID, PixelFormat.MONO1, 1024, OCT | DOTS)
    for density in (0.001, 0.02, 0.3, 0.9, 1):
        index = np.flatnonzero(rng.random(GRID.voxels) < density)
        (bound,) = min_bytes(index, index * 0, 1, config)
        made = encode_set(index, np.ones(len(index), dtype=int), config)
        assert 0 <= bound <= made.bytes_per_value.sum()
    parts = min_bytes(index, index // 7000, 4, config)
    assert len(parts) == 4
    # A whole solid has nothing but full cells, but for a side of 33.
    assert parts.sum() < GRID.voxels / 8


def test_the_bytes_of_each_pixel_are_counted():
    index = np.sort(np.random.default_rng(5).permutation(GRID.voxels)[:500])
    values = np.where(index % 3, 7, 200)
    config = EncoderConfig(GRID, PixelFormat.INDEX8, 65535, OCT | DOTS)
    made = encode_set(index, values, config)
    (payload,) = encode_set_payloads(index, values, config)
    assert made.values.tolist() == [7, 200]
    assert made.bytes_per_value.sum() + 2 * config.pen_bytes == len(payload)
