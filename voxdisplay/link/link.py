"""The host's end of protocol.md: one session after the other, and when to ask.

A `Link` does no I/O and reads no clock: `receive` takes what a pipe brought, `transmit` gives what
to write, `next_timeout` says when to come back if nothing happens. It knows frames only as
payloads, and no pipe at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from voxdisplay.errors import RemoteProtocolError, TransportTimeout
from voxdisplay.link.counters import LinkCounters
from voxdisplay.link.events import Event, PageRead, Ready, Refused, Restarted, Shown, Told
from voxdisplay.link.info_validation import check_info
from voxdisplay.link.outgoing_frames import Frames, OnDisplay
from voxdisplay.link.payload_size import suited
from voxdisplay.link.readback import Reads
from voxdisplay.link.sender import Sender
from voxdisplay.link.session_opening import Greeting, no_answer
from voxdisplay.link.silence_timer import Silence
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.packet_stream import PacketStream

MOST_LATE_S = 0.25  # a caller that comes back later than this was away
MOST_RESTARTS = 8  # without a frame shown


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
        self._patience_s = patience_s
        self._frames = Frames()
        self._reads = Reads()
        self._sender = Sender(self._frames, self._reads, self.counters)
        self._zeros = 0  # that came before the first session
        self._shown_ticket = 0  # in this session
        self._restarts = 0
        self._greeting = Greeting(session, now)
        self._silence = Silence(now, patience_s)
        self._back_s = math.inf  # when the caller should be back
        self._ask_at_once = False
        self._curious = False  # the caller wants an answer to a STATUS

    # -- what the caller wants

    @property
    def ready(self) -> bool:
        """Whether a session is open."""
        return self.info is not None

    @property
    def idle(self) -> bool:
        """Whether nothing is on its way or waited for."""
        return not (self._frames or self._reads or self._sender.unanswered)

    @property
    def backlog(self) -> int:
        """Frames that have been handed over and not shown yet."""
        return len(self._frames)

    @property
    def hungry(self) -> bool:
        """Whether another frame is needed now for the line to stay busy: none is too early."""
        return self._sender.pace.runs_out(self._frames.unsent_bytes)

    @property
    def payloads_in_all(self) -> int:
        """Payloads of all frames that have not been shown yet, as far as they are coded."""
        return self._frames.payloads

    @property
    def payloads_left(self) -> int:
        """Payloads that have not been received yet."""
        return self._frames.payloads_left + self._sender.unanswered

    @property
    def bytes_per_s(self) -> float | None:
        """What the line has been seen to carry while it was busy; None if it was not yet."""
        return self._sender.pace.bytes_per_s

    @property
    def payload_bytes(self) -> int:
        """How long payloads should be now: what suits the line's losses and the device's buffer.

        Until a session is open, as long as none has to be cut by any device.
        """
        if self.info is None:
            return spec.LIMIT_MIN_PAYLOAD
        best = self._sender.loss.best_payload
        return suited(best, self.info.max_payload, self.info.rx_buffer)

    @property
    def on_display(self) -> OnDisplay:
        """What stands for the picture on display: it changes whenever that may have changed."""
        return self.counters.sessions, self._shown_ticket

    def present(self, payloads: list[bytes], *, clear: bool = True) -> int:
        """Queue a frame; give its ticket, which comes back in `Shown`. See `Frames.present`."""
        return self._frames.present(payloads, clear=clear)

    def begin(self) -> int:
        """Queue a frame that is still being coded; give its ticket. See `Frames.begin`."""
        return self._frames.begin()

    def supply(self, ticket: int, payloads: list[bytes], *, last: bool) -> None:
        """Add payloads to a frame that was begun. See `Frames.supply`."""
        self._frames.supply(ticket, payloads, last=last)

    def withdraw(self) -> None:
        """Give up a frame that is still being coded, if there is one. See `Frames.withdraw`."""
        self._frames.withdraw()

    def present_on(
        self, base: OnDisplay, payloads: list[bytes], whole: Callable[[], list[bytes]]
    ) -> int:
        """Queue a difference from what is on display; give its ticket. See `Frames.present_on`."""
        return self._frames.present_on(base, payloads, whole)

    def read(self, start: int, count: int, *, back: bool = False) -> None:
        """Ask for pixels; `PageRead` brings them, or the first of them."""
        self._reads.add(start, count, back=back)

    def forget_reads(self) -> None:
        """Want no pixels any more that have been asked for."""
        self._reads.clear()

    def ask(self) -> None:
        """Ask what is on display now; `Told` brings it."""
        self._curious = self._ask_at_once = True

    def _reopen(self, now: float) -> None:
        """Begin a new session; frames that are not shown yet are sent again, whole."""
        self._shown_ticket = 0
        self.info = None
        self._sender.end()
        self._ask_at_once = self._curious
        self._silence.forget()
        self._greeting = self._greeting.next(now)

    def renew(self, now: float) -> None:
        """Begin a new session over a new pipe; frames that are not shown yet are sent again."""
        self.stream = PacketStream()
        self._sender.change_line()
        self._reopen(now)
        self._silence.rest(now)

    # -- what goes out

    def transmit(self, now: float) -> bytes:
        """Give the bytes to write now: as many as window and credit allow, or a portion of them.

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
        return b"".join(self._sender.outgoing(now, self.on_display)) + self._ask(now)

    def _greet(self, now: float) -> bytes:
        if now >= self._silence.end_s:
            if self.counters.sessions:
                raise self._silence.error(now)
            raise no_answer(self._patience_s, self.stream, self._zeros)
        return self._greeting.hello(now)

    # -- silence

    @property
    def _blocked(self) -> bool:
        """Whether nothing more can be sent, and an answer that unblocks it might get lost."""
        starves = self._sender.starved and not self._sender.on_the_way
        return (starves or self._sender.hangs) and not self._silence.asking

    @property
    def _waiting(self) -> bool:
        return bool(
            self._sender.unanswered
            or self._sender.starved
            or (self._curious and self._silence.asking)
            or self._frames.any_due
            or self._reads.on_the_way
        )

    def _ask(self, now: float) -> bytes:
        """Give a STATUS if it is time for one."""
        silence = self._silence
        if not (self._waiting or self._curious):
            return b""
        due = silence.ask_due_s <= now
        at_once = self._ask_at_once or self._blocked
        self._ask_at_once = False
        if silence.may_ask and (due or at_once):
            tag, wire = self._sender.status()
            silence.ask(tag, now)
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
            return max(0.0, min(self._greeting.due_s, silence.end_s) - now)
        if self._sender.goes_on:
            return 0.0
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
        if not self.counters.sessions:
            self._zeros += data.count(0)
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
            case packets.Info() if packet.session == self._greeting.session:
                yield from self._take_info(packet, now)
            case packets.Ack() if info and packet.session == self._greeting.session:
                yield from self._take_ack(info, packet, now)
            case packets.Page() if info:
                yield from self._take_page(packet, now)
            case packets.Error() if info and packet.session in (0, self._greeting.session):
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
        self._sender.begin(info.rx_buffer - self._greeting.unread_bytes)
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
        round_trip_s = self._sender.acknowledge(ack, now)
        if round_trip_s is not None:
            silence.progress(now)
            silence.measure(round_trip_s)
        self._ask_at_once |= self._sender.all_damaged and self._waiting
        yield from self._note_shown(info, ack, now)

    def _note_shown(self, info: packets.Info, ack: packets.Ack, now: float) -> Iterator[Event]:
        ticket = self._frames.shown(ack.shown)
        if ticket is None:
            return
        self._silence.progress(now)
        self._restarts = 0
        self._shown_ticket = ticket
        yield Shown(ticket, _digest(info, ack))

    def _take_page(self, page: packets.Page, now: float) -> Iterator[Event]:
        if self._reads.answered(page):
            self._silence.progress(now)
            yield PageRead(page)

    def _take_error(self, error: packets.Error, now: float) -> Iterator[Event]:
        if error.code == spec.CODE_NO_SESSION:
            yield self._restart(now)
        else:
            self._frames.clear()
            self._reads.clear()
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
