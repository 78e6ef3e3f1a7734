"""Server of the live view: HTTP for the page, a WebSocket for the frames.

A browser has at most two frames in flight; it acknowledges each that it has painted. So a slow one
gets fewer and a hidden one none, without an effect on others. Which pages are answered at all is
the business of `origins`. Knows sources only as `Source`, and pictures only as messages.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import ipaddress
import json
import threading
from collections.abc import AsyncIterator, Hashable, Iterable
from http import HTTPStatus
from urllib.parse import parse_qs, urlsplit

from voxdisplay.errors import MissingExtra
from voxdisplay.printable_text import printable
from voxdisplay.view.camera import Camera
from voxdisplay.view.live.dropped_files import MAX_FILE_BYTES, DroppedFileError, frames_of_file
from voxdisplay.view.live.origins import OriginCheck
from voxdisplay.view.live.page import content_security_policy, page_html
from voxdisplay.view.live.snapshot_message import Snapshot, encode
from voxdisplay.view.live.sources import Source
from voxdisplay.view.picture import RenderOptions, render_page

try:
    from websockets.asyncio.server import Server, ServerConnection, serve
    from websockets.datastructures import Headers
    from websockets.exceptions import ConnectionClosed
    from websockets.frames import CloseCode
    from websockets.http11 import Request, Response
except ModuleNotFoundError as error:
    raise MissingExtra(
        "the live view needs websockets, which is not installed",
        hint="pip install 'voxdisplay[view]'",
    ) from error

_MAX_IN_FLIGHT = 2
_IDLE_CHECK_S = 1.0  # interval of checks that the source is alive while nobody watches
_STOP_TIMEOUT_S = 2.0  # for the source's thread to end
_MAX_MESSAGE_BYTES = 1 << 16  # from a browser: acknowledgements, and pieces of a dropped file
_MAX_REASON_BYTES = 120  # of the end of a connection; the protocol allows 123
_NO_UPGRADE = (
    "the page's WebSocket did not get through: what is between must pass on the headers Upgrade "
    "and Connection, by HTTP/1.1"
)


class _LatestSnapshot:
    """The newest picture; older ones are not kept."""

    def __init__(self) -> None:
        self.serial = 0
        self.message = b""
        self.snapshot: Snapshot | None = None
        self.wanted = threading.Event()  # for the source's thread: a browser waits
        self._key: Hashable = None
        self._fresh = False  # read since a browser began to wait
        self._waiting = 0
        self._changed = asyncio.Event()

    async def wait_for_newer(self, serial: int) -> int:
        """Wait for a picture other than that of a serial number; return its serial number."""
        self._waiting += 1
        self.wanted.set()
        try:
            while self.serial == serial or not self._fresh:
                await self._changed.wait()
        finally:
            self._waiting -= 1
            if not self._waiting:
                self.wanted.clear()
        return self.serial

    def update(self, key: Hashable, snapshot: Snapshot, message: bytes) -> None:
        """Store what is on display now."""
        self._fresh = True
        if key != self._key:
            self._key, self.snapshot, self.message = key, snapshot, message
            self.serial += 1
        self._changed.set()
        self._changed = asyncio.Event()

    def mark_stale(self) -> None:
        """Note that the display is not watched: the picture may be out of date."""
        self._fresh = False


class LiveServer:
    """Serves one source to any number of browsers; made by `open_server`.

    Attributes
    ----------
    url : str
        Address for a browser.

    """

    def __init__(self, source: Source, origins: OriginCheck) -> None:
        self.url = ""
        self._origins = origins
        self._source = source
        self._latest = _LatestSnapshot()
        self._closing = False
        self._browsers: set[ServerConnection] = set()
        self._reading_file = asyncio.Lock()
        self._ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._thread = threading.Thread(
            target=self._run_source, args=(asyncio.get_running_loop(),), name="source", daemon=True
        )

    async def wait_until_ended(self) -> None:
        """Wait until the source has no more pictures; tell browsers why, and raise its error."""
        try:
            await asyncio.shield(self._ended)
        except Exception as error:
            reason = printable(str(error)).encode()[:_MAX_REASON_BYTES].decode(errors="ignore")
            closing = (each.close(CloseCode.GOING_AWAY, reason) for each in self._browsers)
            await asyncio.gather(*closing, return_exceptions=True)
            raise

    # -- the source, in its thread

    def _run_source(self, loop: asyncio.AbstractEventLoop) -> None:
        newest, source = self._latest, self._source
        try:
            while not self._closing:
                if not newest.wanted.is_set():
                    loop.call_soon_threadsafe(newest.mark_stale)
                    while not newest.wanted.wait(_IDLE_CHECK_S):
                        source.check_alive()
                    source.resend()
                key, snapshot = source.next()
                loop.call_soon_threadsafe(newest.update, key, snapshot, encode(snapshot))
        except Exception as error:  # noqa: BLE001 - raised again where somebody waits for it
            if not self._closing:
                loop.call_soon_threadsafe(self._ended.set_exception, error)

    async def _stop_source(self) -> None:
        self._closing = True
        self._latest.wanted.set()
        self._source.close()
        await asyncio.to_thread(self._thread.join, _STOP_TIMEOUT_S)

    # -- browsers

    async def _handle_request(self, _: ServerConnection, request: Request) -> Response | None:
        """Return the response to an HTTP request; None lets it become a WebSocket."""
        hosts = request.headers.get_all("Host")
        host = hosts[0] if len(hosts) == 1 else ""
        if refusal := self._origins.host_refusal(host):
            return _text_response(HTTPStatus.FORBIDDEN, refusal)
        url = urlsplit(request.path)
        match url.path:
            case "/":
                return _page_response()
            case "/frame.png":
                return await self._picture_response()
            case "/live" | "/drop":
                return self._live_response(request, host, parse_qs(url.query))
        return _text_response(HTTPStatus.NOT_FOUND, "there are / and /frame.png")

    def _live_response(
        self, request: Request, host: str, query: dict[str, list[str]]
    ) -> Response | None:
        """Let a WebSocket through, or return why it is refused.

        A script cannot see why its WebSocket failed. So it asks here by an ordinary request, which
        has no Origin header, and names its origin in the query.
        """
        asked = query.get("origin", [None])[-1]
        origin = ", ".join(request.headers.get_all("Origin")) or asked
        if refusal := self._origins.origin_refusal(origin, host):
            return _text_response(HTTPStatus.FORBIDDEN, refusal)
        if asked is not None:
            return _text_response(HTTPStatus.UPGRADE_REQUIRED, _NO_UPGRADE)
        return None

    async def _picture_response(self) -> Response:
        await self._latest.wait_for_newer(0)
        snapshot = self._latest.snapshot
        assert snapshot is not None  # noqa: S101 - there is a first one now
        return _response(HTTPStatus.OK, "image/png", await asyncio.to_thread(_png, snapshot))

    async def _serve_browser(self, browser: ServerConnection) -> None:
        """Send frames as the browser acknowledges them; answer pings; or take a dropped file."""
        assert browser.request is not None  # noqa: S101 - it has been answered
        url = urlsplit(browser.request.path)
        if url.path == "/drop":
            with contextlib.suppress(ConnectionClosed):
                await browser.send(await self._dropped(browser, parse_qs(url.query)))
            return
        room = asyncio.BoundedSemaphore(_MAX_IN_FLIGHT)
        sending = asyncio.create_task(self._send_snapshots(browser, room))
        self._browsers.add(browser)
        try:
            async for message in browser:
                if message == "ping":
                    await browser.send("pong")
                else:
                    room.release()
        except (ConnectionClosed, ValueError):  # it left, or acknowledged what it was not sent
            pass
        finally:
            self._browsers.discard(browser)
            sending.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await sending

    async def _dropped(self, browser: ServerConnection, query: dict[str, list[str]]) -> str:
        """Receive a file in pieces, of which an empty one is the end; return its frames as JSON."""
        if not _is_loopback(browser):
            return json.dumps({"error": "files are shown for browsers on the view's own computer"})
        data = bytearray()
        async for piece in browser:
            if not piece:
                break
            if len(data) <= MAX_FILE_BYTES:  # what is more is read, so that the answer is seen
                data += piece if isinstance(piece, bytes) else piece.encode()
        name = query.get("name", ["file"])[0]
        try:
            async with self._reading_file:
                return await frames_of_file(name, bytes(data))
        except DroppedFileError as error:
            return json.dumps({"error": str(error)})

    async def _send_snapshots(
        self, browser: ServerConnection, room: asyncio.BoundedSemaphore
    ) -> None:
        serial = 0
        while True:
            await room.acquire()
            serial = await self._latest.wait_for_newer(serial)
            await browser.send(self._latest.message)


@contextlib.asynccontextmanager
async def open_server(
    source: Source, host: str, port: int, allow_origins: Iterable[str] = ()
) -> AsyncIterator[LiveServer]:
    """Serve a source until the context ends.

    Parameters
    ----------
    source : Source
        It is closed at the end.
    host, port
        Address to listen at; port 0 is any that is free.
    allow_origins : iterable of str
        Origins from `parse_origin` whose pages may watch, too.

    Raises
    ------
    OSError
        If the address is not available.

    """
    live = LiveServer(source, OriginCheck(host, allow_origins))
    try:
        async with serve(
            live._serve_browser,  # noqa: SLF001 - of this module
            host,
            port,
            process_request=live._handle_request,  # noqa: SLF001
            compression=None,  # it costs more than this machine's own network
            max_size=_MAX_MESSAGE_BYTES,
            close_timeout=1,
        ) as server:
            live.url = _url(server)
            live._thread.start()  # noqa: SLF001
            yield live
    finally:
        if live._thread.ident:  # noqa: SLF001
            await live._stop_source()  # noqa: SLF001
        else:
            source.close()


def _is_loopback(browser: ServerConnection) -> bool:
    """Return whether a browser runs on this computer, and asked for it: not through a proxy."""
    assert browser.request is not None  # noqa: S101 - it has been answered
    headers = browser.request.headers
    asked = urlsplit(f"//{headers['Host']}").hostname or ""
    origins = [urlsplit(origin).hostname or "" for origin in headers.get_all("Origin")]
    names = {asked, *origins, str(browser.remote_address[0])}
    return all(name == "localhost" or _is_loopback_number(name) for name in names)


def _is_loopback_number(name: str) -> bool:
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False


def _url(server: Server) -> str:
    host, port = next(iter(server.sockets)).getsockname()[:2]
    address = ipaddress.ip_address(host)
    if address.is_unspecified:
        host = "127.0.0.1" if address.version == 4 else "::1"
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def _page_response() -> Response:
    headers = {
        "Content-Security-Policy": content_security_policy(connect="'self'")
        + "; frame-ancestors 'none'",
        "Referrer-Policy": "no-referrer",
    }
    return _response(HTTPStatus.OK, "text/html; charset=utf-8", page_html().encode(), headers)


def _text_response(status: HTTPStatus, text: str) -> Response:
    return _response(status, "text/plain; charset=utf-8", f"{text}\n".encode())


def _response(
    status: HTTPStatus, kind: str, body: bytes, headers: dict[str, str] | None = None
) -> Response:
    common = {
        "Content-Type": kind,
        "Content-Length": str(len(body)),
        "Cache-Control": "no-store",
        "Connection": "close",
        "Cross-Origin-Resource-Policy": "same-origin",
        "X-Content-Type-Options": "nosniff",
    }
    return Response(status, status.phrase, Headers(common | (headers or {})), body)


def _png(snapshot: Snapshot) -> bytes:
    out = io.BytesIO()
    options = RenderOptions(camera=snapshot.camera or Camera())
    drawn = render_page(
        snapshot.page, snapshot.grid, snapshot.format, options, palette=snapshot.palette
    )
    drawn.save(out, "PNG", compress_level=1)
    return out.getvalue()
