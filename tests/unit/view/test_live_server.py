"""Server of the live view, without a browser: its responses, its pace and its end."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from collections import Counter

import numpy as np
import pytest
from live_messages import read_back
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import voxdisplay as vd
from voxdisplay.errors import TransportClosed
from voxdisplay.view.live import dropped_files
from voxdisplay.view.live.address import parse_address
from voxdisplay.view.live.server import open_server
from voxdisplay.view.live.snapshot_message import Snapshot
from voxdisplay.view.live.sources import StaticSource

WAIT = 20
GRID = vd.Grid(3, 5, 7)


@contextlib.contextmanager
def served(source, host="127.0.0.1", allow_origins=()):
    """Serve a source in a thread; yield the URL."""
    ready, place = threading.Event(), {}

    async def serve():
        async with open_server(source, host, 0, allow_origins) as server:
            place.update(url=server.url, end=asyncio.Event(), loop=asyncio.get_running_loop())
            ready.set()
            await place["end"].wait()

    thread = threading.Thread(target=asyncio.run, args=(serve(),))
    thread.start()
    assert ready.wait(WAIT)
    try:
        yield place["url"]
    finally:
        place["loop"].call_soon_threadsafe(place["end"].set)
        thread.join(WAIT)
        assert not thread.is_alive()


def still(value=7, number=1):
    page = np.full((7, 5, 3), value, np.uint8)
    return Snapshot(page, GRID, vd.PixelFormat.INDEX8, number, "still")


class Pushed:
    """A source that gives what the test hands it, and notes whether it is asked."""

    def __init__(self):
        self._has = threading.Semaphore(0)
        self._number = 0
        self._shown = 0
        self.asked = threading.Semaphore(0)
        self.push()

    def push(self):
        self._number += 1
        self._has.release()

    def next(self):
        self.asked.release()
        while self._shown == self._number:
            self._has.acquire()
        self._shown = self._number
        if self._number < 0:
            raise TransportClosed("over")
        return self._shown, still(number=self._shown)

    def resend(self):
        self._shown = 0

    def check_alive(self):
        pass

    def close(self):
        self._number = -1
        self._has.release()


def fetch(url, **headers):
    request = urllib.request.Request(url, headers=headers)  # noqa: S310 - http, here
    try:
        with urllib.request.urlopen(request, timeout=WAIT) as answer:  # noqa: S310
            return answer.status, answer.headers, answer.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.headers, error.read()


def test_what_is_served():
    with served(StaticSource(still())) as url:
        status, headers, body = fetch(url)
        assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
        assert body.startswith(b"<!doctype html>")
        assert len(body) < 60_000
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert "unsafe" not in headers["Content-Security-Policy"]
        status, headers, body = fetch(url + "frame.png")
        assert (status, body[:4]) == (200, b"\x89PNG")
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert fetch(url + "favicon.ico")[0] == 404


def test_only_its_own_names_are_answered():
    """A name that an attacker lets point here is none of them; a number cannot be."""
    with served(StaticSource(still())) as url:
        for host in (
            "evil.example",
            "evil.example:80",
            "",
            "127.0.0.1.evil.example",
            "[::1",
            "a b",
        ):
            assert fetch(url, Host=host)[0] == 403, host
        for host in ("127.0.0.1:9", "localhost:8000", "LOCALHOST", "[::1]:5", "192.168.0.7"):
            assert fetch(url, Host=host)[0] == 200, host


def test_a_request_with_two_hosts_is_refused():
    with served(StaticSource(still())) as url:
        place = urllib.parse.urlsplit(url)
        with socket.create_connection((place.hostname, place.port), WAIT) as raw:
            raw.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nHost: localhost\r\n\r\n")
            assert b" 403 " in raw.makefile("rb").readline()


def test_pages_of_other_sites_get_no_frames():
    with served(StaticSource(still())) as url:
        live = url.replace("http", "ws") + "live"
        for origin in ("http://evil.example", "null", "http://127.0.0.1:1", url.rstrip("/") + "0"):
            with pytest.raises(InvalidStatus) as refused, connect(live, origin=origin):
                pass
            assert refused.value.response.status_code == 403
        with connect(live, origin=url.rstrip("/")) as browser:
            assert read_back(browser.recv(WAIT))[0]["number"] == 1
        with connect(live) as program:
            assert program.recv(WAIT)


def test_pages_of_an_allowed_origin_get_frames():
    """Behind a reverse proxy: Host is the server's, Origin the visitor's."""
    visited = "https://cube.example.com"
    with served(StaticSource(still()), allow_origins=[visited]) as url:
        live = url.replace("http", "ws") + "live"
        with connect(live, origin=visited) as browser:
            assert read_back(browser.recv(WAIT))[0]["number"] == 1
        assert fetch(url, Host="cube.example.com")[0] == 200
        with pytest.raises(InvalidStatus), connect(live, origin="https://evil.example"):
            pass
        assert fetch(url, Host="evil.example")[0] == 403


def test_a_page_is_told_why_its_socket_is_refused():
    with served(StaticSource(still())) as url:
        status, _, body = fetch(url + "live?origin=https%3A%2F%2Fcube.example.com")
        assert status == 403
        assert b"--allow-origin https://cube.example.com" in body
        status, _, body = fetch(url + "live?origin=" + urllib.parse.quote(url.rstrip("/"), ""))
        assert status == 426
        assert b"Upgrade" in body


def test_two_frames_are_under_way_at_most_and_the_next_is_the_newest():
    source = Pushed()
    with served(source) as url, connect(url.replace("http", "ws") + "live") as browser:
        numbers = [read_back(browser.recv(WAIT))[0]["number"]]
        source.push()
        numbers.append(read_back(browser.recv(WAIT))[0]["number"])
        for _ in range(5):
            source.push()
        with pytest.raises(TimeoutError):
            browser.recv(0.05)
        browser.send("shown")
        numbers.append(read_back(browser.recv(WAIT))[0]["number"])
        assert numbers == [1, 2, 7]


def test_a_slow_browser_holds_up_nobody():
    source = Pushed()
    with served(source) as url:
        live = url.replace("http", "ws") + "live"
        with connect(live) as slow, connect(live) as quick:
            slow.recv(WAIT)
            for number in range(1, 20):
                assert read_back(quick.recv(WAIT))[0]["number"] == number
                quick.send("shown")
                source.push()


def open_and_never_read(url):
    """Become a browser that looks at nothing it is sent."""
    place = urllib.parse.urlsplit(url)
    browser = socket.create_connection((place.hostname, place.port), WAIT)
    browser.sendall(
        f"GET /live HTTP/1.1\r\nHost: {place.netloc}\r\nConnection: Upgrade\r\n"
        "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
    )
    answer = b""
    while not answer.endswith(b"\r\n\r\n"):
        answer += browser.recv(1)
    assert answer.startswith(b"HTTP/1.1 101 ")
    return browser


def test_two_hundred_that_never_read_are_sent_two_pictures_each(monkeypatch):
    sent, send = Counter(), ServerConnection.send

    def counted(browser, message):
        sent[browser] += 1
        return send(browser, message)

    monkeypatch.setattr(ServerConnection, "send", counted)
    source = Pushed()
    with served(source) as url, contextlib.ExitStack() as stack:
        for _ in range(200):
            stack.enter_context(open_and_never_read(url))
        quick = stack.enter_context(connect(url.replace("http", "ws") + "live"))
        for number in range(1, 20):
            assert read_back(quick.recv(WAIT))[0]["number"] == number
            quick.send("shown")
            source.push()
        quick.recv(WAIT)
        counts = sorted(sent.values())
    assert len(counts) == 201
    assert counts[-2:] == [2, 20]


def test_who_says_more_than_it_has_shown_is_sent_away():
    with served(StaticSource(still())) as url:
        with connect(url.replace("http", "ws") + "live") as browser:
            browser.recv(WAIT)
            for _ in range(3):
                browser.send("shown")
            with pytest.raises(ConnectionClosed):
                browser.recv(WAIT)
        assert fetch(url)[0] == 200


def test_nobody_is_asked_while_nobody_looks():
    source = Pushed()
    with served(source) as url:
        fetch(url)
        assert not source.asked.acquire(timeout=0.05)
        with connect(url.replace("http", "ws") + "live") as browser:
            browser.recv(WAIT)
        assert source.asked.acquire(timeout=WAIT)


def test_who_comes_later_sees_nothing_old():
    """What was on display when somebody last looked may be long gone."""
    source = Pushed()
    with served(source) as url:
        live = url.replace("http", "ws") + "live"
        for number in (1, 4, 7):
            with connect(live) as browser:
                assert read_back(browser.recv(WAIT))[0]["number"] == number
            assert source.asked.acquire(timeout=WAIT)
            for _ in range(3):  # the first may still be asked for, the others are not
                source.push()
                time.sleep(0.02)


def test_the_end_of_a_source_is_the_end_of_the_view():
    source = Pushed()

    def look(url):
        with connect(url.replace("http", "ws") + "live") as browser:
            browser.recv(WAIT)
            source.close()
            with pytest.raises(ConnectionClosed):
                browser.recv(WAIT)

    async def serve():
        async with open_server(source, "127.0.0.1", 0) as server:
            looking = asyncio.create_task(asyncio.to_thread(look, server.url))
            with pytest.raises(TransportClosed, match="over"):
                await server.wait_until_ended()
        await looking

    asyncio.run(asyncio.wait_for(serve(), WAIT))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "8000",
        "127.0.0.1",
        "127.0.0.1:x",
        "127.0.0.1:65536",
        "::1:5]",
        "a..b:0",
        "http://127.0.0.1:8000",
        "*:8000",
        "a b:8000",
        "x" * 70 + ":0",
    ],
)
def test_a_bad_address(text):
    with pytest.raises(ValueError, match="write HOST:PORT"):
        parse_address(text)


def test_addresses():
    assert parse_address("[::1]:80") == ("::1", 80)
    assert parse_address("localhost:0") == ("localhost", 0)


def test_a_file_takes_no_longer_than_its_time(monkeypatch):
    monkeypatch.setattr(dropped_files, "_MAX_SECONDS", 0.01)
    with pytest.raises(dropped_files.DroppedFileError, match="takes longer"):
        asyncio.run(dropped_files.frames_of_file("a.json", b"{}"))
