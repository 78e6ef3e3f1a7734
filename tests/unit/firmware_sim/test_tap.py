"""Tap, by its own description alone, and the start of viewers."""

import contextlib
import errno
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from device_packets import CLEAR, COMMIT, DOT, data, hello

from firmware_sim import command_line, serve
from firmware_sim import tap as tap_module
from firmware_sim import viewer as viewers
from firmware_sim.__main__ import main
from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.tap import Tap

WAIT = 20  # seconds after which a test has failed; none takes so long
ROOT = Path(__file__).parents[3]
NOTHING = b"\xff" * 6
HEADER = struct.Struct("<4sHHHHHHIIIIII")


def device(**config: object) -> Device:
    return Device(Config((3, 5, 7), **{"refresh": 0, "boot": 0x1234, **config}))


@contextlib.contextmanager
def tapped(device: Device) -> Iterator[Tap]:
    with Tap(device) as tap:
        device.on_swap = tap.notify_swap
        yield tap


def watch(tap: Tap) -> socket.socket:
    host, port = tap.address.split(":")
    return socket.create_connection((host, int(port)), WAIT)


def take(watcher: socket.socket, size: int = 3 * 5 * 7 * 3) -> tuple[tuple, bytes]:
    got = b""
    while len(got) < HEADER.size + size:
        piece = watcher.recv(65_536)
        assert piece, "cut off"
        got += piece
    assert len(got) == HEADER.size + size
    return HEADER.unpack(got[: HEADER.size]), got[HEADER.size :]


def until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + WAIT
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.001)


def question(header: tuple) -> bytes:
    return struct.pack("<HI", header[1], header[7])


def test_the_header_is_as_it_is_written() -> None:
    assert HEADER.size == 40
    watched = device(pixel_format="rgb565")
    watched.receive(hello() + data(200, 0, DOT) + b"\x05nonsense, and long\0")
    with tapped(watched) as tap, watch(tap) as watcher:
        watcher.sendall(NOTHING)
        header, page = take(watcher, 3 * 5 * 7 * 2)
    packets, refused = sum(watched.taken_by_type.values()), sum(watched.errors_by_code.values())
    assert (packets, refused, watched.damaged) == (2, 1, 1)
    assert header == (b"VXT1", 0x1234, 0xFFFF, 3, 5, 7, 3, 0, 0, packets, refused, 1, 0)
    assert page == bytes(3 * 5 * 7 * 2)


def test_a_palette_comes_behind_its_page() -> None:
    watched = device(pixel_format="index8")
    watched.receive(hello() + data(0, 0, b"\x06\x03\x00\x01\x02\x04", CLEAR | COMMIT))
    with tapped(watched) as tap, watch(tap) as watcher:
        watcher.sendall(NOTHING)
        _, page = take(watcher, 3 * 5 * 7 + 256 * 3)
    shown = Bench(watched).snapshot()
    assert page == shown.pixels + shown.palette
    assert page[105 + 9 : 105 + 12] == b"\x01\x02\x04"


def test_a_large_page_comes_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tap_module, "_SEND_BYTES", 100_000)
    watched = Device(Config((64, 64, 64), refresh=0))
    watched.receive(hello() + data(0, 0, b"\x02\x3e\x3f\x3f" + DOT, CLEAR | COMMIT))
    with tapped(watched) as tap, watch(tap) as watcher:
        watcher.sendall(NOTHING)
        _, page = take(watcher, 64**3 * 3)
    assert page == Bench(watched).snapshot().pixels
    assert page.strip(b"\0")


def test_a_watcher_gets_the_newest_picture_and_none_twice() -> None:
    watched = device()
    watched.receive(hello())
    with tapped(watched) as tap, watch(tap) as watcher:
        watcher.sendall(NOTHING)
        header, page = take(watcher)
        assert page == bytes(315)
        for number in range(3):
            watched.receive(data(number, number, DOT, CLEAR | COMMIT))
        watcher.sendall(question(header))
        header, page = take(watcher)
        shown = Bench(watched).snapshot()
        assert (header[1:3], header[7:9]) == ((0x1234, 2), (3, shown.digest))
        assert page == shown.pixels != bytes(315)
        watcher.sendall(question(header))
        watcher.settimeout(0.05)
        with pytest.raises(TimeoutError):
            watcher.recv(1)
        watcher.settimeout(WAIT)
        watched.receive(data(3, 3, b"", CLEAR | COMMIT))
        header, page = take(watcher)
        assert (header[2], header[7], page) == (3, 4, bytes(315))


def test_a_restarted_device_shows_another_picture() -> None:
    watched = device()
    with tapped(watched) as tap, watch(tap) as watcher:
        watcher.sendall(NOTHING)
        header, _ = take(watcher)
        watcher.sendall(question(header))
        Bench(watched).power_cycle()
        header, _ = take(watcher)
        assert (header[1], header[7]) == (0x1235, 0)


def test_who_asks_out_of_turn_is_cut_off_and_the_next_is_served() -> None:
    with tapped(device()) as tap:
        with watch(tap) as watcher:
            watcher.sendall(NOTHING)
            header, _ = take(watcher)
            watcher.sendall(question(header) * 2)
            with contextlib.suppress(ConnectionResetError):  # as rude as what was asked
                assert watcher.recv(1) == b""
        with watch(tap) as watcher:
            watcher.sendall(b"\x01")
            watcher.shutdown(socket.SHUT_WR)
            assert watcher.recv(1) == b""
        with watch(tap) as watcher:
            watcher.sendall(NOTHING)
            take(watcher)


@pytest.mark.parametrize("asked", [b"", NOTHING, b"\x34\x12\0\0\0\0"])
def test_closing_ends_it_whatever_it_waits_for(asked: bytes) -> None:
    tap = Tap(device())
    with watch(tap) as watcher:
        watcher.sendall(asked)
        if asked == NOTHING:
            take(watcher)
        else:
            until(lambda: tap._connection is not None and (tap._waiting or not asked))
        tap.close()
        tap.close()
        assert watcher.recv(1) == b""
    with pytest.raises(ConnectionRefusedError):
        watch(tap)


def test_a_watcher_that_does_not_read_holds_up_nobody() -> None:
    big = Device(Config((128, 128, 128), refresh=0))
    with tapped(big) as tap, watch(tap) as watcher:
        watcher.sendall(NOTHING)
        big.receive(hello() + data(0, 0, DOT, CLEAR | COMMIT))
        assert big.swaps == 1
        watcher.recv(1)
    assert not tap._thread.is_alive()


def test_of_two_hundred_that_do_not_read_one_is_sent_a_page(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The others stand in the system's queue, and cost the device nothing."""
    looks, look = [], Tap._capture
    monkeypatch.setattr(Tap, "_capture", lambda tap: looks.append(tap) or look(tap))
    big = Device(Config((128, 128, 128), refresh=0))
    big.receive(hello())
    with tapped(big) as tap, contextlib.ExitStack() as stack:
        threads = threading.active_count()
        stack.enter_context(watch(tap)).sendall(NOTHING)
        until(lambda: bool(looks))
        host, port = tap.address.split(":")
        for _ in range(199):
            watcher = stack.enter_context(socket.socket())
            watcher.setblocking(False)
            watcher.connect_ex((host, int(port)))
            with contextlib.suppress(OSError):  # not connected: the queue is short
                watcher.send(NOTHING)
        for number in range(20):
            big.receive(data(number, number, DOT, CLEAR | COMMIT))
        assert big.swaps == 20
        assert threading.active_count() == threads
        assert len(looks) == 1


def test_a_bell_that_rings_already_is_not_waited_for() -> None:
    class Full:
        def send(self, _data: bytes) -> None:
            raise BlockingIOError

    with tapped(device()) as tap:
        ringer, tap._ringer = tap._ringer, Full()
        tap._wake()
        tap._ringer = ringer


def test_no_picture_is_torn() -> None:
    """While somebody looks, pages are not exchanged; and nobody looks while they are."""
    watched = device()
    watched.receive(hello())
    done = []
    acts = (
        lambda: Bench(watched).snapshot(),
        lambda: watched.receive(data(0, 0, DOT, CLEAR | COMMIT)),
        lambda: Bench(watched).power_cycle(),
    )
    for act in acts:
        with watched.page_lock:
            thread = threading.Thread(target=lambda act=act: done.append(act()))
            thread.start()
            thread.join(0.02)
            assert thread.is_alive()
        thread.join(WAIT)
        assert not thread.is_alive()
    assert len(done) == len(acts)


def test_a_bell_without_a_swap_is_no_harm() -> None:
    watched = device()
    watched.receive(hello())
    with tapped(watched) as tap, watch(tap) as watcher:
        watcher.sendall(struct.pack("<HI", 0x1234, 0))
        for number in range(20):
            until(lambda: tap._waiting)
            tap.notify_swap()
            if number == 19:
                watched.receive(data(0, 0, DOT, CLEAR | COMMIT))
        assert take(watcher)[0][7] == 1


# The viewer


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


def test_a_watcher_for_which_no_descriptor_is_left_is_served_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The thread of the tap survives that the process has too many files open."""
    failures = iter([OSError(errno.EMFILE, "Too many open files"), ConnectionAbortedError()])
    accept = socket.socket.accept

    def fail_twice(listener: socket.socket) -> tuple[socket.socket, object]:
        for error in failures:
            raise error
        return accept(listener)

    monkeypatch.setattr(serve.socket.socket, "accept", fail_twice)
    monkeypatch.setattr(serve, "_ACCEPT_RETRY_S", 0.01)
    with tapped(device()) as tap, watch(tap) as watcher:
        watcher.sendall(NOTHING)
        assert take(watcher)[0][0] == b"VXT1"
    assert next(failures, None) is None


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
