"""The ops that draw, against the plainest decoder there is, and those of PAGE: 7 and 10."""

import random
from collections.abc import Sequence
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simpage import GRIDS, digest, unpack

from firmware_sim.config import Config
from firmware_sim.grid import Grid
from firmware_sim.memory import DEFAULT_PALETTE, FORMATS, Page
from firmware_sim.pack import pack
from firmware_sim.refusal import Refusal


class Plain:
    """Decoder of section 7, voxel by voxel."""

    def __init__(self, grid: tuple[int, int, int], name: str) -> None:
        self.grid = grid
        self.volume = grid[0] * grid[1] * grid[2]
        self.size = FORMATS[name].size
        self.mono = name == "mono1"
        self.voxels = {}
        self.palette = bytearray(DEFAULT_PALETTE)
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

    def at(self, index: int) -> tuple[int, int, int]:
        nx, ny, _ = self.grid
        return index % nx, index // nx % ny, index // nx // ny

    def index(self, place: Sequence[int]) -> int:
        x, y, z = place
        assert all(0 <= a < side for a, side in zip(place, self.grid, strict=True))
        return x + self.grid[0] * (y + self.grid[1] * z)

    def line(self, target: tuple[int, int, int]) -> None:
        p = self.at(self.cursor)
        d = [b - a for a, b in zip(p, target, strict=True)]
        length = max(map(abs, d))
        for k in range(length + 1):
            voxel = [
                a + (2 * k * da + length) // (2 * length) if length else a
                for a, da in zip(p, d, strict=True)
            ]
            self.voxels[self.index(voxel)] = self.pen
        self.cursor = self.index(target)

    def box(self, target: tuple[int, int, int]) -> None:
        (x, u), (y, v), (z, w) = (
            sorted(pair) for pair in zip(self.at(self.cursor), target, strict=True)
        )
        for k, j, i in product(range(z, w + 1), range(y, v + 1), range(x, u + 1)):
            self.voxels[self.index((i, j, k))] = self.pen
        self.cursor = self.index(target)

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


def random_ops(rng: random.Random, plain: Plain, name: str) -> bytes:
    """Draw at random, with a plain decoder beside; return the ops."""
    out = b""
    for _ in range(rng.randrange(1, 12)):
        room = plain.volume - plain.cursor
        count = min(rng.choice((1, rng.randrange(1, 40), 32, 160)), room)
        kinds = ["pen", "move", "step", "from", "skip", "run", "lit", "line", "box", "dots", "oct"]
        kind = rng.choice(kinds + ["diff", "colors"] * (name == "index8"))
        if kind == "colors":
            first = rng.randrange(256)
            colors = rng.randbytes(3 * rng.randrange(1, min(5, 257 - first)))
            plain.palette[3 * first : 3 * first + len(colors)] = colors
            out += bytes((6, first, len(colors) // 3 - 1)) + colors
        elif kind == "dots":
            places = [random_dot(rng, plain) for _ in range(rng.choice((1, 2, 256)))]
            out += bytes((5, len(places) - 1)) + b"".join(places)
        elif kind == "oct":
            out += random_brick(rng, plain)
        elif kind in ("line", "box") and count:
            target = plain.at(rng.randrange(plain.volume))
            (plain.line if kind == "line" else plain.box)(target)
            out += bytes((3 if kind == "line" else 4,)) + coordinates(plain, target)
        elif kind == "pen":
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
    plain.cursor = rng.randrange(plain.volume)
    return coordinates(plain, plain.at(plain.cursor))


def random_dot(rng: random.Random, plain: Plain) -> bytes:
    place = random_place(rng, plain)
    plain.voxels[plain.cursor] = plain.pen
    return place


def coordinates(plain: Plain, place: Sequence[int]) -> bytes:
    width = 1 if max(plain.grid) <= 256 else 2
    return b"".join(axis.to_bytes(width, "little") for axis in place)


def random_brick(rng: random.Random, plain: Plain) -> bytes:
    """Section 7.4, node by node, along one voxel at least that is on the grid."""
    level = rng.randrange(5)
    seed = plain.at(rng.randrange(plain.volume))
    origin = [axis >> level << level for axis in seed]
    out = bytes((0x60 | level,)) + coordinates(plain, [axis >> level for axis in seed])
    nodes = [origin]
    chance = rng.random()
    for j in range(level, 0, -1):
        half = 1 << j - 1
        following = []
        for node in nodes:
            end = [a + 2 * half <= side for a, side in zip(node, plain.grid, strict=True)]
            if all(end) and rng.random() < 0.2:
                out += b"\0"
                for k, b, a in product(range(2 * half), repeat=3):
                    plain.voxels[plain.index((node[0] + a, node[1] + b, node[2] + k))] = plain.pen
                continue
            children = []
            for c in range(8):
                child = [a + half * (c >> k & 1) for k, a in enumerate(node)]
                seeded = all(a <= s < a + half for a, s in zip(child, seed, strict=True))
                on_grid = all(a < side for a, side in zip(child, plain.grid, strict=True))
                if on_grid and (seeded or rng.random() < chance):
                    children.append((c, child))
            if not children:  # the node's first child is on the grid, for the node is
                children = [(0, node)]
            out += bytes((sum(1 << c for c, _ in children),))
            following += [child for _, child in children]
        nodes = following
    for voxel in nodes:
        plain.voxels[plain.index(voxel)] = plain.pen
    return out


def random_run(rng: random.Random, plain: Plain, kind: str, count: int) -> bytes:
    if kind == "skip":
        plain.cursor += count
        return leb(0x80, count)
    if kind == "run":
        for _ in range(count):
            plain.write()
        return leb(0xA0, count)
    if kind == "diff":
        steps = [rng.randrange(-8, 8) for _ in range(count)]
        for step in steps:
            plain.pen = (plain.pen + step) % 256
            plain.write()
        nibbles = sum((step & 15) << 4 * k for k, step in enumerate(steps))
        return leb(0xE0, count) + nibbles.to_bytes((count + 1) // 2, "little")
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
    for _ in range(60 if grid.volume < 10_000 else 5):
        plain = Plain(sides, name)
        ops = random_ops(rng, plain, name)
        page = Page(grid.volume, FORMATS[name].size)
        unpack(ops, grid, name, page)
        assert page.pixels == plain.pixels()
        assert page.palette == plain.palette
        assert page.digest == digest(page.pixels, page.pixel_size, page.palette)


def test_a_chain_of_256_steps() -> None:
    plain = Plain((300, 4, 3), "rgb888")
    plain.chain(0, [0] * 256)
    page = Page(3600, 3)
    unpack(b"\x20\xff" + bytes(64), Grid(300, 4, 3), "rgb888", page)
    assert page.pixels == plain.pixels()


OP, COUNT, TRUNCATED, PADDING, PIXEL, OUTSIDE = range(7, 13)


@pytest.mark.parametrize(
    ("name", "ops", "code", "offset"),
    [
        *(("index8", f"a0 {op:02x}", OP, 4) for op in (*range(7, 32), *range(0x65, 0x80))),
        *(("rgb565", f"{op:02x}", OP, 3) for op in (6, *range(0xE0, 0x100))),
        *(("index8", f"{op:02x} 00 00 00 00 00", OP, 3) for op in (*range(0x38, 0x40), 0x59, 0x5F)),
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
    with pytest.raises(Refusal) as refusal:
        unpack(bytes.fromhex(ops), grid, name, page)
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
    unpack(bytes.fromhex(ops), grid, "index8", page, config.feature_bits)
    with pytest.raises(Refusal) as refusal:
        unpack(bytes.fromhex("a0" + ops), grid, "index8", page, others)
    assert (refusal.value.code, refusal.value.offset) == (OP, 4)


def test_a_line_goes_up_from_the_middle_and_back_over_the_same_voxels() -> None:
    """The line from q to p has the same voxels."""
    rng = random.Random(2)
    sides = (17, 23, 9)
    for _ in range(200):
        plain = Plain(sides, "mono1")
        p, q = (plain.at(rng.randrange(plain.volume)) for _ in range(2))
        pictures = []
        for start, end in ((p, q), (q, p)):
            page = Page(plain.volume, 1)
            ops = bytes((2, *start, 3, *end))
            unpack(ops, Grid(*sides), "mono1", page)
            pictures.append(page.pixels)
        plain.cursor = plain.index(p)
        plain.line(q)
        assert pictures == [plain.pixels()] * 2


def test_a_box_may_be_flat_or_thin_on_every_axis() -> None:
    sides = (5, 4, 6)
    for p in product((0, 1, 3), (0, 3), (0, 2, 5)):
        for q in product((0, 4), (0, 1, 3), (0, 5)):
            plain = Plain(sides, "index8")
            plain.cursor = plain.index(p)
            plain.box(q)
            page = Page(plain.volume, 1)
            unpack(bytes((2, *p, 4, *q)), Grid(*sides), "index8", page)
            assert page.pixels == plain.pixels()


def test_a_full_brick_and_all_its_masks_are_the_same() -> None:
    sides = (20, 18, 33)
    pictures = []
    for masks in (b"\0", b"\xff" + bytes(8), b"\xff" * 9 + bytes(64), b"\xff" * 585):
        page = Page(Grid(*sides).volume, 3)
        unpack(b"\x64\0\0\1" + masks, Grid(*sides), "rgb888", page)
        assert page.digest == digest(page.pixels, 3)
        pictures.append(page.pixels)
    assert pictures[1:] == pictures[:1] * 3
    assert pictures[0].count(255) == 3 * 4096


@given(st.binary(max_size=80), st.sampled_from(sorted(FORMATS)), st.sampled_from(GRIDS))
@settings(deadline=None, max_examples=300)
def test_no_ops_write_outside_the_page(ops: bytes, name: str, sides: tuple[int, int, int]) -> None:
    """MUST NOT write outside its pages whatever comes."""
    grid, pixel_format = Grid(*sides), FORMATS[name]
    page = Page(grid.volume, pixel_format.size)
    refusal = None
    try:
        unpack(ops, grid, name, page)
    except Refusal as raised:
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
    covered, ops = pack(page, pixel_format, start, count, room)
    assert 1 <= covered <= count
    assert len(ops) <= room
    assert covered == count or len(ops) > room - 12
    back = Page(covered, size)
    if covered <= 256 * 256:
        unpack(ops, Grid(covered, 1, 1), name, back, features=0)
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
