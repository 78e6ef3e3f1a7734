"""Decoder of range-coded chains against an encoder written from the same section 7.7."""

import random
from dataclasses import dataclass, field
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_sim import spec
from firmware_sim.config import Config
from firmware_sim.grid import Grid
from firmware_sim.memory import FORMATS, Page
from firmware_sim.op_decoder import OpDecoder
from firmware_sim.packet_error import PacketError
from firmware_sim.range_decoder import RangeDecoder

GRIDS = [(3, 5, 7), (17, 64, 40), (300, 4, 3), (1, 1, 1), (256, 2, 2)]
TRUNCATED, PADDING, OUTSIDE = 9, 10, 12
Step = tuple[int, int, int]


class Coder:
    """Range encoder of a host, as section 7.7 describes it."""

    def __init__(self) -> None:
        self.low = 0
        self.range = 2**24
        self.p = [2048] * 266
        self.seen = [0] * 266
        self.out = []

    def code(self, bit: int, bound: int) -> None:
        if bit:
            self.low += bound
            self.range -= bound
        else:
            self.range = bound
        while self.range < 2**24:
            self.out.append(self.low >> 24)
            self.low = self.low % 2**24 << 8
            self.range <<= 8

    def bit(self, bit: int, i: int, j: int | None = None) -> None:
        j = i if j is None else j
        self.code(bit, (self.range >> 13) * (self.p[i] + self.p[j]))
        for k in {i, j}:
            shift = 1 + self.seen[k] // 2
            self.p[k] += -(self.p[k] >> shift) if bit else (4096 - self.p[k]) >> shift
            self.seen[k] = min(self.seen[k] + 1, 6)

    def plain(self, value: int, count: int) -> None:
        for k in reversed(range(count)):
            self.code(value >> k & 1, (self.range >> 13) * 4096)

    def number(self, value: int) -> None:
        k = (value + 1).bit_length() - 1
        for i in range(k):
            self.bit(1, 3 + i)
        if k < 15:
            self.bit(0, 3 + k)
        self.plain(value + 1 - 2**k, k)

    def end(self) -> bytes:
        self.out.append(self.low + 2**24 - 1 >> 24)
        for k in reversed(range(len(self.out))):
            if self.out[k] > 255:
                self.out[k] -= 256
                self.out[k - 1] += 1
        assert self.out[0] == 0
        return bytes(self.out[1:])


@dataclass
class Memory:
    last: int = 0
    run: int = 0
    prev: int = 0
    prev2: int = 0
    past: list[int] = field(default_factory=lambda: [0] * 7)  # the latest step first
    way: int = 0


@dataclass
class Piece:
    steps: list[Step]
    start: tuple[int, int, int] | None = None  # of a jump
    pen: int | None = None


def code_step(coder: Coder, axes: list[Memory], step: Step) -> None:
    streak = [axis.run if axis.last else 0 for axis in axes]
    m = max((0, 1, 2), key=lambda k: (streak[k], -k))
    b, c = (m + 1) % 3, (m + 2) % 3
    for k in (m, b, c):
        axis, moves = axes[k], abs(step[k])
        if k == m:
            coder.bit(moves, 42 + 8 * min(streak[m], 3) + min(max(streak[b], streak[c]), 7))
        elif step[m]:
            bits = [1 - bit if axis.last else bit for bit in axis.past[1:]]
            h = sum(bit << i for i, bit in enumerate(bits))
            d = min(max(axis.run - axis.prev2, -2), 1) + 2
            r = 64 * axis.last + 16 * d + (8 if axis.prev > 1 else 0) + min(axis.run, 7)
            coder.bit(moves ^ axis.last, 74 + h, 138 + r)
        elif k == b or step[b]:
            coder.bit(moves, 18 + min(streak[k], 7))
        if moves and not axis.way:
            coder.plain(int(step[k] < 0), 1)
        elif moves:
            coder.bit(int(step[k] != axis.way), 26 + (0 if axis.last else min(axis.run, 15)))
        if moves:
            axis.way = step[k]
    for axis, way in zip(axes, step, strict=True):
        moved = abs(way)
        axis.past = [moved, *axis.past[:6]]
        if moved == axis.last:
            axis.run = min(axis.run + 1, 255)
        else:
            axis.prev2, axis.prev, axis.run, axis.last = axis.prev, axis.run, 1, moved


def code(pieces: list[Piece], sides: tuple[int, int, int], name: str) -> bytes:
    coder = Coder()
    axes = [Memory() for _ in range(3)]
    for number, piece in enumerate(pieces):
        coder.bit(1, 0)
        if number:
            coder.bit(int(piece.start is not None), 1)
        coder.bit(int(piece.pen is not None), 2)
        if piece.pen is not None:
            coder.plain(piece.pen, 1 if name == "mono1" else 8 * FORMATS[name].size)
        if piece.start is not None:
            axes = [Memory() for _ in range(3)]
            for place, side in zip(piece.start, sides, strict=True):
                coder.plain(place, (side - 1).bit_length())
        coder.number(len(piece.steps))
        for step in piece.steps:
            code_step(coder, axes, step)
    coder.bit(0, 0)
    return coder.end()


def drawn(pieces: list[Piece], sides: tuple[int, int, int], name: str, pen: int) -> bytes:
    size = FORMATS[name].size
    pixels = bytearray(sides[0] * sides[1] * sides[2] * size)
    place = (0, 0, 0)
    for piece in pieces:
        pen = pen if piece.pen is None else piece.pen
        voxels = []
        if piece.start is not None:
            place = piece.start
            voxels.append(place)
        for step in piece.steps:
            place = tuple(a + b for a, b in zip(place, step, strict=True))
            voxels.append(place)
        for x, y, z in voxels:
            at = (x + sides[0] * (y + sides[1] * z)) * size
            pixels[at : at + size] = pen.to_bytes(size, "little")
    return bytes(pixels)


STEPS = [step for step in product((-1, 0, 1), repeat=3) if any(step)]


def curve(rng: random.Random, sides: tuple[int, int, int], name: str) -> list[Piece]:
    """Draw pieces that go on as they went, mostly, and stay on the grid."""
    pieces = []
    place = (0, 0, 0)
    for number in range(rng.randrange(6)):
        start = None
        if not number or rng.random() < 0.5:
            start = place = tuple(rng.randrange(side) for side in sides)
        top = 2 if name == "mono1" else 256 ** FORMATS[name].size
        pen = rng.randrange(top) if rng.random() < 0.5 else None
        steps = []
        favourites = rng.sample(STEPS, 2)
        for _ in range(rng.choice((0, 1, 5, 100, 400))):
            step = rng.choice(favourites if rng.random() < 0.95 else STEPS)
            goes = tuple(a + b for a, b in zip(place, step, strict=True))
            if not all(0 <= a < side for a, side in zip(goes, sides, strict=True)):
                favourites = rng.sample(STEPS, 2)
                continue
            steps.append(step)
            place = goes
        pieces.append(Piece(steps, start, pen))
    return pieces


def unpack(ops: bytes, sides: tuple[int, int, int], name: str) -> Page:
    config = Config(sides, name)
    page = Page(config.shape.volume, config.pixels.size)
    OpDecoder(config.shape, config.pixels, config.feature_bits).draw(b"\x11\0\0" + ops, page)
    return page


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("sides", GRIDS)
def test_what_a_host_codes_is_drawn(name: str, sides: tuple[int, int, int]) -> None:
    rng = random.Random(f"{name} {sides}")
    for _ in range(25):
        pieces = curve(rng, sides, name)
        pen = 1 if name == "mono1" else rng.randrange(256 ** FORMATS[name].size)
        before = b"\1" + pen.to_bytes(FORMATS[name].size, "little")
        ops = before + b"\x58" + code(pieces, sides, name)
        page = unpack(ops, sides, name)
        expected = Page(page.volume, page.pixel_size)
        expected.put(0, drawn(pieces, sides, name, pen))
        assert (page.pixels, page.digest) == (expected.pixels, expected.digest)
        with pytest.raises(PacketError) as refusal:
            unpack(ops + b"\0", sides, name)
        assert (refusal.value.code, refusal.value.offset) == (PADDING, 3 + len(before))


@pytest.mark.parametrize("count", [0, 1, 2, 3, 254, 255, 257, 32_767])
def test_numbers_of_every_length(count: int) -> None:
    """A run is remembered as 255 at most."""
    sides = (300, 2, 1)
    steps = [(1, 0, 0)] * min(count, 299)
    steps += [(0, 1 if k % 2 == 0 else -1, 0) for k in range(count - len(steps))]
    pieces = [Piece(steps, (0, 0, 0)), Piece([], None, 1), Piece([], (299, 1, 0))]
    ops = b"\x58" + code(pieces, sides, "mono1")
    assert unpack(ops, sides, "mono1").pixels == drawn(pieces, sides, "mono1", 1)


def test_the_longest_number() -> None:
    coder = Coder()
    for value in (65_534, 0, 32_766, 32_767, 1):
        coder.number(value)
    bits = RangeDecoder(coder.end(), AssertionError, 266, 2, 6)
    assert [bits.number() for _ in range(5)] == [65_534, 0, 32_766, 32_767, 1]
    assert bits.exhausted


def test_long_runs_are_remembered_as_255() -> None:
    sides = (1, 700, 2)
    way = [(0, 1, 0)] * 600 + [(0, 0, 1)] + [(0, -1, 0)] * 300 + [(0, 0, -1), (0, -1, 0)]
    pieces = [Piece(way, (0, 0, 0))]
    ops = b"\x58" + code(pieces, sides, "index8")
    assert unpack(ops, sides, "index8").pixels == drawn(pieces, sides, "index8", 255)


def test_an_empty_one_draws_nothing() -> None:
    assert code([], (3, 5, 7), "index8") == b"\0"
    assert not any(unpack(b"\x58\0", (3, 5, 7), "index8").pixels)


def test_what_is_cut_off_is_refused() -> None:
    """What decoding meets first: the bytes that are read as 00 may lead off the grid, or end."""
    rng = random.Random(6)
    sides = (17, 64, 40)
    seen = set()
    for _ in range(10):
        ops = code(curve(rng, sides, "rgb565"), sides, "rgb565")
        for size in range(max(0, len(ops) - 20), len(ops)):
            with pytest.raises(PacketError) as refusal:
                unpack(b"\x58" + ops[:size], sides, "rgb565")
            assert refusal.value.offset == 3
            seen.add(refusal.value.code)
    assert seen == {TRUNCATED, OUTSIDE}


@pytest.mark.parametrize(
    ("start", "step"),
    [((3, 0, 0), None), ((0, 5, 0), None), ((0, 0, 7), None)]
    + [((2, 4, 6), way) for way in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    + [((0, 0, 0), way) for way in ((-1, 0, 0), (0, -1, 0), (0, 0, -1))],
)
def test_off_the_grid_is_refused(start: Step, step: Step | None) -> None:
    ops = code([Piece([step] if step else [], start)], (3, 5, 7), "index8")
    with pytest.raises(PacketError) as refusal:
        unpack(b"\xa0\x58" + ops, (3, 5, 7), "index8")
    assert (refusal.value.code, refusal.value.offset) == (OUTSIDE, 4)


@given(st.binary(max_size=80), st.sampled_from(sorted(FORMATS)), st.sampled_from(GRIDS))
@settings(deadline=None, max_examples=200)
def test_no_bytes_write_outside_the_page(
    ops: bytes, name: str, sides: tuple[int, int, int]
) -> None:
    config = Config(sides, name)
    page = Page(config.shape.volume, config.pixels.size)
    unpacker = OpDecoder(Grid(*sides), config.pixels, 1 << spec.FEATURE_ARC)
    code = None
    try:
        unpacker.draw(b"\x11\0\0\x58" + ops, page)
    except PacketError as refusal:
        code = refusal.code
    assert code in (None, TRUNCATED, PADDING, OUTSIDE)
    assert len(page.pixels) == config.shape.volume * config.pixels.size
    if name == "mono1":
        assert max(page.pixels) <= 1
