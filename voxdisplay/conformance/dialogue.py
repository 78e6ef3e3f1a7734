"""Request-response exchange with a device under test, with assertions on what it answers.

Nothing assumes that a response comes at once, and nothing waits without a limit. Where *no*
response is required, a STATUS is sent behind: packets are processed in order, so a response that
has not come before that of the STATUS will not come. Sends any packet, valid or not; knows no page.
"""

from __future__ import annotations

import random
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NoReturn

from voxdisplay.conformance import packets
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.packets import SHOWN, Response
from voxdisplay.conformance.response_reader import ResponseReader
from voxdisplay.errors import TransportTimeout
from voxdisplay.transport import Transport
from voxdisplay.wire import spec

_TAGS = range(129, 223)  # never the sequence number of a DATA packet that a check has just sent
_HELLO_INTERVAL_S = 0.25
_MAX_RESPONSES = 10_000
_MAX_LOG_ENTRIES = 2_000
_BITS_PER_BYTE = 10  # on a serial line
_HURRY_FACTOR, _HURRIED_S = 4, 0.05
_PATIENCE = 5  # a busy computer may delay a response by more than the limit
_SLICE_S = 0.1  # of a wait, which measures how late this process is woken up
_LOGGED_BYTES = 48  # of each packet, in a transcript


class Violation(Exception):  # noqa: N818 - a verdict
    """The device does not meet a requirement.

    Parameters
    ----------
    expected, actual : str
        What the document requires, and what the device did.
    likely_cause : str
        The bug that is probably behind it, if one is known.
    """

    def __init__(self, expected: str, actual: str, likely_cause: str = "") -> None:
        super().__init__(expected, actual, likely_cause)  # pickled by these arguments
        self.expected, self.actual, self.likely_cause = expected, actual, likely_cause

    def __str__(self) -> str:
        return f"must be: {self.expected}; was: {self.actual}"


class NoResponse(Violation):
    """No response came in time."""


class NotApplicable(Exception):  # noqa: N818 - a verdict
    """The check does not apply to this device, or cannot be made here."""


@dataclass(frozen=True, slots=True)
class LogEntry:
    """One packet or some raw bytes, sent or received."""

    sent: bool
    data: bytes
    text: str

    def __str__(self) -> str:
        shown = self.data[:_LOGGED_BYTES].hex(" ").upper()
        more = f" ... {len(self.data)} bytes" if len(self.data) > _LOGGED_BYTES else ""
        return f"{'->' if self.sent else '<-'} {shown}{more}   {self.text}"


class Dialogue:
    """A device under test, spoken to packet by packet.

    Parameters
    ----------
    pipe : Transport
    timeout_s : float
        How long a response may take, plus a refresh period and the time on a serial line. Up to
        five times that is waited for it, and it is counted as late.
    opening_s : float
        How long the first INFO may take: a board may have to boot.
    baud : int
        Bits per second of a serial line.
    seed : int
        Seed of all random numbers.
    clock : callable
        Monotonic seconds; the same clock by which ``pipe`` measures its timeouts.

    Attributes
    ----------
    device : AnnouncedDevice
        The device as announced in its INFO.
    info : Response
        That INFO.
    session : int
        Number of the session opened last.
    seq, frame : int
        Next sequence number and frame id.
    state : Response
        Latest response to a STATUS: an ACK, or an ERROR if no session was open.
    reader : ResponseReader
    rng : random.Random
    log : list of LogEntry
        Packets sent and received since the check began.
    clock : callable
        See above.
    timeout_count : int
        Number of responses that were waited for in vain.
    late_count, slowest_s : int, float
        Number of responses that took longer than ``timeout_s`` allows, and the longest that any
        took, in seconds.
    is_hurried : bool
        True if responses are given up soon, see `response_timeout_s`.
    """

    def __init__(
        self,
        pipe: Transport,
        *,
        timeout_s: float = 1.0,
        opening_s: float = 5.0,
        baud: int = 115200,
        seed: int = 0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.clock = clock
        self.rng = random.Random(seed)
        self._seed = seed
        self.timeout_count = self.late_count = 0
        self.is_hurried = False
        self.reader = ResponseReader()
        self.session = 0
        self.seq = self.frame = 0
        self.log: list[LogEntry] = []
        self.device = AnnouncedDevice(0, 0, 0, 0)
        self.info = self.state = Response(b"\0\0\0")
        self._pipe = pipe
        self._timeout_s, self._opening_s, self._baud = timeout_s, opening_s, baud
        self._received: deque[Response] = deque()
        self._unanswered_bytes = 0
        self._written_s = self.slowest_s = 0.0
        self._tags: Iterator[int] = iter(())

    def start_check(self, name: str) -> None:
        """Reset random numbers and log: a check runs alike whichever others are run."""
        self.rng = random.Random(f"{self._seed} {name}")
        self.log = []

    # -- bytes

    def send_raw(self, stream: bytes, text: str = "raw") -> None:
        """Send bytes as they are."""
        self._log(sent=True, data=stream, text=text)
        self._write(stream)

    def send(self, *bodies: bytes) -> None:
        """Send packets, given as header and payload, in one write."""
        for packet in bodies:
            self._log(sent=True, data=packet, text=packets.describe(packet))
        self._write(b"".join(map(packets.encode, bodies)))

    def _write(self, stream: bytes) -> None:
        self._unanswered_bytes += len(stream)
        self._written_s = self.clock()
        self.reader.credit_limit.note_sent(stream)
        try:
            self._pipe.write(stream, self.response_timeout_s)
        except TransportTimeout as error:
            raise NoResponse("the device reads what is sent to it", str(error)) from error

    @property
    def response_timeout_s(self) -> float:
        """Seconds to wait for a response: a multiple of the limit, two ticks, time on the line.

        With a device that has failed several checks by silence, the limit is a multiple of its
        slowest response so far: silence in all the other checks must not take minutes.
        """
        wait_s = _PATIENCE * self._timeout_s
        if self.is_hurried:
            wait_s = min(self._timeout_s, max(_HURRY_FACTOR * self.slowest_s, _HURRIED_S))
        return wait_s + self._unavoidable_s

    @property
    def _unavoidable_s(self) -> float:
        """Seconds that a response may take in any case: two ticks, time on the line."""
        return 2 * self.device.period_s + self._unanswered_bytes * _BITS_PER_BYTE / self._baud

    def receive(self, until_s: float) -> Response | None:
        """Return the next response; None if none comes before a deadline of `clock`.

        The deadline is moved by the time for which this process should have run, and did not: a
        device on the same computer had to wait as long.
        """
        while not self._received:
            began_s = self.clock()
            left_s = until_s - began_s
            slice_s = min(max(left_s, 0.0), _SLICE_S)
            if not self._read_pipe(slice_s):
                if left_s <= 0:
                    return None
                until_s += max(self.clock() - began_s - slice_s, 0.0)
            if left_s < -self._timeout_s:  # bytes keep coming, but no packet
                return None
        self._unanswered_bytes = 0
        return self._received.popleft()

    def _read_pipe(self, timeout_s: float) -> bool:
        """Read what comes within a time, at least what has come; return whether anything did."""
        data = self._pipe.read(max(timeout_s, 0.0))
        for response in self.reader.feed(data):
            took_s = self.clock() - self._written_s
            self.slowest_s = max(self.slowest_s, took_s)
            self.late_count += took_s > self._timeout_s + self._unavoidable_s
            self._log(sent=False, data=response.body, text=str(response))
            self._received.append(response)
        return bool(data)

    def responses(self) -> Iterator[Response]:
        """Yield responses until none comes in time."""
        until_s = self.clock() + self.response_timeout_s
        for _ in range(_MAX_RESPONSES):
            answer = self.receive(until_s)
            if answer is None:
                self.timeout_count += 1
                return
            yield answer
        raise NoResponse("a device sends responses only", f"{_MAX_RESPONSES} packets in a row")

    def wait_two_ticks(self) -> None:
        """Wait for a little more than two refresh periods."""
        if self.device.refresh:
            self.stay_silent(2 * self.device.period_s + 0.01)

    def stay_silent(self, seconds: float) -> None:
        """Send nothing for a time; what comes is read."""
        until_s = self.clock() + seconds
        while (left_s := until_s - self.clock()) > 0:
            self._read_pipe(left_s)

    def _log(self, *, sent: bool, data: bytes, text: str) -> None:
        if len(self.log) < _MAX_LOG_ENTRIES:
            self.log.append(LogEntry(sent, data, text))

    # -- sessions and requests

    def open_session(self) -> None:
        """Open a new session; raise `Violation` if the device has restarted or does not respond."""
        self.session = self.session % 65535 + 1
        self.seq = self.frame = 0
        self.send_raw(b"\0", "00, which ends any segment before")
        self.send(packets.hello(self.session))
        info = self._await_info()
        if info is None:
            raise NoResponse(
                "INFO in response to HELLO", "nothing", "the packets before hung the device"
            )
        if info.boot != self.device.boot:
            self.info, self.device = info, AnnouncedDevice.from_info(info)
            self.reader.device = self.device
            raise Violation(
                "the device keeps running",
                f"it has restarted: its boot id is {info.boot:04X}h now",
                "it crashed, or its watchdog fired, at what this check sent",
            )

    def handshake(self) -> bool:
        """Open the first session; return whether the device responded."""
        self.session = self.rng.randrange(1, 65536)
        until_s = self.clock() + self._opening_s
        info = None
        while info is None and self.clock() < until_s:
            self.send_raw(b"\0")
            self.send(packets.hello(self.session))
            info = self._await_info(min(until_s, self.clock() + _HELLO_INTERVAL_S))
        if info is None:
            return False
        self.info, self.device = info, AnnouncedDevice.from_info(info)
        self.reader.device = self.device
        return True

    def _await_info(self, until_s: float | None = None) -> Response | None:
        until_s = self.clock() + self.response_timeout_s if until_s is None else until_s
        while answer := self.receive(until_s):
            if answer.kind == spec.TYPE_INFO and answer.session == self.session:
                return answer
        return None

    def end_session(self) -> None:
        """End the session by a DATA packet with a reserved flag, number, frame and op."""
        self.send_and_poll(packets.data(self.seq + 99, self.frame + 99, b"\x1f", 2))
        must = "NO_SESSION answers all, after a refused DATA"
        self.require(self.state.kind == spec.TYPE_ERROR, must, self.state)

    def poll_status(self) -> list[Response]:
        """Send a STATUS, store its response in `state`, and return the responses before it."""
        tag = next(self._tags, 0)
        if not tag:
            self._tags = iter(_TAGS)
            tag = next(self._tags)
        self.send(packets.status(tag))
        before: list[Response] = []
        for answer in self.responses():
            if (answer.kind == spec.TYPE_ACK and answer.last == tag) or (
                answer.kind == spec.TYPE_ERROR and answer.seq == tag
            ):
                self.state = answer
                return before
            before.append(answer)
        raise NoResponse(
            f"a response to STATUS with its tag {tag}, in `last` of an ACK or `seq` of an ERROR",
            f"only {before[-1]}" if before else "nothing",
        )

    def send_and_poll(self, *bodies: bytes) -> list[Response]:
        """Send packets and a STATUS; return the responses to the packets."""
        self.send(*bodies)
        return self.poll_status()

    def request(self, packet: bytes) -> Response:
        """Send a packet; return its response, which must be the only one."""
        self.send(packet)
        answer = next(self.responses(), None)
        if answer is None:
            raise NoResponse(f"a response to {packets.describe(packet)}", "nothing")
        extra = self.poll_status()
        if extra:
            raise Violation("one response", " and ".join(map(str, [answer, *extra])))
        return answer

    def send_raw_and_poll(self, stream: bytes, text: str = "raw") -> list[Response]:
        """Send bytes and a STATUS; return the responses to the bytes."""
        self.send_raw(stream, text)
        return self.poll_status()

    # -- assertions

    def fail(self, expected: str, actual: object, likely: str = "") -> NoReturn:
        """Raise `Violation`."""
        raise Violation(expected, str(actual), likely)

    def skip(self, reason: str) -> NoReturn:
        """Raise `NotApplicable`: the check cannot be made here."""
        raise NotApplicable(reason)

    def require(self, holds: bool, expected: str, actual: object, likely: str = "") -> None:
        """Raise `Violation` unless a condition holds."""
        if not holds:
            raise Violation(expected, str(actual), likely)

    def require_ack(self, answer: Response, likely: str = "", /, **fields: int) -> None:
        """Require an ACK with these fields; ``shown``, ``pending`` and ``asked`` are its flags."""
        if answer.kind != spec.TYPE_ACK:
            raise Violation("ACK", str(answer), likely)
        flags = {"shown": SHOWN, "pending": packets.PENDING, "asked": packets.ASKED}
        for name, value in fields.items():
            if name in flags:
                is_so = bool(answer.flags & flags[name])
                was = f"{name.upper()} {'set' if is_so else 'clear'}"
                must = f"{name.upper()} {'set' if value else 'clear'}"
            else:
                is_so = getattr(answer, name)
                form = "08X" if name in {"received", "digest"} else ""
                must, was = f"{name} {value:{form}}", f"{name} {is_so:{form}}"
            if is_so != value:
                raise Violation(f"ACK with {must}", f"{was} in {answer}", likely)

    def require_refused(self, packet: bytes, code: int, offset: int) -> Response:
        """Require that a packet is refused with this code, at this offset in the packet."""
        answer = self.request(packet)
        must = f"ERROR {packets.CODE_NAMES[code]} at offset {offset}"
        if answer.kind != spec.TYPE_ERROR:
            raise Violation(must, str(answer), "the device does not check this")
        if (answer.code, answer.offset) != (code, offset):
            raise Violation(must, str(answer), _likely_cause(answer, code, offset))
        return answer

    def require_ops_refused(self, ops: bytes, code: int, at: int = 0) -> None:
        """Require, in a new session, that ops are refused, at this offset in the payload."""
        self.open_session()
        self.require_refused(packets.data(0, 0, ops), code, packets.HEADER_BYTES + at)


def _likely_cause(error: Response, code: int, offset: int) -> str:
    if error.code == code and error.offset == offset - packets.HEADER_BYTES:
        return "offsets count from the packet's first byte, its header included"
    if error.code == code:
        return "an op's offset is that of its op byte, a field's that of its first byte"
    return "checks are made in the order of the table of section 11, ops from first to last"
