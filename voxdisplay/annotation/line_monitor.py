"""Checks of protocol.md's rules for both ends of a line, on packets seen from the host's end.

What the host sent may have been lost: only what the device has acknowledged since is certain. A
model of the device's pages finds wrong digests and wrong PAGEs. Knows no file.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from voxdisplay.annotation.capture_file import DEVICE, HOST
from voxdisplay.annotation.op_notes import AnnotatingDecoder, Remark, op_name
from voxdisplay.conformance import packets
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.reference_decoder import ReferenceDecoder, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

_HOST_TYPES = {spec.TYPE_DATA, spec.TYPE_HELLO, spec.TYPE_STATUS, spec.TYPE_READ}
_PAGE_OPS = {spec.OP_END, spec.OP_PEN, spec.OP_SKIP, spec.OP_RUN, spec.OP_LIT}


@dataclass
class _Frame:
    """A frame that the host has begun: its packets by number, and what each writes."""

    number: int
    clear: bool
    payloads: dict[int, bytes] = field(default_factory=dict)
    written: dict[int, tuple[int, int]] = field(default_factory=dict)  # index -> (value, seq)
    commit: int | None = None
    hold: int = 0


@dataclass
class _Session:
    """State of a session since its HELLO."""

    number: int
    next: int = 0  # as acknowledged
    next_unsent: int = 0  # not modulo 256
    sent: dict[int, bytes] = field(default_factory=dict)
    ends: dict[tuple[str, int], int] = field(default_factory=dict)  # stream position, by `last`
    credit_until: int = 0
    frames: list[_Frame] = field(default_factory=list)
    polls: list[int] = field(default_factory=list)
    reads: dict[int, tuple[int, int, bool]] = field(default_factory=dict)
    newest: int = -1  # frame number, not modulo 256
    shown: int = -1


class LineMonitor:
    """Monitor of both directions of one line, packet by packet."""

    def __init__(self) -> None:
        self.device: AnnouncedDevice | None = None
        self._session: _Session | None = None
        self._hello_session: int | None = None
        self._delimited = {HOST: False, DEVICE: False}
        self._position = 0  # bytes that the host has sent
        self._hello_ends: list[int] = []  # stream positions, of the HELLOs of one session
        self._front: Page | None = None  # None: nobody knows
        self._remarks: list[Remark] = []

    def delimiter(self, to: str) -> None:
        """Handle a 00 that ends an empty segment, in the direction of its receiver."""
        self._delimited[to] = True

    def noise(self, to: str, data: bytes) -> list[Remark]:
        """Handle a segment that is no packet; return remarks on it."""
        self._delimited[to] = True
        if to == DEVICE:
            self._position += len(data) + 1
            return [Remark("the host sends what is no packet", "3")]
        return []

    def packet(self, to: str, body: bytes, size: int) -> list[Remark]:
        """Handle a packet; return remarks on it.

        Parameters
        ----------
        to : str
            Receiver: `HOST` or `DEVICE`.
        body : bytes
            Header and payload.
        size : int
            Bytes on the wire.

        """
        self._remarks = []
        if to == DEVICE:
            self._position += size
            self._host_packet(body)
            self._delimited[to] = True
        else:
            self._device_packet(body)
        return self._remarks

    def _note(self, text: str, section: str = "") -> None:
        self._remarks.append(Remark(text, section))

    # -- packets of the host

    def _host_packet(self, body: bytes) -> None:
        kind, flags, seq, frame = body[0] >> 4, body[0] & 15, body[1], body[2]
        if kind not in _HOST_TYPES:
            self._note(f"a host sends no packet of type {kind}", "4")
            return
        if kind == spec.TYPE_HELLO:
            self._hello(body)
            return
        session = self._session
        if session is None or self.device is None:
            self._note("no session is open", "5")
            return
        if len(body) - packets.HEADER_BYTES > self.device.max_payload:
            self._note(f"a payload of more than {self.device.max_payload} bytes", "4")
        room = session.credit_until - self._position
        reserve = 0 if kind == spec.TYPE_STATUS else spec.LIMIT_RESERVE
        if room < reserve:
            self._note(f"credit is exceeded by {reserve - room} bytes", "9.2")
        if kind == spec.TYPE_DATA:
            self._data(session, body, flags, seq, frame)
        elif kind == spec.TYPE_STATUS:
            self._status(session, body, flags, seq, frame)
        else:
            self._read(session, body, flags, seq, frame)

    def _hello(self, body: bytes) -> None:
        answer = packets.HEADER_BYTES + 3
        if len(body) < answer + 2:
            self._note("a HELLO that ends before offset 8", "5")
            return
        number = int.from_bytes(body[4:6], "little")
        if number == 0:
            self._note("session 0", "5")
        if not self._delimited[DEVICE]:
            self._note("no 00 was sent before the first packet", "3")
        if self._hello_session != number:
            self._hello_session, self._hello_ends = number, []
        self._session = None
        self._hello_ends.append(self._position)

    def _status(self, session: _Session, body: bytes, flags: int, seq: int, frame: int) -> None:
        if flags or frame or len(body) > packets.HEADER_BYTES:
            self._note("a STATUS with reserved bits, or a payload", "9")
        session.polls.append(seq)
        if len(session.polls) > spec.LIMIT_MAX_STATUS:
            self._note(f"{len(session.polls)} STATUS without answer", "9.3")
        session.ends["tag", seq] = self._position

    def _read(self, session: _Session, body: bytes, flags: int, seq: int, frame: int) -> None:
        device = self._device
        start, count = (int.from_bytes(body[at : at + 4], "little") for at in (4, 8))
        if not device.has("READ"):
            self._note("the device has not announced READ", "5")
        if flags & ~spec.READ_FLAG_BACK or frame or body[3] or len(body) != 12:
            self._note("a READ with reserved bits, or of another length", "10")
        if count == 0 or start + count > device.voxel_count:
            self._note("a READ of nothing, or beyond the last voxel", "10")
        session.reads[seq] = (start, count, bool(flags & spec.READ_FLAG_BACK))
        session.ends["tag", seq] = self._position

    @property
    def _device(self) -> AnnouncedDevice:
        if self.device is None:
            raise AssertionError("used only in a session")
        return self.device

    def _data(self, session: _Session, body: bytes, flags: int, seq: int, frame: int) -> None:
        if flags & ~(spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT):
            self._note(f"reserved flags {flags:X}", "6")
        if (seq - session.next) % 256 >= spec.LIMIT_WINDOW and seq == session.next_unsent % 256:
            self._note(f"number {seq} is outside the window from {session.next}", "9.1")
        again = session.sent.get(seq) if (session.next_unsent - 1 - seq) % 256 < 224 else None
        session.ends["data", seq] = self._position
        if seq != session.next_unsent % 256:
            if again != body:
                self._note(f"number {seq} is sent out of order, or again with other bytes", "9.1")
            else:
                self._note("retransmitted")
            return
        session.next_unsent += 1
        session.sent[seq] = body
        self._add_to_frame(session, body, flags, seq, frame)

    def _add_to_frame(
        self, session: _Session, body: bytes, flags: int, seq: int, frame: int
    ) -> None:
        clear, commit = bool(flags & spec.DATA_FLAG_CLEAR), bool(flags & spec.DATA_FLAG_COMMIT)
        is_whole = bool(session.frames) and session.frames[-1].commit is not None
        if not session.frames or session.newest % 256 != frame or is_whole:
            if frame != (session.newest + 1) % 256:
                self._note(f"frame {frame} follows frame {session.newest % 256}", "6")
            session.newest += 1
            session.frames.append(_Frame(session.newest, clear))
        current = session.frames[-1]
        if current.clear != clear:
            self._note("CLEAR is not the same as in the frame's other packets", "6")
        if commit:
            current.commit = seq
        payload = body[packets.HEADER_BYTES :]
        current.payloads[seq] = payload
        decoder = self._ops(payload)
        if decoder.hold > current.hold:
            current.hold = decoder.hold
            self._check_holds(session)
        for index, value in decoder.written.items():
            before, by = current.written.setdefault(index, (value, seq))
            if before != value and by != seq:
                voxel = self._device.voxel_at(index)
                self._note(f"voxel {voxel} has another pixel in packet {by}", "6")
                break
            current.written[index] = (value, seq)

    def _check_holds(self, session: _Session) -> None:
        """Remark on holds of frames on their way that are too long together: section 7.12."""
        whole = [frame for frame in session.frames[:-1] if frame.commit is not None]
        ticks = sum(frame.hold for frame in (*whole, session.frames[-1]))
        if ticks * 1_000_000 > spec.LIMIT_MAX_HELD * self._device.refresh:
            self._note(f"frames that are not on display are held for {ticks} ticks", "7.12")

    def _ops(self, payload: bytes) -> AnnotatingDecoder:
        """Remark on each op; return the decoder that has drawn them."""
        decoder = AnnotatingDecoder(self._device)
        try:
            decoder.draw(payload)
        except Refused as refused:
            self._remarks += decoder.remarks
            code = packets.CODE_NAMES[refused.code]
            at = refused.at + packets.HEADER_BYTES
            self._note(f"{at:>5}  {op_name(payload[refused.at])} must be refused: {code}", "11")
        else:
            self._remarks += decoder.remarks
        return decoder

    # -- packets of the device

    def _device_packet(self, body: bytes) -> None:
        answer = packets.Response(body)
        if answer.kind not in packets.LAYOUTS:
            self._note(f"a device sends no packet of type {answer.kind}", "4")
        elif not answer.is_complete:
            self._note("shorter than the fields of its type", "4")
        elif answer.kind == spec.TYPE_INFO:
            self._info(answer)
        elif self._session is None or self.device is None:
            self._note("no session is open: a host drops it")
        elif answer.kind == spec.TYPE_ACK:
            self._ack(self._session, answer)
        elif answer.kind == spec.TYPE_PAGE:
            self._page(self._session, answer)
        else:
            self._error(self._session, answer)

    def _info(self, info: packets.Response) -> None:
        device = AnnouncedDevice.from_info(info)
        self._note(str(device))
        if self.device and self.device.boot != device.boot:
            self._note("the device has restarted")
            self._front = None
        self.device = device
        if info.session != self._hello_session:
            self._note("not of the session of the last HELLO: a host drops it")
            return
        if self._session is None:
            # It may answer any of the HELLOs: the first leaves least credit.
            self._session = _Session(
                info.session, credit_until=self._hello_ends[0] + device.rx_buffer
            )

    def _ack(self, session: _Session, ack: packets.Response) -> None:
        if ack.session != session.number or ack.boot != self._device.boot:
            self._note("of another session or boot of the device: a host opens a new session")
            return
        if (ack.next - session.next) % 256 > (session.next_unsent - session.next) % 256:
            self._note(f"next is {ack.next}, which was never sent", "9")
            return
        session.next = ack.next
        self._credit(session, ack)
        if ack.flags & spec.ACK_FLAG_ASKED:
            if ack.last not in session.polls:
                self._note(f"answers a STATUS {ack.last} that was never sent", "9")
            else:
                del session.polls[: session.polls.index(ack.last) + 1]
        if ack.flags & spec.ACK_FLAG_SHOWN:
            self._shown(session, ack)
        elif ack.frame:
            self._note("frame is not 0 though SHOWN is clear", "9")

    def _credit(self, session: _Session, ack: packets.Response) -> None:
        kind = "tag" if ack.flags & spec.ACK_FLAG_ASKED else "data"
        end = session.ends.get((kind, ack.last))
        if end is not None:
            session.credit_until = max(session.credit_until, end + ack.credit)
        for bit in range(32):
            seq = (ack.next + 1 + bit) % 256
            if (
                ack.received >> bit & 1
                and (seq - ack.next) % 256 > (session.next_unsent - ack.next) % 256
            ):
                self._note(f"received has number {seq}, which was never sent", "9")

    def _shown(self, session: _Session, ack: packets.Response) -> None:
        shown = next((f for f in session.frames if f.number % 256 == ack.frame), None)
        if shown is None:
            if session.shown % 256 != ack.frame or session.shown < 0:
                self._note(f"frame {ack.frame} is on display, but was never sent", "6")
        elif shown.commit is None or (shown.commit - ack.next) % 256 < spec.LIMIT_WINDOW:
            self._note(f"frame {ack.frame} is on display, but is not whole", "6")
        else:
            self._swap(session, shown)
        if self._front is not None and self._device.has("DIGEST"):
            digest = self._front.digest(self._device)
            if ack.digest != digest:
                self._note(f"the digest is {ack.digest:08X}h, that of the frame {digest:08X}h", "8")

    def _swap(self, session: _Session, shown: _Frame) -> None:
        """Draw the frame on the model of the device's pages."""
        if shown.clear:
            page: Page | None = Page()
        else:
            page = None if self._front is None else self._front.copy()
        if page is not None:
            decoder = ReferenceDecoder(self._device, page)
            for payload in shown.payloads.values():
                try:
                    decoder.draw(payload)
                except Refused:
                    self._note("shows a frame that it must refuse", "11")
            lit = len(page.pixels)
            self._note(f"frame {shown.number % 256} is on display: {lit} voxels lit")
        self._front = page
        session.shown = shown.number
        session.frames = [f for f in session.frames if f.number > shown.number]

    def _page(self, session: _Session, answer: packets.Response) -> None:
        request = session.reads.get(answer.seq)
        if request is None:
            self._note(f"answers a READ {answer.seq} that was never sent", "10")
            return
        start, count, back = request
        if answer.start != start or not 1 <= answer.count <= count:
            self._note(
                f"covers {answer.count} voxels from {answer.start}, the READ was of another range",
                "10",
            )
            return
        got = self._pixels(answer)
        if got is None or back or self._front is None:
            return
        for offset, value in enumerate(got):
            shown = self._front.pixels.get(start + offset, 0)
            if value != shown:
                voxel = self._device.voxel_at(start + offset)
                self._note(f"voxel {voxel} is {value:X}h, shown was {shown:X}h", "10")
                return
        self._note("the pixels are those of the frame on display")

    def _pixels(self, answer: packets.Response) -> list[int] | None:
        """Return the pixels of a PAGE: its ops draw from index 0 of a page that is long enough."""
        decoder = AnnotatingDecoder(self._device)
        try:
            decoder.draw(answer.tail)
        except Refused as refused:
            self._note(f"its ops must be refused: {packets.CODE_NAMES[refused.code]}", "10")
            return None
        if decoder.used - _PAGE_OPS:
            self._note("ops that a PAGE may not have", "10")
        if decoder.cursor != answer.count:
            self._note(f"its ops cover {decoder.cursor} voxels, not {answer.count}", "10")
            return None
        return [decoder.page.pixels.get(index, 0) for index in range(answer.count)]

    def _error(self, session: _Session, error: packets.Response) -> None:
        if error.code == spec.CODE_NO_SESSION:
            self._note("the device has lost the session: a host opens a new one")
            self._session = None
        elif error.seq in session.sent and error.code != spec.CODE_OVERRUN:
            packet = session.sent[error.seq]
            if error.frame == packet[2] and error.offset >= packets.HEADER_BYTES:
                op = packet[error.offset : error.offset + 1]
                name = op_name(op[0]) if op else "its end"
                self._note(f"it refuses {name} at byte {error.offset} of number {error.seq}")
