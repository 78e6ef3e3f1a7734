"""Decoder of ops: payloads of DATA to pixels (protocol.md, section 7).

Ops are read one after another, but what they write is found for all ops of a kind together. Must
not know packets, nor what is on the page below.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.raster.color import blend
from voxdisplay.raster.display_list import Spread
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat, Values
from voxdisplay.wire import op_expansion, spec
from voxdisplay.wire.fades import FadedPens
from voxdisplay.wire.op_encoding import Ints
from voxdisplay.wire.range_coded_chain_decoder import decode_range_coded
from voxdisplay.wire.slab_decoder import decode_slabs
from voxdisplay.wire.slab_value_decoder import decode_valued_slabs

# Bits of crumbs, by byte: those for the first and for the second other axis.
_EVEN: Final = bytes((byte & 0x55).bit_count() for byte in range(256))
_ODD: Final = bytes((byte & 0xAA).bit_count() for byte in range(256))
_OPERAND: Final = 0x1F
_LAST_BRICK: Final = spec.OP_OCT + spec.LIMIT_MAX_LEVEL
# A host should write a voxel once (section 6): ops that write many more are hostile, and would fill
# the memory.
_MAX_WRITES: Final = 4  # for each voxel of the grid
_FEW_WRITES: Final = 1 << 20  # on a small grid these are no matter
_MAX_WRITTEN: Final = 1 << 26


@dataclass(frozen=True, eq=False)
class DecodedOps:
    """Pixels that ops draw.

    Attributes
    ----------
    index : (n,) int64 array
        Scan-order indices of the voxels that are written, ascending.
    values : (n,) array
        Their pixel values; of voxels that are written twice, the later one.
    colors : dict of int to (int, int, int)
        Palette entries that are set.

    """

    index: Ints
    values: Values
    colors: dict[int, tuple[int, int, int]]


def decode_ops(payloads: Iterable[bytes], grid: Grid, format_: PixelFormat) -> DecodedOps:
    """Return what payloads draw.

    Parameters
    ----------
    payloads : iterable of bytes
        In the order in which they are applied.
    grid, format_
        Those of the display.

    Raises
    ------
    RemoteProtocolError
        If an op is none that protocol.md defines, is cut off, or writes outside the grid.

    """
    parser = _Parser(grid, format_)
    for payload in payloads:
        parser.read(payload)
    return parser.result()


@dataclass
class _Spans:
    """Runs of pixels in scan order: number of the op, first index, count, and pixel values."""

    op: list[int] = field(default_factory=list)
    start: list[int] = field(default_factory=list)
    count: list[int] = field(default_factory=list)
    values: list[Values] = field(default_factory=list)


class _Parser:
    """Parser of ops: notes what each of them writes, for `op_expansion`."""

    def __init__(self, grid: Grid, format_: PixelFormat) -> None:
        self._grid = grid
        self._format = format_
        self._voxels = grid.voxels
        self._wide = 2 if max(grid) > 256 else 1
        self._spans = _Spans()
        self._chains = op_expansion.Chains()
        self._bricks = op_expansion.Bricks()
        self._shapes = op_expansion.Shapes()
        self._colors: dict[int, tuple[int, int, int]] = {}
        self._ops = 0
        self._left = min(max(_MAX_WRITES * self._voxels, _FEW_WRITES), _MAX_WRITTEN)
        self._data = b""
        self._at = self._op_at = 0
        self._cursor = 0
        self._pen = 0
        self._fade = FadedPens(format_)

    def read(self, payload: bytes) -> None:
        """Read the ops of one packet."""
        self._data, self._at = payload, 0
        self._cursor, self._pen = 0, self._format.full
        self._fade.end()
        while self._at < len(payload):
            self._op_at = self._at
            op = payload[self._at]
            self._at += 1
            self._ops += 1
            if op in _SIMPLE:
                _SIMPLE[op](self)
            elif op >= spec.OP_SKIP:
                _COUNTED[op & ~_OPERAND](self, self._count(op & _OPERAND))
            elif spec.OP_STEP <= op <= spec.OP_STEP + spec.LIMIT_MAX_OCTANT:
                self._chain(op - spec.OP_STEP, self._cursor, again=True)
            elif spec.OP_FROM <= op <= spec.OP_FROM + spec.LIMIT_MAX_OCTANT:
                self._chain(op - spec.OP_FROM, self._voxel())
            elif spec.OP_OCT <= op <= _LAST_BRICK:
                self._brick(op - spec.OP_OCT)
            else:
                raise self._error(f"op byte {op:02X} is reserved")

    def result(self) -> DecodedOps:
        """Return what all ops have written."""
        spans = self._spans
        starts, counts = np.array(spans.start, np.int64), np.array(spans.count, np.int64)
        op = np.repeat(np.array(spans.op, dtype=np.int64), counts)
        index = np.repeat(starts - np.cumsum(counts) + counts, counts) + np.arange(len(op))
        values = np.concatenate([*spans.values, np.empty(0, dtype=np.int64)])
        parts = [(op, index, values.astype(np.int64))]
        for expand in (self._chains, self._bricks, self._shapes):
            try:
                parts.append(expand.expand(self._grid))
            except ValueError as error:
                raise RemoteProtocolError(f"ops: {error}", section="7.8") from error
        op, index, values = (np.concatenate(part) for part in zip(*parts, strict=True))
        values = self._fade.values_of(op, values)
        # By index, and for equal indices by op: the last of them counts.
        order = np.lexsort((op, index))
        index, values = index[order], values[order]
        last = np.append(index[1:] != index[:-1], np.ones(min(len(index), 1), dtype=np.bool_))
        kept = values[last].astype(np.uint32)
        return DecodedOps(index[last], kept, self._colors)

    def _error(self, what: str) -> RemoteProtocolError:
        return RemoteProtocolError(
            f"ops: {what}", section="7", offset=3 + self._op_at, raw=self._data
        )

    # Operands

    def _take(self, count: int) -> bytes:
        if self._at + count > len(self._data):
            raise self._error("the payload ends inside an op")
        self._at += count
        return self._data[self._at - count : self._at]

    def _voxel(self) -> int:
        """Return the index of a voxel that an op names."""
        raw = self._take(3 * self._wide)
        x, y, z = raw if self._wide == 1 else np.frombuffer(raw, dtype="<u2").tolist()
        nx, ny, nz = self._grid
        if x >= nx or y >= ny or z >= nz:
            raise self._error(f"({x}, {y}, {z}) is not on the grid")
        return int(x + nx * (y + ny * z))

    def _place(self, index: int) -> tuple[int, int, int]:
        nx, ny, _ = self._grid
        return index % nx, index // nx % ny, index // (nx * ny)

    def _cursor_voxel(self) -> int:
        if self._cursor >= self._voxels:
            raise self._error("the cursor is behind the last voxel")
        return self._cursor

    def _count(self, low: int) -> int:
        """Return a count: section 7.2."""
        return low + 1 if low < _OPERAND else 32 + self._leb128(32)

    def _leb128(self, base: int = 0) -> int:
        """Return a LEB128 to which ``base`` is added."""
        k = 0
        for place in range(5):
            byte = self._take(1)[0]
            k |= (byte & 127) << 7 * place
            if byte < 128:
                if (place and not byte) or k + base >= 1 << 32:
                    break
                return k
        raise self._error("a count is not in its shortest form")

    def _reserve(self, voxels: int) -> None:
        """Count voxels that are written; raise if there are too many."""
        self._left -= voxels
        if self._left < 0:
            raise self._error("voxels are written again and again")

    def _span_end(self, count: int) -> int:
        end = self._cursor + count
        if end > self._voxels:
            raise self._error("voxels behind the last one")
        return end

    def _begin_span(self, count: int) -> None:
        """Check a span before anything of its size is made."""
        self._span_end(count)
        self._reserve(count)

    def _add_span(self, values: Values) -> None:
        end = self._span_end(len(values))
        self._spans.op.append(self._ops)
        self._spans.start.append(self._cursor)
        self._spans.count.append(len(values))
        self._spans.values.append(values)
        self._cursor = end
        self._fade.leave()

    def _row_pen(self, count: int, *, again: bool) -> int:
        """Return the pixel value of voxels in a row, or its code if there is a fade."""
        self._reserve(count)
        if not self._fade.active:
            return self._pen
        code = self._fade.row(count, again=again)
        self._pen = self._fade.pen
        return code

    # Ops

    def read_end(self) -> None:
        """Read END: all bytes behind it are 00."""
        if any(self._take(len(self._data) - self._at)):
            raise self._error("bytes behind END that are not 00")

    def read_pen(self) -> None:
        """Read PEN."""
        self._pen = int.from_bytes(self._take(self._format.bytes), "little")
        if self._format is PixelFormat.MONO1 and self._pen > 1:
            raise self._error("a mono1 pixel is 0 or 1")
        self._fade.end()

    def read_hold(self) -> None:
        """Read HOLD, which draws nothing."""
        self._take(1)

    def read_fade(self) -> None:
        """Read FADE."""
        stops = self._take(1)[0] + 1
        count = self._leb128() + 1
        if count > spec.LIMIT_MAX_FADE or self._format is PixelFormat.MONO1:
            raise self._error(f"a fade of {count} voxels, or of mono1")
        place = self._leb128()
        if place >= count:
            raise self._error(f"a fade begins at voxel {place} of {count}")
        self._fade.begin(Spread(self._stops(stops), count), place)
        self._pen = self._fade.pen

    def _stops(self, count: int, size: int | None = None) -> NDArray[np.uint8]:
        """Return colours of FADE, or of ``size`` bytes each: (count, size)."""
        size = size or (1 if self._format is PixelFormat.INDEX8 else 3)
        return np.frombuffer(self._take(size * count), dtype=np.uint8).reshape(count, size)

    def read_move(self) -> None:
        """Read MOVE."""
        self._cursor = self._voxel()
        self._fade.leave()

    def read_line(self) -> None:
        """Read LINE."""
        begin, self._cursor = self._cursor_voxel(), self._voxel()
        ends = self._grid.voxels_at(np.array([begin, self._cursor])).astype(np.int64)
        pen = self._row_pen(int(np.abs(ends[1] - ends[0]).max()) + 1, again=True)
        self._shapes.add_line(self._ops, pen, begin, self._cursor)

    def read_box(self) -> None:
        """Read BOX."""
        begin, self._cursor = self._cursor_voxel(), self._voxel()
        corners = zip(self._place(begin), self._place(self._cursor), strict=True)
        self._reserve(math.prod(abs(a - b) + 1 for a, b in corners))
        self._shapes.add_box(self._ops, self._pen, begin, self._cursor)
        self._fade.leave()

    def read_dots(self) -> None:
        """Read DOTS."""
        count = self._take(1)[0] + 1
        raw = self._take(3 * self._wide * count)
        voxels = np.frombuffer(raw, dtype="<u2" if self._wide == 2 else np.uint8).reshape(-1, 3)
        if not self._grid.inside(voxels).all():
            raise self._error("a voxel is not on the grid")
        index = self._grid.index_of(voxels)
        self._shapes.add_dots(self._ops, self._row_pen(count, again=False), index)
        self._cursor = int(index[-1])

    def read_colors(self) -> None:
        """Read COLORS."""
        first, more = self._take(2)
        if first + more >= spec.LIMIT_MAX_COLORS:
            raise self._error("entries behind the end of the palette")
        raw = self._take(3 * (more + 1))
        for at in range(more + 1):
            red, green, blue = raw[3 * at : 3 * at + 3]
            self._colors[first + at] = (red, green, blue)

    def read_ramp(self) -> None:
        """Read RAMP."""
        first, more, stops = self._take(3)
        colors = self._stops(stops + 1, 3)
        if first + more >= spec.LIMIT_MAX_COLORS:
            raise self._error("entries behind the end of the palette")
        for at, (red, green, blue) in enumerate(
            blend(colors, more + 1, np.arange(more + 1)).tolist()
        ):
            self._colors[first + at] = (red, green, blue)

    def read_arc(self, *, second: bool = False) -> None:
        """Read ARC, which takes the rest; or ARC2, under which a fade goes on."""
        raw = self._take(len(self._data) - self._at)
        try:
            pieces = list(decode_range_coded(raw, self._grid, self._format, second=second))
        except ValueError as error:
            raise self._error(str(error)) from error
        if not second:
            self._fade.end()
        for ink, voxels in pieces:
            if isinstance(ink, Spread):
                self._fade.begin(ink, ink.first)
            elif ink is not None:
                self._pen = ink
                self._fade.end()
            if voxels:
                pen = self._row_pen(len(voxels), again=False)
                self._shapes.add_dots(self._ops, pen, np.array(voxels, dtype=np.int64))
            self._ops += 1  # the pens of a fade are counted for each op by itself

    def read_arc2(self) -> None:
        """Read ARC2."""
        self.read_arc(second=True)

    def read_slabs(self) -> None:
        """Read SLABS, which takes the rest."""
        raw = self._take(len(self._data) - self._at)
        try:
            for index in decode_slabs(raw, self._grid):
                self._reserve(len(index))
                self._shapes.add_dots(self._ops, self._pen, index)
        except ValueError as error:
            raise self._error(str(error)) from error

    def read_values(self) -> None:
        """Read VALUES, which takes the rest."""
        if self._format is PixelFormat.MONO1:
            raise self._error("VALUES is no op of mono1")
        raw = self._take(len(self._data) - self._at)
        try:
            for index, values in decode_valued_slabs(raw, self._grid, self._format):
                self._reserve(len(index))
                self._shapes.add_dots(self._ops, values, index)
        except ValueError as error:
            raise self._error(str(error)) from error

    def _chain(self, octant: int, begin: int, *, again: bool = False) -> None:
        steps = self._take(1)[0] + 1
        crumbs = self._take(-(-steps // 4))
        if steps % 4 and crumbs[-1] >> 2 * (steps % 4):
            raise self._error("unused crumbs are not 0")
        if begin >= self._voxels:
            raise self._error("the cursor is behind the last voxel")
        moved = (steps, sum(crumbs.translate(_EVEN)), sum(crumbs.translate(_ODD)))
        self._cursor = begin
        for number, count in enumerate(moved):
            axis = (octant // 8 + number) % 3
            # On each axis a chain moves in one direction: its end is the farthest.
            self._cursor += self._moved(begin, axis, -count if octant >> axis & 1 else count)
        pen = self._row_pen(steps + 1, again=again)
        self._chains.add(self._ops, pen, begin, octant, steps, crumbs)

    def _moved(self, index: int, axis: int, count: int) -> int:
        """Return the change of an index by a move; raise if it leaves the grid."""
        nx, ny, nz = self._grid
        place = self._place(index)[axis] + count
        if not 0 <= place < (nx, ny, nz)[axis]:
            raise self._error("a chain leaves the grid")
        return count * (1, nx, nx * ny)[axis]

    def _brick(self, level: int) -> None:
        raw = self._take(3 * self._wide)
        x, y, z = raw if self._wide == 1 else np.frombuffer(raw, dtype="<u2").tolist()
        masks = []
        nodes, voxels = 1, 0
        for height in range(level, 0, -1):
            masks.append(self._take(nodes))
            nodes = int.from_bytes(masks[-1], "little").bit_count()
            voxels += masks[-1].count(0) << 3 * height
            if not nodes:
                break
        self._reserve(voxels + nodes)
        self._bricks.add(self._ops, self._pen, (x, y, z), level, masks)

    def read_skip(self, count: int) -> None:
        """Read SKIP."""
        self._cursor = self._span_end(count)
        self._fade.leave()

    def read_run(self, count: int) -> None:
        """Read RUN."""
        self._begin_span(count)
        self._add_span(np.full(count, self._pen, dtype=np.uint32))

    def read_literal(self, count: int) -> None:
        """Read LIT."""
        self._begin_span(count)
        if self._format is PixelFormat.MONO1:
            raw = self._take(-(-count // 8))
            bits = np.unpackbits(np.frombuffer(raw, dtype=np.uint8), bitorder="little")
            if bits[count:].any():
                raise self._error("unused bits of pixels are not 0")
            values = bits[:count].astype(np.uint32)
        else:
            size = self._format.bytes
            raw = self._take(count * size)
            padded = np.zeros((count, 4), dtype=np.uint8)
            padded[:, :size] = np.frombuffer(raw, dtype=np.uint8).reshape(count, size)
            values = padded.view("<u4")[:, 0]
        self._pen = int(values[-1])
        self._fade.end()
        self._add_span(values)

    def read_differences(self, count: int) -> None:
        """Read DIFF."""
        if self._format is not PixelFormat.INDEX8:
            raise self._error("DIFF is an op of index8")
        self._begin_span(count)
        raw = np.frombuffer(self._take(-(-count // 2)), dtype=np.uint8)
        nibbles = np.stack((raw & 15, raw >> 4), axis=1).reshape(-1)
        if nibbles[count:].any():
            raise self._error("unused bits of differences are not 0")
        steps = nibbles[:count].astype(np.int64)
        steps[steps > 7] -= 16
        values: NDArray[np.uint32] = ((self._pen + np.cumsum(steps)) % 256).astype(np.uint32)
        self._pen = int(values[-1])
        self._fade.end()
        self._add_span(values)


_SIMPLE: Final = {
    spec.OP_END: _Parser.read_end,
    spec.OP_PEN: _Parser.read_pen,
    spec.OP_MOVE: _Parser.read_move,
    spec.OP_LINE: _Parser.read_line,
    spec.OP_BOX: _Parser.read_box,
    spec.OP_DOTS: _Parser.read_dots,
    spec.OP_COLORS: _Parser.read_colors,
    spec.OP_HOLD: _Parser.read_hold,
    spec.OP_FADE: _Parser.read_fade,
    spec.OP_RAMP: _Parser.read_ramp,
    spec.OP_ARC: _Parser.read_arc,
    spec.OP_SLABS: _Parser.read_slabs,
    spec.OP_ARC2: _Parser.read_arc2,
    spec.OP_VALUES: _Parser.read_values,
}
_COUNTED: Final = {
    spec.OP_SKIP: _Parser.read_skip,
    spec.OP_RUN: _Parser.read_run,
    spec.OP_LIT: _Parser.read_literal,
    spec.OP_DIFF: _Parser.read_differences,
}
