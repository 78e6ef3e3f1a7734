"""A USB device: transfers in, transfers out, packet by packet (USB 2.0, chapters 5, 8 and 9).

A host submits a transfer (`Urb`) and it is done when its status says so. What a device cannot take
or has not got it answers with NAK: the transfer waits. No clock, no thread, no input or output.
"""

import struct
from collections import deque
from enum import IntEnum
from typing import Final, Protocol

from firmware_sim.usb.descriptors import IN, Descriptors

# Why a transfer ended: Linux's numbers, as USB/IP carries them on every system.
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
    """What a device is for: what stands behind its endpoints."""

    descriptors: Descriptors

    def accepts(self, endpoint: int, size: int) -> bool:
        """Tell whether a packet of a size to an OUT endpoint has room; else it is NAKed."""

    def receive(self, endpoint: int, packet: bytes) -> None:
        """Take a packet."""

    def next_packet(self, endpoint: int) -> bytes | None:
        """Give the next packet of an IN endpoint, at most as long as the endpoint says.

        None is NAK.
        """

    def request(self, setup: "Setup", data: bytes) -> bytes | None:
        """Answer a request of a class or vendor; None stalls it."""

    def reset(self) -> None:
        """Forget what was under way: plugged in anew, or given a configuration."""

    def next_event_s(self) -> float | None:
        """Return the seconds until something happens without the host; None if nothing will."""


class Setup:
    """The eight bytes that begin a control transfer."""

    def __init__(self, raw: bytes) -> None:
        self.kind, self.request, self.value, self.index, self.length = _SETUP.unpack(raw)

    @property
    def is_in(self) -> bool:
        """Whether the device sends the data."""
        return bool(self.kind & IN)


class Urb:
    """A transfer, from submission to completion.

    Parameters
    ----------
    endpoint
        Address, with the bit of its direction; 0 is control, whatever its direction.
    data
        What the host sends.
    length
        How many bytes the host takes.
    setup
        The eight bytes of a control transfer.

    Attributes
    ----------
    actual : int
        Bytes moved so far.
    got : bytearray
        What the device has sent.
    status : int or None
        None while it waits.
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
        What it is for.

    Attributes
    ----------
    configuration : int
        Value of its configuration; 0 as long as the host has chosen none.
    halted : set of int
        Addresses of the endpoints that stall.
    plugged : bool
        Whether it is there.
    number : int
        Its number on the bus, another one each time it is plugged in.
    packets : int
        How many packets its endpoints have moved, all but control's.
    unplug_at : int or None
        After how many packets it is unplugged.
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
        """Begin a transfer; it may be done at once."""
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
        """Give a transfer up, if it is not done: what has been moved has been moved."""
        if urb.status is None:
            self._queues[urb.endpoint].remove(urb)
            urb.status = ECONNRESET

    def advance(self) -> None:
        """Move packets until the device or the host has to wait."""
        while self.plugged and any(self._step(address) for address in self._queues):
            if self.packets == self.unplug_at:
                self.unplug()

    def next_event_s(self) -> float | None:
        """Return the seconds until something moves without the host; 0 if it just has."""
        before = self.packets
        self.advance()  # a tick may have come while the last packets were moved
        return 0.0 if self.packets != before else self.function.next_event_s()

    def unplug(self) -> None:
        """Go away; what was under way fails."""
        self.plugged = False
        self._shut_down()

    def plug(self) -> None:
        """Come back, as after power on."""
        self.number += 1
        self.plugged = True
        self.reset()

    def reset(self) -> None:
        """Forget configuration, halts and what was under way."""
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
        """Move a packet of the first transfer of an endpoint, if there is one to move."""
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
