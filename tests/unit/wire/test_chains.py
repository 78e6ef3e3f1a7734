"""Chain encoder (protocol.md, 7.1): the right voxels, in the fewest segments."""

import numpy as np
import pytest
from drawing import chains_in, page_after, segments_in, values_of

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire.chains import encode_chains
from voxdisplay.wire.op_encoding import EncoderConfig

LONG = Grid(1200, 4, 3)
FORMATS = pytest.mark.parametrize("format_", PixelFormat)


def row(count, start=0):
    """Voxels along x."""
    x = np.arange(start, start + count)
    return np.stack((x, x * 0 + 1, x * 0 + 2), axis=1)


def encode(voxels, pens=None, *, grid=LONG, format_=PixelFormat.INDEX8, max_payload=1024):
    voxels = np.asarray(voxels).reshape(-1, 3)
    pens = np.full(len(voxels), format_.full) if pens is None else np.asarray(pens)
    return encode_chains(voxels, pens, EncoderConfig(grid, format_, max_payload))


def test_nothing_is_no_payload():
    assert encode([]) == []


def test_one_voxel_is_a_skip_or_a_move_and_a_run():
    assert encode([(1, 2, 0)], grid=Grid(3, 5, 7)) == [bytes.fromhex("86 A0")]
    far = Grid(256, 256, 256)
    assert encode([(1, 2, 200)], grid=far) == [bytes.fromhex("02 01 02 C8 A0")]


def test_the_vector_of_two_octants():
    """protocol.md, 17.3: chain-in-two-octants."""
    voxels = [
        (3, 60, 7),
        (3, 59, 7),
        (3, 58, 8),
        (4, 57, 8),
        (5, 56, 9),
        (5, 55, 10),
        (4, 56, 11),
        (4, 57, 12),
    ]
    drawn = encode(voxels, grid=Grid(17, 64, 40), format_=PixelFormat.MONO1)
    (payload,) = drawn
    assert [op[0] for op in chains_in(payload, (17, 64, 40), PixelFormat.MONO1)] == ["FROM", "STEP"]
    assert len(payload) <= len(bytes.fromhex("4A 03 3C 07 04 E4 01 31 01 0B"))


@pytest.mark.parametrize(
    ("voxels", "steps"),
    [
        (2, [1]),
        (256, [255]),
        (257, [256]),
        (258, [256, 1]),
        (513, [256, 256]),
        (514, [256, 256, 1]),
    ],
)
def test_a_chain_has_at_most_256_steps(voxels, steps):
    payloads = encode(row(voxels))
    assert [op[2] for op in segments_in(payloads, LONG, PixelFormat.INDEX8)] == steps
    values = values_of(page_after(payloads, LONG, PixelFormat.INDEX8), PixelFormat.INDEX8)
    assert values.nonzero()[0].tolist() == LONG.index_of(row(voxels)).tolist()


@FORMATS
@pytest.mark.parametrize("grid", [Grid(256, 4, 3), Grid(257, 4, 3)])
def test_a_longest_chain_fits_the_smallest_payload(format_, grid):
    """14: MIN_PAYLOAD is 64. The pen, too, must fit before the chain."""
    pens = np.full(256, max(1, format_.full - 1))
    payloads = encode(row(256), pens, grid=grid, format_=format_, max_payload=64)
    assert max(map(len, payloads)) <= 64
    assert np.count_nonzero(values_of(page_after(payloads, grid, format_), format_)) == 256


@FORMATS
def test_a_payload_is_filled_to_the_last_byte_and_no_further(format_):
    lone = [(2 * k % 300, k % 4, k % 3) for k in range(40)]
    pens = [max(1, (37 * k + 1) & format_.full) for k in range(40)]
    (whole,) = encode(lone, pens, grid=Grid(300, 4, 3), format_=format_)
    size = len(whole)
    config = {"grid": Grid(300, 4, 3), "format_": format_}
    assert encode(lone, pens, max_payload=size, **config) == [whole]
    first, second = encode(lone, pens, max_payload=size - 1, **config)
    assert len(first) < size
    assert len(chains_in(second, Grid(300, 4, 3), format_)) <= 2


def test_a_pen_is_set_when_it_changes_and_at_the_begin_of_a_payload():
    """7: "At the start of each packet ... the pen is the full pixel"."""
    (payload,) = encode([(1, 1, 1), (5, 1, 1), (9, 1, 1)], [0xFF, 7, 7])
    ops = [op[0] for op in chains_in(payload, LONG, PixelFormat.INDEX8)]
    assert ops == ["LONE", "PEN", "LONE", "LONE"]
    voxels = [(2 * k, 1, 1) for k in range(30)]
    for payload in encode(voxels, [7] * 30, max_payload=64):
        ops = [op[0] for op in chains_in(payload, LONG, PixelFormat.INDEX8)]
        assert ops[0] == "PEN"
        assert set(ops[1:]) == {"LONE"}


def test_a_chain_goes_on_in_the_next_payload_where_it_was():
    voxels = [(k, k % 2, 0) for k in range(300)]
    zigzag = np.array(voxels)
    payloads = encode(zigzag, max_payload=64)
    assert len(payloads) > 3
    for payload in payloads:
        (first, *others) = chains_in(payload, LONG, PixelFormat.INDEX8)
        assert first[0] in {"FROM", "STEP"}  # behind a SKIP, if that is shorter
        assert {op[0] for op in others} <= {"STEP"}


def test_a_repeated_voxel_is_drawn_and_does_no_harm():
    payloads = encode([(1, 1, 1), (1, 1, 1), (2, 1, 1), (2, 1, 1)])
    values = values_of(page_after(payloads, LONG, PixelFormat.INDEX8), PixelFormat.INDEX8)
    assert values.nonzero()[0].tolist() == LONG.index_of(np.array([[1, 1, 1], [2, 1, 1]])).tolist()
