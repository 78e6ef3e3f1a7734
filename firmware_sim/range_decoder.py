"""Bits out of a range-coded sequence, each with the chance of its model (7.7).

It knows nothing of what the bits mean.
"""

from collections.abc import Callable
from typing import Final

from firmware_sim import spec

_RANGE: Final = 1 << 24  # below this, the range asks for a byte
_ONE: Final = 4096  # a chance that is sure
_SHIFT: Final = 13  # by so much the range is smaller before it is shared out
_BEGIN: Final = 3  # bytes of the code at first


class RangeDecoder:
    """Decoder of one sequence.

    Parameters
    ----------
    data
        The sequence.
    cut_off
        Makes what is raised where the sequence should go on and does not.
    """

    def __init__(self, data: bytes, cut_off: Callable[[], Exception]) -> None:
        self._data = data + bytes(spec.ARC_BEHIND)
        self._cut_off = cut_off
        self._chances = [spec.ARC_HALF] * spec.ARC_MODELS
        self._seen = [0] * spec.ARC_MODELS
        self._range = _RANGE
        self._code = int.from_bytes(self._data[:_BEGIN], "big")
        self._at = _BEGIN

    @property
    def exhausted(self) -> bool:
        """Whether the whole sequence has been read, and all that is read behind it."""
        return self._at == len(self._data)

    def _decode(self, bound: int) -> int:
        """Return a bit, which is 0 if the code is below a bound."""
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
        """Return a bit by one model."""
        chance = self._chances[model]
        bit = self._decode((self._range >> _SHIFT) * 2 * chance)
        self._update(model, chance, bit)
        return bit

    def mixed_bit(self, one: int, other: int) -> int:
        """Return a bit by two models."""
        chance, second = self._chances[one], self._chances[other]
        bit = self._decode((self._range >> _SHIFT) * (chance + second))
        self._update(one, chance, bit)
        self._update(other, second, bit)
        return bit

    def _update(self, model: int, chance: int, bit: int) -> None:
        seen = self._seen[model]
        shift = 1 + (seen >> 1)
        self._chances[model] = (
            chance - (chance >> shift) if bit else chance + (_ONE - chance >> shift)
        )
        if seen < spec.ARC_ENOUGH:
            self._seen[model] = seen + 1

    def plain_bits(self, count: int) -> int:
        """Return a number of so many bits without models, the highest first."""
        value = 0
        for _ in range(count):
            value = value << 1 | self._decode((self._range >> _SHIFT) * _ONE)
        return value

    def number(self) -> int:
        """Return a number from 0 to 65534."""
        k = 0
        while k < spec.ARC_MAX_K and self.bit(spec.ARC_COUNT + k):
            k += 1
        return (1 << k) - 1 + self.plain_bits(k)
