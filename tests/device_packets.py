"""Packets packed by hand from protocol.md, and an emulated device to send them to."""

import socket
import struct
from dataclasses import dataclass

from document import off_wire, on_wire

from firmware_sim.config import Config
from firmware_sim.device import Device

DATA, HELLO, STATUS, READ, ACK, INFO, PAGE, ERROR = 1, 3, 4, 5, 8, 9, 10, 11
CLEAR, COMMIT = 1, 4
SHOWN, PENDING, ASKED = 1, 2, 4
NO_SESSION, TYPE, LENGTH, FIELD, SEQUENCE, FRAME, OP = range(1, 8)
PADDING, OUTSIDE, OVERRUN = 10, 12, 13
DOT = b"\xa0"  # RUN 1: lights voxel 0 with the full pixel
SESSION = 0x1234
BOOT = 0xB007


class Clock:
    """A clock that stands still until it is set."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def packet(kind: int, flags: int = 0, seq: int = 0, frame: int = 0, payload: bytes = b"") -> bytes:
    return on_wire(bytes((kind << 4 | flags, seq, frame)) + payload)


def hello(session: int = SESSION, major: int = 1, more: bytes = b"\0\0") -> bytes:
    return packet(HELLO, payload=struct.pack("<BH", major, session) + more)


def data(seq: int, frame: int, ops: bytes = b"", flags: int = CLEAR) -> bytes:
    return packet(DATA, flags, seq, frame, ops)


def status(tag: int = 0) -> bytes:
    return packet(STATUS, seq=tag)


def read(start: int, count: int, tag: int = 0, back: int = 0) -> bytes:
    return packet(READ, back, tag, 0, struct.pack("<BII", 0, start, count))


@dataclass
class Response:
    kind: int
    flags: int
    seq: int
    frame: int
    payload: bytes

    def __getattr__(self, name: str) -> int:
        fields = {
            ACK: (
                "<BHHIIIH",
                ("last", "session", "boot", "received", "credit", "digest", "damaged"),
            ),
            INFO: (
                "<BHHBBHHHBBHIII",
                (
                    *("major", "session", "boot", "minor", "format", "nx", "ny", "nz", "pages"),
                    *("reserved", "max_payload", "rx_buffer", "refresh", "features"),
                ),
            ),
            ERROR: ("<BHH", ("code", "session", "offset")),
            PAGE: ("<BII", ("reserved", "start", "count")),
        }
        layout, names = fields[self.kind]
        if name not in names:
            raise AttributeError(name)
        return struct.unpack_from(layout, self.payload)[names.index(name)]

    @property
    def error(self) -> tuple[int, int]:
        assert self.kind == ERROR, self
        return self.code, self.offset


def parse_responses(wire: bytes) -> list[Response]:
    """Parse what a device sent; every byte must belong to a valid packet."""
    return [
        Response(body[0] >> 4, body[0] & 15, body[1], body[2], body[3:]) for body in off_wire(wire)
    ]


class DeviceUnderTest:
    """An emulated device, and methods to send it packets."""

    def __init__(self, *grid: int, session: bool = True, **config: object) -> None:
        config = {"refresh": 1, "boot": BOOT, **config}
        self.device = Device(Config(grid=grid or (3, 5, 7), **config))
        if session:
            (info,) = self.send(hello())
            assert info.kind == INFO

    def send(self, *packets: bytes) -> list[Response]:
        """Send packets; return the responses."""
        self.device.receive(b"".join(packets))
        return parse_responses(self.device.transmit())

    def request(self, wire: bytes) -> Response:
        """Send one packet; return its only response."""
        (answer,) = self.send(wire)
        return answer

    def tick(self) -> list[Response]:
        self.device.tick()
        return parse_responses(self.device.transmit())

    def show_frame(self, seq: int, frame: int, ops: bytes, flags: int = CLEAR) -> Response:
        """Send a frame of one packet and show it by a tick."""
        self.request(data(seq, frame, ops, flags | COMMIT))
        (ack,) = self.tick()
        return ack

    @property
    def front(self) -> bytes:
        return bytes(self.device.memory.front.pixels)

    @property
    def back(self) -> bytes:
        return bytes(self.device.memory.back.pixels)


def block_with_pending_frame(rig: DeviceUnderTest) -> int:
    """Make a packet wait for the tick; return how much of the credit it takes."""
    rig.request(data(0, 0, DOT, CLEAR | COMMIT))
    wire = data(1, 1, DOT)
    assert rig.send(wire) == []
    return len(wire)


def data_of_wire_size(seq: int, size: int) -> bytes:
    """Return a DATA packet of ``size`` bytes on the wire."""
    wire = data(seq, 1, bytes(size - 9))  # END and what pads it
    assert len(wire) == size
    return wire


def receive(connection: socket.socket, count: int) -> list[Response]:
    """Receive ``count`` packets from a device."""
    got = b""
    while got.count(b"\0") < count:
        piece = connection.recv(65_536)
        assert piece
        got += piece
    return parse_responses(got)
