"""Baud rates, and their detection, over RFC 2217, where the device sees the rate."""

import contextlib
import os
import select
import socket
import threading

import pytest
from carriers import CARRIERS, WAIT_S, Rfc2217Server

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.display import baud
from voxdisplay.transport import open_transport

# pyserial's reader of rfc2217:// is a thread of the old style.
pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name)")


class Uart:
    """A device on a line of RFC 2217 that listens at one rate; all else is garbage to both."""

    def __init__(self, rate):
        inner, self._line = socket.socketpair()
        self.server = Rfc2217Server(inner)
        self.device = Device(Config((3, 5, 7), "index8", 0))
        self._rate = rate
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _garbled(self, data):
        return data if self.server.line.baudrate == self._rate else bytes(b ^ 0x55 for b in data)

    def _run(self):
        with contextlib.suppress(OSError):
            while data := self._line.recv(4096):
                self.device.receive(self._garbled(data))
                self._line.sendall(self._garbled(self.device.transmit()))

    def close(self):
        self.server.close()
        self._thread.join(WAIT_S)
        assert not self._thread.is_alive()
        self._line.close()


@pytest.fixture
def uart():
    uarts = []

    def at(rate):
        uarts.append(Uart(rate))
        return uarts[-1]

    yield at
    for each in uarts:
        each.close()


def test_a_server_of_rfc2217_shows_the_device_rate_and_wires(uart):
    uart = uart(57_600)
    with vd.open(uart.server.port, baud=57_600) as display:
        line = uart.server.line
        assert (line.baudrate, line.dtr, line.rts) == (57_600, True, True)
        frame = display.frame()
        frame.draw([(1, 2, 3)], "red")
        assert display.present(frame).digest == frame.digest()
        assert (display.read() == frame.array()).all()


def test_a_wrong_rate_is_a_device_that_does_not_answer(uart):
    with pytest.raises(vd.TransportTimeout, match="nothing answered HELLO") as caught:
        vd.open(uart(57_600).server.port, baud=9600, timeout_s=0.4)
    assert "display" in caught.value.hint


def test_the_fastest_rate_at_which_it_answers(uart):
    uart, notes = uart(3_000_000), []
    with vd.open(uart.server.port, baud="auto", note=notes.append) as display:
        display.clear()
    assert uart.server.line.rates[-1] == 3_000_000
    assert uart.server.line.rates[1] == baud.RATES[0], "the fastest was tried first"
    assert "answers at 3000000 Bd" in notes[0]
    assert uart.device.errors_by_code == {}, "what came at other rates was no packet"


def test_none_of_the_rates(uart, monkeypatch):
    monkeypatch.setattr(baud, "RATES", (230_400, 115_200))
    uart = uart(77)
    with pytest.raises(vd.TransportTimeout, match="at 115200 to 230400 Bd"):
        vd.open(uart.server.port, baud="auto", timeout_s=0.1)


@pytest.mark.parametrize("kind", ["pty", "socket", "tcp"])
def test_a_port_without_a_rate_is_opened_as_it_is(kind, monkeypatch):
    notes = []
    with CARRIERS[kind]() as (transport, peer):
        monkeypatch.setattr(baud, "open_transport", lambda _port, **_options: transport)
        assert baud.open_at_best_rate("a port", 1.0, notes.append) is transport
        assert notes == ["a port has no baud rate"]
        transport.write(b"x", 1.0)
        assert peer.read(1) == b"x", "and nothing was said before"


def test_a_rate_that_a_port_refuses_is_left_out(monkeypatch):
    asked = []

    class Picky:
        port = "picky"
        has_baud_rate = True

        def set_baud(self, rate):
            asked.append(rate)
            raise ValueError

        def close(self):
            asked.append("closed")

    monkeypatch.setattr("voxdisplay.transport.serial.SerialTransport", Picky)
    monkeypatch.setattr(baud, "open_transport", lambda _port, **_baud: Picky())
    with pytest.raises(vd.TransportTimeout, match="the port refuses all"):
        baud.open_at_best_rate("picky", 0.0, print)
    assert asked == [*baud.RATES, "closed"]


def test_the_command_takes_auto(run):
    done = run("info", "--port", "sim:?size=3x5x7", "--baud", "auto")
    assert done.returncode == 0, done.stderr
    for bad in ("fast", "49", "-1"):
        refused = run("info", "--port", "sim:", "--baud", bad)
        assert refused.returncode == 2
        assert "write one like 115200" in refused.stderr


def test_everything_goes_through_a_spied_port(tmp_path):
    master, slave = os.openpty()
    path = os.ttyname(slave)
    with contextlib.closing(open_transport(f"spy://{path}?file={tmp_path}/log")) as transport:
        with pytest.raises(vd.OpenError, match="busy"):
            open_transport(path)
        transport.write(b"\x00\xffa", 1.0)
        assert select.select([master], [], [], WAIT_S)[0]
        assert os.read(master, 10) == b"\x00\xffa"
        os.write(master, b"\x00\xffb")
        assert transport.read(WAIT_S) == b"\x00\xffb"
    os.close(master)
    os.close(slave)
