"""Reference decoder of ops (section 7 of protocol.md), written for readability.

It is the simplest decoder that refuses all that must be refused. Every rule that is easily misread
is a small method of its own, so that ``device_bugs`` can misread one at a time. Knows no packet.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from voxdisplay.conformance import (
    range_coded_chains,
    range_coded_slabs,
    range_coded_values,
    second_chains,
)
from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.fades import Fade, blend, color_bytes
from voxdisplay.conformance.reference_page import Page, rgb
from voxdisplay.wire import spec


class Refused(Exception):  # noqa: N818 - a verdict on ops, not a fault of the kit
    """Ops that a device must refuse; ``at`` counts from the first byte of the payload."""

    def __init__(self, code: int, at: int) -> None:
        super().__init__(code, at)  # pickled by these arguments
        self.code = code
        self.at = at

    def __str__(self) -> str:
        return f"code {self.code} at {self.at}"


class ReferenceDecoder:
    """Decoder that draws the payloads of DATA packets on a page."""

    def __init__(self, device: AnnouncedDevice, page: Page) -> None:
        self.device = device
        self.page = page
        self.cursor = 0
        self.pen = device.full_pixel
        self.fade: Fade | None = None
        self.hold = 0
        self._payload = b""
        self._at = 0
        self._op_at = 0

    def draw(self, payload: bytes) -> None:
        """Draw the ops of one packet, or raise `Refused`."""
        self.begin_packet()
        self.draw_more(payload)

    def draw_more(self, payload: bytes) -> None:
        """Draw ops that follow others in the same packet."""
        self._payload, self._at = payload, 0
        while self._at < len(payload):
            self._op_at = self._at
            self._op(self._byte())

    # -- rules that can be misread, one method each

    def begin_packet(self) -> None:
        """Reset the cursor to 0 and the pen to the full pixel."""
        self.cursor, self.pen, self.fade = 0, self.device.full_pixel, None
        self.hold = 0

    def coordinates(self, a: int, b: int, c: int) -> Voxel:
        """Return x, y, z of coordinates as they were sent: in the order x, y, z."""
        return a, b, c

    def axes_of(self, octant: int) -> tuple[int, tuple[int, int, int]]:
        """Return main axis and direction on each axis: bits 0..2 are set if x, y, z falls."""
        x, y, z = (-1 if octant >> axis & 1 else 1 for axis in range(3))
        return octant >> 3, (x, y, z)

    def chain_axes(self, crumb: int, main: int) -> set[int]:
        """Return the axes that a step moves on: bit 0 is for axis main + 1, bit 1 for main + 2."""
        return {main} | {(main + 1 + bit) % 3 for bit in (0, 1) if crumb >> bit & 1}

    def unpack_bits(self, raw: bytes, count: int, bits: int) -> list[int]:
        """Unpack crumbs, nibbles or MONO1 pixels, the first in the lowest bits."""
        per_byte = 8 // bits
        return [raw[i // per_byte] >> i % per_byte * bits & ((1 << bits) - 1) for i in range(count)]

    def steps_of(self, byte: int) -> int:
        """Return the number of steps of a chain: the byte is n - 1."""
        return byte + 1

    def chain_start(self, at: Voxel) -> list[Voxel]:
        """Return what a chain writes before its first step: the voxel at the cursor."""
        return [at]

    def count_of(self, low: int) -> int:
        """Return a count: n = c + 1 for c = 0..30, n = 32 + k for c = 31, k as LEB128."""
        return low + 1 if low < 31 else 32 + self._leb128(32)

    def rounded(self, k: int, d: int, length: int) -> int:
        """Return the offset of voxel k of a LINE: floor((2 k d + L) / (2 L)), ties rounded up."""
        return (2 * k * d + length) // (2 * length) if length else 0

    def span(self, a: int, b: int) -> range:
        """Return the coordinates of a BOX on an axis: both ends included, in either order."""
        return range(min(a, b), max(a, b) + 1)

    def child(self, bit: int) -> Voxel:
        """Return (cx, cy, cz) of a child: bit c = cx + 2 · cy + 4 · cz."""
        return bit & 1, bit >> 1 & 1, bit >> 2 & 1

    def difference(self, nibble: int) -> int:
        """Return a DIFF's nibble as a number: four bits in two's complement."""
        return nibble - 16 if nibble > 7 else nibble

    def after_chain(self, begin: Voxel, end: Voxel) -> Voxel:
        """Return the cursor after a chain: the last voxel."""
        del begin
        return end

    def after_shape(self, begin: Voxel, end: Voxel) -> Voxel:
        """Return the cursor after LINE, BOX or DOTS: the voxel named last."""
        del begin
        return end

    def after_brick(self, cursor: int, corner: int) -> int:
        """Return the cursor after OCT: unchanged."""
        del corner
        return cursor

    def after_literal(self, before: int, last: int) -> int:
        """Return the pen after LIT: the last of its pixels."""
        del before
        return last

    def pixel_of(self, raw: bytes) -> int:
        """Return the pixel value: the bytes as a little-endian integer."""
        return int.from_bytes(raw, "little")

    # -- operands

    def refusal(self, code: int) -> Refused:
        """Return the refusal of the current op."""
        return Refused(code, self._op_at)

    def _take(self, count: int) -> bytes:
        if self._at + count > len(self._payload):
            raise self.refusal(spec.CODE_TRUNCATED)
        self._at += count
        return self._payload[self._at - count : self._at]

    def _byte(self) -> int:
        return self._take(1)[0]

    def rest(self) -> bytes:
        """Consume the rest of the payload and return it."""
        return self._take(len(self._payload) - self._at)

    def _read_voxel(self) -> Voxel:
        size = self.device.coordinate_bytes
        a, b, c = (int.from_bytes(self._take(size), "little") for _ in range(3))
        return self.coordinates(a, b, c)

    def _leb128(self, base: int = 0) -> int:
        k = 0
        for place in range(5):
            byte = self._byte()
            k |= (byte & 127) << 7 * place
            if byte < 128:
                if (place and not byte) or base + k >= 1 << 32:
                    raise self.refusal(spec.CODE_COUNT)
                return k
        raise self.refusal(spec.CODE_COUNT)

    def _padded_bits(self, count: int, bits: int) -> list[int]:
        raw = self._take(-(-count * bits // 8))
        if count * bits % 8 and raw[-1] >> count * bits % 8:
            raise self.refusal(spec.CODE_PADDING)
        return self.unpack_bits(raw, count, bits)

    def _pixels(self, count: int) -> list[int]:
        if self.device.format == spec.FORMAT_MONO1:
            return self._padded_bits(count, 1)
        size = self.device.pixel_bytes
        raw = self._take(count * size)
        return [self.pixel_of(raw[at : at + size]) for at in range(0, len(raw), size)]

    # -- drawing

    def write_row(self, places: Iterable[Voxel], *, again: bool = False) -> None:
        """Write the pen to voxels that a fade counts; ``again``: the cursor's comes first."""
        if self.fade is None:
            self.write_voxels(places)
            return
        for number, place in enumerate(places):
            repeats = again and not number and self.fade.end is not None
            self.pen = self.fade.pen(self.fade.place - repeats)
            self.write_voxels([place])
            self.fade.end = self.device.index(*place)
            if not repeats:
                self.fade.count_voxel()
        self.pen = self.fade.pen(self.fade.place)

    def require_on_grid(self, place: Voxel) -> Voxel:
        """Return the voxel; raise `Refused` if it is off the grid."""
        if not self.device.contains(*place):
            raise self.refusal(spec.CODE_OUTSIDE)
        return place

    def _cursor_voxel(self) -> Voxel:
        if self.cursor >= self.device.voxel_count:
            raise self.refusal(spec.CODE_OUTSIDE)
        return self.device.voxel_at(self.cursor)

    def write_voxels(self, places: Iterable[Voxel]) -> None:
        """Write the pen to voxels; raise `Refused` if one is off the grid."""
        for index in [self.device.index(*self.require_on_grid(place)) for place in places]:
            self.page.write(index, self.pen)

    def _write_scan_order(self, values: list[int]) -> None:
        if self.cursor + len(values) > self.device.voxel_count:
            raise self.refusal(spec.CODE_OUTSIDE)
        for value in values:
            self.page.write(self.cursor, value)
            self.cursor += 1

    # -- the ops

    def _op(self, op: int) -> None:
        if self.fade and (op in _SET_CURSOR or op >= spec.OP_SKIP):
            self.fade.end = None
        for first, more, feature, draw in _OPS:
            if first <= op <= first + more and (not feature or self.device.has(feature)):
                draw(self, op - first)
                return
        raise self.refusal(spec.CODE_OP)

    def op_end(self, _: int) -> None:
        """END: refuse what follows unless all of it is 00."""
        if any(self.rest()):
            raise self.refusal(spec.CODE_PADDING)

    def op_move(self, _: int) -> None:
        """MOVE: set the cursor."""
        self.cursor = self.device.index(*self.require_on_grid(self._read_voxel()))

    def op_arc(self, _: int) -> None:
        """ARC: draw range-coded chains."""
        for pen, voxel in range_coded_chains.decode(self.rest(), self.device, self.refusal):
            self.pen = self.pen if pen is None else pen
            self.write_voxels([voxel])

    def op_arc2(self, _: int) -> None:
        """ARC2: draw range-coded chains with fades."""
        for pen, voxel in second_chains.decode(self.rest(), self.device, self.refusal):
            if isinstance(pen, Fade):
                self.fade = pen
            elif pen is not None:
                self.pen, self.fade = pen, None
            self.write_row([voxel])

    def op_slabs(self, _: int) -> None:
        """SLABS: draw range-coded slabs."""
        for voxel in range_coded_slabs.decode(self.rest(), self.device, self.refusal):
            self.write_voxels([voxel])

    def op_values(self, _: int) -> None:
        """VALUES: draw range-coded voxels with their pixels."""
        for voxel, value in range_coded_values.decode(self.rest(), self.device, self.refusal):
            self.page.write(self.device.index(*voxel), value)

    def op_pen(self, _: int) -> None:
        """PEN: set the pen."""
        pen = self.pixel_of(self._take(self.device.pixel_bytes))
        if self.device.format == spec.FORMAT_MONO1 and pen > 1:
            raise self.refusal(spec.CODE_PIXEL)
        self.pen, self.fade = pen, None

    def op_skip(self, low: int) -> None:
        """SKIP: advance the cursor."""
        count = self.count_of(low)
        if self.cursor + count > self.device.voxel_count:
            raise self.refusal(spec.CODE_OUTSIDE)
        self.cursor += count

    def op_run(self, low: int) -> None:
        """RUN: write the pen to n voxels in scan order."""
        count = self.count_of(low)
        if self.cursor + count > self.device.voxel_count:
            raise self.refusal(spec.CODE_OUTSIDE)
        self._write_scan_order([self.pen] * count)

    def op_literal(self, low: int) -> None:
        """LIT: write n pixels in scan order."""
        values = self._pixels(self.count_of(low))
        self._write_scan_order(values)
        self.pen, self.fade = self.after_literal(self.pen, values[-1]), None

    def op_differences(self, low: int) -> None:
        """DIFF: write n pixels by their differences."""
        values, pen = [], self.pen
        for nibble in self._padded_bits(self.count_of(low), 4):
            pen = (pen + self.difference(nibble)) % 256
            values.append(pen)
        self._write_scan_order(values)
        self.pen, self.fade = pen, None

    def op_step(self, octant: int) -> None:
        """STEP: draw a chain from the cursor."""
        self._chain(octant, None)

    def op_from(self, octant: int) -> None:
        """FROM: draw a chain from the voxel that it names."""
        self._chain(octant, self._read_voxel())

    def _chain(self, octant: int, named: Voxel | None) -> None:
        steps = self.steps_of(self._byte())
        crumbs = self._padded_bits(steps, 2)
        at = begin = self.require_on_grid(named) if named else self._cursor_voxel()
        main, signs = self.axes_of(octant)
        places = self.chain_start(begin)
        for crumb in crumbs:
            moved = list(at)
            for axis in self.chain_axes(crumb, main):
                moved[axis] += signs[axis]
            at = self.require_on_grid((moved[0], moved[1], moved[2]))
            places.append(at)
        self.write_row(places, again=named is None)
        self.cursor = self.device.index(*self.after_chain(begin, at))

    def op_line(self, _: int) -> None:
        """LINE: draw a straight line from the cursor."""
        end = self._read_voxel()
        begin = self._cursor_voxel()
        self.require_on_grid(end)
        d = [b - a for a, b in zip(begin, end, strict=True)]
        length = max(map(abs, d))
        x, y, z = (
            [a + self.rounded(k, da, length) for k in range(length + 1)]
            for a, da in zip(begin, d, strict=True)
        )
        self.write_row(zip(x, y, z, strict=True), again=True)
        self.cursor = self.device.index(*self.after_shape(begin, end))

    def op_box(self, _: int) -> None:
        """BOX: fill the box between the cursor and the voxel that it names."""
        end = self._read_voxel()
        begin = self._cursor_voxel()
        self.require_on_grid(end)
        xs, ys, zs = (self.span(a, b) for a, b in zip(begin, end, strict=True))
        self.write_voxels((x, y, z) for z in zs for y in ys for x in xs)
        self.cursor = self.device.index(*self.after_shape(begin, end))

    def op_dots(self, _: int) -> None:
        """DOTS: write single voxels."""
        places = [self._read_voxel() for _ in range(self.steps_of(self._byte()))]
        self.write_row([self.require_on_grid(place) for place in places])
        begin = self.device.voxel_at(min(self.cursor, self.device.voxel_count - 1))
        self.cursor = self.device.index(*self.after_shape(begin, places[-1]))

    def op_brick(self, level: int) -> None:
        """OCT: write voxels of a brick."""
        x, y, z = self._read_voxel()
        side = 1 << level
        corner = (x * side, y * side, z * side)
        nodes = [corner]
        places: list[Voxel] = []
        while side > 1:
            children: list[Voxel] = []
            side //= 2
            for node in nodes:
                mask = self._byte()
                for bit in range(8):
                    offset = (side * part for part in self.child(bit))
                    x, y, z = (a + b for a, b in zip(node, offset, strict=True))
                    at = (x, y, z)
                    if not mask:
                        places += self._cube(at, side)
                    elif mask >> bit & 1:
                        children.append(at)
            nodes = children
        self.write_voxels(places + nodes)
        self.cursor = self.after_brick(self.cursor, self.device.index(*corner))

    def _cube(self, at: Voxel, side: int) -> list[Voxel]:
        x, y, z = at
        part = range(side)
        return [(x + i, y + j, z + k) for k in part for j in part for i in part]

    def op_hold(self, _: int) -> None:
        """HOLD: name the ticks for which the frame before stays on display."""
        self.hold = max(self.hold, self._byte())

    def op_colors(self, _: int) -> None:
        """COLORS: set entries of the palette."""
        first = self._byte()
        count = self._byte() + 1
        raw = self._take(3 * count)
        if first + count > spec.LIMIT_MAX_COLORS:
            raise self.refusal(spec.CODE_OUTSIDE)
        for i in range(count):
            self.page.palette[first + i] = rgb(*raw[3 * i : 3 * i + 3])

    def op_ramp(self, _: int) -> None:
        """RAMP: set entries of the palette to a blend."""
        first = self._byte()
        count = self._byte() + 1
        stops = self._stops(self._byte() + 1, 3)
        if first + count > spec.LIMIT_MAX_COLORS:
            raise self.refusal(spec.CODE_OUTSIDE)
        for i in range(count):
            self.page.palette[first + i] = rgb(*blend(stops, count, i))

    def op_fade(self, _: int) -> None:
        """FADE: begin a pen that changes from voxel to voxel."""
        colors = self._byte() + 1
        count = self._leb128() + 1
        if count > spec.LIMIT_MAX_FADE:
            raise self.refusal(spec.CODE_COUNT)
        place = self._leb128()
        if place >= count:
            raise self.refusal(spec.CODE_COUNT)
        stops = self._stops(colors, color_bytes(self.device))
        self.fade = Fade(self.device, stops, count, place)
        self.pen = self.fade.pen(place)

    def _stops(self, count: int, size: int) -> list[bytes]:
        return [self._take(size) for _ in range(count)]


# Ops below SKIP that set the cursor and are not counted by a fade.
_SET_CURSOR = (spec.OP_MOVE, spec.OP_BOX)
# First op byte, how many more, the feature that they need, and what draws them.
_OPS: tuple[tuple[int, int, str, Callable[[ReferenceDecoder, int], None]], ...] = (
    (spec.OP_END, 0, "", ReferenceDecoder.op_end),
    (spec.OP_PEN, 0, "", ReferenceDecoder.op_pen),
    (spec.OP_MOVE, 0, "", ReferenceDecoder.op_move),
    (spec.OP_LINE, 0, "LINE", ReferenceDecoder.op_line),
    (spec.OP_BOX, 0, "BOX", ReferenceDecoder.op_box),
    (spec.OP_DOTS, 0, "DOTS", ReferenceDecoder.op_dots),
    (spec.OP_COLORS, 0, "PALETTE", ReferenceDecoder.op_colors),
    (spec.OP_HOLD, 0, "HOLD", ReferenceDecoder.op_hold),
    (spec.OP_FADE, 0, "FADE", ReferenceDecoder.op_fade),
    (spec.OP_RAMP, 0, "RAMP", ReferenceDecoder.op_ramp),
    (spec.OP_STEP, spec.LIMIT_MAX_OCTANT, "", ReferenceDecoder.op_step),
    (spec.OP_FROM, spec.LIMIT_MAX_OCTANT, "", ReferenceDecoder.op_from),
    (spec.OP_ARC, 0, "ARC", ReferenceDecoder.op_arc),
    (spec.OP_ARC2, 0, "ARC2", ReferenceDecoder.op_arc2),
    (spec.OP_SLABS, 0, "SLABS", ReferenceDecoder.op_slabs),
    (spec.OP_VALUES, 0, "VALUES", ReferenceDecoder.op_values),
    (spec.OP_OCT, spec.LIMIT_MAX_LEVEL, "OCT", ReferenceDecoder.op_brick),
    (spec.OP_SKIP, 31, "", ReferenceDecoder.op_skip),
    (spec.OP_RUN, 31, "", ReferenceDecoder.op_run),
    (spec.OP_LIT, 31, "", ReferenceDecoder.op_literal),
    (spec.OP_DIFF, 31, "DIFF", ReferenceDecoder.op_differences),
)
