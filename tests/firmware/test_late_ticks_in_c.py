"""Refresh ticks of the reference device on a machine that lets it run late (section 6)."""

from __future__ import annotations

import os
import select
import signal
import termios
import time
import tty

import c_device
import pytest
from c_device import HELLO, TerminalDevice, all_features, build
from document import off_wire, on_wire

pytestmark = pytest.mark.skipif(c_device.COMPILER is None, reason="no C compiler (cc)")

REFRESH = 2  # Hz
WHOLE = bytes((0x15, 0, 0))  # DATA of a frame that is whole
WAITING = bytes((0x15, 1, 1))  # DATA of the next frame, which waits for a tick
STATUS = bytes((0x40, 9, 0))
ACK, ACK_OF_STATUS = 0x8, 4


def ask(line: int, *packets: bytes) -> list[bytes]:
    """Send packets; return those that come back within a second."""
    os.write(line, b"".join(map(on_wire, packets)))
    received = b""
    while select.select([line], [], [], 1)[0]:
        received += os.read(line, 4096)
    return off_wire(received)


def test_ticks_that_are_due_come_before_bytes_that_were_read() -> None:
    """Both frames are shown before a STATUS that comes several refresh periods later."""
    program = build((3, 5, 7), "index8", all_features("index8", ticks=True))
    device = TerminalDevice(program, refresh=REFRESH)
    with device as port:
        line = os.open(port, os.O_RDWR | os.O_NOCTTY)
        try:
            tty.setraw(line)
            termios.tcflush(line, termios.TCIOFLUSH)
            assert ask(line, HELLO)
            os.write(line, on_wire(WHOLE) + on_wire(WAITING))
            # The frames' first tick is still to come, or has just been.
            time.sleep(0.1)
            device.process.send_signal(signal.SIGSTOP)
            time.sleep(4 / REFRESH)
            os.write(line, on_wire(STATUS))
            device.process.send_signal(signal.SIGCONT)
            answers = ask(line)
        finally:
            os.close(line)
    (status,) = (packet for packet in answers if packet[0] >> 4 == ACK and packet[3] == STATUS[1])
    flags, frame = status[0] & 15, status[2]
    assert flags & ACK_OF_STATUS
    assert (flags & 1, frame) == (1, 1), "the last frame is not shown yet"
