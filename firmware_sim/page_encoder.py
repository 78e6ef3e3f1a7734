"""Encoder of the ops of a PAGE: pixels in scan order as SKIP, RUN, LIT and PEN (7, 10).

Reads a page; knows nothing of packets.
"""

import mmap
import re
from typing import Final

from firmware_sim import spec
from firmware_sim.memory import Page, PixelFormat

_SHORT: Final = 31  # section 7.2: largest count that fits the op byte
_MARGIN: Final = 11  # most bytes that one stretch can need: a pixel, two op bytes, two counts
_CHUNK: Final = 24  # MONO1: number of pixels to consider for a LIT, 3 bytes
_DIGITS: Final = bytes.maketrans(b"\0\1", b"01")
_DARK: Final = re.compile(rb"\0*+")
_SAME: Final = {  # a pixel and its repetitions
    size: re.compile(rb"(?s:(.{%d})\1*+)" % size) for size in (1, 2, 3)
}


def encode_page(
    page: Page, pixel_format: PixelFormat, start: int, count: int, room: int
) -> tuple[int, bytes]:
    """Encode a range of pixels, as many as fit.

    Parameters
    ----------
    page
        The page.
    pixel_format
        The format of its pixels.
    start, count
        Index of the first voxel, and number of voxels; all on the grid.
    room
        Most bytes that the ops may have, at least 12.

    Returns
    -------
    covered : int
        Number of voxels that the ops cover, 1 to `count`.
    ops : bytes
        The ops, at most `room` bytes.
    """
    size = pixel_format.size
    writer = _OpWriter(pixel_format)
    at, end = start * size, (start + count) * size
    while at < end and writer.size + _MARGIN <= room:
        at += writer.add(page.memory, at, end)
    writer.close_literal()
    return at // size - start, bytes(writer.ops)


class _OpWriter:
    """Writer of ops; the last may be an open LIT, to which pixels are still added."""

    def __init__(self, pixel_format: PixelFormat) -> None:
        self._size = pixel_format.size
        self._mono = pixel_format.code == spec.FORMAT_MONO1
        self._cheap = 8 if self._mono else 1 // self._size  # pixels per byte of a LIT
        self._pen = pixel_format.full
        self._literal = bytearray()  # pixels of the open LIT
        self.ops = bytearray()

    @property
    def size(self) -> int:
        """Number of bytes of all ops, including the open LIT."""
        if not self._literal:
            return len(self.ops)
        count = len(self._literal) // self._size
        return len(self.ops) + len(_op(spec.OP_LIT, count)) + self._run_size(count)

    def _run_size(self, count: int) -> int:
        """Return the number of bytes of a pixel run (2.1)."""
        return (count + 7) // 8 if self._mono else count * self._size

    def add(self, pixels: mmap.mmap, at: int, end: int) -> int:
        """Encode a stretch of equal pixels at an offset in memory; return its length in bytes."""
        size = self._size
        if self._mono and _prefers_literal(chunk := pixels[at : min(at + _CHUNK, end)]):
            self._extend_literal(chunk)
            return len(chunk)
        pixel = pixels[at : at + size]
        dark = not any(pixel)
        stretch = _length(_DARK if dark else _SAME[size], pixels, at, end)
        count = stretch // size  # the zeros at the end of a dark one may belong to the next pixel
        if self._literal and count <= self._cheap:
            self._extend_literal(pixel * count)
        elif dark:
            self._append_op(spec.OP_SKIP, count)
        elif pixel == self._pen:
            self._append_op(spec.OP_RUN, count)
        elif count == 1:
            self._extend_literal(pixel)
        elif self._literal:
            self._extend_literal(pixel)
            self._append_op(spec.OP_RUN, count - 1)
        else:
            self.ops.append(spec.OP_PEN)
            self.ops += pixel
            self._pen = bytes(pixel)
            self._append_op(spec.OP_RUN, count)
        return count * size

    def _extend_literal(self, pixels: bytes) -> None:
        self._literal += pixels
        self._pen = bytes(pixels[-self._size :])

    def _append_op(self, op: int, count: int) -> None:
        self.close_literal()
        self.ops += _op(op, count)

    def close_literal(self) -> None:
        """Write out the open LIT."""
        if not self._literal:
            return
        count = len(self._literal) // self._size
        self.ops += _op(spec.OP_LIT, count)
        if self._mono:
            bits = int(self._literal[::-1].translate(_DIGITS), 2)
            self.ops += bits.to_bytes(self._run_size(count), "little")
        else:
            self.ops += self._literal
        self._literal.clear()


def _prefers_literal(pixels: bytes) -> bool:
    """Return whether pixels of MONO1 need fewer bytes as a LIT than as SKIPs and RUNs."""
    ops = 1 + pixels.count(b"\0\1") + pixels.count(b"\1\0")
    return ops > 1 + (len(pixels) + 7) // 8


def _length(pattern: re.Pattern[bytes], pixels: mmap.mmap, at: int, end: int) -> int:
    match = pattern.match(pixels, at, end)
    return match.end() - at if match else 0


def _op(op: int, count: int) -> bytes:
    """Return an op with its count (7.2)."""
    if count <= _SHORT:
        return bytes((op | count - 1,))
    ops = bytearray((op | _SHORT,))
    count -= _SHORT + 1
    while count > 0x7F:
        ops.append(count & 0x7F | 0x80)
        count >>= 7
    ops.append(count)
    return bytes(ops)
