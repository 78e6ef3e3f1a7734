"""The emulator where the system lacks something, or something ends early."""

import errno
import io
import os
import socket
import sys

import pytest

from firmware_sim import command_line, readiness, serve
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.usb import usbip_server
from firmware_sim.usb.device import UsbDevice
from firmware_sim.usb.function import DisplayFunction
from firmware_sim.usb.usbip_server import Server


def test_descriptors_that_select_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(readiness, "_SELECT_LIMIT", 0)
    here, there = socket.socketpair()
    with here, there:
        assert readiness.wait_ready([here], [here], 0.0) == ([], [here])
        assert readiness.wait_ready([here], timeout_s=0.0) == ([], [])
        there.send(b"\0")
        assert readiness.wait_ready([here.fileno()]) == ([here.fileno()], [])


def test_no_pseudo_terminals(monkeypatch: pytest.MonkeyPatch) -> None:
    def full() -> tuple[int, int]:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "openpty", full)
    message = "no pseudo-terminal: No space left on device; use --tcp"
    with pytest.raises(OSError, match=message), serve.open_pty():
        pass
    monkeypatch.delattr(os, "openpty")
    with pytest.raises(OSError, match="no pseudo-terminals: use --tcp"), serve.open_pty():
        pass


def test_a_first_line_that_cannot_be_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    noted = io.StringIO()
    monkeypatch.setattr(sys, "stderr", noted)
    monkeypatch.setattr(sys, "stdout", None)
    command_line._announce({"port": "tcp://127.0.0.1:5"})
    assert not noted.getvalue()
    closed = io.StringIO()
    closed.close()
    monkeypatch.setattr(sys, "stdout", closed)
    command_line._announce({"port": "tcp://127.0.0.1:5"})
    assert 'this is the port: {"port": "tcp://127.0.0.1:5"}' in noted.getvalue()
    monkeypatch.setattr(sys, "stderr", None)
    command_line._announce({"port": "tcp://127.0.0.1:5"})


def test_origins_are_those_of_a_view(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command_line.run(["--allow-origin", "display.example"], 0)
    assert "--allow-origin is for --view" in capsys.readouterr().err


def test_a_host_that_has_gone_before_it_is_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(usbip_server, "accept", lambda *_: None)
    server = Server(UsbDevice(DisplayFunction(DeviceOnLine(Device(Config(grid=(3, 5, 7)))))))
    with socket.socket() as listener:
        server._accept(listener, 0)
    assert not server._connections
