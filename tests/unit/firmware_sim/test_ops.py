"""Op decoder against a voxelwise decoder, and the encoder of PAGE: sections 7 and 10."""

import random
from itertools import product

import pytest
from emulator_page import GRIDS, digest, draw_ops
from hypothesis import given, settings
from hypothesis import strategies as st
from random_ops import VoxelwiseDecoder, random_ops

from firmware_sim import spec
from firmware_sim.config import Config
from firmware_sim.grid import Grid
from firmware_sim.memory import FORMATS, Page
from firmware_sim.packet_error import PacketError
from firmware_sim.page_encoder import _op, encode_page


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("sides", GRIDS)
def test_ops_draw_what_the_plainest_decoder_draws(name: str, sides: tuple[int, int, int]) -> None:
    rng = random.Random(f"{name} {sides}")
    grid = Grid(*sides)
    for _ in range(60 if grid.volume < 10_000 else 5):
        plain = VoxelwiseDecoder(sides, name)
        ops = random_ops(rng, plain, name)
        page = Page(grid.volume, FORMATS[name].size)
        draw_ops(ops, grid, name, page)
        assert page.pixels == plain.pixels()
        assert page.palette == plain.palette
        assert page.digest == digest(page.pixels, page.pixel_size, page.palette)


def test_a_chain_of_256_steps() -> None:
    plain = VoxelwiseDecoder((300, 4, 3), "rgb888")
    plain.chain(0, [0] * 256)
    page = Page(3600, 3)
    draw_ops(b"\x20\xff" + bytes(64), Grid(300, 4, 3), "rgb888", page)
    assert page.pixels == plain.pixels()


OP, COUNT, TRUNCATED, PADDING, PIXEL, OUTSIDE = range(7, 13)


@pytest.mark.parametrize(
    ("name", "ops", "code", "offset"),
    [
        *(("index8", f"a0 {op:02x}", OP, 4) for op in (*range(10, 32), *range(0x65, 0x80))),
        *(("rgb565", f"{op:02x}", OP, 3) for op in (6, *range(0xE0, 0x100))),
        *(("index8", f"{op:02x} 00 00 00 00 00", OP, 3) for op in (*range(0x38, 0x40), 0x5C, 0x5F)),
        ("index8", "9f 80 00", COUNT, 3),
        ("index8", "bf 80 80 00", COUNT, 3),
        ("index8", "df ff ff ff ff 80", COUNT, 3),
        ("index8", "df 80 80 80 80 80 80", COUNT, 3),
        ("index8", "9f e0 ff ff ff 0f", COUNT, 3),
        ("index8", "9f ff ff ff ff 7f", COUNT, 3),
        ("index8", "9f df ff ff ff 0f", OUTSIDE, 3),
        ("index8", "9f", TRUNCATED, 3),
        ("index8", "bf ff", TRUNCATED, 3),
        ("index8", "bf 80 80 80 80", TRUNCATED, 3),
        ("index8", "01", TRUNCATED, 3),
        ("rgb888", "01 ff ff", TRUNCATED, 3),
        ("index8", "02 00 00", TRUNCATED, 3),
        ("index8", "20", TRUNCATED, 3),
        ("index8", "20 00", TRUNCATED, 3),
        ("index8", "20 04 00", TRUNCATED, 3),
        ("index8", "40 09 09 09 00", TRUNCATED, 3),
        ("index8", "c1 01", TRUNCATED, 3),
        ("mono1", "c8 01", TRUNCATED, 3),
        ("index8", "df df ff ff ff 0f", TRUNCATED, 3),
        ("index8", "20 00 04", PADDING, 3),
        ("index8", "40 09 09 09 00 04", PADDING, 3),
        ("index8", "a0 00 00 01", PADDING, 4),
        ("mono1", "c8 ff 02", PADDING, 3),
        ("mono1", "9f 48 c1 04", PADDING, 5),
        ("mono1", "01 02", PIXEL, 3),
        ("mono1", "01 ff", PIXEL, 3),
        ("index8", "02 03 00 00", OUTSIDE, 3),
        ("index8", "02 00 05 00", OUTSIDE, 3),
        ("index8", "02 00 00 07", OUTSIDE, 3),
        ("index8", "40 03 00 00 00 00", OUTSIDE, 3),
        ("index8", "20 02 00", OUTSIDE, 3),
        ("index8", "21 00 00", OUTSIDE, 3),
        ("index8", "28 00 02 28 03 aa", OUTSIDE, 6),
        ("index8", "30 05 00 00 30 00 01", OUTSIDE, 7),
        ("index8", "9f 49 20 00 00", OUTSIDE, 5),
        ("index8", "9f 49 80", OUTSIDE, 5),
        ("index8", "9f 49 a0", OUTSIDE, 5),
        ("index8", "9f 49 c0 01", OUTSIDE, 5),
        ("index8", "9f 4a", OUTSIDE, 3),
        ("index8", "bf 4a", OUTSIDE, 3),
        ("index8", "9f 48 c1 01 01", OUTSIDE, 5),
        ("index8", "a0 03 02 04", TRUNCATED, 4),
        ("index8", "a0 04 02 04", TRUNCATED, 4),
        ("index8", "a0 05", TRUNCATED, 4),
        ("index8", "a0 05 01 03 00 00 09 09", TRUNCATED, 4),
        ("index8", "a0 06 00", TRUNCATED, 4),
        ("index8", "a0 07", TRUNCATED, 4),
        ("index8", "06 ff 01 00 00 00 00 00", TRUNCATED, 3),
        ("index8", "60 02 04", TRUNCATED, 3),
        ("index8", "62 00 00 00 03 01", TRUNCATED, 3),
        ("index8", "62 09 09 09 03 01", TRUNCATED, 3),
        ("index8", "ff 80 00", COUNT, 3),
        ("index8", "ff 80 80", TRUNCATED, 3),
        ("index8", "9f 49 e2 00 f0", PADDING, 5),
        ("index8", "9f 49 e2 00 00", OUTSIDE, 5),
        ("index8", "03 03 00 00", OUTSIDE, 3),
        ("index8", "03 00 05 00", OUTSIDE, 3),
        ("index8", "03 00 00 07", OUTSIDE, 3),
        ("index8", "04 00 05 00", OUTSIDE, 3),
        ("index8", "9f 49 03 02 04 06", OUTSIDE, 5),
        ("index8", "9f 49 04 02 04 06", OUTSIDE, 5),
        ("index8", "05 01 00 00 00 03 00 00", OUTSIDE, 3),
        ("index8", "05 01 00 05 00 00 00 00", OUTSIDE, 3),
        ("index8", "05 00 00 00 07", OUTSIDE, 3),
        ("index8", "06 ff 01 00 00 00 00 00 00", OUTSIDE, 3),
        ("index8", "06 01 ff" + " 00" * 768, OUTSIDE, 3),
        ("index8", "60 03 00 00", OUTSIDE, 3),
        ("index8", "61 01 00 00 02", OUTSIDE, 3),
        ("index8", "61 00 02 00 04", OUTSIDE, 3),
        ("index8", "61 00 00 03 10", OUTSIDE, 3),
        ("index8", "61 01 00 00 00", OUTSIDE, 3),
        ("index8", "62 00 00 00 00", OUTSIDE, 3),
        ("index8", "a0 62 00 01 01 01 04", OUTSIDE, 4),
        ("index8", "64 ff ff ff 01 01 01 01", OUTSIDE, 3),
    ],
)
def test_the_first_fault_is_refused(name: str, ops: str, code: int, offset: int) -> None:
    """The device checks in the order of this table, ops from first to last."""
    grid, pixel_format = Grid(3, 5, 7), FORMATS[name]
    page = Page(grid.volume, pixel_format.size)
    with pytest.raises(PacketError) as refusal:
        draw_ops(bytes.fromhex(ops), grid, name, page)
    assert (refusal.value.code, refusal.value.offset) == (code, offset)
    assert len(refusal.value.text.encode()) <= 59
    assert len(page.pixels) == grid.volume * pixel_format.size
    assert page.digest == digest(page.pixels, page.pixel_size)


@pytest.mark.parametrize(
    ("feature", "ops"),
    [
        ("line", "03 01 02 03"),
        ("box", "04 01 02 03"),
        ("dots", "05 00 01 02 03"),
        ("arc", "58 00"),
        ("slabs", "59 00"),
        ("values", "5b 00"),
        ("palette", "06 00 00 01 02 03"),
        *(("oct", f"6{level} 00 00 00 01 01 01 01"[: 11 + 3 * level]) for level in range(3)),
        *(("diff", f"{op:02x}" + " 00" * 16) for op in range(0xE0, 0xFF)),
    ],
)
def test_ops_of_features_are_reserved_if_not_announced(feature: str, ops: str) -> None:
    """So is every op of a feature that the device has not announced."""
    grid = Grid(4, 5, 7)
    config = Config(grid.sides, "index8", features=frozenset({feature}))
    others = Config(grid.sides, "index8").feature_bits & ~config.feature_bits
    page = Page(grid.volume, 1)
    draw_ops(bytes.fromhex(ops), grid, "index8", page, config.feature_bits)
    with pytest.raises(PacketError) as refusal:
        draw_ops(bytes.fromhex("a0" + ops), grid, "index8", page, others)
    assert (refusal.value.code, refusal.value.offset) == (OP, 4)


def test_a_line_goes_up_from_the_middle_and_back_over_the_same_voxels() -> None:
    """The line from q to p has the same voxels."""
    rng = random.Random(2)
    sides = (17, 23, 9)
    for _ in range(200):
        plain = VoxelwiseDecoder(sides, "mono1")
        p, q = (plain.at(rng.randrange(plain.volume)) for _ in range(2))
        pictures = []
        for start, end in ((p, q), (q, p)):
            page = Page(plain.volume, 1)
            ops = bytes((2, *start, 3, *end))
            draw_ops(ops, Grid(*sides), "mono1", page)
            pictures.append(page.pixels)
        plain.cursor = plain.index(p)
        plain.line(q)
        assert pictures == [plain.pixels()] * 2


def test_a_box_may_be_flat_or_thin_on_every_axis() -> None:
    sides = (5, 4, 6)
    for p in product((0, 1, 3), (0, 3), (0, 2, 5)):
        for q in product((0, 4), (0, 1, 3), (0, 5)):
            plain = VoxelwiseDecoder(sides, "index8")
            plain.cursor = plain.index(p)
            plain.box(q)
            page = Page(plain.volume, 1)
            draw_ops(bytes((2, *p, 4, *q)), Grid(*sides), "index8", page)
            assert page.pixels == plain.pixels()


def test_a_full_brick_and_all_its_masks_are_the_same() -> None:
    sides = (20, 18, 33)
    pictures = []
    for masks in (b"\0", b"\xff" + bytes(8), b"\xff" * 9 + bytes(64), b"\xff" * 585):
        page = Page(Grid(*sides).volume, 3)
        draw_ops(b"\x64\0\0\1" + masks, Grid(*sides), "rgb888", page)
        assert page.digest == digest(page.pixels, 3)
        pictures.append(page.pixels)
    assert pictures[1:] == pictures[:1] * 3
    assert pictures[0].count(255) == 3 * 4096


@given(st.binary(max_size=80), st.sampled_from(sorted(FORMATS)), st.sampled_from(GRIDS))
@settings(deadline=None, max_examples=300)
def test_no_ops_write_outside_the_page(ops: bytes, name: str, sides: tuple[int, int, int]) -> None:
    """MUST NOT write outside its pages for any input."""
    grid, pixel_format = Grid(*sides), FORMATS[name]
    page = Page(grid.volume, pixel_format.size)
    refusal = None
    try:
        draw_ops(ops, grid, name, page)
    except PacketError as raised:
        refusal = raised
    assert refusal is None or OP <= refusal.code <= OUTSIDE
    assert refusal is None or 3 <= refusal.offset < 3 + len(ops)
    assert len(page.pixels) == grid.volume * pixel_format.size
    if name == "mono1":
        assert max(page.pixels) <= 1
    assert len(page.palette) == 768
    if grid.volume < 5000:
        assert page.digest == digest(page.pixels, page.pixel_size, page.palette)


def pictures(size: int, mono: bool) -> st.SearchStrategy[bytes]:
    pixel = (
        st.integers(0, 1).map(lambda v: bytes((v,)))
        if mono
        else st.sampled_from(
            [bytes(size), b"\0\0\x07"[-size:], b"\x07\0\0"[:size], b"\xff" * size, b"abc"[:size]]
        )
    )
    run = st.tuples(pixel, st.one_of(st.integers(1, 3), st.integers(1, 200)))
    return st.lists(run, min_size=1, max_size=60).map(lambda runs: b"".join(p * n for p, n in runs))


@pytest.mark.parametrize("name", FORMATS)
@given(data=st.data())
@settings(deadline=None, max_examples=120)
def test_a_page_unpacks_to_what_was_packed(name: str, data: st.DataObject) -> None:
    """They cover exactly `count`: at least 1, at most as in the READ; in one packet."""
    pixel_format = FORMATS[name]
    size = pixel_format.size
    pixels = data.draw(pictures(size, name == "mono1"))
    volume = len(pixels) // size
    page = Page(volume, size)
    page.put(0, pixels)
    room = data.draw(st.integers(55, 300))
    start = data.draw(st.integers(0, volume - 1))
    count = data.draw(st.integers(1, volume - start))
    covered, ops = encode_page(page, pixel_format, start, count, room)
    assert 1 <= covered <= count
    assert len(ops) <= room
    assert covered == count or len(ops) > room - 12
    back = Page(covered, size)
    if covered <= 256 * 256:
        draw_ops(ops, Grid(covered, 1, 1), name, back, features=0)
    assert back.pixels == pixels[start * size : (start + covered) * size]


@pytest.mark.parametrize("name", FORMATS)
def test_stretches_are_found_across_windows_and_blocks(name: str) -> None:
    """SKIP and RUN of all that is equal, wherever memory is divided."""
    pixel_format = FORMATS[name]
    size, full = pixel_format.size, pixel_format.full
    for counts in ((5000, 9000, 4096), (4096, 4096, 1), (1, 12_288, 128), (20_000, 100, 9999)):
        dark, lit, rest = counts
        page = Page(sum(counts), size)
        page.fill([dark], lit, full)
        page.put(dark + lit - 1, bytes(size) * 2)  # a dark pixel that was lit once
        covered, ops = encode_page(page, pixel_format, 0, sum(counts), 64)
        assert covered == sum(counts)
        expected = _op(spec.OP_SKIP, dark) + _op(spec.OP_RUN, lit - 1)
        assert ops == expected + _op(spec.OP_SKIP, rest + 1)


def test_pixels_are_read_across_windows() -> None:
    rng = random.Random(5)
    for name, pixel_format in FORMATS.items():
        values = bytes(rng.choices((0, 1), k=10_000 * pixel_format.size))
        page = Page(10_000, pixel_format.size)
        page.put(0, values)
        covered, ops = encode_page(page, pixel_format, 3, 9990, 60_000)
        back = Page(covered, pixel_format.size)
        draw_ops(ops, Grid(covered, 1, 1), name, back, features=0)
        assert covered == 9990
        assert back.pixels == values[3 * pixel_format.size : 9993 * pixel_format.size]


@pytest.mark.parametrize(
    ("name", "pixels", "ops"),
    [
        ("rgb888", bytes(9), "82"),
        ("rgb888", b"\xff" * 9 + bytes(3), "a2 80"),
        ("rgb888", b"abc" * 5, "01 61 62 63 a4"),
        ("rgb888", b"abcdefdefdef", "c1 61 62 63 64 65 66 a1"),
        ("index8", b"abcd\0e", "c5 61 62 63 64 00 65"),
        ("index8", bytes(32), "9f 00"),
        ("index8", bytes(160), "9f 80 01"),
        ("mono1", b"\1" * 31 + bytes(31), "be 9e"),
        ("mono1", b"\0\1" * 12, "d7 aa aa aa"),
        ("mono1", bytes(20) + b"\1\1", "93 a1"),
    ],
)
def test_pages_are_small(name: str, pixels: bytes, ops: str) -> None:
    size = FORMATS[name].size
    page = Page(len(pixels) // size, size)
    page.put(0, pixels)
    assert encode_page(page, FORMATS[name], 0, page.volume, 1015) == (
        page.volume,
        bytes.fromhex(ops),
    )
