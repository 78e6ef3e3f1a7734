"""Faults of a line: parsing of fault specifications, and one direction of a line with faults.

Knows nothing of what the faults do.
"""

import difflib
import math
import random
import re
from collections import deque
from dataclasses import dataclass
from typing import Final

from firmware_sim import fault_types
from firmware_sim.fault_types import BYTES, TIMED, Event, Fault, HitSelector, Piece
from firmware_sim.quoting import excerpt

KINDS: Final[dict[str, type[Fault]]] = {
    "flip": fault_types.Flip,
    "drop": fault_types.Drop,
    "double": fault_types.Double,
    "insert": fault_types.Insert,
    "lose": fault_types.Lose,
    "delay": fault_types.Delay,
    "reorder": fault_types.Reorder,
    "short": fault_types.Short,
    "stall": fault_types.Stall,
    "reboot": fault_types.Reboot,
    "unplug": fault_types.Unplug,
}
DIRECTIONS: Final = ("down", "up")  # to the device, and from it
_FAULT: Final = re.compile(r"(?:(\w+)\.)?(\w+)(?:[=:]([^@]*))?(?:@(.*))?")


@dataclass(frozen=True)
class FaultSpec:
    """A fault as specified.

    Parameters
    ----------
    kind
        One of `KINDS`.
    directions
        Some of `DIRECTIONS`.
    rate
        Probability per bit, byte or packet, depending on the kind.
    seconds
        Duration, if the kind has one.
    after
        Number of bytes after which the fault occurs once; None if it has a rate.
    """

    kind: str
    directions: tuple[str, ...]
    rate: float = 0.0
    seconds: float = 0.0
    after: int | None = None


def forms(kind: str) -> list[str]:
    """Return how a fault of a kind is written, such as ``["reboot=RATE", "reboot@BYTES"]``."""
    return [kind + form for form in KINDS[kind].FORMS]


def parse_faults(text: str) -> tuple[FaultSpec, ...]:
    """Parse a list of faults such as ``flip=1e-5,down.drop=1e-6,stall=0.2@0.01,reboot@5000``.

    Parameters
    ----------
    text
        Faults joined by commas, each in one of the `forms` of its kind. A colon may stand for the
        equals sign. The prefix ``down.`` or ``up.`` limits a fault to one direction; otherwise it
        applies to both, but reboot and unplug to the direction to the device.

    Returns
    -------
    tuple of FaultSpec
        The faults, in the order in which they act on the stream.

    Raises
    ------
    ValueError
        If a kind is unknown or its values are invalid; the message says what is possible.
    """
    return tuple(_parse(part.strip()) for part in text.split(",") if part.strip())


def _parse(part: str) -> FaultSpec:
    match = _FAULT.fullmatch(part)
    direction, kind, value, behind = match.groups() if match else (None, part, None, None)
    if kind not in KINDS:
        near = difflib.get_close_matches(kind[:20], KINDS, 1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise ValueError(f"fault {excerpt(kind)} is unknown: {hint}there are {', '.join(KINDS)}")
    if direction not in (None, *DIRECTIONS):
        raise ValueError(
            f"fault {excerpt(part)}: the prefix is down. (to the device) or up. (from it)"
        )
    allowed = KINDS[kind].FORMS
    one_way = DIRECTIONS[:1] if BYTES in allowed else DIRECTIONS
    directions = one_way if direction is None else (direction,)
    if TIMED in allowed:
        seconds, rate = _non_negative(value), _non_negative(behind)
        if seconds < math.inf and rate <= 1:
            return FaultSpec(kind, directions, rate, seconds)
    elif BYTES in allowed and value is None and behind and re.fullmatch("[0-9]{1,18}", behind):
        if after := int(behind):
            return FaultSpec(kind, directions, after=after)
    elif behind is None and _non_negative(value) <= 1:
        return FaultSpec(kind, directions, _non_negative(value))
    raise ValueError(
        f"fault {excerpt(part)}: write {' or '.join(forms(kind))}, with a RATE from 0 to 1"
        + (" and BYTES from 1 on" if BYTES in allowed else "")
    )


def _non_negative(text: str | None) -> float:
    """Return a number that is not negative; infinity for anything else."""
    try:
        number = float(text or "")
    except ValueError:
        return math.inf
    return number if number >= 0 else math.inf


class FaultyLine:
    """One direction of a line with its faults.

    Parameters
    ----------
    faults
        As from `parse_faults`.
    seed
        Seed of the random numbers: equal seeds hit equal places.
    direction
        One of `DIRECTIONS`.

    Attributes
    ----------
    backlog : int
        Number of bytes on the line.
    """

    def __init__(self, faults: tuple[FaultSpec, ...], seed: int, direction: str) -> None:
        self._faults = [
            _build(fault, f"{seed} {direction} {place} {fault.kind}")
            for place, fault in enumerate(faults)
            if direction in fault.directions
        ]
        self.connect()

    def connect(self) -> None:
        """Begin a connection; what was on the line is lost."""
        self._pieces: deque[Piece] = deque()
        self._last = -math.inf  # arrival time of the last piece
        self.backlog = 0
        for fault in self._faults:
            fault.connect()

    def send(self, at: float, data: bytes) -> None:
        """Put bytes on the line.

        Parameters
        ----------
        at
            Time in seconds, not before that of the call before.
        data
            The bytes.
        """
        pieces = [Piece(at, data)]
        for fault in self._faults:
            pieces = [new for old in pieces for new in _apply(fault, old)]
        for when, what in pieces:
            if what:
                self._last = max(self._last, when)
                self._pieces.append(Piece(self._last, what))
                self.backlog += len(what) if isinstance(what, bytes) else 0

    @property
    def due(self) -> float:
        """Arrival time of the next piece in seconds; infinity if none is on the line."""
        return self._pieces[0].at if self._pieces else math.inf

    def take(self, now: float) -> bytes | Event:
        """Return what has arrived by now: the bytes up to an event, or the event.

        No bytes if nothing has arrived. Bytes sent together arrive together unless a fault parts
        them.
        """
        come = bytearray()
        while self._pieces and self._pieces[0].at <= now:
            what = self._pieces[0].what
            if isinstance(what, bytes):
                come += what
                self.backlog -= len(what)
            elif not come:
                self._pieces.popleft()
                return what
            else:
                break
            self._pieces.popleft()
        return bytes(come)


def _build(fault: FaultSpec, seed: str) -> Fault:
    hits: HitSelector = (
        fault_types.RandomHits(fault.rate, random.Random(seed))
        if fault.after is None
        else fault_types.SingleHit(fault.after)
    )
    return KINDS[fault.kind](hits, fault.seconds, random.Random(f"{seed} besides"))


def _apply(fault: Fault, piece: Piece) -> list[Piece]:
    """Return the pieces that a fault makes of one; events pass unchanged."""
    if isinstance(piece.what, Event):
        return [piece]
    return list(fault.apply(piece.at, piece.what))
