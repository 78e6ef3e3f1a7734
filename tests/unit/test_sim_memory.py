"""Pages, the digest, and the ops that draw: sections 2, 7, 8 and 10."""

import random
from array import array

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_sim import spec
from firmware_sim.digest import terms
from firmware_sim.grid import Grid
from firmware_sim.memory import FORMATS, Memory, Page
from firmware_sim.pack import pack
from firmware_sim.refusal import Refusal
from firmware_sim.unpack import unpack

GRIDS = [(3, 5, 7), (17, 64, 40), (300, 4, 3), (1, 1, 1), (256, 2, 2)]


def mix(index: int, value: int) -> int:
    """Section 8, word for word."""
    h = (index * 0x9E3779B1 + value * 0x85EBCA77) % 2**32
    h ^= h >> 15
    h = h * 0x2C1B3C6D % 2**32
    h ^= h >> 12
    h = h * 0x297A2D39 % 2**32
    return h ^ h >> 15


def digest(pixels: bytes, size: int) -> int:
    values = [int.from_bytes(pixels[i : i + size], "little") for i in range(0, len(pixels), size)]
    return sum(mix(index, value) for index, value in enumerate(values) if value) % 2**32


@pytest.mark.parametrize("size", [1, 2, 3])
def test_terms_are_those_of_the_document(size: int) -> None:
    rng = random.Random(size)
    for count in (1, 2, 1023, 1024, 1025, 3000):
        pixels = bytearray(rng.randbytes(count * size))
        pixels[: size * (count // 3)] = bytes(size * (count // 3))
        indices = array("Q", (rng.randrange(2**31) for _ in range(count)))
        expected = sum(
            mix(index, value)
            for index, at in zip(indices, range(0, len(pixels), size), strict=True)
            if (value := int.from_bytes(pixels[at : at + size], "little"))
        )
        assert terms(indices, pixels, size) == expected % 2**32


def test_the_largest_index_and_value_stay_in_their_lanes() -> None:
    top = spec.LIMIT_MAX_VOXELS - 1
    pixels = b"\xff" * 3 * 1024
    expected = sum(mix(top - k, 0xFFFFFF) for k in range(1024)) % 2**32
    assert terms(range(top, top - 1024, -1), pixels, 3) == expected


@given(st.data())
@settings(deadline=None, max_examples=50)
def test_the_digest_is_kept_at_every_write(data: st.DataObject) -> None:
    size = data.draw(st.integers(1, 3))
    page = Page(60, size)
    expected = bytearray(60 * size)
    pixel = st.one_of(st.just(bytes(size)), st.binary(min_size=size, max_size=size))
    for _ in range(data.draw(st.integers(1, 6))):
        if data.draw(st.booleans()):
            start = data.draw(st.integers(0, 59))
            run = b"".join(data.draw(st.lists(pixel, min_size=1, max_size=60 - start)))
            page.put(start, run)
            expected[start * size : start * size + len(run)] = run
        else:
            indices = data.draw(st.sets(st.integers(0, 59), min_size=1))
            pen = data.draw(pixel)
            page.plot(array("Q", indices), pen)
            for i in indices:
                expected[i * size : i * size + size] = pen
        assert page.pixels == expected
        assert page.digest == digest(expected, size)


def test_pages_are_cleared_copied_and_exchanged() -> None:
    memory = Memory(Grid(3, 5, 7), FORMATS["rgb565"])
    memory.back.put(4, b"\x11\x22")
    memory.swap()
    memory.begin(dark=False)
    assert memory.back.pixels == memory.front.pixels
    assert memory.back.digest == memory.front.digest == mix(4, 0x2211)
    memory.back.put(5, b"\x11\x22")
    assert memory.front.digest == mix(4, 0x2211)
    memory.begin(dark=True)
    assert not any(memory.back.pixels)
    assert memory.back.digest == 0


# Ops, against the plainest decoder there is


class Plain:
    """Decoder of section 7, voxel by voxel."""

    def __init__(self, grid: tuple[int, int, int], name: str) -> None:
        self.grid = grid
        self.volume = grid[0] * grid[1] * grid[2]
        self.size = FORMATS[name].size
        self.mono = name == "mono1"
        self.voxels = {}
        self.pen = 1 if self.mono else 256**self.size - 1
        self.cursor = 0

    def write(self) -> None:
        self.voxels[self.cursor] = self.pen
        self.cursor += 1

    def chain(self, octant: int, crumbs: list[int]) -> None:
        nx, ny, _ = self.grid
        place = [self.cursor % nx, self.cursor // nx % ny, self.cursor // nx // ny]
        self.voxels[self.cursor] = self.pen
        main = octant // 8
        for crumb in crumbs:
            for axis, moves in (
                (main, 1),
                ((main + 1) % 3, crumb & 1),
                ((main + 2) % 3, crumb >> 1),
            ):
                if moves:
                    place[axis] += -1 if octant % 8 >> axis & 1 else 1
            assert all(0 <= place[k] < self.grid[k] for k in range(3))
            self.cursor = place[0] + nx * (place[1] + ny * place[2])
            self.voxels[self.cursor] = self.pen

    def pixels(self) -> bytes:
        return b"".join(
            self.voxels.get(i, 0).to_bytes(self.size, "little") for i in range(self.volume)
        )


def leb(op: int, count: int) -> bytes:
    if count < 32:
        return bytes((op | count - 1,))
    out = [op | 31]
    count -= 32
    while True:
        out.append(count % 128 | (128 if count >= 128 else 0))
        count //= 128
        if not count:
            return bytes(out)


def random_ops(rng: random.Random, plain: Plain) -> bytes:
    """Draw at random, with a plain decoder beside; return the ops."""
    out = b""
    for _ in range(rng.randrange(1, 12)):
        room = plain.volume - plain.cursor
        count = min(rng.choice((1, rng.randrange(1, 40), 32, 160)), room)
        kind = rng.choice(("pen", "move", "step", "from", "skip", "run", "lit"))
        if kind == "pen":
            plain.pen = random_pixel(rng, plain)
            out += b"\x01" + plain.pen.to_bytes(plain.size, "little")
        elif not count or kind in ("move", "from"):
            place = random_place(rng, plain)
            chain = random_chain(rng, plain) if kind == "from" else None
            out += bytes((0x40 | chain[0],)) + place + chain[1] if chain else b"\x02" + place
        elif kind == "step":
            chain = random_chain(rng, plain)
            out += bytes((0x20 | chain[0],)) + chain[1] if chain else b""
        else:
            out += random_run(rng, plain, kind, count)
    return out + rng.choice((b"", b"\0", b"\0\0\0"))


def random_pixel(rng: random.Random, plain: Plain) -> int:
    return rng.randrange(2 if plain.mono else 256**plain.size)


def random_place(rng: random.Random, plain: Plain) -> bytes:
    x, y, z = (rng.randrange(side) for side in plain.grid)
    plain.cursor = x + plain.grid[0] * (y + plain.grid[1] * z)
    width = 1 if max(plain.grid) <= 256 else 2
    return b"".join(axis.to_bytes(width, "little") for axis in (x, y, z))


def random_run(rng: random.Random, plain: Plain, kind: str, count: int) -> bytes:
    if kind == "skip":
        plain.cursor += count
        return leb(0x80, count)
    if kind == "run":
        for _ in range(count):
            plain.write()
        return leb(0xA0, count)
    values = [random_pixel(rng, plain) for _ in range(count)]
    for plain.pen in values:
        plain.write()
    if plain.mono:
        bits = sum(value << k for k, value in enumerate(values))
        return leb(0xC0, count) + bits.to_bytes((count + 7) // 8, "little")
    return leb(0xC0, count) + b"".join(v.to_bytes(plain.size, "little") for v in values)


def random_chain(rng: random.Random, plain: Plain) -> tuple[int, bytes] | None:
    nx, ny, _ = plain.grid
    place = [plain.cursor % nx, plain.cursor // nx % ny, plain.cursor // nx // ny]
    octant = rng.randrange(24)
    main = octant // 8
    room = [place[k] if octant % 8 >> k & 1 else plain.grid[k] - 1 - place[k] for k in range(3)]
    count = min(room[main], rng.randrange(1, 257))
    if not count:
        return None
    crumbs = []
    for _ in range(count):
        crumb = 0
        for bit in (0, 1):
            axis = (main + 1 + bit) % 3
            if room[axis] and rng.random() < 0.5:
                room[axis] -= 1
                crumb |= 1 << bit
        crumbs.append(crumb)
    plain.chain(octant, crumbs)
    packed = sum(crumb << 2 * k for k, crumb in enumerate(crumbs))
    return octant, bytes((count - 1,)) + packed.to_bytes((count + 3) // 4, "little")


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("sides", GRIDS)
def test_ops_draw_what_the_plainest_decoder_draws(name: str, sides: tuple[int, int, int]) -> None:
    rng = random.Random(f"{name} {sides}")
    grid = Grid(*sides)
    for _ in range(60 if grid.volume < 10_000 else 4):
        plain = Plain(sides, name)
        ops = random_ops(rng, plain)
        page = Page(grid.volume, FORMATS[name].size)
        unpack(b"\x11\0\0" + ops, grid, FORMATS[name], page)
        assert page.pixels == plain.pixels()
        assert page.digest == digest(page.pixels, page.pixel_size)


def test_a_chain_of_256_steps() -> None:
    plain = Plain((300, 4, 3), "rgb888")
    plain.chain(0, [0] * 256)
    page = Page(3600, 3)
    unpack(b"\x11\0\0\x20\xff" + bytes(64), Grid(300, 4, 3), FORMATS["rgb888"], page)
    assert page.pixels == plain.pixels()


OP, COUNT, TRUNCATED, PADDING, PIXEL, OUTSIDE = range(7, 13)


@pytest.mark.parametrize(
    ("name", "ops", "code", "offset"),
    [
        *(("index8", f"a0 {op:02x}", OP, 4) for op in (*range(3, 32), *range(0x60, 0x80))),
        *(("index8", f"{op:02x}", OP, 3) for op in range(0xE0, 0x100)),
        *(("index8", f"{op:02x} 00 00 00 00 00", OP, 3) for op in (*range(0x38, 0x40), 0x58, 0x5F)),
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
    ],
)
def test_the_first_fault_is_refused(name: str, ops: str, code: int, offset: int) -> None:
    """The device checks in the order of this table, ops from first to last."""
    grid, pixel_format = Grid(3, 5, 7), FORMATS[name]
    page = Page(grid.volume, pixel_format.size)
    with pytest.raises(Refusal) as refusal:
        unpack(b"\x11\0\0" + bytes.fromhex(ops), grid, pixel_format, page)
    assert (refusal.value.code, refusal.value.offset) == (code, offset)
    assert len(refusal.value.text.encode()) <= 59
    assert len(page.pixels) == grid.volume * pixel_format.size
    assert page.digest == digest(page.pixels, page.pixel_size)


@given(st.binary(max_size=80), st.sampled_from(sorted(FORMATS)), st.sampled_from(GRIDS))
@settings(deadline=None, max_examples=300)
def test_no_ops_write_outside_the_page(ops: bytes, name: str, sides: tuple[int, int, int]) -> None:
    """MUST NOT write outside its pages whatever comes."""
    grid, pixel_format = Grid(*sides), FORMATS[name]
    page = Page(grid.volume, pixel_format.size)
    refusal = None
    try:
        unpack(b"\x11\0\0" + ops, grid, pixel_format, page)
    except Refusal as raised:
        refusal = raised
    assert refusal is None or OP <= refusal.code <= OUTSIDE
    assert refusal is None or 3 <= refusal.offset < 3 + len(ops)
    assert len(page.pixels) == grid.volume * pixel_format.size
    if name == "mono1":
        assert max(page.pixels) <= 1
    if grid.volume < 5000:
        assert page.digest == digest(page.pixels, page.pixel_size)


# PAGE


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
    covered, ops = pack(page, pixel_format, start, count, room)
    assert 1 <= covered <= count
    assert len(ops) <= room
    assert covered == count or len(ops) > room - 12
    back = Page(covered, size)
    if covered <= 256 * 256:
        unpack(b"\x11\0\0" + ops, Grid(covered, 1, 1), pixel_format, back)
    assert back.pixels == pixels[start * size : (start + covered) * size]


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
    assert pack(page, FORMATS[name], 0, page.volume, 1015) == (page.volume, bytes.fromhex(ops))
