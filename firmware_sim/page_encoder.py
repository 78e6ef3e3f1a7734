"""Encoder of the ops of a PAGE: pixels in scan order as SKIP, RUN, LIT and PEN (7, 10).

Reads a page; knows nothing of packets.
"""

import re
from typing import Final

from firmware_sim import spec
from firmware_sim.memory import Page, PixelFormat
from firmware_sim.sparse_pixels import SparsePixels

_SHORT: Final = 31  # section 7.2: largest count that fits the op byte
_MARGIN: Final = 11  # most bytes that one stretch can need: a pixel, two op bytes, two counts
_CHUNK: Final = 24  # MONO1: number of pixels to consider for a LIT, 3 bytes
_WINDOW: Final = 4096  # number of pixels to look at in one piece
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
    writer = _OpWriter(pixel_format)
    pixels = _PixelReader(page.stored, start, start + count)
    while pixels.at < pixels.end and writer.size + _MARGIN <= room:
        pixels.at += writer.add(pixels)
    writer.close_literal()
    return pixels.at - start, bytes(writer.ops)


class _PixelReader:
    """Cursor in a range of pixels, with a window of them in one piece.

    Parameters
    ----------
    stored
        All pixels of the page.
    at, end
        The range.
    """

    def __init__(self, stored: SparsePixels, at: int, end: int) -> None:
        self._stored = stored
        self._size = stored.pixel_size
        self._load(at, end)
        self.at = at
        self.end = end

    def _load(self, start: int, end: int) -> None:
        self._start, self._stop = start, min(start + _WINDOW, end)
        self._window = self._stored.read(start, self._stop - start)

    def peek(self, count: int) -> bytes:
        """Return the next pixels: `count` of them, or as many as there are."""
        stop = min(self.at + count, self.end)
        if stop > self._stop:
            self._load(self.at, self.end)
        size = self._size
        return self._window[(self.at - self._start) * size : (stop - self._start) * size]

    def stretch(self) -> tuple[bytes, bool, int]:
        """Return the next pixel, whether it is dark, and the number of equal ones from it on."""
        # It is in the window: a stretch that ends with the window has loaded the next one.
        at, size = self.at, self._size
        offset = (at - self._start) * size
        pixel = self._window[offset : offset + size]
        lit = any(pixel)
        pattern = _SAME[size] if lit else _DARK
        match = pattern.match(self._window, offset)
        # The zeros at the end of a dark stretch may belong to the next pixel.
        count = (match.end() - offset) // size if match else 0
        if at + count == self._stop < self.end:
            count = self._extend(pixel, pattern) - at
        return pixel, not lit, count

    def _extend(self, pixel: bytes, pattern: re.Pattern[bytes]) -> int:
        """Return where a stretch ends that goes on to the end of the window."""
        stop = self._stop
        while stop == self._stop < self.end:
            if pattern is _DARK:
                stop = self._stored.next_stored(stop, self.end)
                if stop == self.end:
                    break
            self._load(stop, self.end)
            if self._window[: self._size] != pixel:
                break
            match = pattern.match(self._window)
            stop = self._start + (match.end() if match else 0) // self._size
        return stop


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

    def add(self, pixels: _PixelReader) -> int:
        """Encode a stretch of equal pixels at the reader's cursor; return its length in pixels."""
        if self._mono and _prefers_literal(chunk := pixels.peek(_CHUNK)):
            self._extend_literal(chunk)
            return len(chunk)
        pixel, dark, count = pixels.stretch()
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
        return count

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
