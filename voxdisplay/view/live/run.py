"""Runs a live view until its source ends or somebody stops it."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable

from voxdisplay.view.live.server import open_server
from voxdisplay.view.live.sources import Source


def run(source: Source, host: str, port: int, announce: Callable[[str], object]) -> None:
    """Serve a source to browsers.

    Parameters
    ----------
    source : Source
        It is closed in the end.
    host, port
        Where to listen; port 0 is any that is free.
    announce : callable
        Called with the URL as soon as browsers can come.

    Raises
    ------
    OSError
        If the address cannot be had.
    VoxDisplayError
        What ended the source.

    """

    async def serve() -> None:
        async with open_server(source, host, port) as server:
            announce(server.url)
            await server.ended()

    asyncio.run(serve())


def parse_address(text: str) -> tuple[str, int]:
    """Read HOST:PORT, with an IPv6 number in brackets.

    Raises
    ------
    ValueError
        If it is none.

    """
    match = re.fullmatch(r"\[?([^\[\]]+?)\]?:(\d{1,5})", text)
    if not match or int(match[2]) > 0xFFFF:
        raise ValueError(f"{text!r} is no address: write HOST:PORT like 127.0.0.1:8000")
    return match[1], int(match[2])
