"""Displays that are waited for when they are opened: not plugged in, or not started yet."""

import os
import socket
import subprocess
import sys
import termios
import threading
import tty

import pytest
from conftest import DEADLINE_S, ROOT

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device


class NoteThen(list):
    """Notes; the first one has an action follow."""

    def __init__(self, action):
        super().__init__()
        self._action = action

    def __call__(self, text):
        self.append(text)
        if len(self) == 1:
            self._action()


def test_a_port_that_is_not_there_yet(plug):
    notes = NoteThen(plug.plug)
    with vd.open(str(plug.path), reconnect_s=DEADLINE_S, note=notes) as display:
        display.clear()
        assert "does not exist" in notes[0]
        assert f"waiting {DEADLINE_S:g} s for it" in notes[0]
        assert len(notes) == 1
        plug.unplug()  # and it is waited for later as well
        threading.Timer(0.1, plug.plug).start()
        display.clear()
    assert any("is back after" in text for text in notes)


def test_the_command_waits_for_it(plug):
    command = [sys.executable, "-m", "voxdisplay", "push", "examples/trefoil.json"]
    command += ["--port", str(plug.path), "--reconnect", str(DEADLINE_S)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT) as push:
        assert any("does not exist; waiting" in line for line in iter(push.stderr.readline, ""))
        plug.plug()
        _, text = push.communicate(timeout=DEADLINE_S)
    assert push.returncode == 0, text
    assert any(plug.snapshot().pixels)


def test_a_link_that_points_nowhere_yet(plug, tmp_path):
    link = tmp_path / "by-id"
    link.symlink_to(plug.path)
    with vd.open(str(link), reconnect_s=DEADLINE_S, note=NoteThen(plug.plug)) as display:
        display.clear()


def test_a_pattern_that_matches_nothing_yet(plug, monkeypatch):
    def grep(_regexp):
        return iter([(str(plug.path), "a display", "USB")] if plug.path.exists() else [])

    monkeypatch.setattr("serial.tools.list_ports.grep", grep)
    notes = NoteThen(plug.plug)
    with vd.open("hwgrep://display", reconnect_s=DEADLINE_S, note=notes) as display:
        display.clear()
    assert notes[0].startswith("hwgrep://display matches no port; waiting")


def test_a_port_that_goes_away_while_it_is_configured(plug, monkeypatch):
    """A termios.error is no OSError, and pyserial hides it in an error without a number."""
    get, failures = termios.tcgetattr, [termios.error(5, "Input/output error")]

    def fail_once(descriptor):
        if failures:
            raise failures.pop()
        return get(descriptor)

    plug.plug()
    monkeypatch.setattr(termios, "tcgetattr", fail_once)
    notes = []
    with vd.open(str(plug.path), reconnect_s=DEADLINE_S, note=notes.append) as display:
        display.clear()
    assert not failures
    assert "waiting" in notes[0]


def test_a_device_that_does_not_answer_yet(plug):
    plug.plug()
    plug.device.receive = lambda _data: None  # as one that starts
    notes = NoteThen(lambda: plug.device.__dict__.pop("receive"))
    with vd.open(str(plug.path), timeout_s=0.3, reconnect_s=DEADLINE_S, note=notes) as display:
        display.clear()
    assert "nothing answered HELLO" in notes[0]


def test_a_server_that_is_not_started_yet(emulator):
    with socket.create_server(("127.0.0.1", 0)) as server:
        number = server.getsockname()[1]
    notes = NoteThen(lambda: emulator("--tcp", f"127.0.0.1:{number}", "--size", "3x5x7"))
    port = f"tcp://127.0.0.1:{number}"
    with vd.open(port, reconnect_s=DEADLINE_S, note=notes) as display:
        assert display.info.grid == (3, 5, 7)
    assert "refused" in notes[0]


def test_a_port_that_another_program_still_has(plug):
    first = vd.open(str(plug.plug().path))
    notes = NoteThen(first.close)
    with vd.open(str(plug.path), reconnect_s=DEADLINE_S, note=notes) as display:
        display.clear()
    assert "busy" in notes[0]


def test_one_that_does_not_come(tmp_path):
    with pytest.raises(vd.OpenError, match=r"does not exist.*not change within 0.3 s") as caught:
        vd.open(str(tmp_path / "port"), reconnect_s=0.3)
    assert caught.value.port == str(tmp_path / "port")
    assert "sim:" in caught.value.hint


def test_one_that_never_answers():
    master, slave = os.openpty()
    tty.setraw(slave)
    with pytest.raises(vd.TransportTimeout, match=r"nothing answered.*not change within 0.3 s"):
        vd.open(os.ttyname(slave), timeout_s=0.2, reconnect_s=0.3)
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(
    "port",
    [
        "sim:?size=bad", "sim:?color=red", "tcp://127.0.0.1", "usb:what", "nonsense://x",
        "socket://127.0.0.1:99999", "",
    ],
)  # fmt: skip
def test_what_waiting_cannot_change_is_an_error_at_once(port):
    notes = []
    with pytest.raises(vd.OpenError):
        vd.open(port, reconnect_s=3600, note=notes.append)
    assert notes == []


def test_a_folder_is_no_port_that_may_come(tmp_path):
    with pytest.raises(vd.OpenError):
        vd.open(str(tmp_path), reconnect_s=3600)


def test_a_device_that_cannot_be_served_is_not_waited_for(plug, monkeypatch):
    plug.plug(Device(Config((3, 5, 7), "index8", 0)))
    monkeypatch.setattr("voxdisplay.wire.spec.VERSION_MAJOR", 2)
    with pytest.raises((vd.IncompatibleDevice, vd.TransportTimeout)):
        vd.open(str(plug.path), timeout_s=0.5, reconnect_s=0.2)


def test_a_usb_display_that_is_not_there_yet(monkeypatch):
    usb = pytest.importorskip("voxdisplay.transport.usb")
    monkeypatch.setattr(usb, "find_backend", lambda _port: None)
    monkeypatch.setattr(usb.usb.core, "find", lambda **_options: [])
    notes = []
    with pytest.raises(vd.OpenError, match=r"no such display on USB.*within 0.1 s"):
        vd.open("usb:", reconnect_s=0.1, note=notes.append)
    assert "waiting 0.1 s" in notes[0]
