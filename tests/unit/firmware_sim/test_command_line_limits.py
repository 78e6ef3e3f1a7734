"""``voxdisplay-sim``: ports in use, and limits of the system."""

import contextlib
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from device_packets import (
    INFO,
    hello,
    receive,
)
from emulator_program import ROOT, WAIT, exit_code

from firmware_sim import __main__ as entry
from firmware_sim import command_line, serve
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.serve import listen_tcp, serve_tcp


def test_a_port_in_use_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with listen_tcp("127.0.0.1", 0) as listener:
        port = listener.getsockname()[1]
        for kind in ("--tcp", "--usbip"):
            assert exit_code([kind, f"127.0.0.1:{port}"]) == 2
            err = capsys.readouterr().err
            assert f"cannot listen on 127.0.0.1 port {port}: it is in use" in err


def test_connections_are_accepted_again_when_descriptors_are_free(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The device goes on when the process has too many files open, and when a client has gone."""
    failures = iter([OSError(24, "Too many open files"), ConnectionAbortedError()])
    accept = socket.socket.accept

    def fail_twice(listener: socket.socket) -> tuple[socket.socket, object]:
        for error in failures:
            raise error
        return accept(listener)

    monkeypatch.setattr(socket.socket, "accept", fail_twice)
    monkeypatch.setattr(serve, "_ACCEPT_RETRY_S", 0.01)
    stop, stopper = os.pipe()
    wire = DeviceOnLine(Device(Config((3, 5, 7))))
    with listen_tcp("127.0.0.1", 0) as listener:
        server = threading.Thread(target=serve_tcp, args=(wire, listener, stop))
        server.start()
        try:
            with socket.create_connection(listener.getsockname(), WAIT) as connection:
                connection.sendall(hello())
                assert receive(connection, 1)[0].kind == INFO
        finally:
            os.write(stopper, b"\0")
            server.join(WAIT)
    os.close(stop)
    os.close(stopper)
    assert next(failures, None) is None


def test_more_open_files_than_select_takes() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < 1300:
        pytest.skip("this process may not have so many files open")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 1300), hard))
    with contextlib.ExitStack() as stack:
        stack.callback(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        files = [stack.enter_context(Path(os.devnull).open()) for _ in range(1100)]
        command = [sys.executable, "-m", "firmware_sim", "--size", "3x5x7", "--tcp", "127.0.0.1:0"]
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, cwd=ROOT, pass_fds=[file.fileno() for file in files]
        )
        stack.callback(process.communicate)
        stack.callback(process.kill)
        _, _, port = json.loads(process.stdout.readline())["port"].rpartition(":")
        with socket.create_connection(("127.0.0.1", int(port)), WAIT) as connection:
            connection.sendall(hello())
            assert receive(connection, 1)[0].kind == INFO
        process.terminate()
        assert process.wait(WAIT) == 0


def test_the_largest_grid_needs_no_memory(capsys: pytest.CaptureFixture[str]) -> None:
    with entry._stop_on_signal() as stop:
        signal.raise_signal(signal.SIGTERM)
        assert command_line.run(["--size", "2048x1024x1023"], stop) == 0
    assert json.loads(capsys.readouterr().out)["size"] == "2048x1024x1023"
    assert exit_code(["--size", "2048x1024x1024"]) == 2
    assert "take one of 2147483647 voxels or less" in capsys.readouterr().err


def test_what_is_lit_exceeds_the_memory(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(command_line, "_serve", fail)
    assert command_line.run(["--size", "3x5x7"], 0) == 2
    text = "what is lit needs more memory than there is: take a smaller --size"
    assert text in capsys.readouterr().err
