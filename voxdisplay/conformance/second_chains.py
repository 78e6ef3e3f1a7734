"""Range-coded chains with fades and near starts (op ARC2, section 7.10 of protocol.md).

What ARC2 has beside ARC, in its simplest form; pieces are given and returned with their pens.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.fades import Fade, color_bytes
from voxdisplay.conformance.range_coded_chains import (
    AxisMemory,
    Coder,
    Decoder,
    Encoder,
    number,
    pen_bits,
)
from voxdisplay.wire import spec

_SIDE_BITS = 10


@dataclass(frozen=True, slots=True)
class FadeInk:
    """A pen that is a fade: its colours, number of voxels, and the place of the first."""

    stops: Sequence[bytes]
    count: int
    place: int


Ink = int | FadeInk | None


@dataclass(frozen=True, slots=True)
class InkedPiece:
    """A piece, with a pen of its own unless that is None."""

    voxels: tuple[Voxel, ...]
    ink: Ink = None
    jump: bool = True


def morton(place: Voxel) -> int:
    """Return the Morton index of a voxel, x lowest."""
    return sum((place[a] >> b & 1) << 3 * b + a for b in range(_SIDE_BITS) for a in range(3))


def voxel_of(index: int) -> Voxel:
    """Return the voxel with a Morton index."""
    x, y, z = (sum((index >> 3 * b + a & 1) << b for b in range(_SIDE_BITS)) for a in range(3))
    return x, y, z


def _has_near(device: AnnouncedDevice) -> bool:
    return max(device.grid) <= spec.ARC2_MAX_SIDE


def _delta(coder: Coder, want: int = 0) -> int:
    return number(coder, want, spec.ARC2_DELTA, spec.ARC2_MAX_DELTA)


def decode(
    data: bytes, device: AnnouncedDevice, refusal: Callable[[int], Exception]
) -> Iterator[tuple[int | Fade | None, Voxel]]:
    """Yield the voxels of an ARC2, each with the pen of its piece.

    Parameters
    ----------
    data, device, refusal
        As of `range_coded_chains.decode`.

    Yields
    ------
    pen : int, Fade or None
        Pixel value; the same fade for all voxels that it counts; None for the pen or fade from
        before the op.
    voxel : tuple of int
        x, y, z. It may lie off the grid: the caller must not go on then.

    """
    coder = Decoder(data, refusal)
    memory, at = AxisMemory(), (0, 0, 0)
    pen: int | Fade | None = None
    start: Voxel | None = None
    while coder.bit(spec.ARC_MORE):
        jump = 1 if start is None else coder.bit(spec.ARC_JUMP)
        if coder.bit(spec.ARC_INK):
            pen = _decode_ink(coder, device, refusal)
        if jump:
            if start is not None and _has_near(device) and coder.bit(spec.ARC2_NEAR):
                index = morton(start) + _delta(coder)
                if index >> 3 * _SIDE_BITS:
                    raise refusal(spec.CODE_OUTSIDE)
                at = voxel_of(index)
            else:
                x, y, z = (coder.plain((side - 1).bit_length()) for side in device.grid)
                at = (x, y, z)
            start, memory = at, AxisMemory()
        steps = number(coder)
        if jump:
            yield pen, at
        for _ in range(steps):
            dx, dy, dz = memory.step(coder)
            at = (at[0] + dx, at[1] + dy, at[2] + dz)
            yield pen, at
    coder.end()


def _decode_ink(
    coder: Coder, device: AnnouncedDevice, refusal: Callable[[int], Exception]
) -> int | Fade:
    if device.format == spec.FORMAT_MONO1 or not coder.bit(spec.ARC2_FADE):
        return coder.plain(pen_bits(device))
    colors = coder.plain(4) + 1
    count = number(coder) + 1
    place = number(coder)
    if place >= count:
        raise refusal(spec.CODE_COUNT)
    stops = [bytes(coder.plain(8) for _ in range(color_bytes(device))) for _ in range(colors)]
    return Fade(device, stops, count, place)


def encode(device: AnnouncedDevice, pieces: Sequence[InkedPiece], *, near: bool = True) -> bytes:
    """Return the op ARC2 that draws pieces; ``near``: with near starts where they can be."""
    coder = Encoder()
    memory, at = AxisMemory(), (0, 0, 0)
    start: Voxel | None = None
    for piece in pieces:
        coder.bit(spec.ARC_MORE, want=1)
        places = list(piece.voxels)
        if start is not None:
            coder.bit(spec.ARC_JUMP, want=int(piece.jump))
        if coder.bit(spec.ARC_INK, want=int(piece.ink is not None)):
            _encode_ink(coder, device, piece.ink)
        if piece.jump:
            at, memory = places.pop(0), AxisMemory()
            delta = morton(at) - morton(start) if start is not None else -1
            if start is not None and _has_near(device):
                coder.bit(spec.ARC2_NEAR, want=int(near and delta >= 0))
            if near and delta >= 0 and _has_near(device):
                _delta(coder, delta)
            else:
                for a, side in zip(at, device.grid, strict=True):
                    coder.plain((side - 1).bit_length(), a)
            start = at
        number(coder, len(places))
        for place in places:
            memory.step(coder, (place[0] - at[0], place[1] - at[1], place[2] - at[2]))
            at = place
    coder.bit(spec.ARC_MORE)
    return bytes((spec.OP_ARC2,)) + coder.end()


def _encode_ink(coder: Coder, device: AnnouncedDevice, ink: Ink) -> None:
    faded = isinstance(ink, FadeInk)
    if device.format != spec.FORMAT_MONO1:
        coder.bit(spec.ARC2_FADE, want=int(faded))
    if not isinstance(ink, FadeInk):
        coder.plain(pen_bits(device), ink or 0)
        return
    coder.plain(4, len(ink.stops) - 1)
    number(coder, ink.count - 1)
    number(coder, ink.place)
    for stop in ink.stops:
        for channel in stop[: color_bytes(device)]:
            coder.plain(8, channel)
