"""Sans-I/O state machine of the device: bytes in, bytes out, and the refresh tick (3 to 13).

No clock, no I/O and no thread: everything happens within a call.
"""

import random
import re
import struct
import threading
from typing import TYPE_CHECKING

from firmware_sim import spec
from firmware_sim.config import Config
from firmware_sim.info import make_announcement
from firmware_sim.memory import Memory
from firmware_sim.op_decoder import OpDecoder
from firmware_sim.packet_error import PacketError
from firmware_sim.page_encoder import encode_page
from firmware_sim.receiver import Receiver
from firmware_sim.sender import encode_packet
from firmware_sim.session import BackPage, DataAction, Session

if TYPE_CHECKING:
    from collections.abc import Callable

TX_BUFFER = 65_536  # bytes of unread output with which the device takes no more packets
_DATA_FLAGS = spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT
_HELLO = struct.Struct("<BHBB")
_ACK = struct.Struct("<BHHIIIH")
_READ = struct.Struct("<BII")
_PAGE = struct.Struct("<BII")
_ERROR = struct.Struct("<BHH")


class Device:
    """A volumetric display.

    Parameters
    ----------
    config
        Its configuration.

    Attributes
    ----------
    boot : int
        Boot id.
    memory : Memory
        The two pages.
    session : Session or None
        The open session.
    taken_by_type : dict of int to int
        Number of packets taken of each type.
    errors_by_code : dict of int to int
        Number of ERRORs sent of each code.
    damaged, swaps : int
        Number of damaged segments, and of swaps.
    on_swap : callable
        Called without arguments after each swap and each restart.
    page_lock : Lock
        While it is held, the pages are not exchanged: for observers in other threads.
    """

    def __init__(self, config: Config) -> None:
        self.config = config
        self.boot = random.randrange(0x10000) if config.boot is None else config.boot
        self.on_swap: Callable[[], object] = lambda: None
        # The implemented features: those announced, unless that is one of its lies.
        self._features = 0 if "features" in config.lies else config.feature_bits
        self._unpacker = OpDecoder(config.shape, config.pixels, self._features)
        self.page_lock = threading.Lock()
        self._start()

    def _start(self) -> None:
        self._announcement = make_announcement(self.config, self.boot)
        self.memory = Memory(self.config.shape, self.config.pixels)
        self.taken_by_type: dict[int, int] = {}
        self.errors_by_code: dict[int, int] = {}
        self.damaged = 0
        self.swaps = 0
        self.disconnect()

    def power_cycle(self) -> None:
        """Restart: another boot id, no session, dark pages."""
        with self.page_lock:
            self.boot = (self.boot + 1) % 0x10000
            self._start()
        self.on_swap()

    def disconnect(self) -> None:
        """End the session and drop all unprocessed input and unsent output (16)."""
        self.session: Session | None = None
        self._receiver = Receiver(self.config.max_payload + spec.LIMIT_OVERHEAD)
        self._ring = bytearray()  # unread input: whole segments, then perhaps a part of one
        self._deferred = b""  # the packet that waits for the tick (6, point 6)
        self._deferred_bytes = 0  # its size on the wire: it still occupies the ring
        self._overrun = False  # bytes were lost, and the ring has not been read since
        self._skip_to_delimiter = False  # the beginning of the current segment was lost
        self._unacknowledged = 0  # DATA packets whose ACK was left out
        self._out = bytearray()

    # The wire

    @property
    def pending(self) -> bool:
        """True if a whole frame waits for its tick."""
        return self.session is not None and self.session.state is BackPage.PENDING

    @property
    def ticks_left(self) -> int:
        """Number of ticks, from the last one that it was told of, to a pending swap."""
        return self.session.ticks_left if self.session else 1

    @property
    def free_bytes(self) -> int:
        """Free space of the receive ring in bytes: what a carrier may hand over."""
        return self.config.rx_buffer - self._deferred_bytes - len(self._ring)

    @property
    def _blocked(self) -> bool:
        """True while the device takes no packet.

        Either one waits for the tick, or the host does not read the responses. It stops between
        two segments, so that the ring begins with a whole one.
        """
        return bool(self._deferred) or (len(self._out) >= TX_BUFFER and self._receiver.at_boundary)

    def receive(self, data: bytes) -> None:
        """Take bytes from the carrier.

        Parameters
        ----------
        data
            Any bytes. Those that do not fit the ring are lost, and reported by OVERRUN.
        """
        if not data:
            return
        if self._overrun:
            self._skip_to_delimiter = not data.endswith(b"\0")
            return
        at = 0
        if self._skip_to_delimiter:
            at = data.find(0) + 1
            self._skip_to_delimiter = not at
            if self._skip_to_delimiter:
                return
        at = self._take(data, at)
        self._store(data[at:])

    def transmit(self) -> bytes:
        """Return all pending output."""
        out, self._out = self._out, bytearray()
        if (self._ring or self._overrun) and not self._blocked:
            self._drain()
        return bytes(out)

    def tick(self, count: int = 1) -> None:
        """Process refresh ticks: a pending frame whose hold is over is put on display.

        Parameters
        ----------
        count
            How many ticks have come. At those before the last one nothing was to be exchanged.
        """
        if not self.session or not self.session.tick(count):
            return
        self._swap(self.session)
        self._acknowledge()
        if self._deferred:
            packet, self._deferred, self._deferred_bytes = self._deferred, b"", 0
            self._dispatch(packet)
            self._drain()

    def _drain(self) -> None:
        """Process the input in the ring."""
        ring, self._ring = self._ring, bytearray()
        self._overrun = False
        self._ring += ring[self._take(ring, 0) :]

    def _take(self, data: bytes | bytearray, at: int) -> int:
        """Process packets until the data ends or the device is blocked; return that position."""
        receiver = self._receiver
        while at < len(data) and not self._blocked:
            at = receiver.read(data, at)
            if receiver.packet is not None:
                self._dispatch(receiver.packet)
            elif receiver.damaged:
                self._count_damaged()
        if self._unacknowledged:
            self._acknowledge()
        return at

    def _store(self, data: bytes) -> None:
        """Store input in the ring, as far as it has room."""
        # A 00 behind a 00 is not stored: it needs no credit (9.2).
        ends = self._ring.endswith(b"\0") if self._ring else True
        data = re.sub(rb"\0+", b"\0", data.lstrip(b"\0") if ends else data)
        room = self.free_bytes
        self._ring += data[:room]
        if len(data) <= room:
            return
        # The truncated segment counts as damaged: nothing of it is kept.
        del self._ring[self._ring.rfind(0) + 1 :]
        self._overrun = True
        self._skip_to_delimiter = not data.endswith(b"\0")
        self._send_error(0, 0, PacketError(spec.CODE_OVERRUN, 0, "more bytes than credit"))
        self._count_damaged()

    def _count_damaged(self) -> None:
        self.damaged += 1
        self._acknowledge()

    def _send(self, kind: int, flags: int, seq: int, frame: int, payload: bytes) -> None:
        self._out += encode_packet(kind, flags, seq, frame, payload)

    # Packets

    def _dispatch(self, packet: bytes) -> None:
        """Process a packet, or defer it if it must wait for the tick."""
        kind = packet[0] >> 4
        session = self.session
        if session and kind == spec.TYPE_DATA and session.must_wait(packet[1], packet[2]):
            self._deferred = packet
            self._deferred_bytes = self._receiver.size + 1
            return
        self.taken_by_type[kind] = self.taken_by_type.get(kind, 0) + 1
        try:
            self._process(packet)
        except PacketError as refusal:
            self._send_error(packet[1], packet[2], refusal)
            if kind == spec.TYPE_DATA:
                self.session = None

    def _process(self, packet: bytes) -> None:
        kind, flags = packet[0] >> 4, packet[0] & 15
        seq, frame = packet[1:3]
        if kind == spec.TYPE_HELLO:
            self._hello(packet)
        elif not self.session:
            raise PacketError(spec.CODE_NO_SESSION, 0, "no session is open")
        elif kind == spec.TYPE_DATA:
            self._data(self.session, packet, flags, seq, frame)
        elif kind == spec.TYPE_STATUS:
            self._status(packet, flags, seq, frame)
        elif kind == spec.TYPE_READ and self._features >> spec.FEATURE_READ & 1:
            self._read(packet, flags, seq, frame)
        else:
            raise PacketError(spec.CODE_TYPE, 0, f"type {kind} is none of a host")

    def _send_error(self, seq: int, frame: int, refusal: PacketError) -> None:
        self.errors_by_code[refusal.code] = self.errors_by_code.get(refusal.code, 0) + 1
        number = self.session.number if self.session else 0
        error = _ERROR.pack(refusal.code, number, refusal.offset)
        self._send(spec.TYPE_ERROR, 0, seq, frame, error + refusal.text.encode())

    def _hello(self, packet: bytes) -> None:
        if len(packet) < 3 + _HELLO.size:
            raise PacketError(spec.CODE_LENGTH, 0, "a HELLO has 5 bytes of payload")
        major, number, _minor, _reserved = _HELLO.unpack_from(packet, 3)
        if not number:
            raise PacketError(spec.CODE_FIELD, 4, "session 0 is reserved")
        if major == spec.VERSION_MAJOR:
            self.session = Session(number)
            self._unacknowledged = 0
        self._send(spec.TYPE_INFO, 0, 0, 0, self._announcement.payload(number))

    def _data(self, session: Session, packet: bytes, flags: int, seq: int, frame: int) -> None:
        if flags & ~_DATA_FLAGS:
            raise PacketError(spec.CODE_FIELD, 0, "a reserved flag of DATA is not 0")
        verdict = session.classify(seq, frame, flags)
        if verdict is DataAction.BEGIN:
            session.begin_frame(frame, flags)
            self.memory.begin_frame(dark=bool(flags & spec.DATA_FLAG_CLEAR))
        if verdict in (DataAction.BEGIN, DataAction.APPLY):
            session.hold(self._unpacker.draw(packet, self.memory.back))
            session.mark_received(seq, flags)
        session.last = seq
        self._unacknowledged += 1
        if self.pending and not self.config.refresh:
            self._swap(session)
            self._acknowledge()
        elif self._unacknowledged > self.config.max_silent_acks:
            self._acknowledge()

    def _swap(self, session: Session) -> None:
        with self.page_lock:
            session.swap()
            self.memory.swap()
            self.swaps += 1
        self.on_swap()

    def _acknowledge(self, tag: int | None = None) -> None:
        """Send an ACK if a session is open; with a tag it is the response to a STATUS (9)."""
        session = self.session
        if not session:
            return
        self._unacknowledged = 0
        shown = session.shown is not None
        flags = spec.ACK_FLAG_SHOWN if shown else 0
        if session.state is BackPage.PENDING:
            flags |= spec.ACK_FLAG_PENDING
        if tag is not None:
            flags |= spec.ACK_FLAG_ASKED
        ack = _ACK.pack(
            session.last if tag is None else tag,
            session.number,
            self.boot,
            session.received,
            self._announcement.credit,
            self.memory.front.digest if self._features >> spec.FEATURE_DIGEST & 1 else 0,
            self.damaged & 0xFFFF,
        )
        self._send(spec.TYPE_ACK, flags, session.next, session.shown or 0, ack)

    def _status(self, packet: bytes, flags: int, seq: int, frame: int) -> None:
        if len(packet) > 3:
            raise PacketError(spec.CODE_LENGTH, 0, "a STATUS has no payload")
        _check_zero((flags, 0), (frame, 2))
        self._acknowledge(tag=seq)

    def _read(self, packet: bytes, flags: int, seq: int, frame: int) -> None:
        if len(packet) != 3 + _READ.size:
            raise PacketError(spec.CODE_LENGTH, 0, f"a READ has {_READ.size} bytes of payload")
        reserved, start, count = _READ.unpack_from(packet, 3)
        _check_zero((flags & ~spec.READ_FLAG_BACK, 0), (frame, 2), (reserved, 3))
        if not count:
            raise PacketError(spec.CODE_FIELD, 8, "a READ of no voxels")
        if start + count > self.config.shape.volume:
            raise PacketError(spec.CODE_OUTSIDE, 4, f"{count} voxels from {start} on")
        page = self.memory.back if flags & spec.READ_FLAG_BACK else self.memory.front
        room = self.config.max_payload - _PAGE.size
        covered, ops = encode_page(page, self.config.pixels, start, count, room)
        shown = (self.session and self.session.shown) or 0
        self._send(spec.TYPE_PAGE, flags, seq, shown, _PAGE.pack(0, start, covered) + ops)


def _check_zero(*fields: tuple[int, int]) -> None:
    """Refuse the first reserved (value, offset) that is not 0."""
    for value, offset in fields:
        if value:
            raise PacketError(spec.CODE_FIELD, offset, "a reserved flag or field is not 0")
