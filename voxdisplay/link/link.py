"""The host's end of protocol.md: session, frames, reads, and when to ask.

A `Link` does no I/O and reads no clock: `receive` takes what a pipe brought, `transmit` gives what
to write, `next_timeout` says when to come back if nothing happens. It knows frames only as payloads
and an expected digest, and no pipe at all.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from voxdisplay.errors import RemoteProtocolError, TransportTimeout
from voxdisplay.link.events import Event, PageRead, Ready, Refused, Restarted, Shown
from voxdisplay.link.window import Window
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.stream import PacketStream

HELLO_INTERVAL_S = 0.25
FIRST_TIMEOUT_S = 0.25  # before a round trip has been measured
LEAST_TIMEOUT_S = 0.05  # section 9.3
MOST_TRANSMISSIONS = 30
MOST_RESTARTS = 3
_MODULUS = 256


@dataclass(slots=True)
class LinkCounters:
    """What a link has done since it was made."""

    packets: int = 0
    wire_bytes: int = 0
    retransmitted: int = 0
    statuses: int = 0
    sessions: int = 0
    device_damaged: int = 0


@dataclass(slots=True)
class _Frame:
    """A frame that is to be shown: its payloads, and how many are in the window already."""

    ticket: int
    payloads: list[bytes]
    clear: bool
    frame_id: int = -1
    entered: int = 0

    @property
    def begun(self) -> bool:
        return self.frame_id >= 0

    @property
    def all_entered(self) -> bool:
        return self.begun and self.entered == len(self.payloads)


@dataclass(slots=True)
class _Request:
    """A READ that waits for its PAGE."""

    start: int
    count: int
    back: bool
    tag: int = -1
    ordinal: int = 0  # 0: to be sent


@dataclass(slots=True)
class _Silence:
    """When something was last heard, and what has been asked since."""

    heard_s: float
    asked_s: float
    progress_s: float
    backoff: int = 1
    asked: dict[int, float] = field(default_factory=dict)  # tag -> when


class Link:
    """One host talking to one device.

    Parameters
    ----------
    session : int
        1..65535, at random.
    now : float
        Seconds on any steady clock; later calls take the same clock.
    patience_s : float
        How long silence, or talk without progress, lasts before `TransportTimeout`.

    """

    def __init__(self, session: int, now: float, *, patience_s: float = 5.0) -> None:
        self.info: packets.Info | None = None
        self.counters = LinkCounters()
        self.stream = PacketStream()
        self._session = session
        self._patience_s = patience_s
        self._window = Window(0)
        self._frames: deque[_Frame] = deque()
        self._next_frame_id = 0
        self._requests: deque[_Request] = deque()
        self._tag = 0
        self._tickets = 0
        self._restarts = 0
        self._hello_due_s = now
        self._round_trip_s: float | None = None
        self._silence = _Silence(now, now, now)
        self._ask_at_once = False

    # -- what the caller wants

    @property
    def ready(self) -> bool:
        """Whether a session is open."""
        return self.info is not None

    @property
    def idle(self) -> bool:
        """Whether nothing is on its way or waited for."""
        return not (self._frames or self._requests or self._window.flights)

    @property
    def backlog(self) -> int:
        """Frames that have been handed over and not shown yet."""
        return len(self._frames)

    @property
    def payloads_left(self) -> int:
        """Payloads that have not been received yet."""
        waiting = sum(len(frame.payloads) - frame.entered for frame in self._frames)
        return waiting + len(self._window.flights)

    def present(self, payloads: list[bytes], *, clear: bool = True) -> int:
        """Queue a frame; give its ticket, which comes back in `Shown`.

        Parameters
        ----------
        payloads : list of bytes
            Ops, each at most INFO's ``max_payload`` long. None at all is a frame without ops.
        clear : bool
            Whether the frame starts dark; otherwise as a copy of what is shown.

        """
        self._tickets += 1
        self._frames.append(_Frame(self._tickets, payloads or [b""], clear))
        return self._tickets

    def withdraw(self, ticket: int) -> bool:
        """Take back a frame of which nothing has been sent; tell whether that was so."""
        for frame in self._frames:
            if frame.ticket == ticket and not frame.begun:
                self._frames.remove(frame)
                return True
        return False

    def read(self, start: int, count: int, *, back: bool = False) -> None:
        """Ask for pixels; `PageRead` brings them, or the first of them."""
        self._requests.append(_Request(start, count, back))

    def reopen(self, session: int, now: float) -> None:
        """Begin a new session; frames that are not shown yet are sent again, whole."""
        self._session = session
        self.info = None
        self._window = Window(0)
        self._next_frame_id = 0
        for frame in self._frames:
            frame.frame_id, frame.entered = -1, 0
        for request in self._requests:
            request.ordinal = 0
        self._hello_due_s = now
        self._silence = _Silence(now, now, now)

    # -- what goes out

    def transmit(self, now: float) -> bytes:
        """Give the bytes to write now: as many as window and credit allow.

        Raises
        ------
        TransportTimeout
            If the device has been silent, or has made no progress, for too long; or a packet was
            lost too often.

        """
        if self.info is None:
            return self._greet(now)
        if self._waiting:
            self._check_patience(now)
        else:  # nothing was on its way: silence so far says nothing
            self._silence.heard_s = self._silence.progress_s = now
        out = bytearray()
        for wire in self._outgoing(now):
            out += wire
        out += self._ask(now)
        self.counters.wire_bytes += len(out)
        return bytes(out)

    def _greet(self, now: float) -> bytes:
        if now < self._hello_due_s:
            return b""
        self._hello_due_s = now + HELLO_INTERVAL_S
        wire = b"\0" + packets.encode(packets.Hello(session=self._session))
        self.counters.wire_bytes += len(wire)
        return wire

    def _outgoing(self, now: float) -> Iterator[bytes]:
        window = self._window
        while (seq := window.lost()) is not None:
            flight = window.flights[seq]
            if not window.fits(len(flight.wire)):
                return
            if flight.transmissions >= MOST_TRANSMISSIONS:
                raise TransportTimeout(
                    f"packet {seq} did not arrive in {flight.transmissions} tries; the device "
                    f"counts {self.counters.device_damaged} damaged packets",
                    hint="the line is too noisy: lower the baud rate, or look at cable and ground",
                )
            self.counters.retransmitted += 1
            yield window.send(seq, now)
        for frame in self._frames:
            while not frame.all_entered:
                size = self._wire_bound(frame)
                if not (window.has_room and window.fits(size)):
                    return
                yield window.send(self._enter(frame), now)
                self.counters.packets += 1
        for request in self._requests:
            if not request.ordinal:
                yield from self._send_read(request)

    def _wire_bound(self, frame: _Frame) -> int:
        payload = frame.payloads[frame.entered] if frame.begun else frame.payloads[0]
        size = len(payload) + spec.LIMIT_OVERHEAD
        return size + size // 254 + 2

    def _enter(self, frame: _Frame) -> int:
        """Put the next packet of a frame into the window."""
        if not frame.begun:
            frame.frame_id = self._next_frame_id
            self._next_frame_id = (frame.frame_id + 1) % _MODULUS
        payload = frame.payloads[frame.entered]
        frame.entered += 1
        flags = spec.DATA_FLAG_CLEAR * frame.clear
        flags |= spec.DATA_FLAG_COMMIT * frame.all_entered
        data = packets.Data(
            seq=self._window.next_seq, frame=frame.frame_id, flags=flags, ops=payload
        )
        return self._window.add(packets.encode(data))

    def _send_read(self, request: _Request) -> Iterator[bytes]:
        self._tag = request.tag = (self._tag + 1) % _MODULUS
        flags = spec.READ_FLAG_BACK * request.back
        wire = packets.encode(
            packets.Read(seq=request.tag, flags=flags, start=request.start, count=request.count)
        )
        if self._window.fits(len(wire)):
            request.ordinal = self._window.send_tagged(request.tag, len(wire))
            yield wire

    # -- silence

    @property
    def _waiting(self) -> bool:
        return bool(
            self._window.flights
            or any(frame.all_entered for frame in self._frames)
            or any(request.ordinal for request in self._requests)
        )

    @property
    def _timeout_s(self) -> float:
        if self._round_trip_s is None:
            return FIRST_TIMEOUT_S * self._silence.backoff
        assert self.info is not None  # noqa: S101 - a session is open, or nobody asks
        tick_s = 1000 / self.info.refresh if self.info.refresh else 0.0
        least = max(LEAST_TIMEOUT_S, 2 * self._round_trip_s + tick_s)
        return least * self._silence.backoff

    def _check_patience(self, now: float) -> None:
        silence = self._silence
        if now - silence.heard_s > self._patience_s and silence.asked:
            raise TransportTimeout(
                f"the device has been silent for {now - silence.heard_s:.1f} s",
                hint="is it still plugged in and switched on?",
            )
        if now - silence.progress_s > 2 * self._patience_s:
            raise TransportTimeout(
                f"the device answers, but nothing has moved for {now - silence.progress_s:.1f} s",
                hint="its firmware may be stuck: switch it off and on",
            )

    def _ask(self, now: float) -> bytes:
        """Give a STATUS if it is time for one."""
        silence = self._silence
        due = max(silence.heard_s, silence.asked_s) + self._timeout_s <= now
        if not self._waiting or not (due or self._ask_at_once):
            return b""
        self._ask_at_once = False
        self._tag = (self._tag + 1) % _MODULUS
        wire = packets.encode(packets.Status(seq=self._tag))
        if len(silence.asked) >= spec.LIMIT_MAX_STATUS or not self._window.fits(
            len(wire), reserved=True
        ):
            silence.asked_s = now
            return b""
        self._window.send_tagged(self._tag, len(wire))
        silence.asked[self._tag] = silence.asked_s = now
        silence.backoff *= 2
        self.counters.statuses += 1
        return wire

    def next_timeout(self, now: float) -> float | None:
        """Seconds until `transmit` has something to do even if nothing comes; None: never."""
        if self.info is None:
            return max(0.0, self._hello_due_s - now)
        if not self._waiting:
            return None
        silence = self._silence
        ask_s = max(silence.heard_s, silence.asked_s) + self._timeout_s
        return max(0.0, min(ask_s, silence.heard_s + self._patience_s) - now)

    # -- what comes in

    def receive(self, data: bytes, now: float) -> list[Event]:
        """Take bytes from the pipe; give what they mean.

        Raises
        ------
        RemoteProtocolError
            If the device breaks protocol.md.

        """
        events: list[Event] = []
        for packet in self.stream.feed(data):
            events += self._take(packet, now)
        return events

    def _take(self, packet: packets.Packet, now: float) -> Iterator[Event]:
        match packet:
            case packets.Info():
                yield from self._take_info(packet, now)
            case packets.Ack() if self.info and packet.session == self._session:
                yield from self._take_ack(packet, now)
            case packets.Page() if self.info:
                yield from self._take_page(packet, now)
            case packets.Error() if self.info and packet.session in (0, self._session):
                yield from self._take_error(packet, now)

    def _take_info(self, info: packets.Info, now: float) -> Iterator[Event]:
        if self.info is not None:
            if info.boot != self.info.boot:
                yield self._restart(now)
            return
        if info.session != self._session:
            return
        if info.major == spec.VERSION_MAJOR:
            check_info(info)
        self.info = info
        self.counters.sessions += 1
        self._window = Window(info.rx_buffer)
        self._silence = _Silence(now, now, now)
        yield Ready(info)

    def _take_ack(self, ack: packets.Ack, now: float) -> Iterator[Event]:
        assert self.info is not None  # noqa: S101 - the caller looked
        if ack.boot != self.info.boot:
            yield self._restart(now)
            return
        silence = self._silence
        silence.heard_s = now
        if ack.flags & spec.ACK_FLAG_ASKED and ack.last in silence.asked:
            self._measure(now - silence.asked[ack.last])
            silence.asked.clear()
            silence.backoff = 1
        done = self._window.acknowledge(ack)
        if done:
            silence.progress_s = now
            silence.backoff = 1
            self._measure(now - done[-1].sent_s)
        self._find_lost_reads(ack)
        if ack.damaged != self.counters.device_damaged:
            self.counters.device_damaged = ack.damaged
            self._ask_at_once = self._waiting
        yield from self._note_shown(ack, now)

    def _measure(self, seconds: float) -> None:
        before = self._round_trip_s
        self._round_trip_s = seconds if before is None else before + (seconds - before) / 8

    def _find_lost_reads(self, ack: packets.Ack) -> None:
        """Send a READ again whose PAGE did not come before the answer to a later STATUS."""
        if ack.flags & spec.ACK_FLAG_ASKED:
            taken = self._window.taken_tag(ack.last)
            for request in self._requests:
                if request.ordinal < taken:
                    request.ordinal = 0

    def _note_shown(self, ack: packets.Ack, now: float) -> Iterator[Event]:
        if ack.shown is None or not any(
            frame.all_entered and frame.frame_id == ack.shown for frame in self._frames
        ):
            return
        assert self.info is not None  # noqa: S101 - the caller looked
        digest = ack.digest if self.info.has(spec.FEATURE_DIGEST) else None
        self._silence.progress_s = now
        self._restarts = 0
        while True:
            frame = self._frames.popleft()
            if frame.frame_id == ack.shown:
                yield Shown(frame.ticket, digest)
                return

    def _take_page(self, page: packets.Page, now: float) -> Iterator[Event]:
        request = next((r for r in self._requests if r.ordinal and r.tag == page.seq), None)
        if request is None:
            return
        if page.start != request.start or not 1 <= page.count <= request.count:
            raise RemoteProtocolError(
                f"PAGE covers {page.count} voxels from {page.start}; "
                f"asked were {request.count} from {request.start}",
                section="10",
                offset=4,
            )
        self._window.taken_tag(page.seq)
        self._requests.remove(request)
        self._silence.heard_s = self._silence.progress_s = now
        self._silence.backoff = 1
        yield PageRead(page)

    def _take_error(self, error: packets.Error, now: float) -> Iterator[Event]:
        if error.code == spec.CODE_NO_SESSION:
            yield self._restart(now)
        else:
            self._frames.clear()
            self._requests.clear()
            yield Refused(error)

    def _restart(self, now: float) -> Restarted:
        self._restarts += 1
        if self._restarts > MOST_RESTARTS:
            raise TransportTimeout(
                f"the device has lost the session {self._restarts} times without showing a frame",
                hint="does it restart by itself? Look at its power supply",
            )
        self.reopen(self._session % 0xFFFF + 1, now)
        return Restarted()


def check_info(info: packets.Info) -> None:
    """Refuse an INFO that contradicts protocol.md.

    Raises
    ------
    RemoteProtocolError
        Naming the field.

    """
    longest = info.max_payload + spec.LIMIT_OVERHEAD
    wrong = {
        "nx, ny, nz": not all((info.nx, info.ny, info.nz))
        or info.nx * info.ny * info.nz > spec.LIMIT_MAX_VOXELS,
        "pages": info.pages < 2,
        "max_payload": info.max_payload < spec.LIMIT_MIN_PAYLOAD,
        "rx_buffer": info.rx_buffer < longest + longest // 254 + 2 + spec.LIMIT_RESERVE,
        "session": info.session == 0,
    }
    for name, is_wrong in wrong.items():
        if is_wrong:
            raise RemoteProtocolError(
                f"INFO announces a value of {name} that is not allowed", section="5"
            )
