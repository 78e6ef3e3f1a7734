"""Decoder of the ops of a DATA packet, which draws them into a page (7).

Knows nothing of frames and sessions. Writes only to the page that it is given, and only on the
grid.
"""

from array import array
from collections.abc import Callable, Iterable
from itertools import accumulate
from typing import Final

from firmware_sim import fades, spec
from firmware_sim.grid import Grid
from firmware_sim.memory import Page, PixelFormat
from firmware_sim.operands import OPERAND_MASK, Operands
from firmware_sim.packet_error import PacketError
from firmware_sim.range_coded_chains import decode_chains
from firmware_sim.range_coded_slabs import decode_slabs
from firmware_sim.range_coded_values import decode_values
from firmware_sim.shapes import Brick, box, brick_offsets, line

# Tables by byte: its four crumbs, its eight MONO1 pixels, its two differences modulo 256. A byte
# each, those in the lowest bits first.
_CRUMBS: Final = [bytes(byte >> k & 3 for k in (0, 2, 4, 6)) for byte in range(256)]
_BITS: Final = [bytes(byte >> k & 1 for k in range(8)) for byte in range(256)]
_DIFFERENCES: Final = [
    bytes(((byte >> k & 15 ^ 8) - 8) % 256 for k in (0, 4)) for byte in range(256)
]


class OpDecoder:
    """Decoder of packets.

    Parameters
    ----------
    grid, pixel_format
        Those of the pages.
    features
        The implemented features: a bit for each ``spec.FEATURE_*``.
    """

    def __init__(self, grid: Grid, pixel_format: PixelFormat, features: int) -> None:
        self.grid = grid
        self.pixel_format = pixel_format
        self.mono = pixel_format.code == spec.FORMAT_MONO1
        self.ops = _op_table(features)
        self.steps = [grid.crumb_offsets(octant) for octant in range(spec.LIMIT_MAX_OCTANT + 1)]
        self.brick_offsets = brick_offsets(grid)

    def draw(self, packet: bytes, page: Page) -> int:
        """Draw the ops of a packet.

        Parameters
        ----------
        packet
            Header and payload of a DATA packet.
        page
            The page to draw on.

        Returns
        -------
        int
            The longest hold that they name, in ticks (7.12).

        Raises
        ------
        PacketError
            At the first invalid op; the ops before it have been drawn then.
        """
        operands = Operands(packet, self.grid.coordinate_size)
        decoder = _PacketDecoder(self, operands, page)
        while (op := operands.op()) is not None:
            draw = self.ops[op]
            if draw is None:
                raise operands.error(spec.CODE_OP, f"op {op:02X} is reserved or not announced")
            draw(decoder, op & OPERAND_MASK)
        return decoder.hold_ticks


class _PacketDecoder:
    """State of the decoder within one packet: cursor, pen, fade and hold.

    There is a method for each op; it takes the low five bits of the op byte.
    """

    def __init__(self, device: OpDecoder, operands: Operands, page: Page) -> None:
        self._device = device
        self._grid = device.grid
        self._format = device.pixel_format
        self._operands = operands
        self._page = page
        self._fade: fades.Fade | None = None
        self.hold_ticks = 0
        self._cursor = 0
        self._pen = device.pixel_format.full  # with a fade, that of its next voxel
        self._written = False  # True if the fade has written the voxel at the cursor

    # Cursor and pen, which a fade depends on (7.9)

    def _set_cursor(self, index: int) -> None:
        self._cursor = index
        self._written = False

    def _set_pen(self, pixel: bytes) -> None:
        self._pen = pixel
        self._fade = None

    def _plot_row(self, voxels: "array[int]", end: int, *, again: bool = False) -> None:
        """Write voxels in their order, and set the cursor to the end.

        Those of a fade are counted, but not the first if it is written again.
        """
        if not self._fade:
            self._page.plot(voxels, self._pen)
            self._set_cursor(end)
            return
        for voxel, pixel in self._fade.pens(voxels, again=again and self._written):
            self._page.plot(array("Q", (voxel,)), pixel)
        self._pen = self._fade.pixel
        self._set_cursor(end)
        self._written = True

    # Bounds

    def _outside_error(self, text: str) -> PacketError:
        return self._operands.error(spec.CODE_OUTSIDE, text)

    def _check_cursor(self) -> None:
        if self._cursor == self._grid.volume:
            raise self._outside_error("the cursor is behind the last voxel")

    def _check_coordinates(self, place: tuple[int, int, int]) -> None:
        if not self._grid.contains(*place):
            raise self._outside_error("({}, {}, {})".format(*place))

    def _check_room(self, count: int) -> int:
        """Return a count; raise if fewer voxels follow from the cursor on."""
        if count > self._grid.volume - self._cursor:
            raise self._outside_error(f"{count} voxels from {self._cursor} on")
        return count

    # Cursor, pen and palette

    def end(self, _: int) -> None:
        rest = self._operands.remaining()
        if rest.count(0) < len(rest):
            raise self._operands.error(spec.CODE_PADDING, "bytes behind END are not 0")

    def pen(self, _: int) -> None:
        pixel = self._operands.take(self._format.size)
        if self._device.mono and pixel[0] > 1:
            raise self._operands.error(spec.CODE_PIXEL, "a pixel of MONO1 is 00 or 01")
        self._set_pen(pixel)

    def move(self, _: int) -> None:
        place = self._operands.coordinates()
        self._check_coordinates(place)
        self._set_cursor(self._grid.index(*place))

    def hold(self, _: int) -> None:
        self.hold_ticks = max(self.hold_ticks, self._operands.byte())

    def colors(self, _: int) -> None:
        first = self._operands.byte()
        count = self._operands.byte() + 1
        colors = self._operands.take(3 * count)
        if first + count > spec.LIMIT_MAX_COLORS:
            raise self._outside_error(f"{count} colours from {first} on")
        self._page.set_colors(first, colors)

    def ramp(self, _: int) -> None:
        first = self._operands.byte()
        count = self._operands.byte() + 1
        colors = self._operands.take(3 * (self._operands.byte() + 1))
        if first + count > spec.LIMIT_MAX_COLORS:
            raise self._outside_error(f"{count} colours from {first} on")
        self._page.set_colors(first, fades.ramp(colors, count))

    def fade(self, _: int) -> None:
        stops = self._operands.byte() + 1
        count = self._operands.leb128() + 1
        if count > spec.LIMIT_MAX_FADE:
            raise self._operands.error(spec.CODE_COUNT, f"a fade of {count} voxels")
        place = self._operands.leb128()
        if place >= count:
            raise self._operands.error(spec.CODE_COUNT, f"voxel {place} of {count}")
        size = 1 if self._format.code == spec.FORMAT_INDEX8 else 3
        colors = fades.split_colors(self._operands.take(size * stops), size)
        self._fade = fades.Fade(self._format.code, fades.Blend(colors, count, place))
        self._pen = self._fade.pixel
        self._written = False

    # Chains

    def step(self, octant: int) -> None:
        count = self._operands.byte() + 1
        self._draw_chain(octant, count, self._operands.packed(count, 2))

    def from_(self, octant: int) -> None:
        place = self._operands.coordinates()
        count = self._operands.byte() + 1
        crumbs = self._operands.packed(count, 2)
        self._check_coordinates(place)
        self._set_cursor(self._grid.index(*place))
        self._draw_chain(octant, count, crumbs)

    def arc(self, _: int) -> None:
        self._draw_pieces(decode_chains(self._operands, self._grid, self._format, self._pen))

    def arc2(self, _: int) -> None:
        pen = self._fade or self._pen
        self._draw_pieces(decode_chains(self._operands, self._grid, self._format, pen, second=True))

    def _draw_pieces(self, pieces: Iterable[tuple[bytes | fades.Fade, list[int]]]) -> None:
        for pen, voxels in pieces:
            if isinstance(pen, fades.Fade):
                for voxel, pixel in pen.pens(voxels, again=False):
                    self._page.plot(array("Q", (voxel,)), pixel)
            else:
                self._page.plot(array("Q", set(voxels)), pen)

    def slabs(self, _: int) -> None:
        for voxels in decode_slabs(self._operands, self._grid):
            self._page.plot(array("Q", voxels), self._pen)

    def values(self, _: int) -> None:
        for written in decode_values(self._operands, self._grid, self._format.code):
            by_pixel: dict[bytes, array[int]] = {}
            for voxel, pixel in written:
                by_pixel.setdefault(pixel, array("Q")).append(voxel)
            for pixel, voxels in by_pixel.items():
                self._page.plot(voxels, pixel)

    def _draw_chain(self, octant: int, count: int, raw: bytes) -> None:
        self._check_cursor()
        crumbs = int.from_bytes(raw, "little")
        every_other = (4**count - 1) // 3  # 0101...01, a one for each crumb
        moves = (
            count,
            (crumbs & every_other).bit_count(),
            (crumbs >> 1 & every_other).bit_count(),
        )
        if self._grid.chain_leaves(self._cursor, octant, moves):
            raise self._outside_error("a step leaves the grid")
        steps = self._device.steps[octant]
        path = b"".join([_CRUMBS[byte] for byte in raw])[:count]
        chain = array("Q", accumulate(map(steps.__getitem__, path), initial=self._cursor))
        self._plot_row(chain, chain[-1], again=True)

    # Runs

    def skip(self, operand: int) -> None:
        self._set_cursor(self._cursor + self._check_room(self._operands.count(operand)))

    def run(self, operand: int) -> None:
        count = self._check_room(self._operands.count(operand))
        start = self._cursor
        self._page.fill((start,), count, self._pen)
        self._set_cursor(start + count)

    def literal(self, operand: int) -> None:
        count = self._operands.count(operand)
        if self._device.mono:
            raw = self._operands.packed(count, 1)
            self._check_room(count)
            pixels = b"".join([_BITS[byte] for byte in raw])[:count]
        else:
            pixels = self._operands.take(count * self._format.size)
            self._check_room(count)
        self._write_pixels(count, pixels)

    def differences(self, operand: int) -> None:
        count = self._operands.count(operand)
        raw = self._operands.packed(count, 4)
        self._check_room(count)
        steps = b"".join([_DIFFERENCES[byte] for byte in raw])[:count]
        values = accumulate(steps, initial=self._pen[0])
        self._write_pixels(count, bytes([value & 0xFF for value in values])[1:])

    def _write_pixels(self, count: int, pixels: bytes) -> None:
        self._page.put(self._cursor, pixels)
        self._set_cursor(self._cursor + count)
        self._set_pen(pixels[-self._format.size :])

    # Shapes

    def line(self, _: int) -> None:
        place = self._operands.coordinates()
        self._check_cursor()
        self._check_coordinates(place)
        voxels = line(self._grid, self._cursor, place)
        self._plot_row(voxels, self._grid.index(*place), again=True)

    def box(self, _: int) -> None:
        place = self._operands.coordinates()
        self._check_cursor()
        self._check_coordinates(place)
        for starts, count in box(self._grid, self._cursor, place):
            self._page.fill(starts, count, self._pen)
        self._set_cursor(self._grid.index(*place))

    def dots(self, _: int) -> None:
        x, y, z = self._operands.coordinate_lists(self._operands.byte() + 1)
        self._check_coordinates((max(x), max(y), max(z)))
        _, row, plane = self._grid.strides
        voxels = array("Q", (i + row * j + plane * k for i, j, k in zip(x, y, z, strict=True)))
        if self._fade:
            self._plot_row(voxels, voxels[-1])
            return
        self._page.plot(array("Q", set(voxels)), self._pen)
        self._set_cursor(voxels[-1])

    def brick(self, level: int) -> None:
        x, y, z = (axis << level for axis in self._operands.coordinates())
        brick = Brick(level, self._operands.take)
        nx, ny, nz = self._grid.sides
        if not brick.fits((nx - x, ny - y, nz - z)):
            raise self._outside_error(f"a brick at ({x}, {y}, {z}) leaves the grid")
        first = self._grid.index(x, y, z)
        strides = self._device.brick_offsets
        for count, places in brick.rows:
            voxels = array("Q", [first + strides[place] for place in places])
            if count > 1:
                self._page.fill(voxels, count, self._pen)
            else:
                self._page.plot(voxels, self._pen)


_Op = Callable[[_PacketDecoder, int], None]


def _op_table(features: int) -> list[_Op | None]:
    """Return the method for each op byte; None if it is reserved or not implemented."""
    ops: list[_Op | None] = [None] * 256
    last = OPERAND_MASK
    for feature, op, low_bits, draw in (
        (None, spec.OP_END, 0, _PacketDecoder.end),
        (None, spec.OP_PEN, 0, _PacketDecoder.pen),
        (None, spec.OP_MOVE, 0, _PacketDecoder.move),
        (spec.FEATURE_LINE, spec.OP_LINE, 0, _PacketDecoder.line),
        (spec.FEATURE_BOX, spec.OP_BOX, 0, _PacketDecoder.box),
        (spec.FEATURE_DOTS, spec.OP_DOTS, 0, _PacketDecoder.dots),
        (spec.FEATURE_PALETTE, spec.OP_COLORS, 0, _PacketDecoder.colors),
        (spec.FEATURE_HOLD, spec.OP_HOLD, 0, _PacketDecoder.hold),
        (spec.FEATURE_FADE, spec.OP_FADE, 0, _PacketDecoder.fade),
        (_ramp_feature(features), spec.OP_RAMP, 0, _PacketDecoder.ramp),
        (None, spec.OP_STEP, spec.LIMIT_MAX_OCTANT, _PacketDecoder.step),
        (None, spec.OP_FROM, spec.LIMIT_MAX_OCTANT, _PacketDecoder.from_),
        (spec.FEATURE_ARC, spec.OP_ARC, 0, _PacketDecoder.arc),
        (spec.FEATURE_SLABS, spec.OP_SLABS, 0, _PacketDecoder.slabs),
        (spec.FEATURE_ARC2, spec.OP_ARC2, 0, _PacketDecoder.arc2),
        (spec.FEATURE_VALUES, spec.OP_VALUES, 0, _PacketDecoder.values),
        (spec.FEATURE_OCT, spec.OP_OCT, spec.LIMIT_MAX_LEVEL, _PacketDecoder.brick),
        (None, spec.OP_SKIP, last, _PacketDecoder.skip),
        (None, spec.OP_RUN, last, _PacketDecoder.run),
        (None, spec.OP_LIT, last, _PacketDecoder.literal),
        (spec.FEATURE_DIFF, spec.OP_DIFF, last, _PacketDecoder.differences),
    ):
        if feature is None or features >> feature & 1:
            for low in range(low_bits + 1):
                ops[op | low] = draw
    return ops


def _ramp_feature(features: int) -> int:
    """Return the feature that decides about RAMP, which needs two: one that is missing, if any."""
    return spec.FEATURE_FADE if features >> spec.FEATURE_PALETTE & 1 else spec.FEATURE_PALETTE
