"""Main loop of a live view: until its source ends or it is interrupted."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable

from voxdisplay.view.live.server import open_server
from voxdisplay.view.live.sources import Source


def run(
    source: Source,
    host: str,
    port: int,
    announce: Callable[[str], object],
    allow_origins: Iterable[str] = (),
) -> None:
    """Serve a source to browsers.

    Parameters
    ----------
    source : Source
        It is closed at the end.
    host, port
        Address to listen at; port 0 is any that is free.
    announce : callable
        Called with the URL as soon as browsers can connect.
    allow_origins : iterable of str
        Origins from `parse_origin` whose pages may watch, too.

    Raises
    ------
    OSError
        If the address is not available.
    VoxDisplayError
        The error that ended the source.

    """

    async def serve() -> None:
        async with open_server(source, host, port, allow_origins) as server:
            announce(server.url)
            await server.wait_until_ended()

    asyncio.run(serve())
