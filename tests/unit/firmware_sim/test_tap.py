"""Tap, by its own description alone."""

import contextlib
import errno
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from device_packets import CLEAR, COMMIT, DOT, data, hello

from firmware_sim import serve
from firmware_sim import tap as tap_module
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
