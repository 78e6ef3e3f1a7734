"""The ops of a DATA packet, drawn straight into a page (7).

It knows nothing of frames and sessions. It writes nowhere but on the page that it is given, and
on that only what is on the grid.
"""

from array import array
from itertools import accumulate
from typing import Final

from firmware_sim import spec
from firmware_sim.grid import Grid
from firmware_sim.memory import Page, PixelFormat
from firmware_sim.refusal import Refusal

_OPERAND: Final = 0x1F  # the low five bits of an op byte
_COUNT_BYTES: Final = 5  # section 7.2: the longest LEB128
_COUNT_LIMIT: Final = 1 << 32  # section 7.2: n MUST be below

# The four crumbs of a byte, and the eight pixels of MONO1: a byte each, the lowest bits first.
_CRUMBS: Final = [bytes(byte >> k & 3 for k in (0, 2, 4, 6)) for byte in range(256)]
_BITS: Final = [bytes(byte >> k & 1 for k in range(8)) for byte in range(256)]


def unpack(packet: bytes, grid: Grid, pixel_format: PixelFormat, page: Page) -> None:
    """Draw the ops of a packet.

    Parameters
    ----------
    packet
        Header and payload of a DATA packet.
    grid, pixel_format
        Those of the page.
    page
        Where to draw.

    Raises
    ------
    Refusal
        At the first fault, when the ops before it have been drawn.
    """
    _Decoder(packet, grid, pixel_format, page).run()


class _Decoder:
    """Decoder of one packet: a place in the packet, a cursor and a pen."""

    def __init__(self, packet: bytes, grid: Grid, pixel_format: PixelFormat, page: Page) -> None:
        self._packet = packet
        self._grid = grid
        self._format = pixel_format
        self._page = page
        self._at = len(spec.LAYOUT_HEADER)  # its three fields have a byte each
        self._op_at = self._at
        self._cursor = 0
        self._pen = pixel_format.full

    def run(self) -> None:
        packet = self._packet
        while self._at < len(packet):
            op = packet[self._at]
            self._op_at = self._at
            self._at += 1
            kind, operand = op & ~_OPERAND, op & _OPERAND
            if kind == spec.OP_STEP and operand <= spec.LIMIT_MAX_OCTANT:
                self._walk(operand, *self._crumbs())
            elif kind == spec.OP_FROM and operand <= spec.LIMIT_MAX_OCTANT:
                target = self._coordinates()
                crumbs = self._crumbs()
                self._move(target)
                self._walk(operand, *crumbs)
            elif kind == spec.OP_SKIP:
                self._cursor += self._room(self._count(operand))
            elif kind == spec.OP_RUN:
                self._write(self._pen * self._room(self._count(operand)))
            elif kind == spec.OP_LIT:
                self._literal(self._count(operand))
            elif op == spec.OP_PEN:
                self._dip()
            elif op == spec.OP_MOVE:
                self._move(self._coordinates())
            elif op == spec.OP_END:
                self._finish()
            else:
                raise self._refusal(spec.CODE_OP, f"op {op:02X} is reserved")

    def _refusal(self, code: int, text: str) -> Refusal:
        return Refusal(code, self._op_at, text)

    # Operands

    def _take(self, size: int) -> bytes:
        start = self._at
        self._at += size
        if self._at > len(self._packet):
            raise self._refusal(spec.CODE_TRUNCATED, "the payload ends inside the op")
        return self._packet[start : self._at]

    def _coordinates(self) -> tuple[int, int, int]:
        size = self._grid.coordinate_size
        raw = self._take(3 * size)
        x, y, z = (int.from_bytes(raw[k : k + size], "little") for k in range(0, 3 * size, size))
        return x, y, z

    def _count(self, operand: int) -> int:
        """Return the count of a SKIP, RUN or LIT (7.2)."""
        if operand < _OPERAND:
            return operand + 1
        count = 0
        for k in range(_COUNT_BYTES):
            byte = self._take(1)[0]
            count |= (byte & 0x7F) << 7 * k
            if byte < 0x80:
                break
        else:
            raise self._refusal(spec.CODE_COUNT, "the count has more than 5 bytes")
        if k and not byte:
            raise self._refusal(spec.CODE_COUNT, "the count is not in its shortest form")
        count += _OPERAND + 1
        if count >= _COUNT_LIMIT:
            raise self._refusal(spec.CODE_COUNT, "the count is 2^32 or more")
        return count

    def _crumbs(self) -> tuple[int, bytes]:
        """Return the number of steps of a chain and the bytes of its crumbs (7.1)."""
        count = self._take(1)[0] + 1
        raw = self._take((count + 3) // 4)
        if count % 4 and raw[-1] >> count % 4 * 2:
            raise self._refusal(spec.CODE_PADDING, "unused crumbs are not 0")
        return count, raw

    def _room(self, count: int) -> int:
        """Return a count, if so many voxels follow from the cursor on."""
        if count > self._grid.volume - self._cursor:
            raise self._refusal(spec.CODE_OUTSIDE, f"{count} voxels from {self._cursor} on")
        return count

    # Ops

    def _finish(self) -> None:
        rest = self._take(len(self._packet) - self._at)
        if rest.count(0) < len(rest):
            raise self._refusal(spec.CODE_PADDING, "bytes behind END are not 0")

    def _dip(self) -> None:
        pixel = self._take(self._format.size)
        if self._format.code == spec.FORMAT_MONO1 and pixel[0] > 1:
            raise self._refusal(spec.CODE_PIXEL, "a pixel of MONO1 is 00 or 01")
        self._pen = pixel

    def _move(self, target: tuple[int, int, int]) -> None:
        index = self._grid.index(*target)
        if index is None:
            raise self._refusal(spec.CODE_OUTSIDE, "({}, {}, {})".format(*target))
        self._cursor = index

    def _walk(self, octant: int, count: int, raw: bytes) -> None:
        self._room(1)
        crumbs = int.from_bytes(raw, "little")
        every_other = (4**count - 1) // 3  # 0101...01, a one for each crumb
        moves = (
            count,
            (crumbs & every_other).bit_count(),
            (crumbs >> 1 & every_other).bit_count(),
        )
        if self._grid.leaves(self._cursor, octant, moves):
            raise self._refusal(spec.CODE_OUTSIDE, "a step leaves the grid")
        steps = self._grid.steps(octant)
        path = b"".join([_CRUMBS[byte] for byte in raw])[:count]
        indices = accumulate(map(steps.__getitem__, path), initial=self._cursor)
        chain = array("Q", indices)
        self._page.plot(chain, self._pen)
        self._cursor = chain[-1]

    def _literal(self, count: int) -> None:
        if self._format.code == spec.FORMAT_MONO1:
            raw = self._take((count + 7) // 8)
            if count % 8 and raw[-1] >> count % 8:
                raise self._refusal(spec.CODE_PADDING, "unused bits of the pixel run are not 0")
            pixels = b"".join([_BITS[byte] for byte in raw])[:count]
        else:
            pixels = self._take(count * self._format.size)
        self._room(count)
        self._write(pixels)
        self._pen = pixels[-self._format.size :]

    def _write(self, pixels: bytes) -> None:
        self._page.put(self._cursor, pixels)
        self._cursor += len(pixels) // self._format.size
