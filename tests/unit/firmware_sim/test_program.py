"""The program: its lines, its arguments, and how it ends."""

import contextlib
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from device_packets import (
    CLEAR,
    COMMIT,
    DOT,
    SHOWN,
    data,
    hello,
    parse_responses,
    receive,
)

from firmware_sim import __main__ as program
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.serve import (
    listen_tcp,
)

WAIT = 20  # seconds after which a test has failed; none takes so long

ROOT = Path(__file__).parents[3]


@contextlib.contextmanager
def started(*arguments: str, end: int = signal.SIGTERM) -> Iterator[dict[str, str]]:
    process = subprocess.Popen(
        [sys.executable, "-m", "firmware_sim", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
    )
    try:
        yield json.loads(process.stdout.readline())
        process.send_signal(end)
        out, err = process.communicate(timeout=WAIT)
        assert (process.returncode, out, err) == (0, b"", b"")
    finally:
        process.kill()
        process.communicate()


def test_the_program_on_a_pty(tmp_path: Path) -> None:
    link, picture = tmp_path / "port", tmp_path / "front.npy"
    with started(
        "--link", str(link), "--size", "3x5x7", "--refresh", "1000", "--dump", str(picture)
    ) as place:
        assert place == {"port": str(link.readlink()), "size": "3x5x7", "format": "rgb888"}
        assert not np.load(picture).any()
        host = os.open(link, os.O_RDWR | os.O_NOCTTY)
        os.write(host, b"\0" + hello() + data(0, 0, DOT, CLEAR | COMMIT))
        got = b""
        while not got or parse_responses(got)[-1].flags != SHOWN:
            got += os.read(host, 1)
            while not got.endswith(b"\0"):
                got += os.read(host, 1)
        os.close(host)
        assert np.load(picture).sum() == 3 * 255
    assert not link.is_symlink()


def test_the_program_on_tcp() -> None:
    with started(
        "--tcp", "127.0.0.1:0", "--format", "mono1", "--refresh", "0", end=signal.SIGINT
    ) as place:
        port = place["port"].removeprefix("tcp://127.0.0.1:")
        with socket.create_connection(("127.0.0.1", int(port)), WAIT) as connection:
            connection.sendall(hello() + data(0, 0, DOT, CLEAR | COMMIT))
            info, ack = receive(connection, 2)
            assert (info.nx, info.format, info.refresh) == (128, 1, 0)
            assert ack.flags == SHOWN


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--size", "3x5"], "three numbers of voxels like 128x128x128"),
        (["--size", "0x5x5"], "take sides from 1 to 65535"),
        (["--format", "rgb"], "choose from"),
        (["--refresh", "fast"], "number of hertz"),
        (["--baud", "fast"], "whole number"),
        (["--baud", "49"], "take a number from 50"),
        (["--rx-buffer", "9"], "take a number from 1101"),
        (["--fault", "flop=1"], "did you mean flip"),
        (["--features", "palette"], "palette: take of line, box"),
        (["--lie", "all"], "lie all: take of grid"),
        (["--seed", "x"], "whole number"),
        (["--tcp", "5000"], "HOST:PORT like 127.0.0.1:5000"),
        (["--tcp", "localhost:99999"], "HOST:PORT like 127.0.0.1:5000"),
        (["--tcp", "0.0.0.0:0"], "--allow-remote"),
        (["--tcp", "127.0.0.1:0", "--pty"], "not allowed with"),
        (["--tcp", "127.0.0.1:0", "--link", "x"], "leave out --tcp"),
        (["--usbip", "127.0.0.1:0", "--link", "x"], "leave out --tcp and --usbip"),
        (["--usbip", "here"], "HOST:PORT like 127.0.0.1:5000"),
        (["--usbip", "0.0.0.0:0"], "--allow-remote"),
        (["--usb-class", "vendor"], "--usb-class is for --usbip"),
        (["--dump", "/nowhere/at/all.npy"], "/nowhere"),
        (["--link", "/nowhere/at/all"], "/nowhere"),
    ],
)
def test_bad_arguments_are_refused_with_the_remedy(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        program.main(arguments)
    assert end.value.code == 2
    assert message in capsys.readouterr().err


def test_help_has_examples(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["voxdisplay-sim", "--help"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(program.__file__, run_name="__main__")
    assert end.value.code == 0
    assert "voxdisplay-sim --tcp 127.0.0.1:5000" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "port"),
    [
        (["--pty"], "/dev/"),
        (["--link", "LINK"], "/dev/"),
        (["--tcp", "127.0.0.1:0"], "tcp://127.0.0.1:"),
        (["--tcp", "[::1]:0"], "tcp://[::1]:"),
        (["--tcp", "0.0.0.0:0", "--allow-remote"], "tcp://0.0.0.0:"),
        (["--usbip", "127.0.0.1:0"], "usbip://127.0.0.1:"),
        (["--usbip", "127.0.0.1:0", "--usb-class", "cdc-acm"], "usbip://127.0.0.1:"),
    ],
)
def test_the_program_in_this_process(
    arguments: list[str],
    port: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if "[::1]:0" in arguments:
        try:
            listen_tcp("::1", 0).close()
        except OSError:
            pytest.skip("no IPv6 here")
    announce = program._announce

    def announce_and_end(*place: object) -> None:
        announce(*place)
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(program, "_announce", announce_and_end)
    arguments = [str(tmp_path / "port") if a == "LINK" else a for a in arguments]
    before = signal.getsignal(signal.SIGTERM)
    assert program.main(arguments) == 0
    assert signal.getsignal(signal.SIGTERM) is before
    assert json.loads(capsys.readouterr().out)["port"].startswith(port)
    assert list(tmp_path.iterdir()) == []


def test_a_picture_that_cannot_be_dumped_does_not_stop_the_device(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device = Device(Config((3, 5, 7), refresh=0))
    folder = tmp_path / "pictures"
    folder.mkdir()
    program._dump_swaps(device, folder / "front.npy")
    device.receive(hello() + data(0, 0, DOT, CLEAR | COMMIT))
    assert np.load(folder / "front.npy")[0, 0, 0].tolist() == [255, 255, 255]
    (folder / "front.npy").unlink()
    folder.rmdir()
    device.receive(data(1, 1, b"", CLEAR | COMMIT))
    assert "not dumped" in capsys.readouterr().err
    assert device.swaps == 2
