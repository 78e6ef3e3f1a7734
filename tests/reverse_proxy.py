"""A reverse proxy for tests: passes HTTP/1.1 on as nginx does, a connection for each request."""

from __future__ import annotations

import contextlib
import re
import socket
import threading

WAIT_S = 60


class ReverseProxy:
    """Forwards from a free port of 127.0.0.1 to a server, until it is closed.

    Parameters
    ----------
    url
        The server's.
    passes_upgrade
        Whether WebSockets get through; nginx by itself drops the headers for them.
    keeps_host
        Whether the server gets the browser's Host; nginx by itself replaces it by the server's.
    """

    def __init__(self, url, *, passes_upgrade=True, keeps_host=False):
        self._server = re.fullmatch(r"http://(.*):(\d+)/", url).groups()
        self._passes_upgrade, self._keeps_host = passes_upgrade, keeps_host
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        self._threads = []
        self._start(self._accept)

    def _start(self, act, *arguments):
        thread = threading.Thread(target=act, args=arguments, daemon=True)
        thread.start()
        self._threads.append(thread)

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                self._start(self._serve, self._listener.accept()[0])

    def _serve(self, browser):
        with browser, contextlib.suppress(OSError):
            browser.settimeout(WAIT_S)
            head = b""
            while b"\r\n\r\n" not in head:
                if not (data := browser.recv(4096)):
                    return
                head += data
            with socket.create_connection(self._server, WAIT_S) as server:
                server.sendall(self._rewritten(head))
                back = threading.Thread(target=pump, args=(server, browser), daemon=True)
                back.start()
                pump(browser, server)
                back.join(WAIT_S)

    def _rewritten(self, head):
        if not self._keeps_host:
            host = ":".join(self._server).encode()
            head = re.sub(rb"(?i)\r\nHost: [^\r]*", b"\r\nHost: " + host, head)
        if not self._passes_upgrade:
            head = re.sub(rb"(?i)\r\n(Upgrade|Connection): [^\r]*", b"", head)
            head = head.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n", 1)
        return head

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()


def pump(source, sink):
    """Copy bytes until one end is closed; close the other."""
    with contextlib.suppress(OSError):
        while data := source.recv(65536):
            sink.sendall(data)
    for end in (source, sink):
        with contextlib.suppress(OSError):
            end.shutdown(socket.SHUT_RDWR)
