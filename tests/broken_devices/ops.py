"""Devices that break section 7 in its chains, counts, pixels and padding."""

from __future__ import annotations

from array import array

from broken_devices.mutant import Decoder, Operands, Page, around, mutant, on_op
from firmware_sim import op_decoder, operands, spec
from firmware_sim.grid import Grid


@mutant(
    "2/scan-order",
    "7/move",
    "7.1/octants",
    "7.8/move-outside",
    spreads=True,
    likely="axes y and z are swapped",
)
def y_and_z_swapped(patch):
    def place(old, self):
        x, y, z = old(self)
        return x, z, y

    around(patch, Operands, "coordinates", place)


@mutant("2/scan-order", "7/move", "7.1/octants", spreads=True)
def z_runs_fastest(patch):
    def init(old, self, nx, ny, nz):
        old(self, nx, ny, nz)
        object.__setattr__(self, "strides", (ny * nz, nz, 1))

    around(patch, Grid, "__init__", init)
    patch.setattr(Grid, "index", lambda self, x, y, z: z + self.nz * (y + self.ny * x))
    patch.setattr(
        Grid,
        "coordinates",
        lambda self, i: (i // self.nz // self.ny, i // self.nz % self.ny, i % self.nz),
    )


@mutant(
    "7.9/fade-chains",
    "7.9/fade-cursor-set",
    "7.9/fade-ended",
    "7.9/fade-goes-on",
    "7.9/fade-past-its-end",
    "7.9/fade-rounding",
    "7.1/octants",
    "7.1/from",
    "7.1/chain-lengths",
    "7.1/chain-cursor",
    "7.8/step-outside",
    likely="byte is n - 1",
)
def step_one_too_few(patch):
    def walk(old, self, octant, count, raw):
        if count == 1:
            self._check_cursor()
            self._page.plot(array("Q", [self._cursor]), self._pen)
            return
        crumbs = int.from_bytes(raw, "little") & (1 << 2 * count - 2) - 1
        old(self, octant, count - 1, crumbs.to_bytes(len(raw), "little")[: (count + 2) // 4])

    around(patch, Decoder, "_draw_chain", walk)


@mutant(
    "7.9/fade-chains",
    "7.9/fade-cursor-set",
    "7.9/fade-ended",
    "7.9/fade-goes-on",
    "7.9/fade-past-its-end",
    "7.9/fade-rounding",
    "7.9/fade-runs",
    "7.1/octants",
    "7.1/from",
    "7.1/chain-lengths",
    "7.1/chain-cursor",
    "7.8/step-outside",
    likely="taken for rising",
)
def octant_signs(patch):
    around(patch, Grid, "crumb_offsets", lambda old, self, octant: old(self, octant ^ 7))
    around(
        patch,
        Grid,
        "chain_leaves",
        lambda old, self, i, octant, moves: old(self, i, octant ^ 7, moves),
    )


@mutant("7.9/fade-chains", "7.1/octants", "7.1/from", likely="bit 0 is for axis main + 1")
def crumb_bits_swapped(patch):
    swapped = [bytes((0, 2, 1, 3)[c] for c in row) for row in op_decoder._CRUMBS]
    patch.setattr(op_decoder, "_CRUMBS", swapped)


@mutant("7.9/fade-chains", "7.1/octants", "7.1/from", likely="lowest bits")
def crumbs_high_first(patch):
    patch.setattr(op_decoder, "_CRUMBS", [row[::-1] for row in op_decoder._CRUMBS])


@mutant(
    "7.9/fade-chains",
    "7.9/fade-cursor-set",
    "7.9/fade-ended",
    "7.9/fade-rounding",
    "7.1/octants",
    "7.1/from",
    "7.1/chain-lengths",
    "7.1/chain-cursor",
    likely="before its first step",
)
def chain_start_left_out(patch):
    def walk(old, self, octant, count, raw):
        first = self._cursor
        before = self._page.stored.read(first, 1) if self._format.size == 1 else None
        old(self, octant, count, raw)
        if before is not None:
            self._page.put(first, bytes(before))

    around(patch, Decoder, "_draw_chain", walk)


@mutant(
    "7.9/fade-cursor-set",
    "7.9/fade-goes-on",
    "7.9/fade-past-its-end",
    "7.1/chain-cursor",
    likely="stayed at the first",
)
def chain_cursor_stays(patch):
    def walk(old, self, octant, count, raw):
        first = self._cursor
        old(self, octant, count, raw)
        self._cursor = first

    around(patch, Decoder, "_draw_chain", walk)


@mutant("7.8/step-outside")
def step_wraps_around(patch):
    def leaves(_, self, index, octant, moves):
        steps = self.crumb_offsets(octant)
        end = index + moves[0] * steps[0]
        end += moves[1] * (steps[1] - steps[0]) + moves[2] * (steps[2] - steps[0])
        return not 0 <= end < self.volume

    around(patch, Grid, "chain_leaves", leaves)


@mutant("7.2/counts", "7.8/past-the-end", spreads=True, likely="31 + k")
def long_count_from_31(patch):
    around(patch, Operands, "count", lambda old, self, c: old(self, c) - (c == 31))


@mutant("11/count-form", "11/first-op-first", "11/order-of-op")
def any_leb128_taken(patch):
    def count(_, self, operand):
        if operand < 31:
            return operand + 1
        total, shift = 0, 0
        while True:
            byte = self.byte()
            total |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return 32 + total

    around(patch, Operands, "count", count)


@mutant("11/count-form")
def leb128_asks_for_a_sixth_byte(patch):
    def count(old, self, operand):
        if operand == 31 and all(byte & 128 for byte in self._packet[self._at : self._at + 5]):
            self.take(6)
        return old(self, operand)

    around(patch, Operands, "count", count)


@mutant("7.9/fade-ended", "7.2/literal-pen", "7.5/difference-pen", likely="left as it was")
def literal_leaves_pen(patch):
    def write(old, self, count, pixels):
        pen = self._pen
        old(self, count, pixels)
        self._pen = pen

    around(patch, Decoder, "_write_pixels", write)


@mutant(
    "7.2/counts",
    "7.2/to-the-end",
    "7.2/literal",
    "7.2/literal-pen",
    "8/sum",
    "10/whole-page",
    "10/ranges",
    "10/dense-page",
    "4/answers-length",
    pixel_format="mono1",
    likely="lowest bits",
)
def mono_high_bit_first(patch):
    patch.setattr(op_decoder, "_BITS", [row[::-1] for row in op_decoder._BITS])


@mutant("11/pixel", pixel_format="mono1")
def mono_pen_of_two(patch):
    def pen(old, self, low):
        value = self._operands.take(1)
        self._pen = bytes((value[0] & 1,))

    on_op(patch, "pen", pen)


@mutant(
    "2.1/pixels",
    "7/each-packet-anew",
    "7/pen",
    "7/move",
    "7/later-counts",
    "7.4/brick-cursor",
    "7.7/arc-pieces",
    "7.7/arc-behind-ops",
    "8/one-voxel",
    "8/overwritten",
    spreads=True,
    pixel_format="rgb565",
    likely="lowest first",
)
def pixels_big_endian(patch):
    def pen(old, self, low):
        old(self, low)
        self._pen = self._pen[::-1]

    on_op(patch, "pen", pen)


@mutant("7/each-packet-anew", spreads=True, likely="pen is not reset")
def pen_not_reset(patch):
    def draw(_, self, packet, page):
        inner = operands.Operands(packet, self.grid.coordinate_size)
        decoder = Decoder(self, inner, page)
        decoder._pen = getattr(self, "pen", decoder._pen)
        while (op := inner.op()) is not None:
            if self.ops[op] is None:
                raise inner.error(spec.CODE_OP, "")
            self.ops[op](decoder, op & 31)
        self.pen = decoder._pen
        return decoder.hold_ticks

    around(patch, op_decoder.OpDecoder, "draw", draw)


@mutant("7/each-packet-anew", spreads=True, likely="cursor is not reset")
def cursor_not_reset(patch):
    def draw(_, self, packet, page):
        inner = operands.Operands(packet, self.grid.coordinate_size)
        decoder = Decoder(self, inner, page)
        decoder._cursor = getattr(page, "cursor", 0)
        while (op := inner.op()) is not None:
            if self.ops[op] is None:
                raise inner.error(spec.CODE_OP, "")
            self.ops[op](decoder, op & 31)
        page.cursor = decoder._cursor
        return decoder.hold_ticks

    around(patch, op_decoder.OpDecoder, "draw", draw)

    def clear(old, self):
        self.cursor = 0
        old(self)

    around(patch, Page, "clear", clear)


@mutant("11/padding")
def end_padding_taken(patch):
    on_op(patch, "end", lambda old, self, low: self._operands.remaining())


@mutant("11/padding", "11/difference-padding", "11/order-of-op")
def unused_bits_taken(patch):
    def small(_, self, count, bits_):
        raw = self.take((count * bits_ + 7) // 8)
        used = count * bits_ % 8
        return raw[:-1] + bytes((raw[-1] & (1 << used) - 1,)) if used else raw

    around(patch, Operands, "packed", small)


@mutant(
    "6/waits-unchecked",
    "11/session-ends",
    "11/error-session",
    "11/reserved-ops",
    "11/first-op-first",
    "11/refused-commit",
)
def reserved_ops_skipped(patch):
    def ops(old, features):
        table = old(features)
        table[0x1F] = table[0x0A] = lambda decoder, low: None
        return table

    around(patch, op_decoder, "_op_table", ops)


@mutant("7.8/past-the-end", "11/first-op-first")
def run_past_the_end_is_cut(patch):
    def room(_, self, count):
        if self._cursor >= self._grid.volume:
            raise self._outside_error("")
        return min(count, self._grid.volume - self._cursor)

    around(patch, Decoder, "_check_room", room)


@mutant("11/pixel-padding", "11/padding", "11/order-of-op", pixel_format="mono1")
def unused_bits_of_pixels_taken(patch):
    unused_bits_taken(patch)


@mutant("7/begins-at-0", spreads=True)
def pen_begins_at_1(patch):
    def init(old, self, *args):
        old(self, *args)
        self._pen = b"\1"

    around(patch, Decoder, "__init__", init)


@mutant("7/end", "3/cobs-groups")
def end_needs_padding(patch):
    def end(old, self, low):
        if len(self._operands._packet) == self._operands._at:
            raise self._operands.error(spec.CODE_TRUNCATED, "")
        old(self, low)

    on_op(patch, "end", end)
