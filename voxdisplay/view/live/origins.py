"""Origin check of the live view: the headers Host and Origin, against cross-site requests.

A page of another site can open a WebSocket here, and a name of an attacker can point here (DNS
rebinding). So only pages of this server are answered, by its own name or by a number, and those
that its user allows: behind a reverse proxy both headers are the proxy's. Knows no server.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterable
from urllib.parse import urlsplit

from voxdisplay.printable_text import printable

_ANY = "*"


def parse_origin(text: str) -> str:
    """Return an origin as a browser sends it: SCHEME://HOST[:PORT], HOST[:PORT], or ``*``.

    There are no patterns and no lists: ``*`` is all origins, and nothing else.

    Raises
    ------
    ValueError
        If it is none.

    """
    origin = text.strip().rstrip("/").lower()
    if origin == _ANY:
        return origin
    match = re.fullmatch(r"(?:(https?)://)?([^\s/?#@,*]*[^\s/?#@,*:])", origin)
    try:
        url = urlsplit(f"//{match[2]}") if match else None
        host, port = (url.hostname, url.port) if url else (None, None)
        if host and not host.isascii():  # browsers send xn--...
            host = host.encode("idna").decode()
    except ValueError:
        host = None
    if not match or not host:
        raise ValueError(
            f"{printable(text)!r} is no origin: write it like https://cube.example.com, "
            "http://192.168.1.5:8080 or cube.example.com"
        )
    if port == {"http": 80, "https": 443}.get(match[1]):
        port = None  # browsers leave it out
    name = f"[{host}]" if ":" in host else host
    scheme = f"{match[1]}://" if match[1] else ""
    return f"{scheme}{name}" + (f":{port}" if port is not None else "")


class OriginCheck:
    """The pages that a server answers.

    Parameters
    ----------
    name : str
        Name or number that the server listens at.
    allowed : iterable of str
        Origins from `parse_origin` that are answered besides.

    """

    def __init__(self, name: str, allowed: Iterable[str] = ()) -> None:
        self._allowed = frozenset(allowed)
        self._names = {"localhost", name.lower()}
        self._names |= {_host_name(origin.rpartition("://")[2]) for origin in self._allowed}

    def host_refusal(self, host: str) -> str | None:
        """Return why a request for a host is refused; None if it is not.

        A number is accepted: only a name can be made to point here by somebody else. The port is
        not compared, so that a tunnel (``ssh -L``) may have another one.
        """
        name = _host_name(host)
        if name in self._names or _ANY in self._allowed or _is_number(name):
            return None
        if not name:
            return "a request without a valid Host header is not answered"
        return (
            f"this view is not known by the name {printable(name)}; "
            f"to serve it there, start it with --allow-origin {printable(host)}"
        )

    def origin_refusal(self, origin: str | None, host: str) -> str | None:
        """Return why a page of an origin may not watch; None if it may. Programs send no origin."""
        if origin is None or origin in (f"http://{host}", f"https://{host}"):
            return None
        if self._allowed & {_ANY, origin.lower(), origin.lower().rpartition("://")[2]}:
            return None
        return (
            f"pages of {printable(origin)} may not watch this display; "
            f"to allow them, start the view with --allow-origin {printable(origin)}"
        )


def _host_name(host: str) -> str:
    """Return the name in HOST[:PORT], in lower case; empty if there is none."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _is_number(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
