"""Viewers of the emulator: how they are started and ended."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from firmware_sim import command_line
from firmware_sim import viewer as viewers
from firmware_sim.__main__ import main
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.tap import Tap

WAIT = 20  # seconds after which a test has failed; none takes so long
ROOT = Path(__file__).parents[3]


def device() -> Device:
    return Device(Config((3, 5, 7), refresh=0))


def install(monkeypatch: pytest.MonkeyPatch, folder: Path, text: str | None) -> None:
    """Install a module as the only viewer; None for no viewer at all."""
    entries = []
    if text is not None:
        (folder / "a_viewer.py").write_text(textwrap.dedent(text))
        monkeypatch.setenv("PYTHONPATH", str(folder))
        entries = [EntryPoint("browser", "a_viewer", viewers.GROUP)]
    monkeypatch.setattr(viewers, "entry_points", lambda **_: entries)


@pytest.fixture
def never() -> Iterator[int]:
    """Yield a descriptor that never becomes readable."""
    reader, writer = os.pipe()
    yield reader
    os.close(reader)
    os.close(writer)


def test_a_viewer_runs_as_long_as_it_is_wanted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, never: int
) -> None:
    install(
        monkeypatch,
        tmp_path,
        """
        import json, os, sys, time
        print(json.dumps({"url": " ".join(sys.argv[1:]) + f" {os.getpid()}"}), flush=True)
        time.sleep(60)
        """,
    )
    with Tap(device()) as tap, viewers.viewer(tap, "127.0.0.1:0", "a title", never) as url:
        told, _, number = url.rpartition(" ")
        assert told == f"--tap {tap.address} --listen 127.0.0.1:0 --title a title"
        os.kill(int(number), 0)
    with pytest.raises(ProcessLookupError):
        os.kill(int(number), 0)


def test_a_viewer_is_told_the_origins(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, never: int
) -> None:
    install(monkeypatch, tmp_path, 'import json, sys; print(json.dumps({"url": sys.argv[-3:]}))')
    with (
        Tap(device()) as tap,
        viewers.viewer(tap, "127.0.0.1:0", "", never, ["a.example", "b.example"]) as url,
    ):
        assert url == "['a.example', '--allow-origin', 'b.example']"


def test_a_viewer_that_ends_without_a_word(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, never: int
) -> None:
    install(monkeypatch, tmp_path, "")
    with (
        Tap(device()) as tap,
        pytest.raises(viewers.ViewerError, match="a_viewer did not start"),
        viewers.viewer(tap, "127.0.0.1:0", "", never),
    ):
        pass


def test_a_viewer_is_not_waited_for_when_it_is_time_to_stop(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    install(monkeypatch, tmp_path, "import time; time.sleep(60)")
    stop, stopper = os.pipe()
    os.write(stopper, b"\0")
    with Tap(device()) as tap, viewers.viewer(tap, "127.0.0.1:0", "", stop) as url:
        assert not url
    os.close(stop)
    os.close(stopper)


@pytest.mark.parametrize("line", ["", "oops", '["url"]', '{"place": 1}'])
def test_a_viewer_that_does_not_start(
    line: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, never: int
) -> None:
    install(monkeypatch, tmp_path, f"print({line!r})")
    with (
        Tap(device()) as tap,
        pytest.raises(viewers.ViewerError, match="a_viewer did not start"),
        viewers.viewer(tap, "127.0.0.1:0", "", never),
    ):
        pass


def test_a_signal_ends_the_program_while_a_viewer_has_not_started(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    install(
        monkeypatch,
        tmp_path,
        """
        import os, signal, time
        os.kill(os.getppid(), signal.SIGTERM)
        time.sleep(60)
        """,
    )
    assert main(["--size", "3x5x7", "--view"]) == 0
    assert json.loads(capsys.readouterr().out)["view"] == ""


def test_a_viewer_that_does_not_end_is_ended(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, never: int
) -> None:
    install(
        monkeypatch,
        tmp_path,
        """
        import signal, time
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        print('{"url": ""}', flush=True)
        time.sleep(60)
        """,
    )
    monkeypatch.setattr(viewers, "_WAIT_S", 0.05)
    began = time.monotonic()
    with Tap(device()) as tap, viewers.viewer(tap, "127.0.0.1:0", "", never):
        pass
    assert time.monotonic() - began < WAIT


def test_without_a_viewer_the_program_says_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    install(monkeypatch, tmp_path, None)
    assert main(["--size", "3x5x7", "--view"]) == 2
    assert "no viewer is installed: pip install 'voxdisplay[view]'" in capsys.readouterr().err


def test_the_program_shows_itself_here_only(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--size", "3x5x7", "--view", "0.0.0.0:0"]) == 2
    assert "anyone who reaches 0.0.0.0 could look on" in capsys.readouterr().err
    install(
        monkeypatch,
        tmp_path,
        """
        import json, sys, time
        print(json.dumps({"url": sys.argv[4]}), flush=True)
        time.sleep(60)
        """,
    )
    announce = command_line._announce

    def announce_and_end(place: dict[str, str]) -> None:
        announce(place)
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(command_line, "_announce", announce_and_end)
    dump = tmp_path / "front.npy"
    for arguments, address in (([], "127.0.0.1:0"), (["[::1]:5"], "[::1]:5")):
        command = ["--size", "3x5x7", "--dump", str(dump), "--view", *arguments]
        assert main(command) == 0
        assert json.loads(capsys.readouterr().out)["view"] == address


def test_a_device_that_is_killed_takes_its_viewer_with_it() -> None:
    """The viewer that this project brings: the tap ends, and so does it."""
    process = subprocess.Popen(
        [sys.executable, "-m", "firmware_sim", "--size", "3x5x7", "--view"],
        stdout=subprocess.PIPE,
        cwd=ROOT,
    )
    try:
        url = json.loads(process.stdout.readline())["view"]
    finally:
        process.kill()
        process.communicate()
    host, port = url.removeprefix("http://").rstrip("/").split(":")
    for _ in range(WAIT * 20):
        with contextlib.suppress(OSError):
            socket.create_connection((host, int(port)), WAIT).close()
            time.sleep(0.05)
            continue
        break
    else:
        raise AssertionError("it is still there")
