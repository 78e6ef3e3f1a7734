"""Ports that are sinks: found by the entry points of the group ``voxdisplay.sink``.

Such an entry point is a callable that takes the whole name, and by name ``timeout_s``, ``baud`` and
``reset`` as of `open`, ``keys`` if a profile has some for it, and returns a `Sink`. Must not know
frames.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, Final, TextIO

from voxdisplay.errors import OpenError

if TYPE_CHECKING:
    from voxdisplay.display.baud import Baud
    from voxdisplay.display.connection import Clock
    from voxdisplay.display.display import Display

_GROUP: Final = "voxdisplay.sink"
# Of transports, which are opened most: for these no list of installed packages is read.
_TRANSPORTS: Final = frozenset({"sim", "tcp", "socket", "usb", "rfc2217", "hwgrep", "spy", "loop"})


@dataclass(frozen=True, slots=True)
class SinkPortSettings:
    """Arguments of `open` that concern a sink."""

    timeout_s: float
    baud: Baud
    reset: bool
    note: Callable[[str], None] | None
    capture: TextIO | None
    clock: Clock
    keys: Mapping[str, Any] | None  # of a profile, for the sink


def sink_opener(port: object, settings: SinkPortSettings) -> Callable[[], Display] | None:
    """Return a function that opens a port as a sink; None if the port is none.

    Parameters
    ----------
    port : object
        Name of a port; anything else is no sink.
    settings : SinkPortSettings

    Raises
    ------
    OpenError
        If a sink was named, and a capture was asked for.

    """
    entry = _find_entry(port) if isinstance(port, str) else None
    if entry is None:
        return None
    name = str(port)
    if settings.capture is not None:
        raise OpenError(
            f"{name}: a capture holds packets of protocol.md, and none are sent to an LED cube",
            port=name,
            hint="leave the capture out; a network analyser shows what is sent",
        )

    def opener() -> Display:
        from voxdisplay.display.sink_display import SinkDisplay  # noqa: PLC0415 - only for these
        from voxdisplay.transport.plugin import call_opener, opener_of  # noqa: PLC0415

        sink = call_opener(
            name,
            opener_of(entry),
            timeout_s=settings.timeout_s,
            baud=settings.baud,
            reset=settings.reset,
            **({"keys": settings.keys} if settings.keys else {}),
        )
        return SinkDisplay(sink, note=settings.note, clock=settings.clock)

    return opener


def _find_entry(port: str) -> EntryPoint | None:
    match = re.match(r"([a-z][a-z0-9+-]+):", port, re.IGNORECASE)
    kind = match[1].lower() if match else ""
    if not kind or kind in _TRANSPORTS:
        return None
    return next(iter(entry_points(group=_GROUP, name=kind)), None)
