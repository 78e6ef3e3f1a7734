"""What goes wrong on a line and at its ends, at given rates, the same for the same seed.

A fault sees the bytes of one direction and knows of packets only that a 00 ends them. Where it
strikes depends on the bytes' places in the stream and not on how they are cut into pieces; when
depends on the times that it is given, and on no clock.
"""

import math
import random
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator
from enum import Enum, auto
from typing import Final, NamedTuple, Protocol

from firmware_sim import spec
from firmware_sim.sender import max_wire_bytes

_LONGEST: Final = max_wire_bytes(spec.LIMIT_MAX_PAYLOAD + spec.LIMIT_OVERHEAD)  # of a packet


class Event(Enum):
    """What may happen between two bytes."""

    CUT = auto()  # what has come so far is handed over on its own
    REBOOT = auto()  # the device starts again
    UNPLUG = auto()  # the pipe ends


class Piece(NamedTuple):
    """A part of the stream.

    Parameters
    ----------
    at
        When it arrives, in seconds.
    what
        Bytes, or what happens between those before and those after.
    """

    at: float
    what: bytes | Event


class HitSelector(Protocol):
    """Which of a row of chances strike."""

    def select(self, chances: int) -> list[int]:
        """Return which of the next chances strike."""


class RandomHits:
    """Each chance strikes at a fixed rate.

    Parameters
    ----------
    rate
        0 to 1.
    rng
        Where chance comes from.
    """

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

    def select(self, chances: int) -> list[int]:
        """Return which of the next chances strike."""
        hits = []
        while self._next < chances:
            hits.append(int(self._next))
            self._next += 1 + self._gap()
        self._next -= chances
        return hits


class SingleHit:
    """One chance strikes, and none after it.

    Parameters
    ----------
    count
        Which one, from 1 on.
    """

    def __init__(self, count: int) -> None:
        self._next: float = count - 1

    def select(self, chances: int) -> list[int]:
        """Return which of the next chances strike."""
        hits = [int(self._next)] if self._next < chances else []
        self._next = math.inf if hits else self._next - chances
        return hits


class Fault(ABC):
    """One kind of fault, on one direction of a line.

    Parameters
    ----------
    strokes
        What it strikes: bits, bytes or packets, by its kind.
    seconds
        For how long, if its kind has a time.
    rng
        Where chance comes from besides.
    """

    def __init__(self, strokes: HitSelector, seconds: float, rng: random.Random) -> None:
        self._hits = strokes
        self._seconds = seconds
        self._rng = rng
        self.connect()

    def connect(self) -> None:  # noqa: B027 - most remember nothing
        """Begin a connection: nothing of the one before is on its way."""

    @abstractmethod
    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield what becomes of the next bytes of the stream.

        Parameters
        ----------
        at
            When they came, never before those that came before.
        data
            The bytes.
        """


class Flip(Fault):
    """Inverts bits; the rate is that of bits."""

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes with some bits inverted."""
        changed = bytearray(data)
        for hit in self._hits.select(8 * len(data)):
            changed[hit >> 3] ^= 1 << (hit & 7)
        yield Piece(at, bytes(changed))


class Drop(Fault):
    """Loses bytes."""

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes without some of them."""
        changed = bytearray(data)
        for hit in reversed(self._hits.select(len(data))):
            del changed[hit]
        yield Piece(at, bytes(changed))


class Double(Fault):
    """Doubles bytes."""

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes, some of them twice."""
        changed = bytearray(data)
        for hit in reversed(self._hits.select(len(data))):
            changed.insert(hit, changed[hit])
        yield Piece(at, bytes(changed))


class Insert(Fault):
    """Inserts random bytes before others."""

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes, random ones between some of them."""
        hits = self._hits.select(len(data))
        changed = bytearray(data)
        for hit, noise in reversed([(hit, self._rng.randrange(256)) for hit in hits]):
            changed.insert(hit, noise)
        yield Piece(at, bytes(changed))


class _EventFault(Fault):
    """Something happens behind bytes."""

    event: Event

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes and what happens between them."""
        begin = 0
        for hit in self._hits.select(len(data)):
            yield Piece(at, data[begin : hit + 1])
            yield Piece(at, self.event)
            begin = hit + 1
        yield Piece(at, data[begin:])


class Short(_EventFault):
    """Writes and reads take or give a part of what is offered: the rate is that of ends."""

    event = Event.CUT


class Reboot(_EventFault):
    """The device starts again behind a byte: another boot id, no session, dark pages."""

    event = Event.REBOOT


class Unplug(_EventFault):
    """The pipe ends behind a byte."""

    event = Event.UNPLUG


class Stall(Fault):
    """The line stands still before a byte, for some seconds after all that was held back before."""

    def connect(self) -> None:
        """Begin with a line that moves."""
        self._free = -math.inf  # until when it stands still

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes, some later than they came."""
        begin = 0
        for hit in self._hits.select(len(data)):
            self._free = max(self._free, at)
            yield Piece(self._free, data[begin:hit])
            self._free += self._seconds
            begin = hit
        yield Piece(max(self._free, at), data[begin:])


class _PacketFault(Fault):
    """Strikes packets: bytes up to and including a 00, which may stand alone."""

    def connect(self) -> None:
        """Begin with a packet."""
        self._begun = False

    def _parts(self, data: bytes) -> Iterator[tuple[bytes, bool, bool]]:
        """Yield the parts of packets, and whether each begins one and ends one."""
        for part in re.findall(rb"[^\0]*\0|[^\0]+", data):
            begins, ends = not self._begun, part.endswith(b"\0")
            self._begun = not ends
            yield part, begins, ends

    def _strikes(self) -> bool:
        return bool(self._hits.select(1))


class Lose(_PacketFault):
    """Loses packets."""

    def connect(self) -> None:
        """Begin with a packet."""
        super().connect()
        self._losing = False

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes of the packets that are not lost."""
        kept = bytearray()
        for part, begins, _ in self._parts(data):
            if begins:
                self._losing = self._strikes()
            if not self._losing:
                kept += part
        yield Piece(at, bytes(kept))


class Delay(_PacketFault):
    """Holds packets back; those behind come no sooner, so that the order stays."""

    def connect(self) -> None:
        """Begin with nothing held back."""
        super().connect()
        self._free = -math.inf  # until when something is held back

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes, some later than they came."""
        for part, begins, _ in self._parts(data):
            if begins and self._strikes():
                self._free = max(self._free, at + self._seconds)
            yield Piece(max(self._free, at), part)


class Reorder(_PacketFault):
    """Exchanges a packet with the one behind it.

    protocol.md has the order of bytes from the pipe (9.3), so that such a line is outside of what
    it promises. What holds all the same: a DATA packet is applied at most once in a session,
    nothing is shown before it is whole, and the digest tells what is on display. What does not
    hold: that a packet which the host takes for lost was lost, so that some are sent twice; that
    credit is counted right, so that there may be an OVERRUN; and that a DATA packet belongs to
    the session of the last HELLO. One that comes late, behind a new HELLO, may be taken for a
    packet of the new session with the same number, and only the digest shows it.
    """

    def connect(self) -> None:
        """Begin with nothing held back."""
        super().connect()
        self._held = bytearray()
        self._holding = False  # the packet that is held back still comes

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes in the order in which they come now."""
        out = bytearray()
        for part, begins, ends in self._parts(data):
            if begins and not self._held:
                self._holding = self._strikes()
            if self._holding:
                self._held += part
                self._holding = not ends
                release = len(self._held) > _LONGEST  # that is no packet
            else:
                out += part
                release = ends
            if release:
                out += self._held
                self._held.clear()
                self._holding = False
        yield Piece(at, bytes(out))
