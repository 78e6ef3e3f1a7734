"""Live view without a server: messages to browsers, and sources of pictures."""

from __future__ import annotations

import socket
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from live_messages import read_back

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.tap import Tap
from voxdisplay.errors import OpenError, TransportClosed
from voxdisplay.view.live import sources
from voxdisplay.view.live.address import parse_address
from voxdisplay.view.live.page import page_html as page_text
from voxdisplay.view.live.snapshot_message import Snapshot, encode
from voxdisplay.view.live.sources import DisplaySource, TapSource

WAIT = 20
GRID = vd.Grid(3, 5, 7)


@given(
    st.sampled_from(list(vd.PixelFormat)),
    st.sampled_from([(3, 5, 7), (257, 2, 3), (1, 1, 1)]),
    st.sampled_from([0.0, 0.01, 0.5, 1.0]),
    st.integers(0, 1000),
)
def test_a_message_has_every_voxel(format_, size, density, seed):
    grid, rng = vd.Grid(*size), np.random.default_rng(seed)
    shape = format_.shape(grid.array_shape)
    top = 2 if format_ is vd.PixelFormat.MONO1 else np.iinfo(format_.dtype).max + 1
    page = rng.integers(1, top, shape).astype(format_.dtype)
    page[rng.random(grid.array_shape) >= density] = 0
    head, got = read_back(encode(Snapshot(page, grid, format_, 12, "a", 0xBEEF, {"Lost": 3})))
    assert np.array_equal(got, page)
    assert (head["number"], head["title"], head["digest"]) == (12, "a", "0000beef")
    assert head["counters"] == {"Lost": 3}


def test_a_message_has_the_palette():
    palette = vd.Frame(GRID, "index8").palette
    page = np.zeros(GRID.array_shape, np.uint8)
    plain, _ = read_back(encode(Snapshot(page, GRID, vd.PixelFormat.INDEX8, 1, "")))
    assert np.array_equal(plain["palette"], palette)
    assert plain["own"] == []
    palette[[3, 200]] = (1, 2, 3), (4, 5, 6)
    snapshot = Snapshot(page, GRID, vd.PixelFormat.INDEX8, 1, "", palette=palette)
    own, _ = read_back(encode(snapshot))
    assert np.array_equal(own["palette"], palette)
    assert own["own"] == [3, 200]


def test_the_page_stays_small():
    assert len(page_text().encode()) < 60_000


# -- sources


def test_a_tap_that_stops_in_the_middle_of_a_picture_is_an_error(monkeypatch):
    monkeypatch.setattr(sources, "_STALL_S", 0.05)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        source = TapSource(*listener.getsockname(), "a")
        with listener.accept()[0] as tap:
            tap.sendall(b"VXT1" + bytes(10))
            with pytest.raises(TransportClosed, match="in the middle of a picture"):
                source.next()
        source.close()


def test_a_tap_is_read():
    device = Device(Config(GRID, "rgb565", refresh=0, boot=9))
    with Tap(device) as tap:
        device.on_swap = tap.notify_swap
        source = TapSource(*parse_address(tap.address), "title")
        _, snapshot = source.next()
        assert (snapshot.grid, snapshot.format, snapshot.digest) == (GRID, vd.PixelFormat.RGB565, 0)
        device.memory.back.put(17, b"\x34\x12")
        with device.page_lock:
            device.memory.swap()
            device.swaps += 1
        tap.notify_swap()
        (boot, swaps), snapshot = source.next()
        assert (boot, swaps, snapshot.number, snapshot.title) == (9, 1, 1, "title")
        assert np.flatnonzero(snapshot.page).tolist() == [17]
        assert snapshot.page.flat[17] == 0x1234
        source.check_alive()
        source.resend()
        assert source.next()[0] == (9, 1)
    with pytest.raises(TransportClosed, match="is gone"):
        source.check_alive()
    with pytest.raises(TransportClosed, match="is gone"):
        source.next()
    source.close()
    with pytest.raises(OpenError, match="cannot be reached"):
        TapSource(*parse_address(tap.address), "")


def test_a_tap_brings_the_palette():
    device = Device(Config(GRID, "index8", refresh=0))
    device.memory.front.palette[9:12] = b"\x01\x02\x04"
    with Tap(device) as tap:
        source = TapSource(*parse_address(tap.address), "")
        _, snapshot = source.next()
        assert snapshot.palette[3].tolist() == [1, 2, 4]
        assert np.array_equal(snapshot.palette[4:], vd.Frame(GRID, "index8").palette[4:])
        source.close()


def test_what_is_no_tap_is_refused(tmp_path):
    del tmp_path
    with socket.create_server(("127.0.0.1", 0)) as listener:
        source = TapSource("127.0.0.1", listener.getsockname()[1], "")
        peer, _ = listener.accept()
        with peer:
            peer.sendall(b"HTTP/1.1 400 Bad Request\r\nServer: none, and more of it")
            with pytest.raises(TransportClosed, match="no tap of this version"):
                source.next()
        source.close()


class Panel:
    """A display that counts how often it is read."""

    port = "panel"

    def __init__(self, *, digest=True):
        self.page = np.zeros((7, 5, 3), np.uint8)
        self.reads = 0
        self._digest = digest

    def digest(self):
        return int(self.page.sum()) if self._digest else None

    def read(self):
        self.reads += 1
        return self.page.copy()


@pytest.mark.parametrize("digest", [True, False])
def test_a_display_is_read_when_it_shows_something_else(digest, monkeypatch):
    monkeypatch.setattr("voxdisplay.view.live.sources._FULL_READ_POLL_S", 0.001)
    monkeypatch.setattr("voxdisplay.view.live.sources._POLL_S", 0.001)
    panel = Panel(digest=digest)
    source = DisplaySource(panel, GRID, vd.PixelFormat.INDEX8, lambda: {"Bytes sent": 5})
    key, snapshot = source.next()
    assert (snapshot.number, snapshot.counters, snapshot.title) == (1, {"Bytes sent": 5}, "panel")
    threading.Timer(0.05, lambda: panel.page.fill(7)).start()
    other, snapshot = source.next()
    assert other != key
    assert snapshot.page.all()
    assert panel.reads == 2 or not digest
    source.resend()
    assert source.next()[0] == other
    source.close()
    with pytest.raises(TransportClosed):
        source.next()
