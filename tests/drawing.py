"""Pages that payloads draw, by the emulator or the plain decoder; a brute-force segmenter."""

from __future__ import annotations

import itertools

import numpy as np
from plain_decoder import PlainDecoder

from firmware_sim.config import Config
from firmware_sim.grid import Grid as DeviceGrid
from firmware_sim.memory import FORMATS, Page
from firmware_sim.op_decoder import OpDecoder
from voxdisplay.raster.pixel_format import PixelFormat

HEADER = bytes(3)


def page_after(payloads, grid, pixel_format):
    """Return the emulator's page after the payloads, each in a packet of its own."""
    shape, format_ = DeviceGrid(*grid), FORMATS[pixel_format.value]
    page = Page(shape.volume, format_.size)
    bits = Config(tuple(grid), pixel_format.value).feature_bits
    unpacker = OpDecoder(shape, format_, bits)
    for payload in payloads:
        unpacker.draw(HEADER + payload, page)
    return page


def values_of(page, pixel_format):
    """Return the pixel values of a page in scan order."""
    raw = np.frombuffer(page.pixels, dtype=np.uint8).reshape(-1, pixel_format.bytes)
    return (raw.astype(np.uint32) << np.arange(pixel_format.bytes, dtype=np.uint32) * 8).sum(axis=1)


def fits_one_octant(steps):
    """Return whether one octant has all steps, by trying all 24."""
    return any(
        all(
            step[main] == 1 - 2 * falls[main]
            and all(move in (0, 1 - 2 * fall) for move, fall in zip(step, falls, strict=True))
            for step in steps
        )
        for main in range(3)
        for falls in itertools.product((0, 1), repeat=3)
    )


def fewest_segments(voxels, pens, longest=256):
    """Return the least number of segments and lone voxels, by trying every cut of each chain."""
    chains = [[]]
    for here, there, pen, next_pen in zip(voxels, voxels[1:], pens, pens[1:], strict=False):
        step = tuple(int(b) - int(a) for a, b in zip(here, there, strict=True))
        if pen == next_pen and max(map(abs, step)) == 1:
            chains[-1].append(step)
        else:
            chains.append([])
    return sum(max(1, _fewest_cuts(steps, longest)) for steps in chains)


def _fewest_cuts(steps, longest):
    """Return the least number of segments of consecutive steps."""
    best = [0] + [len(steps)] * len(steps)
    for end in range(1, len(steps) + 1):
        for first in range(max(0, end - longest), end):
            if fits_one_octant(steps[first:end]):
                best[end] = min(best[end], best[first] + 1)
    return best[-1]


def decode_plainly(payloads, grid, pixel_format, base=None):
    """Return the plain decoder after the payloads, each in its own packet, from a base page."""
    mono = pixel_format is PixelFormat.MONO1
    page = None if base is None else [int(value) for value in base]
    decoder = PlainDecoder(grid, pixel_format.bytes, pixel_format.full, mono=mono, page=page)
    for payload in payloads:
        decoder.draw(payload)
    return decoder


def chains_in(payload, grid, pixel_format):
    """Return the ops of a payload of chains as (op, octant, steps)."""
    size = 1 if max(grid) <= 256 else 2
    at, found = 0, []
    while at < len(payload):
        op = payload[at]
        at += 1
        if op == 0x01:
            found.append(("PEN", None, None))
            at += pixel_format.bytes
        elif op == 0x02:
            at += 3 * size
        elif op & 0xE0 == 0x80:
            while op & 31 == 31 and payload[at] >= 0x80:
                at += 1
            at += op & 31 == 31
        elif op == 0xA0:
            found.append(("LONE", None, 0))
        else:
            fresh = op & 0xE0 == 0x40
            assert fresh or op & 0xE0 == 0x20
            at += 3 * size * fresh
            steps = payload[at] + 1
            found.append(("FROM" if fresh else "STEP", op & 31, steps))
            at += 1 + -(-steps // 4)
    assert at == len(payload)
    return found


SEGMENTS = {"LONE", "FROM", "STEP"}


def segments_in(payloads, grid, pixel_format):
    return [
        op
        for payload in payloads
        for op in chains_in(payload, grid, pixel_format)
        if op[0] in SEGMENTS
    ]
