"""Devices that stop in the middle of INFO, behind real pipes."""

import contextlib
import os
import socket
import threading
import tty

import pytest
from conftest import DEADLINE_S

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.readiness import wait_ready


class Answerer:
    """Peer that answers each HELLO by the first bytes of INFO, and may hang up then."""

    def __init__(self, descriptor, count, *, hang_up=None):
        self._descriptor, self._count, self._hang_up = descriptor, count, hang_up
        self._stop, self._stopper = os.pipe()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        with contextlib.suppress(OSError):
            while True:
                ready, _ = wait_ready([self._descriptor, self._stop])
                if self._stop in ready:
                    return
                device = Device(Config((3, 5, 7), "index8", 0, name="cube"))
                device.receive(os.read(self._descriptor, 4096))
                if info := device.transmit():
                    os.write(self._descriptor, info[: self._count])
                    if self._hang_up:
                        self._hang_up()
                        return

    def close(self):
        os.write(self._stopper, b"\0")
        self._thread.join(DEADLINE_S)
        assert not self._thread.is_alive()
        os.close(self._stop)
        os.close(self._stopper)


@pytest.mark.parametrize("count", [4, 9, 25])
def test_a_device_that_stops_is_described_as_it_is(count):
    master, slave = os.openpty()
    tty.setraw(slave)
    peer = Answerer(master, count)
    try:
        with pytest.raises(vd.TransportTimeout, match=f"incomplete.*which {count} bytes") as caught:
            vd.open(os.ttyname(slave), timeout_s=0.6)
    finally:
        peer.close()
        os.close(master)
        os.close(slave)
    assert "omething else" not in f"{caught.value} {caught.value.hint}"
    assert "stopped in the middle" in caught.value.hint


@pytest.mark.parametrize("scheme", ["tcp", "socket"])
def test_a_device_that_hangs_up_in_the_middle_is_described_as_it_is(scheme):
    with socket.create_server(("127.0.0.1", 0)) as server:
        opened = []

        def accept():
            connection, _ = server.accept()
            hang_up = lambda: connection.shutdown(socket.SHUT_RDWR)  # noqa: E731
            opened.extend([connection, Answerer(connection.fileno(), 17, hang_up=hang_up)])

        accepter = threading.Thread(target=accept)
        accepter.start()
        with pytest.raises(vd.TransportClosed, match="incomplete INFO, of which 17") as caught:
            vd.open(f"{scheme}://127.0.0.1:{server.getsockname()[1]}", timeout_s=DEADLINE_S)
        accepter.join()
        opened[1].close()
        opened[0].close()
    assert "omething else" not in f"{caught.value} {caught.value.hint}"


def test_the_command_says_so(run):
    master, slave = os.openpty()
    tty.setraw(slave)
    peer = Answerer(master, 12)
    try:
        done = run("info", "--port", os.ttyname(slave), "--timeout", "0.6")
    finally:
        peer.close()
        os.close(master)
        os.close(slave)
    assert done.returncode == 3
    assert "an incomplete INFO, of which 12 bytes came" in done.stderr
