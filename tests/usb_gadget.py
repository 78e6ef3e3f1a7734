"""Scripted USB device: the test decides about every packet; in this process or its own.

    python usb_gadget.py

exports it by USB/IP and prints a JSON object with the address. It takes commands from stdin, each
a line with a JSON list of a name and arguments, and answers each with a line of JSON.

Its interfaces and endpoints have unusual numbers: a driver must not rely on the usual ones.
"""

import json
import os
import queue
import sys
import threading
from collections import deque
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from firmware_sim.serve import listen_tcp
from firmware_sim.usb.descriptors import BULK, INTERRUPT, Descriptors, Endpoint, Interface
from firmware_sim.usb.device import UsbDevice
from firmware_sim.usb.usbip_server import serve_usbip

PACKET = 512
OUT, IN, NOTIFY = 0x03, 0x82, 0x81
NUMBER = 1  # of the display's interface
POLL_S = 0.01  # how long a command waits at most, in a process of its own


_PATTERN = bytes((i * 7 + (i >> 8)) & 0xFF for i in range(1 << 16))


def pattern(size):
    """Bytes of which no two packets are equal, up to 64 KiB."""
    return (_PATTERN * (size // len(_PATTERN) + 1))[:size]


class Gadget:
    """A USB function that takes, sends and records as commanded."""

    def __init__(self, serial="GADGET", packet=PACKET):
        self.packet_bytes = packet
        endpoints = (
            Endpoint(NOTIFY, INTERRUPT, 16, 4),
            Endpoint(IN, BULK, packet),
            Endpoint(OUT, BULK, packet),
        )
        self.descriptors = Descriptors(
            *(0x1209, 0x0001, "tests", "gadget", serial),
            (Interface(0, (0xFF, 0, 0), ()), Interface(NUMBER, (0xFF, 0x56, 0x58), endpoints)),
        )
        self.budget = None  # packets that it takes; None: any number
        self.echoes = False
        self.taken = []
        self.sending = deque()
        self.resets = 0

    # what a function does

    def accepts(self, endpoint, size):
        del endpoint, size
        return self.budget is None or self.budget > 0

    def receive(self, endpoint, packet):
        assert endpoint == OUT
        if self.budget is not None:
            self.budget -= 1
        self.taken.append(packet)
        if self.echoes and packet:
            self.sending.append(packet)

    def next_packet(self, endpoint):
        if endpoint != IN or not self.sending:
            return None
        return self.sending.popleft()

    def request(self, setup, data):
        if setup.request == 1:  # a vendor's request that there is
            return b"" if data == b"good" else None
        return pattern(setup.length) if setup.request == 2 else None

    def reset(self):
        self.resets += 1
        self.sending.clear()

    def next_event_s(self):
        return None


class GadgetDevice(UsbDevice):
    """The device, with its out-of-band commands."""

    def __init__(self, serial="GADGET"):
        super().__init__(Gadget(serial))

    def do(self, command, *arguments):
        return getattr(self, f"do_{command}")(*arguments)

    def do_send(self, size, end):
        """Send bytes, as packets; and an empty one if they end with a full one and ``end``."""
        gadget, data = self.function, pattern(size)
        gadget.sending += [data[at : at + PACKET] for at in range(0, size, PACKET)]
        if end and size % PACKET == 0:
            gadget.sending.append(b"")
        self.advance()

    def do_take(self, count):
        """Take so many packets more; None: all."""
        self.function.budget = count
        self.advance()

    def do_taken(self):
        """Return the sizes of packets taken since the last call, and their bytes in hex."""
        taken, self.function.taken = self.function.taken, []
        return [list(map(len, taken)), b"".join(taken).hex()]

    def do_echo(self, on):
        self.function.echoes = on

    def do_halt(self, address):
        self.halted.add(address)
        self.advance()

    def do_resets(self):
        return self.function.resets

    def do_unplug(self):
        self.unplug()

    def do_plug(self):
        self.plug()

    def do_unplug_after(self, packets):
        self.unplug_at = self.packets + packets


class ToldDevice(GadgetDevice):
    """A gadget that takes its commands from a queue."""

    def __init__(self):
        super().__init__()
        self.commands = queue.SimpleQueue()

    def advance(self):
        super().advance()
        while not self.commands.empty():
            answer = self.do(*self.commands.get())
            sys.stdout.write(json.dumps(answer) + "\n")
            sys.stdout.flush()

    def next_event_s(self):
        return POLL_S


def main():
    device = ToldDevice()
    stop, stopper = os.pipe()

    def obey():
        for line in sys.stdin:
            device.commands.put(json.loads(line))
        os.write(stopper, b"\0")

    with listen_tcp("127.0.0.1", 0) as listener:
        threading.Thread(target=obey, daemon=True).start()
        sys.stdout.write(json.dumps({"address": listener.getsockname()}) + "\n")
        sys.stdout.flush()
        serve_usbip(device, listener, stop)


if __name__ == "__main__":
    main()
