"""Serial lines behind real servers and pipes: ser2net, socat, and servers of RFC 2217 that do less.

The driver needs the bytes and the rate of a line; it needs no modem lines and no PURGE.
"""

import contextlib
import errno
import os
import shutil
import signal
import socket
import subprocess
import termios
import threading
import time
import tty
from pathlib import Path

import numpy as np
import pytest
import serial
from carriers import Peer, Rfc2217Line, Rfc2217Server, eventually
from serial import rfc2217

import voxdisplay as vd
from voxdisplay.transport import open_transport

WAIT_S = 30
SER2NET = shutil.which("ser2net") or shutil.which("ser2net", path="/usr/sbin:/sbin")
SOCAT = shutil.which("socat")
needs_ser2net = pytest.mark.skipif(SER2NET is None, reason="ser2net is not installed")
needs_socat = pytest.mark.skipif(SOCAT is None, reason="socat is not installed")
pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name)")  # of pyserial's reader


@contextlib.contextmanager
def process(*command):
    with subprocess.Popen(
        list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as running:
        try:
            yield running
        finally:
            running.kill()


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


@pytest.fixture
def ser2net(tmp_path):
    """Start ser2net in front of a line; return HOST:PORT."""
    with contextlib.ExitStack() as stack:

        def start(line, accepter, settings="115200n81,local"):
            number = free_port()
            config = tmp_path / "ser2net.yaml"
            config.write_text(
                "connection: &display\n"
                f"  accepter: {accepter},127.0.0.1,{number}\n"
                f"  connector: serialdev,{line},{settings}\n"
            )
            stack.enter_context(process(SER2NET, "-n", "-d", "-c", config))
            eventually(lambda: is_listening(number), "ser2net's start")
            return f"127.0.0.1:{number}"

        yield start


def is_listening(number):
    """Look into the system's table: a connection would take the line."""
    entry = f"0100007F:{number:04X} 00000000:0000 0A"
    return entry in Path("/proc/net/tcp").read_text()


@pytest.fixture
def sim(emulator):
    return emulator("--pty", "--size", "3x5x7", "--refresh", "0", "--format", "rgb888")


def draw_and_read_back(port):
    """Show a picture of all byte values, those of telnet among them; compare what is read."""
    pixels = np.random.default_rng(5).choice(
        np.array([0, 13, 10, 17, 19, 0xF0, 0xFA, 0xFB, 0xFD, 0xFF], np.uint8), (7, 5, 3, 3)
    )
    with vd.open(port, timeout_s=10) as display:
        frame = display.frame()
        frame.set(pixels)
        assert display.present(frame).digest == frame.digest()
        assert np.array_equal(display.read(), pixels)


# -- ser2net, in front of a port without modem lines


@needs_ser2net
@pytest.mark.parametrize(
    "port",
    [
        "rfc2217://{}", "rfc2217://{}?ign_set_control", "rfc2217://{}?timeout=5", "tcp://{}",
        "socket://{}",
    ],
)  # fmt: skip
def test_ser2net_that_speaks_telnet(port, sim, ser2net):
    draw_and_read_back(port.format(ser2net(sim.port, "telnet(rfc2217),tcp")))


@needs_ser2net
@pytest.mark.parametrize("kind", ["tcp", "socket"])
@pytest.mark.parametrize("accepter", ["tcp", "telnet,tcp"])
def test_ser2net_without_rfc_2217(kind, accepter, sim, ser2net):
    draw_and_read_back(f"{kind}://{ser2net(sim.port, accepter)}")


@needs_ser2net
@pytest.mark.parametrize("accepter", ["tcp", "telnet,tcp"])
def test_rfc2217_to_a_server_that_does_not_speak_it(accepter, sim, ser2net):
    with pytest.raises(vd.OpenError) as refused:
        vd.open(f"rfc2217://{ser2net(sim.port, accepter)}?timeout=0.5")
    assert refused.value.hint.endswith("does it pass bytes on? Then try tcp://")


@needs_ser2net
def test_the_rate_is_set_through_ser2net(sim, ser2net):
    port = f"rfc2217://{ser2net(sim.port, 'telnet(rfc2217),tcp')}"
    transport = open_transport(port, baud=57600)
    assert transport.has_baud_rate
    transport.set_baud(230400)
    assert transport.baud == 230400
    transport.close()


@needs_ser2net
def test_a_line_behind_ser2net_that_is_not_there(tmp_path, ser2net):
    """The server runs: the hint must not ask whether it does."""
    where = ser2net(tmp_path / "ttyNOWHERE", "telnet(rfc2217),tcp")
    with pytest.raises(vd.TransportError) as refused:
        vd.open(f"rfc2217://{where}?timeout=3", timeout_s=4)
    assert "running" not in (refused.value.hint or "")


@needs_ser2net
def test_two_of_us_at_one_line_behind_ser2net(sim, ser2net):
    where = ser2net(sim.port, "telnet(rfc2217),tcp")
    with vd.open(f"rfc2217://{where}"), pytest.raises(vd.TransportError) as refused:
        vd.open(f"rfc2217://{where}?timeout=3", timeout_s=4)
    assert "running" not in (refused.value.hint or "")


# -- socat


@needs_socat
@pytest.mark.parametrize("options", ["pty,rawer", "pty,raw,echo=0,b115200"])
def test_a_pair_of_ptys(options, sim, tmp_path):
    link = tmp_path / "display"
    with process(SOCAT, f"{options},link={link}", f"{sim.port},rawer"):
        eventually(link.exists, "socat's pty")
        draw_and_read_back(str(link))


@needs_socat
def test_a_pair_of_ptys_that_is_torn(sim, tmp_path):
    link = tmp_path / "display"
    with process(SOCAT, f"pty,rawer,link={link}", f"{sim.port},rawer") as socat:
        eventually(link.exists, "socat's pty")
        with vd.open(str(link), timeout_s=10) as display:
            socat.send_signal(signal.SIGKILL)
            socat.wait()
            with pytest.raises(vd.TransportClosed):
                display.clear()


@needs_socat
def test_a_pty_in_front_of_a_tcp_port(emulator, tmp_path):
    device = emulator("--tcp", "127.0.0.1:0", "--size", "3x5x7", "--refresh", "0")
    link = tmp_path / "display"
    with process(SOCAT, f"pty,rawer,link={link}", device.port.replace("tcp://", "tcp:")):
        eventually(link.exists, "socat's pty")
        draw_and_read_back(str(link))


# -- bridged RX and TX


def assert_called_an_echo(port):
    with pytest.raises(vd.TransportTimeout) as silent:
        vd.open(port, timeout_s=0.8)
    assert "echo" in str(silent.value)
    assert "another program" not in f"{silent.value} {silent.value.hint}"


@needs_socat
def test_a_line_whose_ends_are_bridged(tmp_path):
    link = tmp_path / "line"
    with process(SOCAT, f"pty,rawer,link={link}", "EXEC:cat"):
        eventually(link.exists, "socat's pty")
        assert_called_an_echo(str(link))


def test_a_tcp_server_that_echoes():
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def echo():
            connection, _ = listener.accept()
            with connection, contextlib.suppress(OSError):
                while data := connection.recv(4096):
                    connection.sendall(data)

        thread = threading.Thread(target=echo)
        thread.start()
        assert_called_an_echo(f"tcp://127.0.0.1:{listener.getsockname()[1]}")
        thread.join(WAIT_S)


def test_a_terminal_that_echoes():
    """A tty of which the other end is another tty with ECHO on: bytes come back changed, too."""
    master, slave = os.openpty()
    tty.setraw(slave)
    stop = threading.Event()

    def echo():
        peer = Peer(master)
        while not stop.is_set():
            with contextlib.suppress(BlockingIOError, OSError):
                peer.write(os.read(master, 4096))
            time.sleep(0.005)

    thread = threading.Thread(target=echo)
    thread.start()
    try:
        assert_called_an_echo(os.ttyname(slave))
    finally:
        stop.set()
        thread.join(WAIT_S)
        os.close(master)
        os.close(slave)


# -- servers of RFC 2217 that do less


@contextlib.contextmanager
def lesser_server(monkeypatch, *ignored):
    """Serve a line, without a word on some of the requests."""
    process_request = rfc2217.PortManager._telnet_process_subnegotiation

    def answer(manager, suboption):
        if suboption[1:2] not in ignored:
            process_request(manager, suboption)

    monkeypatch.setattr(rfc2217.PortManager, "_telnet_process_subnegotiation", answer)
    inner, theirs = socket.socketpair()
    server, peer = Rfc2217Server(inner), Peer(theirs.detach())
    try:
        yield server, peer
    finally:
        peer.close()
        server.close()


@pytest.mark.parametrize(
    "ignored",
    [
        [rfc2217.PURGE_DATA], [rfc2217.SET_CONTROL], [rfc2217.PURGE_DATA, rfc2217.SET_CONTROL],
    ],
    ids=["PURGE", "modem lines", "both"],
)  # fmt: skip
def test_requests_that_are_not_answered(ignored, monkeypatch):
    with lesser_server(monkeypatch, *ignored) as (server, peer):
        transport = open_transport(server.port, baud=57600)
        assert server.line.baudrate == 57600
        transport.write(b"\xff out", 5)
        assert peer.read(5) == b"\xff out"
        peer.write(b"in \xff")
        data = b""
        while len(data) < 4:
            data += transport.read(5)
        assert data == b"in \xff"
        transport.close()


def test_a_rate_that_is_not_confirmed(monkeypatch):
    with lesser_server(monkeypatch, rfc2217.SET_BAUDRATE) as (server, _):
        with pytest.raises(vd.OpenError) as refused:
            open_transport(server.port + "?timeout=0.3")
        assert "did not confirm the line's rate" in refused.value.hint


def test_nothing_that_listens():
    number = free_port()
    for kind in ("rfc2217", "tcp", "socket"):
        with pytest.raises(vd.OpenError) as refused:
            open_transport(f"{kind}://127.0.0.1:{number}")
        assert "running there?" in refused.value.hint


@pytest.mark.parametrize("kind", ["rfc2217", "tcp", "socket", "socket?logging=error"])
def test_a_host_that_there_is_not(kind):
    scheme, _, options = kind.partition("?")
    with pytest.raises(vd.OpenError) as refused:
        open_transport(f"{scheme}://nowhere.invalid:5000" + (f"?{options}" if options else ""))
    assert refused.value.hint == "is the name of the host right?"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (TimeoutError("timed out"), "firewall"),
        (OSError(errno.EHOSTUNREACH, "No route to host"), "is the host on"),
        (OSError(errno.ENETUNREACH, "Network is unreachable"), "is this machine in a network"),
        (ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused"), "running there"),
        (PermissionError(errno.EACCES, "Permission denied"), None),
        (OSError(errno.EMFILE, "Too many open files"), None),
    ],
)
@pytest.mark.parametrize("scheme", ["rfc2217", "tcp"])
def test_connections_that_fail_otherwise(scheme, error, words, monkeypatch):
    def fail(*_arguments, **_named):
        raise error

    monkeypatch.setattr(socket, "create_connection", fail)
    with pytest.raises(vd.OpenError) as refused:
        open_transport(f"{scheme}://127.0.0.1:5000")
    hint = refused.value.hint
    assert hint is None if words is None else words in hint


def test_an_option_that_there_is_not_is_no_fault_of_the_server():
    with pytest.raises(vd.OpenError) as refused:
        open_transport(f"rfc2217://127.0.0.1:{free_port()}?ignore_everything")
    assert "unknown option" in str(refused.value)
    assert refused.value.hint is None


# -- DTR and RTS


def test_modem_lines_are_raised_or_left_alone(monkeypatch):
    for reset, expected in ((True, (True, True)), (False, (None, None))):
        with lesser_server(monkeypatch) as (server, _):
            transport = open_transport(server.port, reset=reset)
            eventually(lambda: (server.line.dtr, server.line.rts) == expected)  # noqa: B023
            transport.set_baud(9600)  # a round trip: nothing is under way any more
            assert (server.line.dtr, server.line.rts) == expected
            transport.close()
        assert isinstance(server.line, Rfc2217Line)


@pytest.mark.parametrize("reset", [True, False])
def test_a_tty_keeps_its_modem_lines(reset, monkeypatch):
    """Neither line is touched at opening, nor dropped at closing, which HUPCL would have done."""
    master, slave = os.openpty()
    touched = []
    for name in ("_update_dtr_state", "_update_rts_state"):
        monkeypatch.setattr(serial.Serial, name, lambda _self, name=name: touched.append(name))
    attributes = termios.tcgetattr(slave)
    attributes[2] |= termios.HUPCL
    termios.tcsetattr(slave, termios.TCSANOW, attributes)
    transport = open_transport(os.ttyname(slave), reset=reset)
    assert bool(touched) is reset
    transport.set_baud(57600)
    assert bool(touched) is reset
    transport.close()
    assert bool(termios.tcgetattr(slave)[2] & termios.HUPCL) is reset
    os.close(master)
    os.close(slave)
