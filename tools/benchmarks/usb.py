"""Emulated USB ports for the transport benchmark: in this process, and over USB/IP."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator

from firmware_sim.serve import listen_tcp
from firmware_sim.usb import open_usbip
from firmware_sim.usb.backend import Backend
from firmware_sim.usb.descriptors import BULK, Descriptors, Endpoint, Interface
from firmware_sim.usb.device import Setup, UsbDevice
from firmware_sim.usb.function import HIGH_SPEED_PACKET, TRIPLE, PacketStream
from firmware_sim.usb.host import Bus
from firmware_sim.usb.usbip_server import serve_usbip
from voxdisplay.transport.usb import UsbTransport

Feed = Callable[[bytes], bytes]  # what the peer makes of bytes


class PeerFunction:
    """USB function that forwards its bytes to a peer, and sends its answers."""

    def __init__(self, feed: Feed) -> None:
        packet = HIGH_SPEED_PACKET
        ends = (Endpoint(0x01, BULK, packet), Endpoint(0x81, BULK, packet))
        interface = Interface(0, TRIPLE, ends)
        self.descriptors = Descriptors(0x1209, 0x0001, "", "peer", "", (interface,))
        self._feed = feed
        self._out = PacketStream(packet)

    def accepts(self, endpoint: int, size: int) -> bool:
        """See `Function.accepts`."""
        del endpoint, size
        return True

    def receive(self, endpoint: int, packet: bytes) -> None:
        """See `Function.receive`."""
        del endpoint
        self._out.put(self._feed(packet))

    def next_packet(self, endpoint: int) -> bytes | None:
        """See `Function.next_packet`."""
        del endpoint
        return self._out.next_packet()

    def request(self, setup: Setup, data: bytes) -> bytes | None:
        """See `Function.request`: there are none."""
        del setup, data
        return None

    def reset(self) -> None:
        """See `Function.reset`: nothing is under way."""

    def next_event_s(self) -> None:
        """See `Function.next_event_s`: nothing happens by itself."""


@contextlib.contextmanager
def on_usb(feed: Feed) -> Iterator[UsbTransport]:
    """Yield a port on a bus in this process, with a peer on it."""
    backend = Backend(Bus(UsbDevice(PeerFunction(feed))))
    with contextlib.closing(UsbTransport("usb:", backend=backend)) as transport:
        yield transport


@contextlib.contextmanager
def on_usbip(
    feed: Feed, in_another_process: Callable[[Callable[[], None]], int]
) -> Iterator[UsbTransport]:
    """Yield a port over USB/IP, with a peer in another process."""
    with listen_tcp("127.0.0.1", 0) as listener:
        port = f"usbip://127.0.0.1:{listener.getsockname()[1]}"
        stop, stopper = os.pipe()

        def serve() -> None:
            os.close(stopper)  # so that the end of who started it is the end of this
            serve_usbip(UsbDevice(PeerFunction(feed)), listener, stop)

        child = in_another_process(serve)
        os.close(stop)
        try:
            with contextlib.closing(UsbTransport(port, backend=open_usbip(port))) as transport:
                yield transport
        finally:
            os.close(stopper)
            os.waitpid(child, 0)
