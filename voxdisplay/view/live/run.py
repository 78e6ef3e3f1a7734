"""Main loop of a live view: until its source ends or it is interrupted."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from voxdisplay.view.live.server import open_server
from voxdisplay.view.live.sources import Source

_SIGNALS: Final = ("SIGTERM", "SIGHUP")


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
    received: list[int] = []

    async def serve() -> None:
        with _cancelled_by_signals(received):
            async with open_server(source, host, port, allow_origins) as server:
                announce(server.url)
                await server.wait_until_ended()

    try:
        asyncio.run(serve())
    except asyncio.CancelledError:
        if not received:
            raise
        signal.raise_signal(received[0])  # now its own handler may raise what it likes


@contextlib.contextmanager
def _cancelled_by_signals(received: list[int]) -> Iterator[None]:
    """Have signals to end cancel the current task, which closes in order, and note them.

    An exception out of a signal's handler would hit whatever task runs, and the loop would wait
    for it in vain. SIGINT is handled like this by asyncio itself.
    """
    task = asyncio.current_task()
    assert task is not None  # noqa: S101 - it is called in one

    def cancel(number: int) -> None:
        received.append(number)
        task.cancel()

    loop = asyncio.get_running_loop()
    before: dict[int, Any] = {}
    for name in _SIGNALS:
        number = getattr(signal, name, None)  # not every system has all
        if number is not None and callable(handler := signal.getsignal(number)):
            # Where a loop takes no signals, as outside the main thread, handlers stay.
            with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
                loop.add_signal_handler(number, cancel, number)
                before[number] = handler
    try:
        yield
    finally:
        for number, handler in before.items():
            loop.remove_signal_handler(number)
            signal.signal(number, handler)
