"""The host's end of protocol.md: session, frames, reads, and when to ask.

A `Link` does no I/O and reads no clock: `receive` takes what a pipe brought, `transmit` gives what
to write, `next_timeout` says when to come back if nothing happens. It knows frames only as
payloads, and no pipe at all.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from voxdisplay.errors import RemoteProtocolError, TransportTimeout
from voxdisplay.link.events import Event, PageRead, Ready, Refused, Restarted, Shown, Told
from voxdisplay.link.info import check_info
from voxdisplay.link.loss import Loss
from voxdisplay.link.pace import Pace
from voxdisplay.link.silence import Silence
from voxdisplay.link.window import Window
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.stream import PacketStream

HELLO_INTERVAL_S = 0.25
MOST_LATE_S = 0.25  # a caller that comes back later than this was away
MOST_TRANSMISSIONS = 30
MOST_RESTARTS = 8  # without a frame shown
_MODULUS = 256
_PACKETS_IN_BUFFER = 4  # so many must fit the device's buffer for the pipe to stay full

OnDisplay: TypeAlias = tuple[int, int]
"""Which picture is on display: how many sessions there were, and the ticket of its frame or 0."""


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
    """A frame that is to be shown: its payloads, and how many are in the window already.

    With a ``base`` they are but the difference from what that stands for, and ``whole`` gives all.
    An ``open`` one is still being coded: more payloads follow.
    """

    ticket: int
    payloads: list[bytes]
    clear: bool
    base: OnDisplay | None = None
    whole: Callable[[], list[bytes]] = list
    open: bool = False
    frame_id: int = -1
    entered: int = 0

    @property
    def begun(self) -> bool:
        return self.frame_id >= 0

    @property
    def all_entered(self) -> bool:
        return self.begun and not self.open and self.entered == len(self.payloads)

    @property
    def left(self) -> int:
        """Payloads that may enter now: of an open one the last may be that with COMMIT."""
        return max(0, len(self.payloads) - self.open - self.entered)


@dataclass(slots=True)
class _Request:
    """A READ that waits for its PAGE."""

    start: int
    count: int
    back: bool
    tag: int = -1
    ordinal: int = 0  # 0: to be sent


class Link:
    """One host talking to one device.

    Parameters
    ----------
    session : int
        1..65535, at random.
    now : float
        Seconds on any steady clock; later calls take the same clock.
    patience_s : float
        How long silence lasts before `TransportTimeout`; talk without progress, twice as long.

    """

    def __init__(self, session: int, now: float, *, patience_s: float = 5.0) -> None:
        self.info: packets.Info | None = None
        self.counters = LinkCounters()
        self.stream = PacketStream()
        self._session = session
        self._patience_s = patience_s
        self._window = Window(0)
        self._loss = Loss()
        self._pace = Pace()
        self._frames: deque[_Frame] = deque()
        self._next_frame_id = 0
        self._requests: deque[_Request] = deque()
        self._tag = 0
        self._tickets = 0
        self._shown_ticket = 0  # in this session
        self._restarts = 0
        self._hello_due_s = now
        self._hellos = 0  # of this session
        self._silence = Silence(now, patience_s)
        self._back_s = math.inf  # when the caller should be back
        self._starved = False  # something is to be sent, and there is no credit for it
        self._ask_at_once = False
        self._hits = 0  # damaged since the device has last taken anything
        self._curious = False  # the caller wants an answer to a STATUS

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
    def hungry(self) -> bool:
        """Whether another frame is needed now for the line to stay busy: none is too early."""
        unsent = sum(
            len(payload) for frame in self._frames for payload in frame.payloads[frame.entered :]
        )
        return self._pace.runs_out(unsent)

    @property
    def payloads_in_all(self) -> int:
        """Payloads of all frames that have not been shown yet, as far as they are coded."""
        return sum(len(frame.payloads) for frame in self._frames)

    @property
    def payloads_left(self) -> int:
        """Payloads that have not been received yet."""
        waiting = sum(len(frame.payloads) - frame.entered for frame in self._frames)
        return waiting + len(self._window.flights)

    @property
    def bytes_per_s(self) -> float | None:
        """What the line has been seen to carry while it was busy; None if it was not yet."""
        return self._pace.bytes_per_s

    @property
    def payload_bytes(self) -> int:
        """How long payloads should be now: what suits the line's losses and the device's buffer.

        Until a session is open, as long as none has to be cut by any device.
        """
        if self.info is None:
            return spec.LIMIT_MIN_PAYLOAD
        room = (self.info.rx_buffer - spec.LIMIT_RESERVE) // _PACKETS_IN_BUFFER
        wanted = min(self._loss.best_payload, room - packets.wire_size(spec.LIMIT_OVERHEAD))
        return min(max(wanted, spec.LIMIT_MIN_PAYLOAD), self.info.max_payload)

    @property
    def on_display(self) -> OnDisplay:
        """What stands for the picture on display: it changes whenever that may have changed."""
        return self.counters.sessions, self._shown_ticket

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

    def begin(self) -> int:
        """Queue a frame that starts dark and is still being coded; give its ticket."""
        self._tickets += 1
        self._frames.append(_Frame(self._tickets, [], clear=True, open=True))
        return self._tickets

    def supply(self, ticket: int, payloads: list[bytes], *, last: bool) -> None:
        """Add payloads to a frame that was begun; what is not queued any more takes none.

        Parameters
        ----------
        ticket : int
            Of a frame from `begin`, whose last payloads have not been supplied.
        payloads : list of bytes
            As of `present`. All but the last of them may be sent at once.
        last : bool
            Whether there are no more.

        """
        for frame in self._frames:
            if frame.ticket == ticket:
                frame.payloads += payloads
                frame.open = not last
                if last and not frame.payloads:
                    frame.payloads = [b""]

    def present_on(
        self, base: OnDisplay, payloads: list[bytes], whole: Callable[[], list[bytes]]
    ) -> int:
        """Queue a frame as its difference from a picture on display; give its ticket.

        Parameters
        ----------
        base : OnDisplay
            The picture.
        payloads : list of bytes
            Ops that make the frame of it.
        whole : callable
            Gives the payloads that draw the frame from the dark. They are sent if the picture is
            not on display any more when the frame's turn comes, or something is on its way, or the
            session ends before the frame is shown.

        """
        self._tickets += 1
        frame = _Frame(self._tickets, payloads or [b""], clear=False, base=base, whole=whole)
        self._frames.append(frame)
        return self._tickets

    def read(self, start: int, count: int, *, back: bool = False) -> None:
        """Ask for pixels; `PageRead` brings them, or the first of them."""
        self._requests.append(_Request(start, count, back))

    def forget_reads(self) -> None:
        """Want no pixels any more that have been asked for."""
        self._requests.clear()

    def ask(self) -> None:
        """Ask what is on display now; `Told` brings it."""
        self._curious = self._ask_at_once = True

    def _reopen(self, now: float) -> None:
        """Begin a new session; frames that are not shown yet are sent again, whole."""
        self._session = self._session % 0xFFFF + 1
        self._shown_ticket = 0
        self.info = None
        self._window = Window(0)
        self._loss.forget_count()
        self._next_frame_id = 0
        for frame in self._frames:
            frame.frame_id, frame.entered = -1, 0
        for request in self._requests:
            request.ordinal = 0
        self._starved = False
        self._ask_at_once = self._curious
        self._hits = 0
        self._silence.forget()
        self._hello_due_s = now
        self._hellos = 0

    def renew(self, now: float) -> None:
        """Begin a new session over a new pipe; frames that are not shown yet are sent again."""
        self.stream = PacketStream()
        self._pace = Pace()  # another line, perhaps
        self._reopen(now)
        self._silence.rest(now)

    # -- what goes out

    def transmit(self, now: float) -> bytes:
        """Give the bytes to write now: as many as window and credit allow.

        Raises
        ------
        TransportTimeout
            If the device has been silent, or has made no progress, for too long; or a packet was
            lost too often.

        """
        if (late_s := now - self._back_s) > MOST_LATE_S:
            self._silence.excuse(late_s)
        out = self._greet(now) if self.info is None else self._converse(now)
        self.counters.wire_bytes += len(out)
        timeout_s = self.next_timeout(now)
        self._back_s = math.inf if timeout_s is None else now + timeout_s
        return out

    def _converse(self, now: float) -> bytes:
        if self._waiting:
            self._silence.check(now)
        else:
            self._silence.rest(now)
        return b"".join(self._outgoing(now)) + self._ask(now)

    def _greet(self, now: float) -> bytes:
        if now >= self._silence.end_s:
            raise self._silence.error(now) if self.counters.sessions else self._no_answer()
        if now < self._hello_due_s:
            return b""
        self._hello_due_s = now + HELLO_INTERVAL_S
        self._hellos += 1
        return b"\0" + packets.encode(packets.Hello(session=self._session))

    def _no_answer(self) -> TransportTimeout:
        noise = self.stream.noise
        heard = f"what came was no packet: {noise[:24]!r}" if noise else "nothing came at all"
        return TransportTimeout(
            f"nothing answered HELLO within {self._patience_s:g} s; {heard}",
            hint="is this the display's port, and its baud rate right?"
            if noise
            else "is the display switched on, and this its port?",
        )

    def _outgoing(self, now: float) -> Iterator[bytes]:
        """Give what window and credit allow: what is lost comes first, as all waits for it."""
        self._starved = False
        for part in (self._lost_packets(now), self._new_packets(now), self._reads()):
            yield from part
            if self._starved:
                return

    def _lost_packets(self, now: float) -> Iterator[bytes]:
        while (seq := self._window.lost()) is not None:
            flight = self._window.flights[seq]
            if flight.transmissions >= MOST_TRANSMISSIONS:
                raise TransportTimeout(
                    f"packet {seq} did not arrive in {flight.transmissions} tries; the device "
                    f"counts {self.counters.device_damaged} damaged packets",
                    hint="the line is too noisy: lower the baud rate, or look at cable and ground",
                )
            if self._too_much(len(flight.wire)) or self._starves(len(flight.wire)):
                return
            self.counters.retransmitted += 1
            yield self._send(seq, now)

    def _new_packets(self, now: float) -> Iterator[bytes]:
        for frame in self._frames:
            if not frame.begun:
                self._check_base(frame)
            while frame.left:
                size = self._wire_bound(frame)
                if not self._window.has_room or self._too_much(size) or self._starves(size):
                    return
                self.counters.packets += 1
                yield self._send(self._enter(frame), now)
            if frame.open:  # those behind it wait for its last
                return

    def _send(self, seq: int, now: float) -> bytes:
        wire = self._window.send(seq, now, self._pace.delivered)
        self._loss.sent(len(wire))
        return wire

    def _too_much(self, size: int) -> bool:
        """Tell whether enough is on its way: its answers come by themselves."""
        count, bytes_ = self._window.on_the_way
        return count > 0 and not self._pace.allows(count + 1, bytes_ + size)

    def _reads(self) -> Iterator[bytes]:
        for request in self._requests:
            if not request.ordinal:
                wire = self._read_packet(request)
                if self._starves(len(wire)):
                    return
                self._tag = request.tag
                request.ordinal = self._window.send_tagged(request.tag, len(wire))
                yield wire

    def _starves(self, size: int) -> bool:
        self._starved = not self._window.fits(size)
        return self._starved

    def _wire_bound(self, frame: _Frame) -> int:
        return packets.wire_size(len(frame.payloads[frame.entered]) + spec.LIMIT_OVERHEAD)

    def _check_base(self, frame: _Frame) -> None:
        """Make a difference the whole frame if it cannot be sent as such."""
        fits = frame.base == self.on_display and frame is self._frames[0]
        if frame.base is not None and (not fits or self._window.flights):
            frame.payloads, frame.clear, frame.base = frame.whole() or [b""], True, None

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

    def _read_packet(self, request: _Request) -> bytes:
        request.tag = (self._tag + 1) % _MODULUS
        flags = spec.READ_FLAG_BACK * request.back
        return packets.encode(
            packets.Read(seq=request.tag, flags=flags, start=request.start, count=request.count)
        )

    # -- silence

    @property
    def _on_its_way(self) -> bool:
        """Whether an answer comes by itself, that brings credit or makes some needless."""
        return bool(
            self._silence.asking
            or any(not flight.lost for flight in self._window.flights.values())
            or any(request.ordinal for request in self._requests)
        )

    @property
    def _waiting(self) -> bool:
        return bool(
            self._window.flights
            or self._starved
            or (self._curious and self._silence.asking)
            or any(frame.all_entered for frame in self._frames)
            or any(request.ordinal for request in self._requests)
        )

    def _ask(self, now: float) -> bytes:
        """Give a STATUS if it is time for one."""
        silence = self._silence
        if not (self._waiting or self._curious):
            return b""
        due = silence.ask_due_s <= now
        at_once = self._ask_at_once or (self._starved and not self._on_its_way)
        self._ask_at_once = False
        if silence.may_ask and (due or at_once):
            self._tag = (self._tag + 1) % _MODULUS
            wire = packets.encode(packets.Status(seq=self._tag))
            self._window.send_tagged(self._tag, len(wire))
            silence.ask(self._tag, now)
            self.counters.statuses += 1
            return b"\0" + wire  # the 00 costs no credit, and ends what a lost 00 has left open
        if due:  # nothing more may be asked; HELLO always may
            self._restart(now)
            silence.forget(doubt=True)
            return self._greet(now)
        return b""

    def next_timeout(self, now: float) -> float | None:
        """Seconds until `transmit` has something to do even if nothing comes; None: never."""
        silence = self._silence
        if self.info is None:
            return max(0.0, min(self._hello_due_s, silence.end_s) - now)
        if not self._waiting:
            return None
        return max(0.0, min(silence.ask_due_s, silence.end_s) - now)

    # -- what comes in

    def receive(self, data: bytes, now: float) -> list[Event]:
        """Take bytes from the pipe; give what they mean.

        Raises
        ------
        RemoteProtocolError
            If the device breaks protocol.md.

        """
        events: list[Event] = []
        for packet in self._packets(data):
            events += self._take(packet, now)
        return events

    def _packets(self, data: bytes) -> Iterator[packets.Packet]:
        while True:
            try:
                yield from self.stream.feed(data)
            except RemoteProtocolError as error:
                # Before a session only INFO counts: the rest may be of any version.
                if self.info or error.section == packets.Info.SECTION:
                    raise
                data = b""
            else:
                return

    def _take(self, packet: packets.Packet, now: float) -> Iterator[Event]:
        info = self.info
        if info and not isinstance(packet, packets.Info):
            self._silence.heard(now)
        match packet:
            case packets.Info() if packet.session == self._session:
                yield from self._take_info(packet, now)
            case packets.Ack() if info and packet.session == self._session:
                yield from self._take_ack(info, packet, now)
            case packets.Page() if info:
                yield from self._take_page(packet, now)
            case packets.Error() if info and packet.session in (0, self._session):
                yield from self._take_error(packet, now)

    def _take_info(self, info: packets.Info, now: float) -> Iterator[Event]:
        if self.info:
            if info.boot != self.info.boot:
                yield self._restart(now)
            return
        if info.major == spec.VERSION_MAJOR:
            check_info(info)
        self.info = info
        self.counters.sessions += 1
        # Which HELLO it answers cannot be known: those behind the first may still be in the buffer.
        behind = (self._hellos - 1) * len(packets.encode(packets.Hello(session=self._session)))
        self._window = Window(info.rx_buffer - behind)
        self._silence.begin(now, info.refresh)
        yield Ready(info)

    def _take_ack(self, info: packets.Info, ack: packets.Ack, now: float) -> Iterator[Event]:
        if ack.boot != info.boot:
            yield self._restart(now)
            return
        silence = self._silence
        if ack.flags & spec.ACK_FLAG_ASKED:
            silence.answered(ack.last, now)
            if self._curious:
                self._curious = False
                silence.progress(now)
                yield Told(_digest(info, ack))
        taken = self._window.taken
        if done := self._window.acknowledge(ack):
            silence.progress(now)
            silence.measure(now - done[-1].sent_s)
            for flight in done:
                self._pace.deliver(len(flight.wire), flight.delivered, now - flight.sent_s)
        self._find_lost_reads()
        self._note_damage(ack, moved=self._window.taken > taken)
        yield from self._note_shown(info, ack, now)

    def _note_damage(self, ack: packets.Ack, *, moved: bool) -> None:
        """Ask at once if all that is on its way was damaged: then no answer tells so."""
        damaged = self._loss.note_damage(ack.damaged)
        self.counters.device_damaged += damaged
        self._hits = 0 if moved else self._hits + damaged  # before what was taken: explained
        self._ask_at_once |= damaged > 0 and self._waiting and self._hits >= self._on_the_way

    @property
    def _on_the_way(self) -> int:
        """Packets whose answers are to come."""
        count, _ = self._window.on_the_way
        return count + sum(request.ordinal > 0 for request in self._requests)

    def _find_lost_reads(self) -> None:
        """Send a READ again whose PAGE did not come before the answer to something later."""
        for request in self._requests:
            if request.ordinal < self._window.taken:
                request.ordinal = 0

    def _note_shown(self, info: packets.Info, ack: packets.Ack, now: float) -> Iterator[Event]:
        if ack.shown is None or not any(
            frame.all_entered and frame.frame_id == ack.shown for frame in self._frames
        ):
            return
        digest = _digest(info, ack)
        self._silence.progress(now)
        self._restarts = 0
        while True:
            frame = self._frames.popleft()
            if frame.frame_id == ack.shown:
                self._shown_ticket = frame.ticket
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
        self._requests.remove(request)
        self._silence.progress(now)
        yield PageRead(page)

    def _take_error(self, error: packets.Error, now: float) -> Iterator[Event]:
        if error.code == spec.CODE_NO_SESSION:
            yield self._restart(now)
        else:
            self._frames.clear()
            self._requests.clear()
            self._reopen(now)  # a refused DATA has ended the session
            yield Refused(error)

    def _restart(self, now: float) -> Restarted:
        self._restarts += 1
        if self._restarts > MOST_RESTARTS:
            raise TransportTimeout(
                f"the device has lost the session {self._restarts} times without showing a frame",
                hint="does it restart by itself? Look at its power supply",
            )
        self._reopen(now)
        return Restarted()


def _digest(info: packets.Info, ack: packets.Ack) -> int | None:
    return ack.digest if info.has(spec.FEATURE_DIGEST) else None
