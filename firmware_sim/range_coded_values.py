"""Decoder of range-coded pixel values, the op VALUES, into voxels and their pixels (7.13).

Draws nothing. Goes through the slices of a slab voxel by voxel, with the slice below beside it.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from firmware_sim import spec
from firmware_sim.grid import Grid
from firmware_sim.operands import Operands
from firmware_sim.range_coded_slabs import Slab, boxes_of_slabs
from firmware_sim.range_decoder import RangeDecoder

# Highest level of each channel, by format (2.1).
_TOPS: Final = {
    spec.FORMAT_INDEX8: (255,),
    spec.FORMAT_RGB565: (31, 63, 31),
    spec.FORMAT_RGB888: (255, 255, 255),
}
_WEIGHTS: Final = 7
_NO_WEIGHT: Final = 1 << spec.VALUES_WEIGHT_BITS - 1  # the weight 0, as it is sent
_CONTEXTS: Final = 128  # of the copies from one neighbour
_NEAR: Final = 3  # neighbours: west, north, below
_DEFAULT_SPREAD: Final = 8  # if fewer than two neighbours are lit
_CLOSE: Final = 8  # largest spread of neighbours that are averaged
_UNARY_MODELS: Final = 16  # of each class
_WIDTH: Final = (spec.SLABS_CELL << spec.VALUES_SIDE_BITS) + 1  # of the widest box, and its rim
_MANY: Final = 2  # residuals above this select the same set

Pixel = tuple[int, ...]
Row = list[Pixel | None]


def decode_values(
    operands: Operands, grid: Grid, pixel_format: int
) -> Iterator[list[tuple[int, bytes]]]:
    """Decode a VALUES.

    Parameters
    ----------
    operands
        Positioned behind the op byte; the rest of the packet is consumed.
    grid
        That of the page.
    pixel_format
        Its code: ``spec.FORMAT_*``, but not that of MONO1.

    Yields
    ------
    list of (int, bytes)
        Indices of the voxels of a slab, each once, and their pixels.

    Raises
    ------
    PacketError
        TRUNCATED, PADDING, OUTSIDE or PIXEL, after the slabs before have been yielded.
    """
    bits = RangeDecoder(
        operands.remaining(),
        lambda: operands.error(spec.CODE_TRUNCATED, "the payload ends inside the op"),
        spec.VALUES_MODELS,
        spec.SLABS_PACE,
        spec.SLABS_ENOUGH,
        (spec.SLABS_MODELS, spec.VALUES_PACE),
    )
    copies, weighted = bits.plain_bits(1), bits.plain_bits(1)
    weights = [
        bits.plain_bits(spec.VALUES_WEIGHT_BITS) - _NO_WEIGHT for _ in range(weighted * _WEIGHTS)
    ]
    tops = _TOPS[pixel_format]
    decoder = _Values(
        bits,
        tops,
        bool(copies),
        weights,
        lambda: operands.error(spec.CODE_PIXEL, "a value is not that of a lit pixel"),
    )
    for slab in boxes_of_slabs(operands, bits, grid, spec.VALUES_SIDE_BITS):
        if slab.first:
            decoder.begin_box(slab)
        pixels = [_pack(pixel_format, pixel) for pixel in decoder.slab(slab)]
        yield list(zip(slab.voxels, pixels, strict=True))


def _pack(pixel_format: int, pixel: Pixel) -> bytes:
    if pixel_format != spec.FORMAT_RGB565:
        return bytes(pixel)
    red, green, blue = pixel
    return (red << 11 | green << 5 | blue).to_bytes(2, "little")


class _Values:
    """State of the decoder: what it remembers of a box."""

    def __init__(
        self,
        bits: RangeDecoder,
        tops: Sequence[int],
        copies: bool,
        weights: list[int],
        no_pixel: Callable[[], Exception],
    ) -> None:
        self._bits = bits
        self._tops = tops
        self._copies = copies
        self._weights = weights
        self._no_pixel = no_pixel
        self._below: list[Row] = []
        self._last: Pixel = ()
        self._errors: list[int] = []
        self._missed = 0

    def begin_box(self, slab: Slab) -> None:
        """Forget the box before."""
        self._below = self._dark_slice(slab)
        self._last = tuple(top + 1 >> 1 for top in self._tops)
        self._errors = [0] * len(self._tops)
        self._missed = 0

    @staticmethod
    def _dark_slice(slab: Slab) -> list[Row]:
        """Return a slice without a pixel: voxel (x, y) is at [y + 1][x + 1]."""
        return [[None] * _WIDTH for _ in slab.slices[0]]

    def slab(self, slab: Slab) -> Iterator[Pixel]:
        """Decode the pixels of a slab, in the order of its voxels."""
        for lit in slab.slices[1:]:
            now = self._dark_slice(slab)
            for y, row in enumerate(lit):
                for x in range(row.bit_length()):
                    if row >> x & 1:
                        pixel = self._pixel(now, y, x)
                        now[y][x] = self._last = pixel
                        yield pixel
            self._below = now

    def _pixel(self, now: list[Row], y: int, x: int) -> Pixel:
        below = self._below
        west, north, under = now[y][x - 1], now[y - 1][x], below[y][x]
        if self._copies:
            copy = self._copy(west, north, under)
            self._missed = int(copy is None)
            if copy is not None:
                self._errors = [0] * len(self._tops)
                return copy
        others = (now[y - 1][x - 1], below[y][x - 1], below[y - 1][x], below[y - 1][x - 1])
        neighbours = (west, north, under, *others)
        pixel: list[int] = []
        largest = 0
        for channel, top in enumerate(self._tops):
            levels = [each[channel] if each else None for each in neighbours]
            predicted, spread, lit = self._predict(levels, self._last[channel])
            kind = (spread + self._errors[channel]).bit_length()
            kind = max(min(kind, spec.VALUES_MAX_CLASS), int(lit < _NEAR))
            residual = self._residual(3 * min(largest, _MANY) + channel, kind)
            level = min(max(predicted, 0), top) + residual
            if not 0 <= level <= top:
                raise self._no_pixel()
            pixel.append(level)
            self._errors[channel] = abs(residual)
            largest = max(largest, abs(residual))
        if not any(pixel):
            raise self._no_pixel()
        return tuple(pixel)

    def _copy(self, west: Pixel | None, north: Pixel | None, under: Pixel | None) -> Pixel | None:
        """Decode whether the pixel is that of a neighbour; return it then."""
        north_repeats = north is not None and north == west
        under_west = under is not None and under == west
        under_north = under is not None and under == north
        context = (
            (west is not None)
            | (north is not None) << 1
            | (under is not None) << 2
            | north_repeats << 3
            | under_west << 4
            | under_north << 5
            | self._missed << 6
        )
        candidates = (
            (west, False),
            (north, north_repeats),
            (under, under_west or under_north),
        )
        model = spec.VALUES_COPY + context
        for pixel, repeats in candidates:
            if pixel is not None and not repeats and self._bits.bit(model):
                return pixel
            model += _CONTEXTS
        return None

    def _predict(self, levels: list[int | None], last: int) -> tuple[int, int, int]:
        """Return prediction, spread, and the number of lit neighbours beside the voxel."""
        near = sorted(level for level in levels[:_NEAR] if level is not None)
        lit = len(near)
        spread = near[-1] - near[0] if lit > 1 else _DEFAULT_SPREAD
        if not lit:
            return last, spread, lit
        if lit < _NEAR:
            return (sum(near) + lit // 2) // lit, spread, lit
        known = [last if level is None else level for level in levels]
        if self._weights:
            total = sum(map(int.__mul__, self._weights, known))
            return total + 32 >> 6, spread, lit
        if spread <= _CLOSE:
            west, north, under = known[:_NEAR]
            return 21 * (west + north) + 22 * under + 32 >> 6, spread, lit
        low, middle, high = near
        closer = low if middle - low < high - middle else high
        return closer + middle + 1 >> 1, spread, lit

    def _residual(self, number: int, kind: int) -> int:
        """Decode a residual with a set of models."""
        bit = self._bits.bit
        models = spec.VALUES_CHANNEL + spec.VALUES_SET * number
        if not bit(models + spec.VALUES_ZERO + kind):
            return 0
        sign = -1 if bit(models + spec.VALUES_SIGN + kind) else 1
        unary = models + spec.VALUES_MAGNITUDE + _UNARY_MODELS * kind
        for magnitude in range(1, spec.VALUES_MAX_UNARY + 1):
            if not bit(unary):
                return sign * magnitude
            unary += 1
        rest = self._bits.number(models + spec.VALUES_LONG, spec.VALUES_MAX_LONG)
        return sign * (spec.VALUES_MAX_UNARY + 1 + rest)
