"""``voxdisplay-sim``: output, arguments, signals and recordings."""

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
from emulator_program import ROOT, WAIT, exit_code
from recordings import Spin, write_recording

from firmware_sim import __main__ as entry
from firmware_sim import command_line, faults
from firmware_sim.__main__ import main
from firmware_sim.card_player import CardPlayer
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.in_process import open_in_process
from firmware_sim.serve import listen_tcp, serve_tcp


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
        (["--size", "64x64"], "three numbers of voxels like 128x128x128"),
        (["--refresh", "fast"], "number of hertz"),
        (["--refresh", "1e-9"], "take 0, or from 0.001"),
        (["--refresh=-1"], "take 0, or from 0.001"),
        (["--refresh", "1e9"], "take 0, or from 0.001"),
        (["--baud", "fast"], "whole number"),
        (["--baud", "49"], "take a number from 50"),
        (["--rx-buffer", "9"], "take a number from 1101"),
        (["--fault", "flop=1"], "did you mean flip"),
        (["--fault", "delay=0.1"], "write delay=SECONDS@RATE"),
        (["--fault", "reboot@0"], "write reboot=RATE or reboot@BYTES"),
        (["--fault", "side.flip=1"], "the prefix is down. (to the device) or up. (from it)"),
        (["--features", "palette"], "unknown feature 'palette': take of line, box"),
        (["--lie", "all"], "unknown lie 'all': take of grid"),
        (["--seed", "x"], "whole number"),
        (["--seed", "9" * 5000], "9...' is no whole number"),
        (["--dump", ""], "'' is no file name"),
        (["--dump", "/"], "'/' is no file name"),
        (["--link", "."], "'.' is no file name"),
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
        (["--link", "/nowhere/at/all"], "link /nowhere/at/all: No such file or directory"),
        (["--tcp", "no.such.host.invalid:1"], "no address 'no.such.host.invalid'"),
        (["--tcp", "." * 300 + ":1"], "no address '....."),
    ],
)
def test_bad_arguments_are_refused_with_the_remedy(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_code(arguments) == 2
    err = capsys.readouterr().err
    assert message in err
    assert len(err) < 500, "it is not buried in a list of all options"


def test_help_lists_examples_and_every_fault_with_its_syntax(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["voxdisplay-sim", "--help"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(entry.__file__, run_name="__main__")
    assert end.value.code == 0
    text = capsys.readouterr().out
    assert "voxdisplay-sim --tcp 127.0.0.1:5000" in text
    assert "64x64x64 or 64,64,64" in text
    assert len(faults.KINDS) == 11
    for kind in faults.KINDS:
        for form in faults.forms(kind):
            assert f"  {form} " in text or f" or {form} " in text
            written = form.replace("SECONDS", "0.1").replace("RATE", "1e-3").replace("BYTES", "9")
            assert [spec.kind for spec in faults.parse_faults(written)] == [kind]
    assert text.isascii()
    assert max(map(len, text.splitlines())) <= 100


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
    announce = command_line._announce

    def announce_and_end(*place: object) -> None:
        announce(*place)
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(command_line, "_announce", announce_and_end)
    arguments = [str(tmp_path / "port") if a == "LINK" else a for a in arguments]
    before = signal.getsignal(signal.SIGTERM)
    assert main(arguments) == 0
    assert signal.getsignal(signal.SIGTERM) is before
    assert json.loads(capsys.readouterr().out)["port"].startswith(port)
    assert list(tmp_path.iterdir()) == []


def test_a_picture_that_cannot_be_dumped_does_not_stop_the_device(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device = Device(Config((3, 5, 7), refresh=0))
    folder = tmp_path / "pictures"
    folder.mkdir()
    command_line._dump_swaps(device, folder / "front.npy")
    device.receive(hello() + data(0, 0, DOT, CLEAR | COMMIT))
    assert np.load(folder / "front.npy")[0, 0, 0].tolist() == [255, 255, 255]
    (folder / "front.npy").unlink()
    folder.rmdir()
    device.receive(data(1, 1, b"", CLEAR | COMMIT))
    assert "not dumped" in capsys.readouterr().err
    assert device.swaps == 2


# Signals


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_before_anything_is_open_ends_the_program_cleanly(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with entry._stop_on_signal() as stop:
        for _ in range(70_000 if name == "SIGINT" else 1):  # more than a pipe holds
            signal.raise_signal(getattr(signal, name))
        assert command_line.run(["--size", "3x5x7"], stop) == 0
    assert json.loads(capsys.readouterr().out)["size"] == "3x5x7"


def test_the_end_of_the_terminal_ends_the_program_and_removes_its_link(tmp_path: Path) -> None:
    with started("--link", str(tmp_path / "port"), "--size", "3x5x7", end=signal.SIGHUP):
        assert (tmp_path / "port").is_symlink()
    assert list(tmp_path.iterdir()) == []


def test_under_nohup_the_program_outlives_its_terminal() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with entry._stop_on_signal():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("size", ["3x5x7", "3,5,7", "3X5X7"])
def test_both_notations_of_sizes(size: str, capsys: pytest.CaptureFixture[str]) -> None:
    with entry._stop_on_signal() as stop:
        signal.raise_signal(signal.SIGTERM)
        assert command_line.run(["--size", size], stop) == 0
    assert json.loads(capsys.readouterr().out)["size"] == "3x5x7"
    port = open_in_process(f"sim:?size={size}")
    assert port.bench.snapshot().grid == (3, 5, 7)
    port.close()


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    """Write a recording of two frames."""
    path = tmp_path / "show.vxs"
    write_recording(path, Spin(2, "mono1"))
    return path


def test_a_recording_says_what_it_is_played_on(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_code(["--show", str(recorded)]) == 0
    out, err = capsys.readouterr()
    place = json.loads(out)
    assert (place["size"], place["format"]) == ("12x10x9", "mono1")
    assert f"{recorded}: 0 frames shown, 0 of them with another digest, 0 left out" in err


def test_recordings_that_cannot_be_played(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.vxs"
    other.write_bytes(b"GIF89a" * 100)
    for arguments, message in (
        (["--show", str(other)], f"{other}: it does not begin with INFO and META"),
        (["--show", str(tmp_path / "none.vxs")], "none.vxs: No such file"),
        (["--show", str(recorded), "--size", "3x5x7"], "leave out --size and --format"),
        (["--show", str(recorded), "--usbip", "127.0.0.1:0"], "leave out --usbip"),
    ):
        assert exit_code(arguments) == 2
        assert message in capsys.readouterr().err


def test_a_recording_is_played_without_a_connection(recorded: Path) -> None:
    device = Device(Config((12, 10, 9), "mono1", 100_000))
    stop, stopper = os.pipe()
    swaps = []

    def swapped() -> None:
        swaps.append(device.memory.front.digest)
        if len(swaps) == 2:
            os.write(stopper, b"\0")

    device.on_swap = swapped
    with recorded.open("rb") as file, listen_tcp("127.0.0.1", 0) as listener:
        wire = DeviceOnLine(device, player=CardPlayer(device, file, loop=True))
        serve_tcp(wire, listener, stop)
    os.close(stop)
    os.close(stopper)
    assert len(swaps) >= 2
