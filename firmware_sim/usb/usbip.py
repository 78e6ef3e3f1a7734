"""Messages of USB/IP 1.1.1, which carries USB transfers over TCP.

As described by the Linux kernel's documentation (Documentation/usb/usbip_protocol.rst); numbers are
big-endian. Encoding only: the server is in `usbip_server`, the client in `usbip_host`.
"""

import struct
from dataclasses import dataclass
from typing import Final

from firmware_sim.usb.descriptors import Descriptors
from firmware_sim.usb.host import HIGH_SPEED

VERSION: Final = 0x0111
REQUEST_LIST, REPLY_LIST = 0x8005, 0x0005
REQUEST_IMPORT, REPLY_IMPORT = 0x8003, 0x0003
OK, NOT_AVAILABLE, BUSY = 0, 1, 2

CMD_SUBMIT, CMD_UNLINK, RET_SUBMIT, RET_UNLINK = 1, 2, 3, 4
NOT_ISOCHRONOUS: Final = 0xFFFFFFFF

BUS_ID: Final = "1-1"

OPERATION: Final = struct.Struct(">HHI")  # version, code, status
BUS_ID_FIELD: Final = struct.Struct(">32s")
DEVICE: Final = struct.Struct(">256s32sIIIHHHBBBBBB")
COUNT: Final = struct.Struct(">I")
INTERFACE: Final = struct.Struct(">BBBx")
_HEADER: Final = struct.Struct(">IIIII")  # command, seqnum, devid, direction, ep
_SUBMIT: Final = struct.Struct(">IiiIi8s")  # flags, length, start_frame, packets, interval, setup
_RETURN: Final = struct.Struct(">iiiIi8x")  # status, actual, start_frame, packets, errors
_UNLINK: Final = struct.Struct(">I24x")
_UNLINKED: Final = struct.Struct(">i24x")
MESSAGE_BYTES: Final = 48


@dataclass(frozen=True)
class Submit:
    """A transfer submitted by the host; its data follows if it is OUT."""

    seqnum: int
    devid: int
    endpoint: int
    is_in: bool
    length: int
    setup: bytes
    packets: int = NOT_ISOCHRONOUS

    def pack(self) -> bytes:
        """Return the bytes of the message."""
        head = _HEADER.pack(CMD_SUBMIT, self.seqnum, self.devid, self.is_in, self.endpoint)
        return head + _SUBMIT.pack(0, self.length, 0, self.packets, 0, self.setup)


@dataclass(frozen=True)
class Unlink:
    """Cancellation of a transfer by the host."""

    seqnum: int
    devid: int
    target: int

    def pack(self) -> bytes:
        """Return the bytes of the message."""
        return _HEADER.pack(CMD_UNLINK, self.seqnum, self.devid, 0, 0) + _UNLINK.pack(self.target)


@dataclass(frozen=True)
class SubmitReply:
    """Completion of a transfer; its data follows if it was IN. Status: 0 or a negative errno."""

    seqnum: int
    status: int
    actual: int

    def pack(self) -> bytes:
        """Return the bytes of the message."""
        head = _HEADER.pack(RET_SUBMIT, self.seqnum, 0, 0, 0)
        return head + _RETURN.pack(self.status, self.actual, 0, NOT_ISOCHRONOUS, 0)


@dataclass(frozen=True)
class UnlinkReply:
    """Reply to an `Unlink`: 0 if the transfer was done before, otherwise a negative errno."""

    seqnum: int
    status: int

    def pack(self) -> bytes:
        """Return the bytes of the message."""
        return _HEADER.pack(RET_UNLINK, self.seqnum, 0, 0, 0) + _UNLINKED.pack(self.status)


def parse_message(raw: bytes) -> Submit | Unlink | SubmitReply | UnlinkReply:
    """Parse the 48 bytes of a message.

    Raises
    ------
    ValueError
        If there is no such message.
    """
    command, seqnum, devid, direction, endpoint = _HEADER.unpack_from(raw)
    if command == CMD_SUBMIT:
        _, length, _, packets, _, setup = _SUBMIT.unpack_from(raw, _HEADER.size)
        return Submit(seqnum, devid, endpoint & 15, bool(direction), length, setup, packets)
    if command == CMD_UNLINK:
        return Unlink(seqnum, devid, _UNLINK.unpack_from(raw, _HEADER.size)[0])
    if command == RET_SUBMIT:
        status, actual, *_ = _RETURN.unpack_from(raw, _HEADER.size)
        return SubmitReply(seqnum, status, actual)
    if command == RET_UNLINK:
        return UnlinkReply(seqnum, _UNLINKED.unpack_from(raw, _HEADER.size)[0])
    raise ValueError(f"there is no USB/IP message {command}")


def pack_device(about: Descriptors, number: int, configuration: int) -> bytes:
    """Return the record of a device for lists and imports, without its interfaces."""
    return DEVICE.pack(
        f"/sys/devices/voxdisplay/{BUS_ID}".encode(),
        BUS_ID.encode(),
        *(1, number, HIGH_SPEED),
        *(about.vid, about.pid, 0x0100),
        *(about.device_class, 0, 0),
        *(configuration, 1, len(about.interfaces)),
    )
