"""A bad line: which faults a text asks for, and one direction of a line that has them.

It knows nothing of what the faults do.
"""

import difflib
import math
import random
import re
from collections import deque
from dataclasses import dataclass
from typing import Final

from firmware_sim import fault_types
from firmware_sim.fault_types import Event, Fault, HitSelector, Piece

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
_WITH_DURATION: Final = ("delay", "stall")
_AT_BYTE: Final = ("reboot", "unplug")
_FAULT: Final = re.compile(r"(?:(\w+)\.)?(\w+)(?:[=:]([^@]*))?(?:@(.*))?")


@dataclass(frozen=True)
class FaultSpec:
    """A fault as a text asks for it.

    Parameters
    ----------
    kind
        One of `KINDS`.
    directions
        Some of `DIRECTIONS`.
    rate
        Chance of each bit, byte or packet, by its kind.
    seconds
        For how long, if its kind has a time.
    after
        Behind so many bytes, once, instead of a rate.
    """

    kind: str
    directions: tuple[str, ...]
    rate: float = 0.0
    seconds: float = 0.0
    after: int | None = None


def parse_faults(text: str) -> tuple[FaultSpec, ...]:
    """Read a list of faults such as ``flip=1e-5,down.drop=1e-6,stall=0.2@0.01,reboot@5000``.

    Parameters
    ----------
    text
        Faults with commas between them: ``KIND=RATE``, for delay and stall ``KIND=SECONDS@RATE``,
        for reboot and unplug also ``KIND@BYTES``. A colon may stand for ``=``. ``down.`` or
        ``up.`` in front has it on one direction; otherwise it is on both, but reboot and unplug
        are on that to the device.

    Returns
    -------
    tuple of Spec
        The faults, in the order in which they work.

    Raises
    ------
    ValueError
        If a kind is not known, or what stands behind it cannot be; the message says what can.
    """
    return tuple(_parse(part) for part in text.split(",") if part)


def _parse(part: str) -> FaultSpec:
    match = _FAULT.fullmatch(part.strip())
    direction, kind, value, behind = match.groups() if match else (None, part, None, None)
    if kind not in KINDS:
        near = difflib.get_close_matches(kind, KINDS, 1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise ValueError(f"fault {kind!r} is not known: {hint}there are {', '.join(KINDS)}")
    if direction not in (None, *DIRECTIONS):
        raise ValueError(f"fault {part!r}: write down. (to the device) or up. (from it) in front")
    one_way = DIRECTIONS[:1] if kind in _AT_BYTE else DIRECTIONS
    directions = one_way if direction is None else (direction,)
    if kind in _WITH_DURATION:
        seconds, rate = _non_negative(value), _non_negative(behind)
        if seconds < math.inf and rate <= 1:
            return FaultSpec(kind, directions, rate, seconds)
        raise ValueError(
            f"fault {part!r}: write {kind}=SECONDS@RATE with a time and a rate from 0 to 1"
        )
    if kind in _AT_BYTE and value is None and behind is not None and re.fullmatch("[0-9]+", behind):
        after = int(behind)
        if after:
            return FaultSpec(kind, directions, after=after)
    if behind is None and _non_negative(value) <= 1:
        return FaultSpec(kind, directions, _non_negative(value))
    also = f" or {kind}@BYTES with a number from 1 on" if kind in _AT_BYTE else ""
    raise ValueError(f"fault {part!r}: write {kind}=RATE with a rate from 0 to 1{also}")


def _non_negative(text: str | None) -> float:
    """Return a number from 0 on, infinity if it is none."""
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
        Equal seeds strike equal places.
    direction
        One of `DIRECTIONS`.

    Attributes
    ----------
    backlog : int
        How many bytes are on their way.
    """

    def __init__(self, faults: tuple[FaultSpec, ...], seed: int, direction: str) -> None:
        self._faults = [
            _build(fault, f"{seed} {direction} {place} {fault.kind}")
            for place, fault in enumerate(faults)
            if direction in fault.directions
        ]
        self.connect()

    def connect(self) -> None:
        """Begin a connection; what was on its way is gone."""
        self._pieces: deque[Piece] = deque()
        self._last = -math.inf  # when the last piece comes
        self.backlog = 0
        for fault in self._faults:
            fault.connect()

    def send(self, at: float, data: bytes) -> None:
        """Let bytes set out.

        Parameters
        ----------
        at
            When, in seconds, never before those that set out before.
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
        """When the next piece comes, in seconds; infinity if none is on its way."""
        return self._pieces[0].at if self._pieces else math.inf

    def take(self, now: float) -> bytes | Event:
        """Return what has come by now: bytes as far as an event, or the event.

        Nothing is no bytes. Bytes that set out together come together, unless a fault has it
        otherwise.
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
    strokes: HitSelector = (
        fault_types.RandomHits(fault.rate, random.Random(seed))
        if fault.after is None
        else fault_types.SingleHit(fault.after)
    )
    return KINDS[fault.kind](strokes, fault.seconds, random.Random(f"{seed} besides"))


def _apply(fault: Fault, piece: Piece) -> list[Piece]:
    """Return what becomes of a piece; what happens, happens."""
    if isinstance(piece.what, Event):
        return [piece]
    return list(fault.apply(piece.at, piece.what))
