"""The ops of a PAGE: pixels in scan order as SKIP, RUN, LIT and PEN (7, 10).

It reads a page and knows nothing of packets.
"""

import re
from typing import Final

from firmware_sim import spec
from firmware_sim.memory import Page, PixelFormat

_SHORT: Final = 31  # section 7.2: counts up to this stand in the op byte
_MARGIN: Final = 11  # more than one stretch can need: a pixel, two op bytes, two counts
_CHUNK: Final = 24  # MONO1: so many pixels are looked at for a LIT, 3 bytes
_DIGITS: Final = bytes.maketrans(b"\0\1", b"01")
_DARK: Final = re.compile(rb"\0*+")
_SAME: Final = {  # a pixel and its repetitions
    size: re.compile(rb"(?s:(.{%d})\1*+)" % size) for size in (1, 2, 3)
}


def encode_page(
    page: Page, pixel_format: PixelFormat, start: int, count: int, room: int
) -> tuple[int, bytes]:
    """Describe pixels by ops, as many as fit.

    Parameters
    ----------
    page
        Where the pixels stand.
    pixel_format
        Their format.
    start, count
        Index of the first voxel, and how many voxels; all on the grid.
    room
        Bytes that the ops may have, at least 12.

    Returns
    -------
    covered : int
        How many voxels the ops cover, 1 to `count`.
    ops : bytes
        The ops, at most `room` bytes.
    """
    size = pixel_format.size
    writer = _OpWriter(pixel_format)
    at, end = start * size, (start + count) * size
    while at < end and writer.size + _MARGIN <= room:
        at += writer.add(page.pixels, at, end)
    writer.close_literal()
    return at // size - start, bytes(writer.ops)


class _OpWriter:
    """Writes ops; the last of them may be an open LIT, to which pixels are still added."""

    def __init__(self, pixel_format: PixelFormat) -> None:
        self._size = pixel_format.size
        self._mono = pixel_format.code == spec.FORMAT_MONO1
        self._cheap = 8 if self._mono else 1 // self._size  # pixels that one byte of a LIT holds
        self._pen = pixel_format.full
        self._literal = bytearray()  # pixels of the open LIT
        self.ops = bytearray()

    @property
    def size(self) -> int:
        """Bytes of all ops, the open LIT as it is now included."""
        if not self._literal:
            return len(self.ops)
        count = len(self._literal) // self._size
        return len(self.ops) + len(_op(spec.OP_LIT, count)) + self._run_size(count)

    def _run_size(self, count: int) -> int:
        """Return the bytes of a pixel run (2.1)."""
        return (count + 7) // 8 if self._mono else count * self._size

    def add(self, pixels: bytearray, at: int, end: int) -> int:
        """Describe a stretch of pixels that begins at a place in memory; return its bytes."""
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

    def _extend_literal(self, pixels: bytearray) -> None:
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


def _prefers_literal(pixels: bytearray) -> bool:
    """Tell whether pixels of MONO1 need fewer bytes as a LIT than as SKIPs and RUNs."""
    ops = 1 + pixels.count(b"\0\1") + pixels.count(b"\1\0")
    return ops > 1 + (len(pixels) + 7) // 8


def _length(pattern: re.Pattern[bytes], pixels: bytearray, at: int, end: int) -> int:
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
