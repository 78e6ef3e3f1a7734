"""Kinds of faults on a line, reproducible for the same seed.

A fault sees the bytes of one direction and knows of packets only that a 00 ends them. Where it hits
depends on the position of the bytes in the stream, not on how they are cut into pieces; delays
depend on the times passed to it, not on a clock.
"""

import math
import random
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator
from enum import Enum, auto
from typing import ClassVar, Final, NamedTuple, Protocol

from firmware_sim import spec
from firmware_sim.sender import max_wire_bytes

_LONGEST: Final = max_wire_bytes(spec.LIMIT_MAX_PAYLOAD + spec.LIMIT_OVERHEAD)  # of a packet

# How the parameters of a kind are written, behind its name.
RATE: Final = "=RATE"
TIMED: Final = "=SECONDS@RATE"
BYTES: Final = "@BYTES"


class Event(Enum):
    """An event between two bytes of the stream."""

    CUT = auto()  # the bytes before are handed over on their own
    REBOOT = auto()  # the device starts again
    UNPLUG = auto()  # the connection ends


class Piece(NamedTuple):
    """A part of the stream.

    Parameters
    ----------
    at
        Arrival time in seconds.
    what
        Bytes, or an event between those before and those after.
    """

    at: float
    what: bytes | Event


class HitSelector(Protocol):
    """Selection of the trials of a sequence (bits, bytes or packets) that a fault hits."""

    def select(self, trials: int) -> list[int]:
        """Return the indices of the hits among the next trials."""


class RandomHits:
    """Hits at random, each trial with the same probability.

    Parameters
    ----------
    rate
        Probability, 0 to 1.
    rng
        Source of random numbers.
    """

    def __init__(self, rate: float, rng: random.Random) -> None:
        self._rate = rate
        self._rng = rng
        self._next = self._gap()  # trials before the next hit

    def _gap(self) -> float:
        if self._rate >= 1:
            return 0
        if not self._rate:
            return math.inf
        return math.log(1 - self._rng.random()) // math.log1p(-self._rate)

    def select(self, trials: int) -> list[int]:
        """Return the indices of the hits among the next trials."""
        hits = []
        while self._next < trials:
            hits.append(int(self._next))
            self._next += 1 + self._gap()
        self._next -= trials
        return hits


class SingleHit:
    """Exactly one hit.

    Parameters
    ----------
    count
        Number of the trial that it hits, from 1 on.
    """

    def __init__(self, count: int) -> None:
        self._next: float = count - 1

    def select(self, trials: int) -> list[int]:
        """Return the indices of the hits among the next trials."""
        hits = [int(self._next)] if self._next < trials else []
        self._next = math.inf if hits else self._next - trials
        return hits


class Fault(ABC):
    """A fault on one direction of a line.

    Parameters
    ----------
    hits
        Selects what it hits: bits, bytes or packets, depending on the kind.
    seconds
        Duration, if the kind has one.
    rng
        Source of all other random numbers.

    Attributes
    ----------
    FORMS : tuple of str
        How its parameters are written.
    EFFECT : str
        What it does, in a few words.
    """

    FORMS: ClassVar[tuple[str, ...]] = (RATE,)
    EFFECT: ClassVar[str]

    def __init__(self, hits: HitSelector, seconds: float, rng: random.Random) -> None:
        self._hits = hits
        self._seconds = seconds
        self._rng = rng
        self.connect()

    def connect(self) -> None:  # noqa: B027 - most kinds have no state
        """Begin a connection: nothing of the one before is on the line."""

    @abstractmethod
    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the pieces that the fault makes of the next bytes of the stream.

        Parameters
        ----------
        at
            Their time in seconds, not before that of the call before.
        data
            The bytes.
        """


class Flip(Fault):
    """Bit errors; the rate is per bit."""

    EFFECT = "inverts bits"

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes with some bits inverted."""
        changed = bytearray(data)
        for hit in self._hits.select(8 * len(data)):
            changed[hit >> 3] ^= 1 << (hit & 7)
        yield Piece(at, bytes(changed))


class Drop(Fault):
    """Loss of bytes."""

    EFFECT = "loses bytes"

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes without some of them."""
        changed = bytearray(data)
        for hit in reversed(self._hits.select(len(data))):
            del changed[hit]
        yield Piece(at, bytes(changed))


class Double(Fault):
    """Duplication of bytes."""

    EFFECT = "sends bytes twice"

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes, some of them twice."""
        changed = bytearray(data)
        for hit in reversed(self._hits.select(len(data))):
            changed.insert(hit, changed[hit])
        yield Piece(at, bytes(changed))


class Insert(Fault):
    """Insertion of random bytes."""

    EFFECT = "inserts random bytes"

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes, random ones between some of them."""
        hits = self._hits.select(len(data))
        changed = bytearray(data)
        for hit, noise in reversed([(hit, self._rng.randrange(256)) for hit in hits]):
            changed.insert(hit, noise)
        yield Piece(at, bytes(changed))


class _EventFault(Fault):
    """An event behind bytes."""

    event: Event

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes and the events between them."""
        begin = 0
        for hit in self._hits.select(len(data)):
            yield Piece(at, data[begin : hit + 1])
            yield Piece(at, self.event)
            begin = hit + 1
        yield Piece(at, data[begin:])


class Short(_EventFault):
    """Short writes and reads: the rate is that of cuts per byte."""

    EFFECT = "cuts writes and reads into pieces behind a byte"

    event = Event.CUT


class Reboot(_EventFault):
    """Restart of the device: another boot id, no session, dark pages."""

    FORMS = (RATE, BYTES)
    EFFECT = "restarts the device behind a byte, or once after BYTES bytes"

    event = Event.REBOOT


class Unplug(_EventFault):
    """End of the connection."""

    FORMS = (RATE, BYTES)
    EFFECT = "ends the connection behind a byte, or once after BYTES bytes"

    event = Event.UNPLUG


class Stall(Fault):
    """Standstill of the line before a byte; standstills add up."""

    FORMS = (TIMED,)
    EFFECT = "stops the line before a byte for SECONDS"

    def connect(self) -> None:
        """Begin with a line that moves."""
        self._free = -math.inf  # end of the standstill

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
    """A fault on packets: bytes up to and including a 00, which may stand alone."""

    def connect(self) -> None:
        """Begin between packets."""
        self._begun = False

    def _parts(self, data: bytes) -> Iterator[tuple[bytes, bool, bool]]:
        """Yield parts of packets, and whether each begins a packet and whether it ends one."""
        for part in re.findall(rb"[^\0]*\0|[^\0]+", data):
            begins, ends = not self._begun, part.endswith(b"\0")
            self._begun = not ends
            yield part, begins, ends

    def _hit(self) -> bool:
        return bool(self._hits.select(1))


class Lose(_PacketFault):
    """Loss of packets."""

    EFFECT = "loses packets"

    def connect(self) -> None:
        """Begin between packets."""
        super().connect()
        self._losing = False

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes of the packets that are not lost."""
        kept = bytearray()
        for part, begins, _ in self._parts(data):
            if begins:
                self._losing = self._hit()
            if not self._losing:
                kept += part
        yield Piece(at, bytes(kept))


class Delay(_PacketFault):
    """Delay of packets; those behind wait, so that the order stays."""

    FORMS = (TIMED,)
    EFFECT = "delays packets, and all behind them, by SECONDS"

    def connect(self) -> None:
        """Begin with nothing held back."""
        super().connect()
        self._free = -math.inf  # end of the delay

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes, some later than they came."""
        for part, begins, _ in self._parts(data):
            if begins and self._hit():
                self._free = max(self._free, at + self._seconds)
            yield Piece(max(self._free, at), part)


class Reorder(_PacketFault):
    """Exchange of a packet with the one behind it.

    protocol.md requires that the pipe keeps the order of bytes (9.3), so such a line is outside of
    its guarantees. These hold all the same: a DATA packet is applied at most once in a session, no
    frame is shown before it is whole, and the digest is that of what is on display. These do not:
    that a packet which the host regards as lost was lost, so some are sent twice; that credit is
    counted right, so there may be an OVERRUN; that a DATA packet belongs to the session of the last
    HELLO. A packet that comes late, behind a new HELLO, may be taken for the packet of the new
    session with the same number; only the digest reveals it.
    """

    EFFECT = "exchanges a packet with the next one"

    def connect(self) -> None:
        """Begin with nothing held back."""
        super().connect()
        self._held = bytearray()
        self._holding = False  # the held packet has not ended yet

    def apply(self, at: float, data: bytes) -> Iterator[Piece]:
        """Yield the bytes in their new order."""
        out = bytearray()
        for part, begins, ends in self._parts(data):
            if begins and not self._held:
                self._holding = self._hit()
            if self._holding:
                self._held += part
                self._holding = not ends
                release = len(self._held) > _LONGEST  # longer than any packet
            else:
                out += part
                release = ends
            if release:
                out += self._held
                self._held.clear()
                self._holding = False
        yield Piece(at, bytes(out))
