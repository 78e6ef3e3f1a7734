"""A bad line: bytes are changed and lost at given rates, the same ones for the same seed.

It knows nothing of packets. Where a fault strikes depends on the bytes' places in the stream and
not on how they are cut into pieces.
"""

import difflib
import math
import random
import re
from typing import Final, Protocol


class Fault(Protocol):
    """One kind of fault, on one direction of a line."""

    def __init__(self, rate: float, rng: random.Random) -> None: ...

    def apply(self, data: bytes) -> bytes:
        """Return what becomes of the next bytes of the stream."""


class _Strokes:
    """Places at which something with a fixed chance happens, in a row of many chances."""

    def __init__(self, rate: float, rng: random.Random) -> None:
        self._rate = rate
        self._rng = rng
        self._next = self._gap()  # chances that go by before the next stroke

    def _gap(self) -> float:
        if self._rate >= 1:
            return 0
        if not self._rate:
            return math.inf
        return math.log(1 - self._rng.random()) // math.log1p(-self._rate)

    def among(self, chances: int) -> list[int]:
        """Return which of the next chances strike."""
        hits = []
        while self._next < chances:
            hits.append(int(self._next))
            self._next += 1 + self._gap()
        self._next -= chances
        return hits


class Flip:
    """Inverts bits; the rate is that of bits.

    Parameters
    ----------
    rate
        Chance of each bit, 0 to 1.
    rng
        Where chance comes from.
    """

    def __init__(self, rate: float, rng: random.Random) -> None:
        self._strokes = _Strokes(rate, rng)

    def apply(self, data: bytes) -> bytes:
        """Return the bytes with some bits inverted."""
        hits = self._strokes.among(8 * len(data))
        if not hits:
            return data
        changed = bytearray(data)
        for hit in hits:
            changed[hit >> 3] ^= 1 << (hit & 7)
        return bytes(changed)


class Drop:
    """Loses bytes; the rate is that of bytes.

    Parameters
    ----------
    rate
        Chance of each byte, 0 to 1.
    rng
        Where chance comes from.
    """

    def __init__(self, rate: float, rng: random.Random) -> None:
        self._strokes = _Strokes(rate, rng)

    def apply(self, data: bytes) -> bytes:
        """Return the bytes without some of them."""
        hits = self._strokes.among(len(data))
        if not hits:
            return data
        changed = bytearray(data)
        for hit in reversed(hits):
            del changed[hit]
        return bytes(changed)


KINDS: Final[dict[str, type[Fault]]] = {"flip": Flip, "drop": Drop}


def parse_faults(text: str) -> tuple[tuple[str, float], ...]:
    """Read a list of faults such as ``flip=1e-5,drop=1e-6``; a colon may stand for ``=``.

    Parameters
    ----------
    text
        Kinds and rates; an empty text has none.

    Returns
    -------
    tuple of (str, float)
        Kind and rate, in the order in which they work.

    Raises
    ------
    ValueError
        If a kind is not known, or a rate not a number from 0 to 1.
    """
    faults = []
    for part in filter(None, text.split(",")):
        kind, *rest = re.split("[=:]", part, maxsplit=1)
        if kind not in KINDS:
            near = difflib.get_close_matches(kind, KINDS, 1) or KINDS
            raise ValueError(f"fault {kind!r} is not known: did you mean {' or '.join(near)}?")
        try:
            rate = float(rest[0])
        except (IndexError, ValueError):
            rate = math.nan
        if not 0 <= rate <= 1:
            raise ValueError(f"fault {part!r}: write {kind}=RATE with a rate from 0 to 1")
        faults.append((kind, rate))
    return tuple(faults)


class Line:
    """One direction of a line with its faults.

    Parameters
    ----------
    faults
        As from `parse_faults`.
    seed
        Equal seeds strike equal places.
    direction
        Name of the direction, so that the two of a line differ.
    """

    def __init__(self, faults: tuple[tuple[str, float], ...], seed: int, direction: str) -> None:
        self._faults = [
            KINDS[kind](rate, random.Random(f"{seed} {direction} {place} {kind}"))
            for place, (kind, rate) in enumerate(faults)
        ]

    def carry(self, data: bytes) -> bytes:
        """Return what arrives of the next bytes of the stream."""
        for fault in self._faults:
            data = fault.apply(data)
        return data
