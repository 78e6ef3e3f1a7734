"""Sans-I/O host endpoint of protocol.md: sessions, retransmission, polling.

`Link.receive` takes the bytes that a pipe brought, `Link.transmit` returns those to write, and
`Link.next_timeout` the time until the next call if nothing comes. Must not know pipes or clocks;
frames are payloads here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.link.bandwidth_delay import DeliveryRate
from voxdisplay.link.counters import LinkCounters
from voxdisplay.link.events import (
    Event,
    FrameShown,
    PacketRefused,
    PageReceived,
    SessionLost,
    SessionOpened,
    StatusReceived,
)
from voxdisplay.link.info_validation import check_info
from voxdisplay.link.link_requests import LinkRequests
from voxdisplay.link.outgoing_frames import PictureId
from voxdisplay.link.payload_size import clamp_payload
from voxdisplay.link.sender import Sender
from voxdisplay.link.session_opening import HELLO_INTERVAL_S, SessionOpening, too_many_restarts
from voxdisplay.link.silence_timer import SilenceTimer
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.packet_stream import PacketStream

# A call that comes later than this means that the caller was away, not that the device was silent.
MAX_CALL_DELAY_S = 0.25
MAX_RESTARTS = 8  # without a frame displayed


class Link(LinkRequests):
    """Endpoint of one host that drives one device.

    Parameters
    ----------
    session : int
        Number of the first session, 1..65535, at random.
    now : float
        Seconds on any monotonic clock; later calls take the same clock.
    timeout_s : float
        How long silence may last before `TransportTimeout`; answers without progress, twice as
        long.
    hello_interval_s : float
        Time between the HELLOs of the first session.

    Attributes
    ----------
    info : Info or None
        Of the open session.
    counters : LinkCounters
    stream : PacketStream
        Reader of the received bytes.

    """

    def __init__(
        self,
        session: int,
        now: float,
        *,
        timeout_s: float = 5.0,
        hello_interval_s: float = HELLO_INTERVAL_S,
    ) -> None:
        super().__init__()
        self.info: packets.Info | None = None
        self.counters = LinkCounters()
        self.stream = PacketStream()
        self._timeout_s = timeout_s
        self._sender = Sender(self._frames, self._reads, self.counters)
        self._shown_ticket = 0  # of this session
        self._restarts = 0
        self._opening = SessionOpening(session, now, hello_interval_s)
        self._timer = SilenceTimer(now, timeout_s)
        self._call_due_s = math.inf  # when `transmit` is expected to be called at the latest
        self._poll_now = False
        self._status_requested = False

    # -- requests

    @property
    def ready(self) -> bool:
        """True if a session is open."""
        return self.info is not None

    @property
    def idle(self) -> bool:
        """True if nothing is queued, outstanding or requested."""
        return not (self._frames or self._reads or self._sender.outstanding)

    @property
    def needs_frame(self) -> bool:
        """True if the line will run idle unless another frame is queued now."""
        return self.delivery_rate.drains_early(self._frames.unsent_bytes)

    @property
    def has_more(self) -> bool:
        """True if the last burst ended at its size, so that another may follow at once."""
        return self.ready and self._sender.has_more

    @property
    def unacknowledged_payloads(self) -> int:
        """Number of those payloads that the device has not acknowledged."""
        return self._frames.unsent_payloads + self._sender.outstanding

    def is_held(self, ticket: int) -> bool:
        """Return whether the device has all of an open frame but its last payload."""
        return self._frames.is_held(ticket) and not self._sender.outstanding

    @property
    def in_flight_bytes(self) -> int:
        """Bytes of frames that were sent and are neither acknowledged nor lost."""
        return self._sender.in_flight_bytes

    @property
    def partial_info(self) -> str | None:
        """Description of an answer to HELLO that did not come whole; None if none began."""
        return self._opening.partial_info

    @property
    def bytes_per_s(self) -> float | None:
        """Measured delivery rate of the busy line; None as long as it had too little to carry."""
        return self.delivery_rate.bytes_per_s

    @property
    def delivery_rate(self) -> DeliveryRate:
        """Estimator of the delivery rate of the line."""
        return self._sender.delivery_rate

    @property
    def payload_bytes(self) -> int:
        """Payload length that suits the line's losses and the device's buffer, in bytes.

        Before a session is open it is one that every device takes.
        """
        if self.info is None:
            return spec.LIMIT_MIN_PAYLOAD
        best = self._sender.loss_rate.best_payload
        return clamp_payload(best, self.info.max_payload, self.info.rx_buffer)

    @property
    def displayed(self) -> PictureId:
        """Id of the displayed picture; another whenever that picture may have changed."""
        return self.counters.sessions, self._shown_ticket

    def request_status(self) -> None:
        """Request the digest of the front page; `StatusReceived` brings it."""
        self._status_requested = self._poll_now = True

    def extend_timeout(self, seconds: float) -> None:
        """Let the device be silent for so much longer this time."""
        self._timer.extend(seconds)

    def _reopen(self, now: float) -> None:
        """Open a new session; frames of the backlog are sent again, in full."""
        self._shown_ticket = 0
        self.info = None  # and the timer goes on to allow for held frames, behind which HELLO waits
        self._sender.close_session()
        self._poll_now = self._status_requested
        self._timer.cancel_polls()
        self._opening = self._opening.successor(now)

    def resume(self, now: float) -> None:
        """Open a new session over a new pipe; frames of the backlog are sent again, in full."""
        self.stream = PacketStream()
        self._sender.reset_delivery_rate()
        self._reopen(now)
        self._timer.note_idle(now)

    # -- out

    def transmit(self, now: float) -> bytes:
        """Return the bytes to write now, at most a burst of what window and credit allow.

        Raises
        ------
        TransportTimeout
            If the device was silent, or nothing was delivered, for too long; or if a packet was
            lost too often.

        """
        if (delay_s := now - self._call_due_s) > MAX_CALL_DELAY_S:
            self._timer.extend(delay_s)
        out = self._transmit_hello(now) if self.info is None else self._transmit_session(now)
        self.counters.wire_bytes += len(out)
        timeout_s = self.next_timeout(now)
        self._call_due_s = math.inf if timeout_s is None else now + timeout_s
        return out

    def _transmit_session(self, now: float) -> bytes:
        if self._waiting:
            self._timer.check(now)
        else:
            self._timer.note_idle(now)
        data = b"".join(self._sender.outgoing(now, self.displayed))
        self._update_held()
        return data + self._transmit_poll(now)

    def _update_held(self) -> None:
        """Tell the timer for how long frames on their way are held."""
        if self.info and self.info.refresh:
            self._timer.held_s = self._frames.held_ticks * 1000 / self.info.refresh

    def _transmit_hello(self, now: float) -> bytes:
        if now >= self._timer.deadline_s:
            if self.counters.sessions:
                raise self._timer.timeout_error(now)
            raise self._opening.timeout_error(self._timeout_s, self.stream)
        return self._opening.hello(now)

    # -- silence

    @property
    def _blocked(self) -> bool:
        """True if nothing can be sent until an answer comes, and that answer might get lost."""
        no_credit = self._sender.out_of_credit and not self._sender.in_flight
        return (no_credit or self._sender.window_stalled) and not self._timer.poll_outstanding

    @property
    def _waiting(self) -> bool:
        """True if an answer of the device is due."""
        return bool(
            self._sender.outstanding
            or self._sender.out_of_credit
            or (self._status_requested and self._timer.poll_outstanding)
            or self._frames.awaiting_swap
            or self._reads.in_flight
        )

    def _transmit_poll(self, now: float) -> bytes:
        """Return a STATUS if a poll is due, or HELLO if too many polls were not answered."""
        timer = self._timer
        if not (self._waiting or self._status_requested):
            return b""
        due = timer.poll_due_s <= now
        now_anyway = self._poll_now or self._blocked
        self._poll_now = False
        if timer.may_poll and (due or now_anyway):
            tag, wire = self._sender.status()
            timer.note_poll(tag, now)
            self.counters.statuses += 1
            return b"\0" + wire  # the 00 costs no credit, and ends a packet whose own 00 was lost
        if due:  # no more STATUS is allowed; HELLO always is
            self._restart(now)
            timer.cancel_polls(timed_out=True)
            return self._transmit_hello(now)
        return b""

    def next_timeout(self, now: float) -> float | None:
        """Return the seconds until `transmit` is to be called even if nothing comes, or None."""
        timer = self._timer
        if self.info is None:
            return max(0.0, min(self._opening.due_s, timer.deadline_s) - now)
        if self._sender.has_more:
            return 0.0
        if not self._waiting:
            return None
        return max(0.0, min(timer.poll_due_s, timer.deadline_s) - now)

    # -- in

    def receive(self, data: bytes, now: float) -> list[Event]:
        """Return the events that follow from bytes of the pipe.

        Raises
        ------
        RemoteProtocolError
            If the device breaks protocol.md. The packets behind are not lost: go on with
            ``receive(b"", now)``.

        """
        self.counters.received_bytes += len(data)
        if not self.counters.sessions:
            self._opening.note_received(data)
        events: list[Event] = []
        for packet in self._packets(data):
            events += self._handle(packet, now)
        return events

    def _packets(self, data: bytes) -> Iterator[packets.Packet]:
        while True:
            try:
                yield from self.stream.feed(data)
            except RemoteProtocolError as error:
                # Before a session only INFO matters: all else may be of another version.
                if self.info or error.section == packets.Info.SECTION:
                    raise
                data = b""
            else:
                return

    def _handle(self, packet: packets.Packet, now: float) -> Iterator[Event]:
        info = self.info
        if info and not isinstance(packet, packets.Info):
            self._timer.note_packet(now)
        match packet:
            case packets.Info() if packet.session == self._opening.session:
                yield from self._handle_info(packet, now)
            case packets.Ack() if info and packet.session == self._opening.session:
                yield from self._handle_ack(info, packet, now)
            case packets.Page() if info:
                yield from self._handle_page(packet, now)
            case packets.Error() if info and packet.session in (0, self._opening.session):
                yield from self._handle_error(packet, now)

    def _handle_info(self, info: packets.Info, now: float) -> Iterator[Event]:
        if self.info:
            if info.boot != self.info.boot:
                yield self._restart(now)
            return
        if info.major == spec.VERSION_MAJOR:
            check_info(info)
        self.info = info
        self.counters.sessions += 1
        held = spec.LIMIT_MAX_HELD * info.refresh // 1_000_000
        self._sender.open_session(
            info.rx_buffer - self._opening.unread_bytes,
            info.max_payload,
            held if info.has(spec.FEATURE_HOLD) else 0,
        )
        self._timer.held_s = 0.0
        self._timer.open_session(now, info.refresh)
        yield SessionOpened(info)

    def _handle_ack(self, info: packets.Info, ack: packets.Ack, now: float) -> Iterator[Event]:
        if ack.boot != info.boot:
            yield self._restart(now)
            return
        timer = self._timer
        if ack.flags & spec.ACK_FLAG_ASKED:
            timer.note_poll_answer(ack.last, now)
            if self._status_requested:
                self._status_requested = False
                timer.note_progress(now)
                yield StatusReceived(_digest(info, ack))
        round_trip_s = self._sender.acknowledge(ack, now)
        if round_trip_s is not None:
            timer.note_progress(now)
            timer.sample_round_trip(round_trip_s)
        self._poll_now |= self._sender.all_in_flight_damaged and self._waiting
        yield from self._note_shown(info, ack, now)

    def _note_shown(self, info: packets.Info, ack: packets.Ack, now: float) -> Iterator[Event]:
        ticket = self._frames.take_shown(ack.shown)
        if ticket is None:
            return
        self._timer.note_progress(now)
        self._update_held()
        self._restarts = 0
        self._shown_ticket = ticket
        yield FrameShown(ticket, _digest(info, ack))

    def _handle_page(self, page: packets.Page, now: float) -> Iterator[Event]:
        if self._reads.take_answered(page):
            self._timer.note_progress(now)
            yield PageReceived(page)

    def _handle_error(self, error: packets.Error, now: float) -> Iterator[Event]:
        if error.code == spec.CODE_NO_SESSION:
            yield self._restart(now)
        else:
            self._frames.clear()
            self._reads.clear()
            self._reopen(now)  # a refused DATA has ended the session
            yield PacketRefused(error)

    def _restart(self, now: float) -> SessionLost:
        self._restarts += 1
        if self._restarts > MAX_RESTARTS:
            raise too_many_restarts(self._restarts)
        self._reopen(now)
        return SessionLost()


def _digest(info: packets.Info, ack: packets.Ack) -> int | None:
    return ack.digest if info.has(spec.FEATURE_DIGEST) else None
