"""Adaptive binary range decoder (7.7, 7.11, 7.13).

Knows nothing of what the bits mean.
"""

from collections.abc import Callable
from typing import Final

from firmware_sim import spec

_RANGE: Final = 1 << 24  # below this, the next byte is read
_ONE: Final = 4096  # probability 1/2 for bits without models, as the sum of two chances
_SHIFT: Final = 13  # scale between range and the sum of two chances
_BEGIN: Final = 3  # bytes of the initial code


class RangeDecoder:
    """Decoder of one sequence.

    Parameters
    ----------
    data
        The sequence.
    cut_off
        Returns the exception to raise if the sequence ends too early.
    models
        How many models there are.
    pace
        Bits after which a model adapts more slowly.
    enough
        Where a model stops counting.
    others
        The first model of those that adapt at another pace, to the last, and that pace.
    """

    def __init__(
        self,
        data: bytes,
        cut_off: Callable[[], Exception],
        models: int,
        pace: int,
        enough: int,
        others: tuple[int, int] | None = None,
    ) -> None:
        self._data = data + bytes(spec.ARC_BEHIND)
        self._cut_off = cut_off
        self._chances = [spec.ARC_HALF] * models
        self._seen = [0] * models
        first, other_pace = others or (models, pace)
        self._shifts = [
            [1 + seen // each for seen in range(enough + 1)] for each in (pace, other_pace)
        ]
        self._others = first
        self._enough = enough
        self._range = _RANGE
        self._code = int.from_bytes(self._data[:_BEGIN], "big")
        self._at = _BEGIN

    @property
    def exhausted(self) -> bool:
        """True if the whole sequence and the bytes behind it have been read."""
        return self._at == len(self._data)

    def _decode(self, bound: int) -> int:
        """Decode a bit: 0 if the code is below a bound, otherwise 1."""
        bit = 0
        if self._code < bound:
            self._range = bound
        else:
            bit = 1
            self._code -= bound
            self._range -= bound
        while self._range < _RANGE:
            if self.exhausted:
                raise self._cut_off()
            self._range <<= 8
            self._code = self._code << 8 | self._data[self._at]
            self._at += 1
        return bit

    def bit(self, model: int) -> int:
        """Decode a bit with one model."""
        chance = self._chances[model]
        bit = self._decode((self._range >> _SHIFT) * 2 * chance)
        self._update(model, chance, bit)
        return bit

    def mixed_bit(self, one: int, other: int) -> int:
        """Decode a bit with two models."""
        chance, second = self._chances[one], self._chances[other]
        bit = self._decode((self._range >> _SHIFT) * (chance + second))
        self._update(one, chance, bit)
        self._update(other, second, bit)
        return bit

    def _update(self, model: int, chance: int, bit: int) -> None:
        seen = self._seen[model]
        shift = self._shifts[model >= self._others][seen]
        self._chances[model] = (
            chance - (chance >> shift) if bit else chance + (_ONE - chance >> shift)
        )
        if seen < self._enough:
            self._seen[model] = seen + 1

    def plain_bits(self, count: int) -> int:
        """Decode a number of ``count`` bits without models, the highest first."""
        value = 0
        for _ in range(count):
            value = value << 1 | self._decode((self._range >> _SHIFT) * _ONE)
        return value

    def number(self, first: int = spec.ARC_COUNT, longest: int = spec.ARC_MAX_K) -> int:
        """Decode a number, from 0 to 65534 with the models of COUNT."""
        k = 0
        while k < longest and self.bit(first + k):
            k += 1
        return (1 << k) - 1 + self.plain_bits(k)
