"""Encoder and decoder of pixels in scan order: SKIP, RUN, LIT, DIFF, PEN (protocol.md, 7.2, 7.5).

The encoder finds runs of equal pixels, has `optimal_parse` choose an op for each, and makes the
bytes. The decoder reads the ops of a PAGE (section 10). Must not know what the pixels show.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.raster.pixel_format import PixelFormat, Values
from voxdisplay.wire import spec
from voxdisplay.wire.incremental_work import Incremental, run_to_end
from voxdisplay.wire.op_encoding import (
    SHORT_COUNT,
    Bools,
    Bytes,
    EncoderConfig,
    Ints,
    concat_ranges,
    counted_op_bytes,
    counted_ops,
    little_endian,
)
from voxdisplay.wire.optimal_parse import DIFF, LIT, OP_PAIRS, RUN, SKIP, Runs, cheapest_ops
from voxdisplay.wire.payload_splitting import ANY, OpBlocks, PayloadLayout, no_blocks

PixelLookup = Callable[[Ints], NDArray[np.integer]]

# Gaps of up to so many pixels may be cheaper to write again than to skip.
_NARROW = 64
# Offset of the ops of a PAGE in its packet.
_PAGE_OPS = 12


def encode_spans(values: NDArray[np.integer], config: EncoderConfig) -> list[bytes]:
    """Return the payloads that draw a page over a dark one.

    Parameters
    ----------
    values : (V,) integer array
        Pixel value of each voxel in scan order.
    config : EncoderConfig

    Returns
    -------
    list of bytes
        At most ``config.max_payload`` bytes each; empty if all is dark.

    """
    return PayloadLayout(run_to_end(encode_runs(page_runs(values), config)), config).payloads


def page_runs(values: NDArray[np.integer]) -> Runs:
    """Return the runs of a page; dark ones may be skipped."""
    edges = np.flatnonzero(values[1:] != values[:-1]) + 1
    start = np.concatenate(([0], edges)) if len(values) else edges
    length = np.diff(start, append=len(values))
    value = values[start].astype(np.int64)
    # Dark runs at the beginning and at the end need no op.
    lit = slice(int(value[:1].sum() == 0), len(value) - int(value[-1:].sum() == 0))
    start, length, value = start[lit], length[lit], value[lit]
    dark = value == 0
    return Runs(start, length, value, dark, ~dark | (length <= _NARROW))


def set_runs(index: Ints, values: NDArray[np.integer], pixels_at: PixelLookup) -> Runs:
    """Return the runs of a set of voxels, and of the gaps between them, which may be skipped.

    Parameters
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once, n >= 1.
    values : (n,) integer array
        Their pixel values.
    pixels_at : PixelLookup
        Function from indices to the pixel values of the finished page.

    """
    apart = np.diff(index) != 1
    first = np.flatnonzero(np.concatenate(([True], apart | (values[1:] != values[:-1]))))
    length = np.diff(first, append=len(index))
    start, value = index[first], values[first].astype(np.int64)
    behind = start[:-1] + length[:-1]
    gap = start[1:] - behind
    gaps = np.flatnonzero(gap)
    behind, gap = behind[gaps], gap[gaps]
    looked_at = np.where(gap <= _NARROW, gap, 1)
    begins = np.cumsum(looked_at) - looked_at
    pixels = pixels_at(concat_ranges(behind, looked_at)).astype(np.int64)
    uniform = gap <= _NARROW
    if len(gap):
        same = pixels == np.repeat(pixels[begins], looked_at)
        uniform &= np.logical_and.reduceat(same, begins)
    order = np.argsort(np.concatenate((start, behind)), kind="stable")
    return Runs(
        np.concatenate((start, behind))[order],
        np.concatenate((length, gap))[order],
        np.concatenate((value, pixels[begins]))[order],
        (np.arange(len(order)) >= len(start))[order],
        np.concatenate((np.ones(len(start), dtype=np.bool_), uniform))[order],
    )


def min_bytes(index: Ints, config: EncoderConfig) -> int:
    """Return a lower bound of the bytes for voxels, (n,) ascending, n >= 1; cheap to find.

    Each gap is either skipped, and a new op follows, or drawn together with a voxel after it.
    """
    gap = np.diff(index) - 1
    gap = gap[gap > 0]
    bits = 1 if config.format is PixelFormat.MONO1 else 8 * config.format.bytes
    if config.has(spec.FEATURE_DIFF):
        bits = 4
    drawn = (gap + 1) * bits // 8
    skipped = np.minimum(counted_op_bytes(gap), 1 + config.position_bytes) + 1
    return 1 + int(np.minimum(skipped, drawn).sum())


def encode_span_set(
    index: Ints, values: NDArray[np.integer], pixels_at: PixelLookup, config: EncoderConfig
) -> Incremental[OpBlocks]:
    """Return op blocks that draw a set of voxels, incrementally; parameters as of `set_runs`."""
    runs = set_runs(index, values, pixels_at)
    yield
    return (yield from encode_runs(runs, config))


def encode_runs(runs: Runs, config: EncoderConfig) -> Incremental[OpBlocks]:
    """Return the op blocks that draw runs, incrementally."""
    choice = yield from cheapest_ops(runs, config)
    yield
    op, rest = OP_PAIRS[:, 0][choice], OP_PAIRS[:, 1][choice]
    split = np.flatnonzero(rest)
    count = runs.length.copy()
    count[split] = 1
    behind = split + 1
    op = np.insert(op, behind, rest[split])
    start = np.insert(runs.start, behind, runs.start[split] + 1)
    count = np.insert(count, behind, runs.length[split] - 1)
    value = np.insert(runs.value, behind, runs.value[split])
    drawn = op != SKIP
    if not drawn.any():
        return no_blocks()
    return _blocks_of_stretches(op[drawn], start[drawn], count[drawn], value[drawn], config)


def _blocks_of_stretches(
    op: Ints, start: Ints, count: Ints, value: Ints, config: EncoderConfig
) -> OpBlocks:
    """Return op blocks of stretches of equal pixels; consecutive LITs or DIFFs become one op."""
    goes_on = np.zeros(len(op), dtype=np.bool_)
    goes_on[1:] = (op[1:] == op[:-1]) & (op[1:] != RUN) & (start[1:] == (start + count)[:-1])
    first = np.flatnonzero(~goes_on)
    pixels = np.add.reduceat(count, first)
    # All pixels of LIT and DIFF, one of RUN; and the pen before each.
    written = np.where(op == RUN, 1, count)
    pixel = np.repeat(value, written)
    pen = np.concatenate(([config.format.full], pixel[:-1]))
    at_pixel = (np.cumsum(written) - written)[first]

    op, start = op[first], start[first]
    bits = 1 if config.format is PixelFormat.MONO1 else 8 * config.format.bytes
    most_literal = _max_pixels(config.max_block_bytes + config.pen_bytes, bits)  # it needs no pen
    most = [most_literal, _max_pixels(config.max_block_bytes, 4)]
    limit = np.select([op == LIT, op == DIFF], most, 1 << 62)
    parts = -(-pixels // limit)
    owner = np.repeat(np.arange(len(op)), parts)
    done = concat_ranges(np.zeros(len(op), dtype=np.int64), parts) * limit[owner]
    op, start = op[owner], start[owner] + done
    pixels = np.minimum(pixels[owner] - done, limit[owner])
    at_pixel = at_pixel[owner] + done
    last = pixel[at_pixel + np.where(op == RUN, 1, pixels) - 1]
    needs = np.where(op == LIT, ANY, np.where(op == RUN, last, pen[at_pixel]))
    body, size = _encode_ops(op, pixels, at_pixel, pixel, pen, config)
    none = np.zeros(len(op), dtype=np.bool_)
    return OpBlocks(body, size, needs, start, last, start + pixels, none)


def _max_pixels(room: int, bits: int) -> int:
    """Return the most pixels of ``bits`` bits that an op with its count holds in ``room`` bytes."""
    overhead = 1
    while True:
        count = (room - overhead) * 8 // bits
        if int(counted_op_bytes(np.array(count))) <= overhead:
            return count
        overhead += 1


def _encode_ops(
    op: Ints, count: Ints, at_pixel: Ints, pixel: Ints, pen: Ints, config: EncoderConfig
) -> tuple[Bytes, Ints]:
    """Return all ops with their operands, concatenated, and the bytes of each."""
    ops, op_bytes = counted_ops(op, count)
    size = op_bytes.copy()
    operands: list[tuple[Bools, Bytes, Ints]] = []
    if (which := op == LIT).any():
        picked = pixel[concat_ranges(at_pixel[which], count[which])]
        operands.append((which, *_literal_operands(picked, count[which], config)))
    if (which := op == DIFF).any():
        places = concat_ranges(at_pixel[which], count[which])
        nibbles = ((pixel[places] - pen[places]) & 15).astype(np.uint8)
        operands.append((which, *_pack_bits(nibbles, count[which], 2)))
    for which, _, bytes_of in operands:
        size[which] += bytes_of
    at = np.cumsum(size) - size
    body = np.empty(int(size.sum()), dtype=np.uint8)
    body[concat_ranges(at, op_bytes)] = ops[np.arange(ops.shape[1]) < op_bytes[:, None]]
    for which, data, bytes_of in operands:
        body[concat_ranges((at + op_bytes)[which], bytes_of)] = data
    return body, size


def _literal_operands(pixel: Ints, count: Ints, config: EncoderConfig) -> tuple[Bytes, Ints]:
    """Return the pixel runs (section 2.1) of LIT ops."""
    if config.format is PixelFormat.MONO1:
        return _pack_bits(pixel.astype(np.uint8), count, 8)
    return little_endian(pixel, config.format.bytes).reshape(-1), count * config.format.bytes


def _pack_bits(parts: Bytes, count: Ints, per_byte: int) -> tuple[Bytes, Ints]:
    """Return parts packed to bytes, the first lowest; each stretch of ``count`` begins a byte."""
    size = -(-count // per_byte)
    padded = np.zeros((int(size.sum()), per_byte), dtype=np.uint8)
    padded.reshape(-1)[concat_ranges((np.cumsum(size) - size) * per_byte, count)] = parts
    weights = (1 << np.arange(per_byte) * (8 // per_byte)).astype(np.uint8)
    return padded @ weights, size


def decode_spans(ops: bytes, count: int, format_: PixelFormat) -> Values:
    """Return the pixel values of the ops of a PAGE (section 10).

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
        If an op is not allowed there or is truncated, or the ops do not cover ``count`` pixels.

    """
    values = np.zeros(count, dtype=np.uint32)
    for start, run in decode_runs(ops, count, format_):
        values[start : start + len(run)] = run
    return values


def decode_runs(ops: bytes, count: int, format_: PixelFormat) -> list[tuple[int, Values]]:
    """Return the runs of pixels that the ops of a PAGE write: all others are dark.

    Parameters and errors are those of `decode_spans`. It costs what is written, however many voxels
    are covered.

    Returns
    -------
    list of (int, (n,) uint32 array)
        The first pixel of each run, ascending, and its pixel values, of which some may be 0.

    """
    reader = _PageReader(ops, count, format_)
    while reader.at < len(ops):
        reader.read_op()
    if reader.cursor != count:
        raise reader.error(f"the ops cover {reader.cursor} voxels, not {count}")
    return reader.runs


class _PageReader:
    """Reader of the ops of a PAGE into runs of pixel values."""

    def __init__(self, ops: bytes, count: int, format_: PixelFormat) -> None:
        self.runs: list[tuple[int, Values]] = []
        self.at = 0
        self.cursor = 0
        self._ops = ops
        self._count = count
        self._format = format_
        self._pen = format_.full

    def error(self, what: str) -> RemoteProtocolError:
        """Return the error of the op at `at`."""
        return RemoteProtocolError(
            f"PAGE: {what}", section="10", offset=_PAGE_OPS + self.at, raw=self._ops
        )

    def read_op(self) -> None:
        """Read the op at `at` and advance past it."""
        op = self._ops[self.at]
        if op == spec.OP_END:
            if any(self._ops[self.at :]):
                raise self.error("bytes behind END are not 0")
            self.at = len(self._ops)
        elif op == spec.OP_PEN:
            run, behind = self._pixels(self.at + 1, 1)
            self._pen = int(run[0])
            self.at = behind
        elif (kind := op & 0xE0) in (spec.OP_SKIP, spec.OP_RUN, spec.OP_LIT):
            self._draw(kind)
        else:
            raise self.error(f"op {op:02X} is not allowed there")

    def _draw(self, kind: int) -> None:
        try:
            n, behind = _read_count(self._ops, self.at)
        except (IndexError, ValueError) as error:
            raise self.error("a count is malformed") from error
        end = self.cursor + n
        if end > self._count:
            raise self.error(f"the ops cover more than {self._count} voxels")
        if kind == spec.OP_RUN and self._pen:
            pen = np.array(self._pen, dtype=np.uint32)
            self.runs.append((self.cursor, np.broadcast_to(pen, (n,))))
        elif kind == spec.OP_LIT:
            run, behind = self._pixels(behind, n)
            self.runs.append((self.cursor, run))
            self._pen = int(run[-1])
        self.cursor, self.at = end, behind

    def _pixels(self, at: int, n: int) -> tuple[Values, int]:
        """Return the pixel run (section 2.1) of n pixels at an offset, and its end."""
        mono = self._format is PixelFormat.MONO1
        behind = at + (-(-n // 8) if mono else n * self._format.bytes)
        if behind > len(self._ops):
            raise self.error("a pixel is cut off")
        run = np.frombuffer(self._ops[at:behind], dtype=np.uint8)
        if not mono:
            channels = run.reshape(n, self._format.bytes).astype(np.uint32)
            shifts = np.arange(self._format.bytes, dtype=np.uint32) * np.uint32(8)
            return np.asarray((channels << shifts).sum(axis=1, dtype=np.uint32)), behind
        bits = np.unpackbits(run, bitorder="little")
        if bits[n:].any():
            raise self.error("unused bits are not 0")
        return bits[:n].astype(np.uint32), behind


def _read_count(ops: bytes, at: int) -> tuple[int, int]:
    """Return the count of the op at ``at``, and the offset of its operands."""
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
