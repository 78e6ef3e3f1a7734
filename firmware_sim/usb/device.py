"""State machine of a USB device: transfers, packet by packet (USB 2.0, chapters 5, 8 and 9).

A host submits a transfer (`Urb`), which is done when its status is set. The device answers NAK
while it cannot take a packet or has none: the transfer waits. No clock, no thread and no I/O.
"""

import struct
from collections import deque
from enum import IntEnum
from typing import Final, Protocol

from firmware_sim.usb.descriptors import IN, Descriptors

# Status of transfers: Linux's error numbers, which USB/IP uses on every system.
DONE: Final = 0
EPIPE: Final = 32  # stalled
EOVERFLOW: Final = 75  # the device sent more than the host asked for
ECONNRESET: Final = 104  # given up by the host
ESHUTDOWN: Final = 108  # unplugged, or its endpoint was reset

_SETUP: Final = struct.Struct("<BBHHH")
_ENDPOINT_HALT: Final = 0
_TYPE_BITS: Final = 0x60  # of bmRequestType: standard 00, class 20, vendor 40
_TO_ENDPOINT: Final = 2


class Request(IntEnum):
    """Standard requests (9.4)."""

    GET_STATUS = 0
    CLEAR_FEATURE = 1
    SET_FEATURE = 3
    GET_DESCRIPTOR = 6
    GET_CONFIGURATION = 8
    SET_CONFIGURATION = 9
    GET_INTERFACE = 10
    SET_INTERFACE = 11


class Function(Protocol):
    """Function of a device: what is behind its endpoints."""

    descriptors: Descriptors

    def accepts(self, endpoint: int, size: int) -> bool:
        """Return whether a packet to an OUT endpoint can be taken; otherwise it gets NAK."""

    def receive(self, endpoint: int, packet: bytes) -> None:
        """Take a packet."""

    def next_packet(self, endpoint: int) -> bytes | None:
        """Return the next packet of an IN endpoint, at most as long as the endpoint allows.

        None means NAK.
        """

    def request(self, setup: "Setup", data: bytes) -> bytes | None:
        """Return the data for a class or vendor request; None stalls it."""

    def reset(self) -> None:
        """Discard all pending data: the device was plugged in or given a configuration."""

    def next_event_s(self) -> float | None:
        """Return the seconds until an event without the host's doing; None if none will come."""


class Setup:
    """The eight bytes that begin a control transfer."""

    def __init__(self, raw: bytes) -> None:
        self.kind, self.request, self.value, self.index, self.length = _SETUP.unpack(raw)

    @property
    def is_in(self) -> bool:
        """True if the device sends the data."""
        return bool(self.kind & IN)


class Urb:
    """A transfer, from submission to completion.

    Parameters
    ----------
    endpoint
        Address with the direction bit; 0 is control, in either direction.
    data
        Data from the host.
    length
        Most bytes that the host takes.
    setup
        The eight bytes of a control transfer.

    Attributes
    ----------
    actual : int
        Bytes moved so far.
    received : bytearray
        Data from the device.
    status : int or None
        None while it is pending.
    """

    def __init__(
        self, endpoint: int, data: bytes = b"", length: int = 0, setup: bytes = b""
    ) -> None:
        self.endpoint = endpoint
        self.data = data
        self.length = length
        self.setup = setup
        self.received = bytearray()
        self.actual = 0
        self.status: int | None = None


class UsbDevice:
    """A device on a bus.

    Parameters
    ----------
    function
        Its function.

    Attributes
    ----------
    configuration : int
        Value of its configuration; 0 until the host has set one.
    halted : set of int
        Addresses of the endpoints that stall.
    plugged : bool
        True while it is plugged in.
    number : int
        Its number on the bus, another one each time it is plugged in.
    packets : int
        Number of packets that its endpoints have moved, except that for control.
    unplug_at : int or None
        Number of packets after which it is unplugged.
    """

    def __init__(self, function: Function) -> None:
        self.function = function
        self.configuration = 0
        self.halted: set[int] = set()
        self.plugged = True
        self.number = 1
        self.packets = 0
        self.unplug_at: int | None = None
        self._endpoints = function.descriptors.endpoints
        self._queues: dict[int, deque[Urb]] = {address: deque() for address in self._endpoints}

    def submit(self, urb: Urb) -> None:
        """Submit a transfer; it may be done at once."""
        if not self.plugged:
            urb.status = ESHUTDOWN
        elif urb.endpoint & ~IN == 0:
            self._control(urb)
        elif urb.endpoint not in self._queues or not self.configuration:
            urb.status = EPIPE
        else:
            self._queues[urb.endpoint].append(urb)
        self.advance()

    def unlink(self, urb: Urb) -> None:
        """Cancel a transfer that is not done; data already moved stays moved."""
        if urb.status is None:
            self._queues[urb.endpoint].remove(urb)
            urb.status = ECONNRESET

    def advance(self) -> None:
        """Move packets until the device or the host has to wait."""
        while self.plugged and any(self._step(address) for address in self._queues):
            if self.packets == self.unplug_at:
                self.unplug()

    def next_event_s(self) -> float | None:
        """Return the seconds until the next event of the device; 0 if one has just occurred."""
        before = self.packets
        self.advance()  # a tick may have passed while the last packets were moved
        return 0.0 if self.packets != before else self.function.next_event_s()

    def unplug(self) -> None:
        """Unplug the device; pending transfers fail."""
        self.plugged = False
        self._shut_down()

    def plug(self) -> None:
        """Plug the device in, as after power on."""
        self.number += 1
        self.plugged = True
        self.reset()

    def reset(self) -> None:
        """Reset configuration and halts; pending transfers fail."""
        self.configuration = 0
        self._shut_down()

    def _shut_down(self) -> None:
        self.halted.clear()
        for queue in self._queues.values():
            while queue:
                queue.popleft().status = ESHUTDOWN
        self.function.reset()

    # Packets

    def _step(self, address: int) -> bool:
        """Move a packet of the first transfer of an endpoint; return whether anything changed."""
        queue = self._queues[address]
        if not queue:
            return False
        urb = queue[0]
        if address in self.halted:
            urb.status = EPIPE
        elif not (self._step_in if address & IN else self._step_out)(address, urb):
            return False
        if urb.status is not None:
            queue.popleft()
        return True

    def _step_out(self, address: int, urb: Urb) -> bool:
        packet = urb.data[urb.actual : urb.actual + self._endpoints[address].packet]
        if not self.function.accepts(address, len(packet)):
            return False
        urb.actual += len(packet)
        if urb.actual == len(urb.data):
            urb.status = DONE
        self.packets += 1
        self.function.receive(address, packet)
        return True

    def _step_in(self, address: int, urb: Urb) -> bool:
        packet = self.function.next_packet(address)
        if packet is None:
            return False
        self.packets += 1
        if len(packet) > urb.length - urb.actual:
            urb.status = EOVERFLOW  # and the packet is lost
            return True
        urb.received += packet
        urb.actual += len(packet)
        if len(packet) < self._endpoints[address].packet or urb.actual == urb.length:
            urb.status = DONE
        return True

    # Control

    def _control(self, urb: Urb) -> None:
        setup = Setup(urb.setup)
        if setup.kind & _TYPE_BITS:
            answer = self.function.request(setup, urb.data)
        else:
            answer = self._standard(setup)
        if answer is None:
            urb.status = EPIPE
            return
        if setup.is_in:
            urb.received += answer[: min(setup.length, urb.length)]
            urb.actual = len(urb.received)
        else:
            urb.actual = len(urb.data)
        urb.status = DONE

    def _standard(self, setup: Setup) -> bytes | None:
        match setup.request:
            case Request.GET_DESCRIPTOR if setup.is_in:
                return self.function.descriptors.get(setup.value >> 8, setup.value & 0xFF)
            case Request.GET_CONFIGURATION:
                return bytes((self.configuration,))
            case Request.SET_CONFIGURATION if setup.value in {0, 1}:
                self.configuration = setup.value
                self._shut_down()
                return b""
            case Request.GET_STATUS:
                halted = setup.kind & 3 == _TO_ENDPOINT and setup.index in self.halted
                return bytes((halted, 0))
            case Request.CLEAR_FEATURE | Request.SET_FEATURE if (
                setup.kind & 3 == _TO_ENDPOINT and setup.value == _ENDPOINT_HALT
            ):
                return self._halt(setup.index, on=setup.request == Request.SET_FEATURE)
            case Request.GET_INTERFACE if self.configuration:
                return b"\0"
            case Request.SET_INTERFACE if self.configuration and not setup.value:
                return b""
        return None

    def _halt(self, address: int, *, on: bool) -> bytes | None:
        if address not in self._endpoints:
            return None
        (self.halted.add if on else self.halted.discard)(address)
        return b""
