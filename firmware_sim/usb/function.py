"""USB function of the display: protocol.md's USB carrier (16), or a CDC-ACM serial port.

Cuts the device's output into packets, and takes no packet for which the device has no room. Knows
nothing of what the bytes mean.
"""

import struct
from typing import Final

from firmware_sim import spec
from firmware_sim.baud_pacing import PacedDevice
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.usb.descriptors import (
    BULK,
    CS_INTERFACE,
    INTERRUPT,
    Descriptors,
    Endpoint,
    Interface,
)
from firmware_sim.usb.device import Setup

TRIPLE: Final = (spec.USB_CLASS, spec.USB_SUBCLASS, spec.USB_PROTOCOL)

HIGH_SPEED_PACKET: Final = 512
FULL_SPEED_PACKET: Final = 64
_OUT: Final = 0x01
_IN: Final = 0x81
_NOTIFY: Final = 0x82

_ACM: Final = (0x02, 0x02, 0x00)
_CDC_DATA: Final = (0x0A, 0x00, 0x00)
_SET_LINE_CODING, _GET_LINE_CODING, _SET_CONTROL_LINE_STATE, _SEND_BREAK = 0x20, 0x21, 0x22, 0x23
_LINE_CODING: Final = struct.pack("<IBBB", 115_200, 0, 0, 8)
_DTR: Final = 1


class PacketStream:
    """Output queue, cut into packets.

    A packet that is not full ends a transfer. So if the last packet of the queue is full, one of
    zero length follows it.

    Parameters
    ----------
    packet
        Longest packet in bytes.
    """

    def __init__(self, packet: int) -> None:
        self._packet = packet
        self._bytes = bytearray()
        self._needs_zero_length = False

    def put(self, data: bytes) -> None:
        """Append bytes."""
        self._bytes += data

    def next_packet(self) -> bytes | None:
        """Return the next packet; None if there is nothing to send."""
        if not self._bytes and not self._needs_zero_length:
            return None
        packet = bytes(self._bytes[: self._packet])
        del self._bytes[: self._packet]
        self._needs_zero_length = len(packet) == self._packet
        return packet

    def __len__(self) -> int:
        return len(self._bytes)


class DisplayFunction:
    """Vendor-specific function: the device behind a bulk endpoint each way.

    Parameters
    ----------
    wire
        The device.
    packet
        Longest packet of the bulk endpoints in bytes: 512 at high speed, 64 at full speed.

    Attributes
    ----------
    descriptors : Descriptors
        Its descriptors. The serial number is that of INFO.
    """

    def __init__(self, wire: DeviceOnLine | PacedDevice, packet: int = HIGH_SPEED_PACKET) -> None:
        self.wire = wire
        self._packet = packet
        self._out = PacketStream(packet)
        bulk = (Endpoint(_OUT, BULK, packet), Endpoint(_IN, BULK, packet))
        config = wire.device.config
        texts = ("voxdisplay project", config.name, config.serial)
        self.descriptors = Descriptors(
            spec.USB_TEST_VENDOR, spec.USB_TEST_PRODUCT, *texts, *self._interfaces(bulk)
        )

    @staticmethod
    def _interfaces(bulk: tuple[Endpoint, ...]) -> tuple[tuple[Interface, ...], int]:
        """Return the interfaces, and the class of the whole device."""
        return (Interface(0, TRIPLE, bulk),), 0

    def accepts(self, endpoint: int, size: int) -> bool:
        """See `Function.accepts`. What is longer than all of an empty ring, the device refuses."""
        del endpoint
        device = self.wire.device
        return self.wire.accepts_data() and device.free_bytes >= min(size, device.config.rx_buffer)

    def receive(self, endpoint: int, packet: bytes) -> None:
        """See `Function.receive`."""
        del endpoint
        self.wire.receive(packet)

    def next_packet(self, endpoint: int) -> bytes | None:
        """See `Function.next_packet`."""
        if endpoint != _IN:
            return None  # there are no notifications
        if not self._out:
            self._out.put(self.wire.transmit())
        return self._out.next_packet()

    def request(self, setup: Setup, data: bytes) -> bytes | None:
        """See `Function.request`: the protocol has none."""
        del setup, data
        return None

    def reset(self) -> None:
        """See `Function.reset`: the session ends."""
        self._out = PacketStream(self._packet)
        self.wire.disconnect()

    def next_event_s(self) -> float | None:
        """See `Function.next_event_s`: the tick that swaps."""
        return self.wire.next_event_s()


class SerialFunction(DisplayFunction):
    """CDC-ACM function: the device as a serial port, which systems support without a driver.

    Attributes
    ----------
    line_coding : bytes
        Baud rate and framing as set by the host; they have no effect.
    """

    def __init__(self, wire: DeviceOnLine | PacedDevice, packet: int = HIGH_SPEED_PACKET) -> None:
        super().__init__(wire, packet)
        self.line_coding = _LINE_CODING

    @staticmethod
    def _interfaces(bulk: tuple[Endpoint, ...]) -> tuple[tuple[Interface, ...], int]:
        functional = b"".join(
            bytes((2 + len(body), CS_INTERFACE)) + body
            for body in (
                b"\x00\x10\x01",  # header: CDC 1.10
                b"\x01\x00\x01",  # calls are not managed
                b"\x02\x02",  # ACM: line coding and line state
                b"\x06\x00\x01",  # union of interfaces 0 and 1
            )
        )
        notify = Endpoint(_NOTIFY, INTERRUPT, 16, 11)
        return (Interface(0, _ACM, (notify,), functional), Interface(1, _CDC_DATA, bulk)), _ACM[0]

    def request(self, setup: Setup, data: bytes) -> bytes | None:
        """See `Function.request`: line coding, line state and breaks."""
        if setup.request == _SET_LINE_CODING and len(data) == len(_LINE_CODING):
            self.line_coding = data
            return b""
        if setup.request == _GET_LINE_CODING:
            return self.line_coding
        if setup.request == _SET_CONTROL_LINE_STATE:
            if not setup.value & _DTR:  # the host closed the port
                self.reset()
            return b""
        return b"" if setup.request == _SEND_BREAK else None
