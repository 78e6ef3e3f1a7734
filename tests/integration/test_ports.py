"""Ports that are missing, busy, forbidden, silent, foreign or gone."""

import contextlib
import http.server
import os
import shutil
import signal
import socketserver
import subprocess
import sys
import threading
import tty
from pathlib import Path

import document
import pytest

import voxdisplay as vd
from voxdisplay.transport import open_transport

PAPER = "examples/paper-curve.json"


class Tty:
    """A tty with the test at its other end."""

    def __init__(self):
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        self._slave = slave

    def read_packets(self):
        """Yield header and payload of each packet that comes, until the tty is gone."""
        data = b""
        while True:
            try:
                data += os.read(self.master, 4096)
            except OSError:
                return
            *segments, data = data.split(b"\0")
            yield from (document.cobs_decode(segment)[:-4] for segment in segments if segment)

    def answer_hello(self, hello, *, major=1):
        session = hello[4:6]
        info = bytes((0x90, 0, 0, major)) + session + bytes.fromhex("01 00 00 02 03 00 05 00 07 00")
        info += bytes.fromhex("02 00 00 04 00 40 00 00 00 00 00 00 80 01 00 00 00 00 00")
        os.write(self.master, document.on_wire(info))

    def close(self):
        for descriptor in (self.master, self._slave):
            with contextlib.suppress(OSError):
                os.close(descriptor)
        self.master = self._slave = -1


@pytest.fixture
def line():
    line = Tty()
    yield line
    line.close()


def pushed(run, port, *arguments, code):
    done = run("push", PAPER, "--port", port, *arguments)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    return done.stderr


def test_a_port_that_does_not_exist(run):
    said = pushed(run, "/dev/ttyNOWHERE", code=3)
    assert "/dev/ttyNOWHERE does not exist" in said
    assert "sim:" in said


@pytest.mark.parametrize(
    "port",
    [
        "tcp://127.0.0.1:1", "TCP://127.0.0.1:1", "tcp://nonsense", "socket://127.0.0.1:1",
        "nothing://x",
    ],
)  # fmt: skip
def test_ports_that_cannot_be_opened(run, port):
    assert port in pushed(run, port, code=3)


@pytest.mark.parametrize(
    ("port", "word"), [("sim:?sise=3x5x7", "size"), ("sim:?format=rgb", "rgb888"), ("sim:x", "x")]
)
def test_emulators_that_there_are_not(run, port, word):
    assert word in pushed(run, port, code=3)


def test_a_slash_behind_a_tcp_port(run):
    assert "is the device, or the server" in pushed(run, "tcp://127.0.0.1:1/", code=3)


@pytest.mark.parametrize(
    "port",
    [
        "tcp://::1:5000", "tcp://x:99999", f"tcp://{'a' * 70}:5000", "tcp://127.0.0.1:1/x",
        "tcp://127.0.0.1:1#x",
    ],
)  # fmt: skip
def test_tcp_ports_that_are_mistyped(run, port):
    assert "write it like tcp://127.0.0.1:5000 or tcp://[::1]:5000" in pushed(run, port, code=3)


def test_a_port_that_a_script_left_empty(run):
    assert "no port was named" in pushed(run, "", code=3)


def test_a_link_that_leads_nowhere(run, tmp_path):
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    assert f"{loop} names nothing" in pushed(run, str(loop), code=3)


def test_a_rate_that_the_system_has_no_number_for(run, line):
    said = pushed(run, line.port, "--baud", "4294967295", code=3)
    assert f"{line.port} cannot be opened" in said


def test_a_busy_port(run, line):
    script = "import serial, sys; s = serial.Serial(sys.argv[1], exclusive=True); print(); input()"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", script, line.port], **pipes) as holder:
        holder.stdout.readline()
        said = pushed(run, line.port, code=3)
        assert f"{line.port} is busy: python" in said
        assert f"(process {holder.pid}) has it open" in said
        assert str(os.getpid()) not in said, "this test has it open, too, but does not keep it"
        holder.stdin.close()


def test_a_port_that_this_program_has_open_itself(line):
    busy = pytest.raises(vd.OpenError, match=r"is busy: this program itself \(process")
    with contextlib.closing(open_transport(line.port)), busy:
        vd.open(line.port)


AS_NOBODY = """
import grp, os, pwd, sys
from voxdisplay.cli import main
from voxdisplay.cli import device_commands, options
from voxdisplay.display import connect
from voxdisplay.transport import diagnosis, serial
from serial.tools import list_ports
os.setgroups([]); os.setgid(65534); os.setuid(65534)
sys.exit(main(["info", "--port", sys.argv[1]]))
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody else")
@pytest.mark.parametrize(
    ("group", "mode", "words"),
    [
        ("dialout", 0o060, ["crw-rw----", "sudo usermod -aG dialout $USER"]),
        ("dialout", 0o000, ["sudo chmod a+rw"]),
        ("root", 0o060, ["sudo chmod a+rw"]),
        (54321, 0o060, ["sudo usermod -aG 54321 $USER"]),
    ],
)
def test_a_forbidden_port(line, group, mode, words):
    try:
        shutil.chown(line.port, "root", group)
    except LookupError:
        pytest.skip(f"there is no group {group} here")
    Path(line.port).chmod(0o600 | mode)
    command = [sys.executable, "-c", AS_NOBODY, line.port]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 3, done.stderr
    assert "Traceback" not in done.stderr
    for word in [f"{line.port} may not be opened by", *words]:
        assert word in done.stderr


def test_a_pty_whose_other_end_is_dead(run, line):
    os.close(line.master)
    said = pushed(run, line.port, code=3)
    assert "no device behind it" in said or "does not exist" in said


@pytest.mark.parametrize("name", ["README.md", "tests", "/dev/null"])
def test_what_is_no_serial_port(run, name):
    assert f"{name} is no serial port" in pushed(run, name, code=3)


def test_nobody_answers(run, line):
    assert "answered HELLO" in pushed(run, line.port, "--timeout", "0.6", code=3)


def test_something_else_answers(run, line):
    def web_server():
        for _ in line.read_packets():
            os.write(line.master, b"HTTP/1.1 400 Bad Request\r\n\r\n")

    threading.Thread(target=web_server, daemon=True).start()
    assert "HTTP/1.1" in pushed(run, line.port, "--timeout", "0.6", code=3)


@contextlib.contextmanager
def server(handler):
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), handler) as server:
        server.daemon_threads = True
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield f"tcp://127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        thread.join()


class Refuses(socketserver.BaseRequestHandler):
    """A web server that does not wait for the end of a line."""

    def handle(self):
        self.request.recv(4096)
        self.request.sendall(b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n<html>")


class Greets(socketserver.BaseRequestHandler):
    def handle(self):
        self.request.sendall(b"SSH-2.0-OpenSSH_9.2p1 Debian-2\r\n")
        while self.request.recv(4096):
            pass


def test_a_web_server_that_hangs_up(run):
    with server(Refuses) as port:
        for kind in ("tcp", "socket"):
            said = pushed(run, port.replace("tcp", kind), code=3)
            assert "HTTP/1.1 400 Bad Request" in said
            assert "Something else answers there" in said


class HangsUp(socketserver.BaseRequestHandler):
    def handle(self):
        self.request.recv(4096)


def test_a_server_that_hangs_up_without_a_word(run):
    """As one does that serves one client at a time."""
    with server(HangsUp) as port:
        said = pushed(run, port, code=3)
    assert "it had not answered HELLO: is it the display's port" in said


def test_a_server_that_greets(run):
    with server(Greets) as port:
        assert "SSH-2.0-OpenSSH_9.2p1" in pushed(run, port, "--timeout", "0.6", code=3)


def test_a_web_server_that_waits_for_a_line(run):
    with server(http.server.SimpleHTTPRequestHandler) as port:
        assert "nothing came at all" in pushed(run, port, "--timeout", "0.6", code=3)


def test_a_device_of_another_major(run, line):
    def device():
        for packet in line.read_packets():
            line.answer_hello(packet, major=2)

    threading.Thread(target=device, daemon=True).start()
    assert "protocol 2" in pushed(run, line.port, code=1)


def test_a_device_that_goes_away_in_mid_push(run, line):
    def device():
        for packet in line.read_packets():
            if packet[0] >> 4 == 3:
                line.answer_hello(packet)
            else:
                line.close()

    threading.Thread(target=device, daemon=True).start()
    assert "is gone" in pushed(run, line.port, code=3)


def test_a_device_that_falls_silent_in_mid_push(run, line):
    statuses = []

    def device():
        for packet in line.read_packets():
            if packet[0] >> 4 == 3:
                statuses.append(0)  # of a session
                line.answer_hello(packet)
            elif packet[0] >> 4 == 4:
                statuses[-1] += 1

    threading.Thread(target=device, daemon=True).start()
    said = pushed(run, line.port, "--timeout", "0.8", code=3)
    assert "answers HELLO, and has sent nothing else" in said or "silent" in said
    assert 1 <= max(statuses) <= 4


def test_interrupted_in_mid_push(line):
    command = [sys.executable, "-m", "voxdisplay", "push", PAPER, "--port", line.port]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        for packet in line.read_packets():
            if packet[0] >> 4 == 3:
                line.answer_hello(packet)
            elif packet[0] >> 4 == 1:
                process.send_signal(signal.SIGINT)
                break
        _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert "interrupted" in said


def test_boot_text_and_a_late_start_are_waited_out(run, line):
    """A board that restarts when its port is opened misses the first HELLO, and talks first."""

    def device():
        os.write(line.master, b"\r\nrst:0x1 (POWERON)\r\nboot: 0x13\r\n")
        hellos = 0
        for packet in line.read_packets():
            if packet[0] >> 4 == 3 and (hellos := hellos + 1) == 3:
                line.answer_hello(packet)

    threading.Thread(target=device, daemon=True).start()
    done = run("info", "--port", line.port)
    assert done.returncode == 0, done.stderr
    assert "3x5x7" in done.stdout


def test_the_emulator_outlives_its_hosts(emulator, run):
    device = emulator("--pty", "--size", "17x64x40")
    for _ in range(3):
        assert run("push", PAPER, "--port", device.port).returncode == 0
    assert device.stop() == 0


def test_the_emulator_pulled_out_under_an_open_display(emulator):
    device = emulator("--pty", "--size", "17x64x40")
    with vd.open(device.port) as display:
        device.process.kill()
        device.process.wait()
        with pytest.raises(vd.TransportClosed):
            display.clear()
