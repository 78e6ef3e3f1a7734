"""Pages, palettes and digests of the emulator: sections 2 and 8."""

import random
import subprocess
import sys
from array import array

import pytest
from emulator_page import default_color, digest, mix
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_sim import spec
from firmware_sim.digest import mix_sum
from firmware_sim.grid import Grid
from firmware_sim.memory import DEFAULT_PALETTE, FORMATS, Memory, Page


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
        assert mix_sum(indices, pixels, size) == expected % 2**32


def test_the_largest_index_and_value_stay_in_their_lanes() -> None:
    top = spec.LIMIT_MAX_VOXELS - 1
    pixels = b"\xff" * 3 * 1024
    expected = sum(mix(top - k, 0xFFFFFF) for k in range(1024)) % 2**32
    assert mix_sum(range(top, top - 1024, -1), pixels, 3) == expected


@given(st.data())
@settings(deadline=None, max_examples=50)
def test_the_digest_is_kept_at_every_write(data: st.DataObject) -> None:
    size = data.draw(st.integers(1, 3))
    page = Page(60, size)
    expected = bytearray(60 * size)
    pixel = st.one_of(st.just(bytes(size)), st.binary(min_size=size, max_size=size))
    palette = bytearray(DEFAULT_PALETTE)
    for _ in range(data.draw(st.integers(1, 6))):
        what = data.draw(st.sampled_from(("put", "plot", "fill", "color")))
        if what == "put":
            start = data.draw(st.integers(0, 59))
            run = b"".join(data.draw(st.lists(pixel, min_size=1, max_size=60 - start)))
            page.put(start, run)
            expected[start * size : start * size + len(run)] = run
        elif what == "color":
            first = data.draw(st.integers(0, 255))
            shades = st.sampled_from((default_color(first), b"abc", b"\xff\0\0"))
            colors = b"".join(data.draw(st.lists(shades, min_size=1, max_size=256 - first)))
            page.set_colors(first, colors)
            palette[3 * first : 3 * first + len(colors)] = colors
        else:
            count = data.draw(st.integers(1, 3)) if what == "fill" else 1
            starts = data.draw(st.sets(st.integers(0, 60 - count), min_size=1))
            pen = data.draw(pixel)
            if what == "fill":
                page.fill(sorted(starts), count, pen)
            else:
                page.plot(array("Q", starts), pen)
            for i in starts:
                expected[i * size : (i + count) * size] = pen * count
        assert page.pixels == expected
        assert page.palette == palette
        if data.draw(st.booleans()):
            assert page.digest == digest(expected, size, palette)
    assert page.digest == digest(expected, size, palette)


def test_the_digest_catches_up_with_many_writes() -> None:
    rng = random.Random(9)
    page = Page(9000, 2)
    for _ in range(300):
        page.put(rng.randrange(8000), rng.randbytes(2) * rng.choice((1, 100, 255, 256, 1000)))
    assert page.digest == digest(page.pixels, 2)


def test_the_default_palette() -> None:
    """Floor(255 * value + 1/2)."""
    assert b"".join(map(default_color, range(256))) == DEFAULT_PALETTE
    page = Page(8, 1)
    page.set_colors(7, b"\x01\x02\x03" + DEFAULT_PALETTE[24:27])
    assert page.digest == mix(8 + 7, 0x1030201)
    page.set_colors(0, DEFAULT_PALETTE)
    assert page.digest == 0


def test_pages_are_cleared_copied_and_exchanged() -> None:
    memory = Memory(Grid(3, 5, 7), FORMATS["rgb565"])
    memory.back.put(4, b"\x11\x22")
    memory.swap()
    memory.begin_frame(dark=False)
    assert memory.back.pixels == memory.front.pixels
    assert memory.back.digest == memory.front.digest == mix(4, 0x2211)
    memory.back.put(5, b"\x11\x22")
    assert memory.front.digest == mix(4, 0x2211)
    memory.back.set_colors(1, b"abc")
    memory.swap()
    memory.begin_frame(dark=False)
    assert memory.back.palette == memory.front.palette != DEFAULT_PALETTE
    assert memory.back.digest == memory.front.digest
    for dark in (False, True):  # of a frame that is given up nothing stays
        memory.back.put(9, b"\x33\x44")
        memory.begin_frame(dark=dark)
        assert memory.back.digest == (0 if dark else memory.front.digest)
    assert not any(memory.back.pixels)
    assert memory.back.palette == DEFAULT_PALETTE
    assert memory.back.digest == 0


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("writes", [1, 3, 40])
def test_copies_are_whole_whatever_was_written_and_given_up(name: str, writes: int) -> None:
    rng = random.Random(writes)
    grid = Grid(31, 47, 53)  # some blocks, and a part of one
    memory = Memory(grid, FORMATS[name])
    size = FORMATS[name].size
    pages = {id(memory.front): bytearray(grid.volume * size)}
    pages[id(memory.back)] = bytearray(grid.volume * size)
    for _ in range(60):
        dark = rng.random() < 0.2
        memory.begin_frame(dark)
        back, front = pages[id(memory.back)], pages[id(memory.front)]
        back[:] = bytes(len(back)) if dark else front
        for _ in range(rng.randrange(writes + 1)):
            start = rng.randrange(grid.volume - 3000)
            run = rng.choice((b"\0", b"\1")) * (size * rng.choice((1, 5, 300, 3000)))
            if rng.random() < 0.5:
                memory.back.put(start, run)
                back[start * size : start * size + len(run)] = run
            else:
                spots = sorted({rng.randrange(grid.volume) for _ in range(9)})
                memory.back.plot(array("Q", spots), b"\1" * size)
                for spot in spots:
                    back[spot * size : (spot + 1) * size] = b"\1" * size
        assert memory.back.pixels == back
        assert memory.front.pixels == front
        if rng.random() < 0.7:  # else the frame is given up
            memory.swap()
    assert memory.front.digest == digest(pages[id(memory.front)], size)


def test_a_large_volume_costs_what_is_lit() -> None:
    script = """
import resource
from array import array
from firmware_sim.grid import Grid
from firmware_sim.memory import FORMATS, Memory

before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
memory = Memory(Grid(1024, 1024, 1024), FORMATS["rgb888"])
for frame in range(6):
    memory.begin_frame(dark=frame % 3 == 0)
    memory.back.plot(array("Q", range(frame, 1 << 30, 1 << 20)), b"abc")
    memory.swap()
assert memory.front.memory[3 * (5 + (1000 << 20))] == ord("a")
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert int(run.stdout) < 100 << 10  # KiB; the volume has 3 GiB
