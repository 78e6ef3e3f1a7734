"""Range-coded pixels (op VALUES, section 7.13 of protocol.md), in their simplest form.

The model of pixels is written once for both directions, as in `range_coded_slabs`, whose boxes
these are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.range_coded_chains import Coder, Decoder, Encoder, Models
from voxdisplay.conformance.range_coded_slabs import Box, PlacedSlab, decode_boxes, encode_boxes
from voxdisplay.wire import spec

Pixel = tuple[int, ...]  # the level of each channel
Pixels = dict[Voxel, Pixel]
_TOPS = {
    spec.FORMAT_INDEX8: (255,),
    spec.FORMAT_RGB565: (31, 63, 31),
    spec.FORMAT_RGB888: (255, 255, 255),
}
_WEIGHTS = 7
_NO_WEIGHT = 64


def tops(device: AnnouncedDevice) -> Pixel:
    """Return the highest level of each channel."""
    return _TOPS[device.format]


def pixel_value(device: AnnouncedDevice, pixel: Pixel) -> int:
    """Return the pixel value of levels."""
    if device.format == spec.FORMAT_RGB565:
        return pixel[0] << 11 | pixel[1] << 5 | pixel[2]
    return sum(level << 8 * n for n, level in enumerate(pixel))


def levels_of(device: AnnouncedDevice, value: int) -> Pixel:
    """Return the levels of a pixel value."""
    if device.format == spec.FORMAT_RGB565:
        return value >> 11, value >> 5 & 63, value & 31
    return tuple(value >> 8 * n & 255 for n in range(device.pixel_bytes))


@dataclass(frozen=True, slots=True)
class Switches:
    """Switches of an op: whether pixels may be copies, and the weights of the neighbours."""

    copies: int = 0
    weights: tuple[int, ...] = ()


def _models() -> Models:
    others = (spec.SLABS_MODELS, spec.VALUES_PACE)
    return Models(spec.VALUES_MODELS, spec.SLABS_PACE, spec.SLABS_ENOUGH, others)


class _Memory:
    """Pixels of a box, and what is remembered of the voxel before."""

    def __init__(self, top: Pixel) -> None:
        self.pixels: Pixels = {}
        self.last = [(level + 1) // 2 for level in top]
        self.error = [0] * len(top)
        self.missed = 0

    def at(self, voxel: Voxel, dx: int, dy: int, dz: int) -> Pixel | None:
        return self.pixels.get((voxel[0] - dx, voxel[1] - dy, voxel[2] - dz))

    def near(self, voxel: Voxel) -> list[Pixel | None]:
        """Return W, N and B."""
        return [self.at(voxel, 1, 0, 0), self.at(voxel, 0, 1, 0), self.at(voxel, 0, 0, 1)]


def copy_context(near: list[Pixel | None], missed: int) -> int:
    """Return c of COPY."""
    west, north, below = near
    facts = [pixel is not None for pixel in near]
    facts += [
        one is not None and one == other
        for one, other in ((west, north), (west, below), (north, below))
    ]
    return sum(int(fact) << n for n, fact in enumerate([*facts, bool(missed)]))


def _code_copy(coder: Coder, memory: _Memory, voxel: Voxel, want: Pixel) -> Pixel | None:
    near = memory.near(voxel)
    c = copy_context(near, memory.missed)
    for n, pixel in enumerate(near):
        if pixel is None or pixel in near[:n]:
            continue
        if coder.bit(spec.VALUES_COPY + 128 * n + c, want=int(pixel == want)):
            return pixel
    return None


def middle_guess(levels: list[int]) -> int:
    """Return the guess of three neighbours W, N and B without weights."""
    low, middle, high = sorted(levels)
    if high - low <= 8:
        return (21 * levels[0] + 21 * levels[1] + 22 * levels[2] + 32) // 64
    if high - middle <= middle - low:
        return (high + middle + 1) // 2
    return (low + middle + 1) // 2


def _guess(
    memory: _Memory, voxel: Voxel, channel: int, weights: tuple[int, ...]
) -> tuple[int, int, int]:
    """Return guess, spread and number of neighbours."""
    last = memory.last[channel]
    levels = [pixel[channel] for pixel in memory.near(voxel) if pixel]
    n = len(levels)
    spread = max(levels) - min(levels) if n >= 2 else 8
    if n == 0:
        return last, spread, n
    if n < 3:
        return (sum(levels) + n // 2) // n, spread, n
    if not weights:
        return middle_guess(levels), spread, n
    steps = ((1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1))
    others = (memory.at(voxel, *step) for step in steps)
    levels += [pixel[channel] if pixel else last for pixel in others]
    total = sum(weight * level for weight, level in zip(weights, levels, strict=True))
    return (total + 32) // 64, spread, n


def code_residual(coder: Coder, group: int, kind: int, want: int = 0) -> int:
    """Code a residual with a set of models, in a class."""
    if not coder.bit(group + spec.VALUES_ZERO + kind, want=int(want != 0)):
        return 0
    sign = -1 if coder.bit(group + spec.VALUES_SIGN + kind, want=int(want < 0)) else 1
    left = abs(want) - 1
    m = 0
    first = group + spec.VALUES_MAGNITUDE + 16 * kind
    while m < spec.VALUES_MAX_UNARY and coder.bit(first + m, want=int(left > m)):
        m += 1
    if m == spec.VALUES_MAX_UNARY:
        k = 0
        rest = left - m
        while k < spec.VALUES_MAX_LONG and coder.bit(
            group + spec.VALUES_LONG + k, want=int(rest >= (1 << (k + 1)) - 1)
        ):
            k += 1
        m += (1 << k) - 1 + coder.plain(k, rest - (1 << k) + 1)
    return sign * (m + 1)


def _code_pixel(
    coder: Coder, memory: _Memory, voxel: Voxel, switches: Switches, top: Pixel, want: Pixel
) -> Pixel | None:
    """Code the pixel of a voxel; return None if it is to be refused."""
    if switches.copies:
        copy = _code_copy(coder, memory, voxel, want)
        memory.missed = int(copy is None)
        if copy is not None:
            memory.error = [0] * len(top)
            return copy
    pixel: list[int] = []
    q = 0
    for channel, highest in enumerate(top):
        guess, spread, n = _guess(memory, voxel, channel, switches.weights)
        guess = min(max(guess, 0), highest)
        kind = min((spread + memory.error[channel]).bit_length(), spec.VALUES_MAX_CLASS)
        kind = max(kind, 1) if n < 3 else kind
        group = spec.VALUES_CHANNEL + spec.VALUES_SET * (3 * min(q, 2) + channel)
        residual = code_residual(coder, group, kind, want[channel] - guess)
        if not 0 <= guess + residual <= highest:
            return None
        pixel.append(guess + residual)
        memory.error[channel] = abs(residual)
        q = max(q, abs(residual))
    return tuple(pixel) if any(pixel) else None


class _Coding:
    """Coding of the pixels of an op, slab after slab."""

    def __init__(self, coder: Coder, switches: Switches, top: Pixel) -> None:
        self._coder = coder
        self._switches = switches
        self._top = top
        self._memory = _Memory(top)

    def code(self, placed: PlacedSlab, want: Pixels) -> Iterator[tuple[Voxel, Pixel | None]]:
        """Code the pixels of a slab; one that is None is to be refused."""
        if placed.first:
            self._memory = _Memory(self._top)
        for voxel in placed.voxels():
            wanted = want.get(voxel, self._top)
            pixel = _code_pixel(self._coder, self._memory, voxel, self._switches, self._top, wanted)
            if pixel:
                self._memory.pixels[voxel] = pixel
                self._memory.last = list(pixel)
            yield voxel, pixel


def decode(
    data: bytes, device: AnnouncedDevice, refusal: Callable[[int], Exception]
) -> Iterator[tuple[Voxel, int]]:
    """Yield the voxels of a VALUES with their pixel values; arguments as of SLABS."""
    coder = Decoder(data, refusal, _models())
    copies, weighted = coder.plain(1), coder.plain(1)
    weights = tuple(
        coder.plain(spec.VALUES_WEIGHT_BITS) - _NO_WEIGHT for _ in range(_WEIGHTS * weighted)
    )
    coding = _Coding(coder, Switches(copies, weights), tops(device))
    for placed in decode_boxes(coder, device, refusal, spec.VALUES_SIDE_BITS):
        for voxel, pixel in coding.code(placed, {}):
            if pixel is None:
                raise refusal(spec.CODE_PIXEL)
            yield voxel, pixel_value(device, pixel)


def encode(device: AnnouncedDevice, pixels: Pixels, boxes: list[Box], switches: Switches) -> bytes:
    """Return the op VALUES that draws the voxels that are in boxes."""
    coder = Encoder(_models())
    coder.plain(1, switches.copies)
    coder.plain(1, int(bool(switches.weights)))
    for weight in switches.weights:
        coder.plain(spec.VALUES_WEIGHT_BITS, weight + _NO_WEIGHT)
    coding = _Coding(coder, switches, tops(device))
    for placed in encode_boxes(coder, device, set(pixels), boxes, spec.VALUES_SIDE_BITS):
        for _ in coding.code(placed, pixels):
            pass
    return bytes((spec.OP_VALUES,)) + coder.end()
