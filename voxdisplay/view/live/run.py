"""Runs a live view until its source ends or somebody stops it."""

from __future__ import annotations

import asyncio
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
            await server.wait_until_ended()

    asyncio.run(serve())
