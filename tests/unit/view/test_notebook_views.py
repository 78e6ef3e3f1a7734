"""Widgets of notebooks without a notebook: what they hold, and how a live view is fed."""

import base64
import json
import re
import threading
import zlib
from dataclasses import replace

import pytest

import voxdisplay as vd
from voxdisplay.errors import TransportClosed
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.view.camera import Camera
from voxdisplay.view.film import FilmJob
from voxdisplay.view.live.snapshot_message import Snapshot, encode

pytest.importorskip("anywidget", reason="needs the extra notebook")

from voxdisplay.view.notebook import film_view, live_feed
from voxdisplay.view.notebook.film_view import film_widget
from voxdisplay.view.notebook.live_feed import LiveFeed, packed_message
from voxdisplay.view.notebook.live_view import LiveView

GRID = (3, 5, 7)
VIEW = "application/vnd.jupyter.widget-view+json"


def snapshot(number, format_="rgb888"):
    frame = vd.Frame(GRID, format_)
    frame.draw([(1, 2, number % 7)])
    return Snapshot(PixelMap(*frame.lit()), frame.grid, frame.format, number, "a & b")


def embedded(widget):
    return json.loads(re.search(r'id="embedded">(.*?)</script>', widget.page)[1])


def film_of(*numbers, fps=12.5):
    pages = [snapshot(number).page for number in numbers]
    return FilmJob(pages, vd.Grid(*GRID), vd.PixelFormat.RGB888, title="a & b", fps=fps)


def test_a_film_is_all_in_its_widget():
    held = embedded(film_widget(film_of(3, 2), None, bytes))
    assert held["cell"] is True
    assert held["fps"] == 12.5
    messages = [zlib.decompress(base64.b64decode(text)) for text in held["frames"]]
    assert messages == [encode(replace(snapshot(n), number=i)) for n, i in ((3, 1), (2, 2))]


def test_a_film_is_seen_from_where_it_is_best():
    held = embedded(film_widget(film_of(1), Camera(yaw=0.5, pitch=0.25), bytes))
    message = zlib.decompress(base64.b64decode(held["frames"][0]))
    assert b'"view": [0.5, 0.25, ' in message


def test_the_output_has_a_png_beside_the_view():
    data, _ = film_widget(film_of(1), None, lambda: b"PNG")._repr_mimebundle_()
    assert set(data) == {VIEW, "image/png", "text/plain"}
    assert base64.b64decode(data["image/png"]) == b"PNG"


def test_the_page_in_a_cell_loads_nothing():
    page = film_widget(film_of(1), None, bytes).page
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1]
    assert "default-src 'none'" in policy
    assert "connect-src 'none'" in policy


def test_of_a_film_that_is_too_large_there_is_the_beginning(monkeypatch):
    size = len(embedded(film_widget(film_of(1), None, bytes))["frames"][0])
    monkeypatch.setattr(film_view, "_MAX_CHARACTERS", 3 * size)
    with pytest.warns(RuntimeWarning, match="first [23] pictures"):
        widget = film_widget(film_of(*range(9)), None, bytes)
    assert len(embedded(widget)["frames"]) in {2, 3}
    monkeypatch.setattr(film_view, "_MAX_CHARACTERS", 1)
    assert len(embedded(film_widget(film_of(1), None, bytes))["frames"]) == 1


class Scripted:
    """A source of given snapshots; then it ends, or waits until it is closed."""

    def __init__(self, *snapshots, ends=True):
        self._snapshots, self._ends = list(snapshots), ends
        self.closed = threading.Event()

    def next(self):
        if not self._snapshots:
            if not self._ends:
                self.closed.wait()
            raise TransportClosed("it is closed\x1b[2J")
        return None, self._snapshots.pop(0)

    def close(self):
        self.closed.set()


def fed(source, monkeypatch):
    """Run a feed to its end; return what it did."""
    monkeypatch.setattr(live_feed, "_PERIOD_S", 0)
    done = []
    feed = LiveFeed(
        source,
        lambda shown, message: done.append((shown.number, zlib.decompress(message))),
        done.append,
        lambda: done.append("end"),
    )
    feed.start()
    feed._thread.join()
    return done


def test_a_feed_brings_pictures_and_says_why_it_ends(monkeypatch):
    shown = [snapshot(1), snapshot(2, "mono1")]
    *pictures, why, end = fed(Scripted(*shown), monkeypatch)
    assert pictures == [(each.number, encode(each)) for each in shown]
    assert why.startswith("it is closed")
    assert "\x1b" not in why
    assert end == "end"


def test_a_picture_that_a_server_would_drop_is_not_sent(monkeypatch):
    monkeypatch.setattr(live_feed, "_MAX_BYTES", 5)
    said, *_ = fed(Scripted(snapshot(4)), monkeypatch)
    assert said == "frame 4 is too large for a live view"


def test_a_feed_that_is_closed_says_nothing():
    done = []
    feed = LiveFeed(Scripted(ends=False), done.append, done.append, lambda: done.append("end"))
    feed.start()
    feed.close()
    assert done == []


def test_a_live_view_has_the_last_picture_and_its_state(monkeypatch):
    ended = threading.Event()
    monkeypatch.setattr(LiveView, "_end", lambda view: (view._ended.set(), ended.set()))
    view = LiveView(Scripted(snapshot(1), snapshot(2)), snapshot(0))
    assert ended.wait(60)
    assert view.widget.latest == packed_message(snapshot(2))
    assert view.widget.state.startswith("it is closed")
    data, _ = view.widget._repr_mimebundle_()
    frame = vd.Frame(GRID)
    frame.draw([(1, 2, 2)])
    assert base64.b64decode(data["image/png"]) == frame._repr_png_()
