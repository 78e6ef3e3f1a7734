"""Encoder and decoder of pixels in scan order (protocol.md, 7.2 and 10)."""

import numpy as np
import pytest
from drawing import page_after, values_of

from firmware_sim.memory import FORMATS as DEVICE_FORMATS
from firmware_sim.memory import Page
from firmware_sim.page_encoder import encode_page
from voxdisplay.errors import RemoteProtocolError
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire.op_encoding import EncoderConfig, counted_ops
from voxdisplay.wire.spans import decode_runs, decode_spans, encode_spans

FORMATS = pytest.mark.parametrize("format_", PixelFormat)
EDGES = [1, 2, 31, 32, 33, 127, 128, 159, 160, 161, 255, 256, 257, 16415, 16416, 16417]


def random_values(format_, count, seed=1):
    """Lit pixels of which no two neighbours are equal, where the format has enough of them."""
    values = np.random.default_rng(seed).integers(1, format_.full, count, endpoint=True)
    return values.astype(np.uint32)


def counted_op(op, count):
    (row,), (size,) = counted_ops(op, np.array([count]))
    return row[:size].tobytes()


def decode(values, format_, max_payload=1024, grid=None):
    grid = grid or Grid(len(values), 1, 1)
    payloads = encode_spans(values, EncoderConfig(grid, format_, max_payload))
    assert all(0 < len(payload) <= max_payload for payload in payloads)
    return payloads, values_of(page_after(payloads, grid, format_), format_)


@pytest.mark.parametrize(
    ("count", "ops"),
    [
        (1, "A0"),
        (31, "BE"),
        (32, "BF 00"),
        (33, "BF 01"),
        (159, "BF 7F"),
        (160, "BF 80 01"),
        (2**32 - 1, "BF DF FF FF FF 0F"),
    ],
)
def test_counts(count, ops):
    assert counted_op(0xA0, count) == bytes.fromhex(ops)


@FORMATS
@pytest.mark.parametrize("count", EDGES)
def test_runs_of_a_length_at_the_limits(format_, count):
    """One pixel repeated, in the dark and among others, that ends with the page or does not."""
    run = np.full(count, random_values(format_, 1)[0], dtype=np.uint32)
    dark = np.zeros(count, dtype=np.uint32)
    for values in (
        run,
        np.concatenate((dark, run)),
        np.concatenate((run, dark)),
        np.concatenate(
            (
                random_values(format_, 5),
                run,
                random_values(format_, 3),
                dark,
                random_values(format_, 2),
            )
        ),
    ):
        assert (decode(values, format_)[1] == values).all()


@FORMATS
@pytest.mark.parametrize("count", EDGES)
@pytest.mark.parametrize("max_payload", [64, 65, 1024])
def test_literals_of_a_length_at_the_limits(format_, count, max_payload):
    values = random_values(format_, count)
    if format_ is PixelFormat.MONO1:
        values = np.arange(count, dtype=np.uint32) % 3 % 2
    assert (decode(values, format_, max_payload)[1] == values).all()


@FORMATS
def test_a_dark_page_is_no_payload(format_):
    assert decode(np.zeros(105, dtype=np.uint32), format_)[0] == []
    assert (
        encode_spans(np.zeros(0, dtype=np.uint32), EncoderConfig(Grid(0, 1, 1), format_, 64)) == []
    )


@FORMATS
def test_a_full_page_is_one_run(format_):
    """7: the pen begins as the full pixel."""
    payloads, _ = decode(np.full(105, format_.full, dtype=np.uint32), format_)
    assert payloads == [counted_op(0xA0, 105)]


@pytest.mark.parametrize(
    ("index", "ops"),
    [(2**21 + 32, "A0 9F FF FF 7F A0"), (2**21 + 33, "A0 02 21 00 20 A0")],
    ids=["skip", "move"],
)
def test_a_long_way_is_a_move(index, ops):
    """SKIP with a LEB128 of three bytes is as long as MOVE; with four, MOVE is shorter."""
    grid = Grid(256, 256, 40)
    values = np.zeros(grid.voxels, dtype=np.uint32)
    values[[0, index]] = 255
    payloads, page = decode(values, PixelFormat.INDEX8, 64, grid)
    assert (page == values).all()
    assert payloads == [bytes.fromhex(ops)]


@pytest.mark.parametrize("format_", [f for f in PixelFormat if f is not PixelFormat.MONO1])
def test_payloads_of_literals_are_filled(format_):
    """But for what MOVE or a pixel might have taken."""
    values = random_values(format_, 3000)
    payloads, page = decode(values, format_, 64)
    assert (page == values).all()
    assert min(map(len, payloads[:-1])) >= 64 - 7 - format_.bytes


@FORMATS
def test_it_takes_hardly_more_bytes_than_the_pixels_themselves(format_):
    values = random_values(format_, 5000)
    bits = 1 if format_ is PixelFormat.MONO1 else 8 * format_.bytes
    payloads, _ = decode(values, format_, 1024)
    assert sum(map(len, payloads)) <= 5000 * bits / 8 * 1.02 + 20


def page_ops_of_device(values, format_):
    page = Page(len(values), format_.bytes)
    page.put(0, format_.pixels(values).astype("<u2" if format_.bytes == 2 else "u1").tobytes())
    return page


@FORMATS
@pytest.mark.parametrize("density", [0, 0.02, 0.5, 1])
@pytest.mark.parametrize("room", [12, 50, 1000])
def test_what_the_device_packs_is_read(format_, density, room):
    rng = np.random.default_rng(7)
    values = random_values(format_, 700) * (rng.random(700) < density)
    values = np.repeat(values, rng.integers(1, 60, 700))[:5000].astype(np.uint32)
    page, device_format = page_ops_of_device(values, format_), DEVICE_FORMATS[format_.value]
    at = 0
    while at < len(values):
        count, ops = encode_page(page, device_format, at, len(values) - at, room)
        assert decode_spans(ops, count, format_).tolist() == values[at : at + count].tolist()
        at += count


@pytest.mark.parametrize(
    ("format_", "count", "ops", "values"),
    [
        ("index8", 3, "A2", [255] * 3),
        ("index8", 4, "01 2A A1 81", [42, 42, 0, 0]),
        ("index8", 4, "C1 01 02 A1", [1, 2, 2, 2]),
        ("index8", 1, "01 2A A0 00 00", [42]),
        ("mono1", 9, "C8 A5 01", [1, 0, 1, 0, 0, 1, 0, 1, 1]),
        ("mono1", 3, "01 00 A0 01 01 A1", [0, 1, 1]),
        ("rgb565", 2, "C1 34 12 78 56", [0x1234, 0x5678]),
        ("rgb888", 2, "01 01 02 03 A1", [0x030201] * 2),
        ("index8", 0, "", []),
    ],
)
def test_a_page_by_hand(format_, count, ops, values):
    assert decode_spans(bytes.fromhex(ops), count, PixelFormat(format_)).tolist() == values


def test_a_page_costs_what_it_writes():
    # A dark start, LIT of two pixels, a PEN of 0 that is drawn, and the dark rest of 1024^3.
    ops = "83 C1 2A 00 A1 01 07 A0 01 00 A2 9F " + "EE FF FF FF 03"
    count = 4 + 2 + 2 + 1 + 3 + 0x3FFFFFEE + 32
    runs = decode_runs(bytes.fromhex(ops), count, PixelFormat.INDEX8)
    assert [(start, run.tolist()) for start, run in runs] == [(4, [42, 0]), (8, [7])]


@pytest.mark.parametrize(
    ("format_", "count", "ops", "what", "offset"),
    [
        ("index8", 3, "A1", "cover 2 voxels, not 3", 13),
        ("index8", 3, "A0 A2", "more than 3", 13),
        ("index8", 3, "A2 80", "more than 3", 13),
        ("index8", 2, "A1 00 00 01", "behind END", 13),
        ("index8", 2, "A1 01", "cut off", 13),
        ("rgb888", 2, "01 11 22", "cut off", 12),
        ("rgb565", 2, "C1 11 22 33", "cut off", 12),
        ("mono1", 9, "C8 FF", "cut off", 12),
        ("mono1", 9, "C8 FF 02", "unused bits", 12),
        ("mono1", 1, "01 02 A0", "unused bits", 12),
        ("index8", 2, "A0 BF", "count is malformed", 13),
        ("index8", 2, "BF 80", "count is malformed", 12),
        ("index8", 99, "BF 80 00", "count is malformed", 12),
        ("index8", 99, "BF 80 80 80 80 80 01", "count is malformed", 12),
        ("index8", 2, "02 00 00 00", "op 02 is not allowed", 12),
        ("index8", 2, "A0 40 00 00 00 00 00", "op 40 is not allowed", 13),
        ("index8", 2, "E0", "op E0 is not allowed", 12),
    ],
)
def test_a_page_that_breaks_the_protocol(format_, count, ops, what, offset):
    with pytest.raises(RemoteProtocolError, match=what) as caught:
        decode_spans(bytes.fromhex(ops), count, PixelFormat(format_))
    assert caught.value.section == "10"
    assert caught.value.offset == offset
