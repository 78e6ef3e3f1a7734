"""Range-coded chains (op ARC, section 7.7 of protocol.md), in their simplest form.

The model of pieces and steps is written once for both directions: a coder's ``bit`` and ``plain``
take the value to encode and return the value coded, which for a decoder is the one it read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.wire import spec

_TOP = 1 << 24


class Coder(Protocol):
    """Binary range coder, of either direction."""

    def bit(self, i: int, j: int | None = None, want: int = 0) -> int:
        """Code a bit with models i and j; return it. ``want`` is the value to encode."""

    def plain(self, n: int, want: int = 0) -> int:
        """Code a number of n bits without models; return it."""


class Models:
    """Adaptive models: how many, after how many bits one adapts more slowly and stops counting.

    Those from ``others[0]`` on adapt at the pace ``others[1]``.
    """

    def __init__(
        self, count: int, pace: int, enough: int, others: tuple[int, int] | None = None
    ) -> None:
        self.others = others or (count, pace)
        self.p = [spec.ARC_HALF] * count
        self.seen = [0] * count
        self.pace = pace
        self.enough = enough

    def learn(self, i: int, bit: int) -> None:
        """Adapt a model to a bit."""
        first, other_pace = self.others
        shift = 1 + self.seen[i] // (self.pace if i < first else other_pace)
        if bit:
            self.p[i] -= self.p[i] >> shift
        else:
            self.p[i] += (4096 - self.p[i]) >> shift
        self.seen[i] = min(self.seen[i] + 1, self.enough)


def _chain_models() -> Models:
    return Models(spec.ARC2_MODELS, 2, spec.ARC_ENOUGH)  # those of ARC are the first


class _RangeCoder:
    def __init__(self, models: Models | None) -> None:
        self.models = models or _chain_models()
        self.range = _TOP

    def bit(self, i: int, j: int | None = None, want: int = 0) -> int:
        j = i if j is None else j
        chance = self.models.p[i] + self.models.p[j]
        bit = self._code((self.range >> 13) * chance, want)
        for model in {i, j}:
            self.models.learn(model, bit)
        return bit

    def plain(self, n: int, want: int = 0) -> int:
        value = 0
        for place in reversed(range(n)):
            value = value << 1 | self._code((self.range >> 13) * 4096, want >> place & 1)
        return value

    def _code(self, bound: int, want: int) -> int:
        raise NotImplementedError


class Decoder(_RangeCoder):
    """Range decoder: ignores the values to encode."""

    def __init__(
        self, data: bytes, refusal: Callable[[int], Exception], models: Models | None = None
    ) -> None:
        super().__init__(models)
        self._data = data
        self._refusal = refusal
        self._at = 0
        self._value = 0
        for _ in range(3):
            self._value = self._value << 8 | self._next()

    def _next(self) -> int:
        self._at += 1
        if self._at > len(self._data) + spec.ARC_BEHIND:
            raise self._refusal(spec.CODE_TRUNCATED)
        return self._data[self._at - 1] if self._at <= len(self._data) else 0

    def _code(self, bound: int, want: int) -> int:
        del want
        bit = int(self._value >= bound)
        if bit:
            self._value -= bound
            self.range -= bound
        else:
            self.range = bound
        while self.range < _TOP:
            self.range <<= 8
            self._value = self._value << 8 | self._next()
        return bit

    def end(self) -> None:
        """Refuse the op unless exactly three bytes behind the payload have been read."""
        if self._at < len(self._data) + spec.ARC_BEHIND:
            raise self._refusal(spec.CODE_PADDING)


class Encoder(_RangeCoder):
    """Range encoder."""

    def __init__(self, models: Models | None = None) -> None:
        super().__init__(models)
        self._low = 0
        self._numbers: list[int] = []

    def _code(self, bound: int, want: int) -> int:
        if want:
            self._low += bound
            self.range -= bound
        else:
            self.range = bound
        while self.range < _TOP:
            self._numbers.append(self._low >> 24)
            self._low = self._low % _TOP << 8
            self.range <<= 8
        return want

    def end(self) -> bytes:
        """Return the bytes of all that was coded."""
        numbers = [*self._numbers, (self._low + _TOP - 1) >> 24]
        for at in reversed(range(1, len(numbers))):
            numbers[at - 1] += numbers[at] >> 8
        return bytes(number & 255 for number in numbers[1:])


@dataclass(slots=True)
class _Axis:
    last: int = 0
    run: int = 0
    prev: int = 0
    prev2: int = 0
    past: int = 0
    direction: int = 0

    @property
    def streak(self) -> int:
        return self.run if self.last else 0

    def record(self, moved: int) -> None:
        self.past = (self.past << 1 | moved) % 128
        if moved == self.last:
            self.run = min(self.run + 1, spec.ARC_MAX_RUN)
        else:
            self.prev2, self.prev, self.run, self.last = self.prev, self.run, 1, moved


@dataclass(slots=True)
class AxisMemory:
    """Step model: what the coder remembers of the three axes."""

    axes: list[_Axis] = field(default_factory=lambda: [_Axis(), _Axis(), _Axis()])

    def step(self, coder: Coder, want: Voxel = (0, 0, 0)) -> Voxel:
        """Code a step."""
        axes = self.axes
        streak = [axis.streak for axis in axes]
        m = streak.index(max(streak))
        b, c = (m + 1) % 3, (m + 2) % 3
        way = [0, 0, 0]
        model = spec.ARC_MAIN + 8 * min(streak[m], 3) + min(max(streak[b], streak[c]), 7)
        if coder.bit(model, want=int(want[m] != 0)):
            way[m] = self._direction(coder, axes[m], want[m])
        for a in (b, c):
            axis, wanted = axes[a], int(want[a] != 0)
            if way[m]:
                h = axis.past >> 1 ^ (63 if axis.last else 0)
                d = min(max(axis.run - axis.prev2, -2), 1) + 2
                r = 64 * axis.last + 16 * d + 8 * (axis.prev > 1) + min(axis.run, 7)
                bit = axis.last ^ coder.bit(
                    spec.ARC_HISTORY + h, spec.ARC_RUNS + r, want=wanted ^ axis.last
                )
            elif a == b or way[b]:
                bit = coder.bit(spec.ARC_LONE + min(streak[a], 7), want=wanted)
            else:
                bit = 1
            if bit:
                way[a] = self._direction(coder, axis, want[a])
        for axis, moved in zip(axes, way, strict=True):
            axis.record(int(moved != 0))
        return way[0], way[1], way[2]

    def _direction(self, coder: Coder, axis: _Axis, want: int) -> int:
        if not axis.direction:
            axis.direction = -1 if coder.plain(1, int(want < 0)) else 1
        else:
            t = 0 if axis.last else min(axis.run, 15)
            if coder.bit(spec.ARC_TURN + t, want=int(want != axis.direction)):
                axis.direction = -axis.direction
        return axis.direction


def number(
    coder: Coder, want: int = 0, first: int = spec.ARC_COUNT, longest: int = spec.ARC_MAX_K
) -> int:
    """Code a number: its length with the models from ``first`` on."""
    k = 0
    while k < longest and coder.bit(first + k, want=int(want >= (1 << (k + 1)) - 1)):
        k += 1
    return (1 << k) - 1 + coder.plain(k, want - (1 << k) + 1)


def pen_bits(device: AnnouncedDevice) -> int:
    """Return the bits of a pen."""
    return 1 if device.format == spec.FORMAT_MONO1 else 8 * device.pixel_bytes


def decode(
    data: bytes, device: AnnouncedDevice, refusal: Callable[[int], Exception]
) -> Iterator[tuple[int | None, Voxel]]:
    """Yield the voxels of an ARC, each with its pen.

    Parameters
    ----------
    data : bytes
        The bytes behind the op byte.
    device : AnnouncedDevice
    refusal : callable
        Takes a code of section 11 and returns the exception to raise.

    Yields
    ------
    pen : int or None
        Pixel value; None for the pen from before the op.
    voxel : tuple of int
        x, y, z. It may lie off the grid: the caller must not go on then.
    """
    coder = Decoder(data, refusal)
    memory, at, jump = AxisMemory(), (0, 0, 0), 1
    pen: int | None = None
    first = True
    while coder.bit(spec.ARC_MORE):
        jump = 1 if first else coder.bit(spec.ARC_JUMP)
        first = False
        if coder.bit(spec.ARC_INK):
            pen = coder.plain(pen_bits(device))
        if jump:
            x, y, z = (coder.plain((side - 1).bit_length()) for side in device.grid)
            at, memory = (x, y, z), AxisMemory()
        steps = number(coder)
        if jump:
            yield pen, at
        for _ in range(steps):
            dx, dy, dz = memory.step(coder)
            at = (at[0] + dx, at[1] + dy, at[2] + dz)
            yield pen, at
    coder.end()


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece: 26-connected voxels, from a jump or from where the piece before ended."""

    voxels: tuple[Voxel, ...]
    pen: int | None = None
    jump: bool = True


def encode(device: AnnouncedDevice, pieces: list[Piece]) -> bytes:
    """Return the op ARC that draws pieces."""
    coder = Encoder()
    memory, at = AxisMemory(), (0, 0, 0)
    for at_piece, piece in enumerate(pieces):
        coder.bit(spec.ARC_MORE, want=1)
        places = list(piece.voxels)
        if at_piece:
            coder.bit(spec.ARC_JUMP, want=int(piece.jump))
        if coder.bit(spec.ARC_INK, want=int(piece.pen is not None)):
            coder.plain(pen_bits(device), piece.pen or 0)
        if piece.jump:
            at, memory = places.pop(0), AxisMemory()
            for a, side in zip(at, device.grid, strict=True):
                coder.plain((side - 1).bit_length(), a)
        number(coder, len(places))
        for place in places:
            memory.step(coder, (place[0] - at[0], place[1] - at[1], place[2] - at[2]))
            at = place
    coder.bit(spec.ARC_MORE)
    return bytes((spec.OP_ARC,)) + coder.end()
