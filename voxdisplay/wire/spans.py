"""Pixels in scan order <-> SKIP, RUN, LIT and PEN (protocol.md, section 7.2).

The encoder cuts lit pixels into *spans*: RUN where one pixel repeats, LIT elsewhere, and nothing at
all where it is dark. The decoder reads what a PAGE brings. Neither knows what the pixels show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.pixel import PixelFormat, Values
from voxdisplay.wire import spec
from voxdisplay.wire.ops import SHORT_COUNT, Coding, Ints, count_op

# A dark gap of at most this many pixel bytes inside a LIT is cheaper than SKIP and a new LIT.
_GAP_BYTES = 2
# Where the ops of a PAGE begin in its packet.
_PAGE_OPS = 12


@dataclass(frozen=True)
class _Spans:
    """Spans of pixels, in order: where they begin, how long they are, and whether they are RUNs."""

    start: Ints
    length: Ints
    is_run: NDArray[np.bool_]


def encode_spans(values: NDArray[np.integer], coding: Coding) -> list[bytes]:
    """Give the payloads that draw a page which is dark before.

    Parameters
    ----------
    values : (V,) integer array
        Pixel value of each voxel in scan order.
    coding : Coding

    Returns
    -------
    list of bytes
        At most ``coding.max_payload`` bytes each; empty if all is dark.

    """
    mono = coding.format is PixelFormat.MONO1
    spans = _mono_spans(values) if mono else _pixel_spans(values, coding.format.bytes)
    return _Payloads(values, coding).of(spans)


def _runs(values: NDArray[np.integer]) -> tuple[Ints, Ints]:
    """Give starts and lengths of the runs of equal values."""
    if len(values) == 0:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    start = np.concatenate(([0], np.flatnonzero(values[1:] != values[:-1]) + 1))
    return start, np.diff(start, append=len(values))


def _pixel_spans(values: NDArray[np.integer], pixel_bytes: int) -> _Spans:
    """Choose LIT or RUN for each run of equal pixels of a byte or more."""
    start, length = _runs(values)
    dark = values[start] == 0
    # A RUN behind a LIT repeats the LIT's last pixel: one pixel, its own op, and the next LIT's.
    repeats = ~dark & ((length - 1) * pixel_bytes > 2 + (length > SHORT_COUNT))
    edge = np.concatenate(([True], dark[:-1] | repeats[:-1]))
    bridge = dark & (length * pixel_bytes <= _GAP_BYTES) & ~edge
    bridge[:-1] &= ~(dark | repeats)[1:]
    if len(bridge):
        bridge[-1] = False
    literal = (~dark & ~repeats) | bridge
    # Runs that a LIT holds follow each other; the first of each group gives the LIT its place.
    first = literal & ~np.concatenate(([False], literal[:-1]))
    group = np.cumsum(first)[literal] - 1
    sizes = np.bincount(group, weights=length[literal]).astype(np.int64)
    # A repeat right behind a LIT lends it its first pixel, which sets the pen.
    lends = repeats & np.concatenate(([False], literal[:-1]))
    if lends.any():
        sizes[np.cumsum(first)[lends] - 1] += 1
    begin = np.concatenate((start[first], start[repeats] + lends[repeats]))
    size = np.concatenate((sizes, length[repeats] - lends[repeats]))
    is_run = np.repeat([False, True], [len(sizes), int(repeats.sum())])
    order = np.argsort(begin, kind="stable")
    return _Spans(begin[order], size[order], is_run[order])


def _mono_spans(values: NDArray[np.integer]) -> _Spans:
    """Choose RUNs of lit pixels, or LIT over a busy stretch: there a pixel is but a bit."""
    start, length = _runs(values)
    lit = values[start] != 0
    start, length = start[lit], length[lit]
    if len(start) == 0:
        return _Spans(start, length, np.zeros(0, dtype=np.bool_))
    end = start + length
    gap = start[1:] - end[:-1]
    # SKIP and RUN cost about 16 bits a lit run; where the runs come closer than that, bits win.
    near = gap + length[1:] < 16
    group = np.concatenate(([0], np.cumsum(~near)))
    runs = np.bincount(group)
    first = np.flatnonzero(np.concatenate(([True], ~near)))
    last = np.concatenate((first[1:] - 1, [len(start) - 1]))
    extent = end[last] - start[first]
    busy = 3 + -(-extent // 8) < 2 * runs
    alone = ~busy[group]
    begin = np.concatenate((start[alone], start[first][busy]))
    size = np.concatenate((length[alone], extent[busy]))
    is_run = np.repeat([True, False], [int(alone.sum()), int(busy.sum())])
    order = np.argsort(begin, kind="stable")
    return _Spans(begin[order], size[order], is_run[order])


class _Payloads:
    """Lays spans out in payloads, each as full as it goes; a LIT is cut where a payload ends."""

    def __init__(self, values: NDArray[np.integer], coding: Coding) -> None:
        self._values = values
        self._coding = coding
        self._done: list[bytes] = []
        self._open = bytearray()
        self._cursor = 0
        self._pen = coding.format.full
        pixels = coding.format.pixels(values)
        self._pixels = pixels if coding.format is PixelFormat.MONO1 else pixels.tobytes()

    def of(self, spans: _Spans) -> list[bytes]:
        """Give the payloads of spans."""
        for start, length, is_run in zip(
            spans.start.tolist(), spans.length.tolist(), spans.is_run.tolist(), strict=True
        ):
            if is_run:
                self._add_run(start, length)
            else:
                self._add_literal(start, length)
        if self._open:
            self._close()
        return self._done

    def _close(self) -> None:
        self._done.append(bytes(self._open))
        self._open.clear()
        self._cursor = 0
        self._pen = self._coding.format.full

    def _goto(self, start: int) -> bytes:
        """Bring the cursor to an index, by SKIP or MOVE, whichever is shorter."""
        if start == self._cursor:
            return b""
        skip = count_op(spec.OP_SKIP, start - self._cursor)
        if len(skip) <= 1 + self._coding.move_bytes:
            return skip
        size = self._coding.coordinate_bytes
        place = self._coding.grid.voxels_at(np.array([start]))[0].tolist()
        return bytes((spec.OP_MOVE,)) + b"".join(c.to_bytes(size, "little") for c in place)

    def _add_run(self, start: int, length: int) -> None:
        op = self._run(start, length)
        if len(self._open) + len(op) > self._coding.max_payload:
            self._close()
            op = self._run(start, length)
        self._open += op
        self._cursor = start + length
        self._pen = int(self._values[start])

    def _run(self, start: int, length: int) -> bytes:
        """Give what draws a RUN from where cursor and pen are now."""
        value = int(self._values[start])
        op = self._goto(start)
        if value != self._pen:
            op += bytes((spec.OP_PEN,)) + value.to_bytes(self._coding.format.bytes, "little")
        return op + count_op(spec.OP_RUN, length)

    def _add_literal(self, start: int, length: int) -> None:
        end = start + length
        while start < end:
            goto = self._goto(start)
            room = self._coding.max_payload - len(self._open) - len(goto)
            count = min(end - start, self._most_pixels(room))
            if count <= 0:
                self._close()
                continue
            self._open += goto + count_op(spec.OP_LIT, count) + self._pixel_run(start, count)
            start += count
            self._cursor = start
            self._pen = int(self._values[start - 1])

    def _most_pixels(self, room: int) -> int:
        """Pixels of the longest LIT in ``room`` bytes."""
        overhead = 1
        while (count := self._pixels_in(room - overhead)) > 0:
            if len(count_op(spec.OP_LIT, count)) <= overhead:
                break
            overhead += 1
        return count

    def _pixels_in(self, room: int) -> int:
        if self._coding.format is PixelFormat.MONO1:
            return 8 * room
        return room // self._coding.format.bytes

    def _pixel_run(self, start: int, count: int) -> bytes:
        if isinstance(self._pixels, bytes):
            size = self._coding.format.bytes
            return self._pixels[start * size : (start + count) * size]
        return np.packbits(self._pixels[start : start + count], bitorder="little").tobytes()


def decode_spans(ops: bytes, count: int, format_: PixelFormat) -> Values:
    """Read the ops of a PAGE (section 10).

    Parameters
    ----------
    ops : bytes
        END, PEN, SKIP, RUN and LIT only.
    count : int
        Pixels that they must cover.
    format_ : PixelFormat

    Returns
    -------
    (count,) uint32 array
        Pixel values.

    Raises
    ------
    RemoteProtocolError
        If an op is not allowed there, is cut off, or the ops do not cover exactly ``count``.

    """
    reader = _Reader(ops, count, format_)
    while reader.at < len(ops):
        reader.read_op()
    if reader.cursor != count:
        raise reader.wrong(f"the ops cover {reader.cursor} voxels, not {count}")
    return reader.values


class _Reader:
    """The ops of a PAGE, one after another, into an array."""

    def __init__(self, ops: bytes, count: int, format_: PixelFormat) -> None:
        self.values = np.zeros(count, dtype=np.uint32)
        self.at = 0
        self.cursor = 0
        self._ops = ops
        self._format = format_
        self._pen = format_.full

    def wrong(self, what: str) -> RemoteProtocolError:
        """Give the error that says what is wrong with the op at `at`."""
        return RemoteProtocolError(
            f"PAGE: {what}", section="10", offset=_PAGE_OPS + self.at, raw=self._ops
        )

    def read_op(self) -> None:
        """Read the op at `at`, and go behind it."""
        op = self._ops[self.at]
        if op == spec.OP_END:
            if any(self._ops[self.at :]):
                raise self.wrong("bytes behind END are not 0")
            self.at = len(self._ops)
        elif op == spec.OP_PEN:
            run, behind = self._pixels(self.at + 1, 1)
            self._pen = int(run[0])
            self.at = behind
        elif (kind := op & 0xE0) in (spec.OP_SKIP, spec.OP_RUN, spec.OP_LIT):
            self._draw(kind)
        else:
            raise self.wrong(f"op {op:02X} is not allowed there")

    def _draw(self, kind: int) -> None:
        try:
            n, behind = _read_count(self._ops, self.at)
        except (IndexError, ValueError) as error:
            raise self.wrong("a count is malformed") from error
        end = self.cursor + n
        if end > len(self.values):
            raise self.wrong(f"the ops cover more than {len(self.values)} voxels")
        if kind == spec.OP_RUN:
            self.values[self.cursor : end] = self._pen
        elif kind == spec.OP_LIT:
            self.values[self.cursor : end], behind = self._pixels(behind, n)
            self._pen = int(self.values[end - 1])
        self.cursor, self.at = end, behind

    def _pixels(self, at: int, n: int) -> tuple[Values, int]:
        """Read the pixel run (section 2.1) of n pixels at a place; give where it ends, too."""
        mono = self._format is PixelFormat.MONO1
        behind = at + (-(-n // 8) if mono else n * self._format.bytes)
        if behind > len(self._ops):
            raise self.wrong("a pixel is cut off")
        run = np.frombuffer(self._ops[at:behind], dtype=np.uint8)
        if not mono:
            channels = run.reshape(n, self._format.bytes).astype(np.uint32)
            shifts = np.arange(self._format.bytes, dtype=np.uint32) * np.uint32(8)
            return np.asarray((channels << shifts).sum(axis=1, dtype=np.uint32)), behind
        bits = np.unpackbits(run, bitorder="little")
        if bits[n:].any():
            raise self.wrong("unused bits are not 0")
        return bits[:n].astype(np.uint32), behind


def _read_count(ops: bytes, at: int) -> tuple[int, int]:
    """Read the count of the op at ``at``; give it and where its operands go on."""
    low = ops[at] & SHORT_COUNT
    at += 1
    if low < SHORT_COUNT:
        return low + 1, at
    rest = 0
    for shift in (0, 7, 14, 21, 28):
        byte = ops[at]
        at += 1
        rest |= (byte & 0x7F) << shift
        if byte < 0x80:
            if byte == 0 and shift:
                break
            return SHORT_COUNT + 1 + rest, at
    raise ValueError("not the shortest LEB128")
