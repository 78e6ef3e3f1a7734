"""Devices that break sections 7.3 to 7.6: shapes, bricks, differences and the palette."""

from __future__ import annotations

from array import array

from broken_devices.digests import EVERY_DIGEST
from broken_devices.mutant import Operands, Page, around, mutant, on_op
from firmware_sim import memory, op_decoder, shapes


@mutant("7.3/lines", "7.3/line-ties", "7.3/shape-cursor", likely="rounded down")
def line_ties_down(patch):
    def line(grid, start, target):
        begin = grid.coordinates(start)
        d = [b - a for a, b in zip(begin, target, strict=True)]
        n = max(map(abs, d))
        places = [
            [a - (n - 2 * k * da) // (2 * n) for a, da in zip(begin, d, strict=True)]
            for k in range(n + 1 if n else 0)
        ] or [begin]
        return array("Q", [grid.index(*place) for place in places])

    patch.setattr(op_decoder, "line", line)


@mutant("7.3/lines", "7.3/line-ties", "7.3/line-of-one")
def line_without_its_end(patch):
    old = shapes.line
    patch.setattr(op_decoder, "line", lambda *args: old(*args)[:-1])


@mutant("7.3/shape-cursor", "7.3/boxes", likely="left out")
def box_without_its_end(patch):
    old = shapes.box

    def box(grid, start, target):
        corners = list(zip(grid.coordinates(start), target, strict=True))
        low = [min(pair) for pair in corners]
        high = [max(min(pair), max(pair) - 1) for pair in corners]
        return old(grid, grid.index(*low), tuple(high))

    patch.setattr(op_decoder, "box", box)


@mutant("7.3/shape-cursor", "7.3/dots-cursor", likely="here it stayed")
def shape_cursor_stays(patch):
    def stay(old, self, low):
        before = self._cursor
        old(self, low)
        self._cursor = before

    for name in ("line", "box", "dots"):
        on_op(patch, name, stay)


@mutant("7.9/fade-runs", "7.3/dots", "7.3/dots-cursor", "7.8/shapes-outside")
def dots_one_too_few(patch):
    def places(old, self, count):
        axes = old(self, count)
        return tuple(axis[: max(1, count - 1)] for axis in axes)

    around(patch, Operands, "coordinate_lists", places)


@mutant("7.4/levels", "7.4/children", "7.4/full-nodes", likely="x and z were swapped")
def children_reversed(patch):
    def children(level, mask):
        half = 1 << level >> 1
        return tuple(
            half * shapes._brick_index(c >> 2, c >> 1 & 1, c & 1) for c in range(8) if mask >> c & 1
        )

    table = [[children(level, mask) for mask in range(256)] for level in range(5)]
    table[1][0] = table[1][255]
    patch.setattr(shapes, "_children_by_mask", table.__getitem__)


@mutant("7.4/levels", "7.4/full-nodes", "7.8/bricks-outside", "11/order-of-op")
def full_node_is_empty(patch):
    table = [list(shapes._children_by_mask(level)) for level in range(5)]
    table[1][0] = ()
    patch.setattr(shapes, "_children_by_mask", table.__getitem__)
    patch.setattr(shapes, "_ROWS", [[] for _ in shapes._ROWS])


@mutant("7.4/brick-cursor", likely="moved to the brick")
def brick_moves_the_cursor(patch):
    def brick(old, self, level):
        at = self._operands._at
        x, y, z = (axis << level for axis in self._operands.coordinates())
        self._operands._at = at
        old(self, level)
        if self._grid.contains(x, y, z):
            self._cursor = self._grid.index(x, y, z)

    on_op(patch, "brick", brick)


@mutant("7.5/differences", "7.5/difference-pen", likely="lowest bits")
def nibbles_high_first(patch):
    patch.setattr(op_decoder, "_DIFFERENCES", [row[::-1] for row in op_decoder._DIFFERENCES])


@mutant("7.5/differences", "7.5/difference-pen", likely="two's complement")
def nibbles_unsigned(patch):
    table = [bytes((byte & 15, byte >> 4)) for byte in range(256)]
    patch.setattr(op_decoder, "_DIFFERENCES", table)


@mutant("7.6/palette-of-a-page")
def palette_not_copied(patch):
    def copy(old, self, other):
        old(self, other)
        self._digest -= self._color_terms(slice(0, 768))
        self.palette[:] = memory.DEFAULT_PALETTE

    around(patch, Page, "copy_from", copy)


@mutant(
    *EVERY_DIGEST,
    "8/given-up",
    spreads=True,
)
def palette_not_cleared(patch):
    def clear(old, self):
        palette = getattr(self, "palette", None)
        old(self)
        if palette is not None:
            self.palette = palette
            self._digest = self._color_terms(slice(0, 768))

    around(patch, Page, "clear", clear)


@mutant("7.9/ramps", "7.6/colors", "7.6/palette-of-a-page", likely="palette is not in the digest")
def palette_not_in_the_digest(patch):
    around(patch, Page, "_color_terms", lambda old, self, place: 0)
