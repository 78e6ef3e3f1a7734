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
from firmware_sim.sparse_pixels import BLOCK, BLOCK_BITS, SparsePixels


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


# Large volumes

IN_LITTLE_MEMORY = """
import resource, sys
from array import array
from firmware_sim.grid import Grid
from firmware_sim.memory import FORMATS, Memory

before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
grid = Grid(1024, 1024, 1024)
memory = Memory(grid, FORMATS["rgb888"])
{}
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.parametrize(
    "acts",
    [
        """
for frame in range(6):
    memory.begin_frame(dark=frame % 3 == 0)
    memory.back.plot(array("Q", range(frame, 1 << 30, 1 << 20)), b"abc")
    memory.swap()
assert memory.front.stored.read(5 + (1000 << 20), 1) == b"abc"
""",
        """
memory.back.put(1 << 29, b"abc")
memory.back.fill([0], grid.volume, bytes(3))  # dark, whatever it was
memory.back.fill(range(0, grid.volume, 1024), 1024, bytes(3))
assert memory.back.digest == 0
assert memory.back.stored == memory.front.stored
""",
        """
from firmware_sim.page_encoder import encode_page
memory.back.put(1 << 29, b"abc")
covered, ops = encode_page(memory.back, FORMATS["rgb888"], 0, grid.volume, 1024)
assert covered == grid.volume
assert len(ops) == 6 + 4 + 6, ops  # SKIP, LIT, SKIP
""",
        """
import os, pathlib, tempfile
import firmware_sim.bench, firmware_sim.config, firmware_sim.device, firmware_sim.npy
device = firmware_sim.device.Device(firmware_sim.config.Config(grid.sides))
device.memory.front.put(grid.volume - 1, b"abc")
with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder, "front.npy")
    firmware_sim.npy.write_npy(path, firmware_sim.bench.Bench(device).snapshot())
    found = path.stat()
    with path.open("rb") as file:
        file.seek(-3, os.SEEK_END)
        assert file.read() == b"abc"
assert found.st_size == 128 + 3 * grid.volume
assert found.st_blocks * 512 < 1 << 20, found
""",
    ],
    ids=["draw", "darken", "read", "dump"],
)
def test_a_large_volume_costs_what_is_lit(acts: str) -> None:
    script = IN_LITTLE_MEMORY.format(acts)
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert int(run.stdout) < 50 << 10  # KiB; the volume has 3 GiB


def test_memory_of_a_bright_frame_is_given_back() -> None:
    page = Page(1 << 23, 3)
    page.fill([0], 1 << 23, b"abc")
    assert page.digest
    for _ in range(2):  # the first frame behind it may need as much
        page.clear()
        page.put(9, b"abc")
    assert len(page.stored._table.pool) <= 1 << 22
    assert page.pixels[27:30] == b"abc"
    assert page.pixels.count(0) == 3 * (1 << 23) - 3


@given(st.data())
@settings(deadline=None, max_examples=100)
def test_sparse_pixels_are_those_of_a_dense_array(data: st.DataObject) -> None:
    size = data.draw(st.sampled_from((1, 2, 3)))
    volume = data.draw(st.sampled_from((1, 105, BLOCK, BLOCK + 1, 20 * BLOCK - 3)))
    sparse, other = SparsePixels(volume, size), SparsePixels(volume, size)
    dense, dense_other = bytearray(volume * size), bytearray(volume * size)
    for _ in range(data.draw(st.integers(1, 8))):
        what = data.draw(st.sampled_from(("run", "many", "clear", "copy", "blocks", "turn")))
        if what == "run":
            start = data.draw(st.integers(0, volume - 1))
            count = data.draw(st.integers(1, volume - start))
            pixels = data.draw(st.sampled_from((b"\0", b"\1", b"\xff"))) * (count * size)
            place = slice(start * size, (start + count) * size)
            assert sparse.exchange_run(start, pixels) == dense[place]
            dense[place] = pixels
        elif what == "many":
            indices = array("Q", data.draw(st.sets(st.integers(0, volume - 1))))
            pixel = data.draw(st.binary(min_size=size, max_size=size))
            before = b"".join(dense[i * size : (i + 1) * size] for i in indices)
            assert sparse.exchange(indices, pixel) == before
            for i in indices:
                dense[i * size : (i + 1) * size] = pixel
        elif what == "clear":
            sparse.clear()
            dense = bytearray(len(dense))
        elif what == "turn":
            sparse, other, dense, dense_other = other, sparse, dense_other, dense
        else:
            differing = {
                at // size >> BLOCK_BITS for at in range(len(dense)) if dense[at] != dense_other[at]
            }
            sparse.copy_from(other, differing if what == "blocks" else None)
            dense[:] = dense_other
    assert bytes(sparse) == dense
    assert b"".join(sparse.dense_pieces()) == dense
    assert (sparse == other) == (dense == dense_other)
    assert sparse == sparse.copy()
    start = data.draw(st.integers(0, volume - 1))
    count = data.draw(st.integers(0, volume - start))
    assert sparse.read(start, count) == dense[start * size : (start + count) * size]
    assert not any(dense[start * size : sparse.next_stored(start, volume) * size])
    from_pieces = bytearray(len(dense))
    for start, pixels in sparse.pieces():
        from_pieces[start * size : start * size + len(pixels)] = pixels
    assert from_pieces == dense


def test_arrays_of_other_sizes_differ() -> None:
    assert SparsePixels(3, 1) != SparsePixels(4, 1)
    assert SparsePixels(3, 1) != SparsePixels(3, 2)
    assert SparsePixels(3, 1) != bytes(3)
