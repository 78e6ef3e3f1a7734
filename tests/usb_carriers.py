"""USB transports and peers for the transport kit: in this process, and over USB/IP.

See `carriers`: each yields the driver's transport and the peer, a plain pipe behind the endpoints.
"""

import contextlib
import os
import threading
import time

from firmware_sim.serve import listen_tcp
from firmware_sim.usb import open_usbip
from firmware_sim.usb.backend import Backend
from firmware_sim.usb.descriptors import BULK, Descriptors, Endpoint, Interface
from firmware_sim.usb.device import UsbDevice
from firmware_sim.usb.function import TRIPLE, PacketStream
from firmware_sim.usb.host import Bus
from firmware_sim.usb.usbip_server import serve_usbip
from voxdisplay.transport.usb import UsbTransport

WAIT_S = 20
_POLL_S = 0.002
_ROOM = 1 << 16  # bytes that wait for who reads here; then packets are NAKed
PACKET = 512


class Pipe:
    """A function that only carries bytes, and can be pulled out by another thread."""

    def __init__(self):
        ends = (Endpoint(0x01, BULK, PACKET), Endpoint(0x81, BULK, PACKET))
        self.descriptors = Descriptors(
            *(0x1209, 0x0001, "", "pipe", ""), (Interface(0, TRIPLE, ends),)
        )
        self.lock = threading.Lock()
        self.heard = bytearray()
        self.to_say = PacketStream(PACKET)

    def accepts(self, endpoint, size):
        del endpoint
        return len(self.heard) + size <= _ROOM

    def receive(self, endpoint, packet):
        del endpoint
        with self.lock:
            self.heard += packet

    def next_packet(self, endpoint):
        del endpoint
        with self.lock:
            return self.to_say.next_packet()

    def request(self, setup, data):
        del setup, data

    def reset(self):
        pass

    def next_event_s(self):
        return _POLL_S


class PipeDevice(UsbDevice):
    pulled = False

    def advance(self):
        super().advance()
        if self.pulled and self.plugged:
            self.unplug()


class Peer:
    """The other end of the pipe."""

    def __init__(self, device):
        self._device = device
        self._pipe = device.function

    def read(self, count):
        data = b""
        deadline_s = time.monotonic() + WAIT_S
        while len(data) < count:
            with self._pipe.lock:
                piece = self._pipe.heard[: count - len(data)]
                del self._pipe.heard[: len(piece)]
            data += piece
            assert time.monotonic() < deadline_s, f"{len(data)} of {count} bytes came"
            time.sleep(_POLL_S)
        return data

    def write(self, data):
        with self._pipe.lock:
            self._pipe.to_say.put(data)

    def close(self):
        self._device.pulled = True
        while self._pipe.to_say:  # what was said before is heard
            time.sleep(_POLL_S)


@contextlib.contextmanager
def usb():
    device = PipeDevice(Pipe())
    transport = UsbTransport("usb:kit", backend=Backend(Bus(device)))
    try:
        yield transport, Peer(device)
    finally:
        transport.close()


@contextlib.contextmanager
def over_usbip():
    device = PipeDevice(Pipe())
    stop, stopper = os.pipe()
    with listen_tcp("127.0.0.1", 0) as listener:
        server = threading.Thread(target=serve_usbip, args=(device, listener, stop))
        server.start()
        try:
            port = f"usbip://127.0.0.1:{listener.getsockname()[1]}"
            transport = UsbTransport(port, backend=open_usbip(port))
            try:
                yield transport, Peer(device)
            finally:
                transport.close()
        finally:
            os.write(stopper, b"\0")
            server.join(WAIT_S)
            os.close(stop)
            os.close(stopper)


USB_CARRIERS = {"usb": usb, "usbip": over_usbip}
