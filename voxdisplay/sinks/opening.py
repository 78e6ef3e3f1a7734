"""Entry points of the group ``voxdisplay.sink``: LED cubes by the name of a port.

``artnet://host[:port]?size=16x16x16&...``, likewise ``sacn``, ``ddp``, ``opc`` and ``wled``, and
``adalight:DEVICE?size=...``. Must not know frames or displays.
"""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any, Final
from urllib.parse import parse_qsl, urlsplit

from voxdisplay.errors import OpenError
from voxdisplay.sinks import adalight, artnet, ddp, opc, sacn, wled
from voxdisplay.sinks.led_sink import Encoder, LedSink
from voxdisplay.sinks.outputs import SerialOutput, TcpOutput, UdpOutput
from voxdisplay.sinks.settings import LAYOUT_KEYS, MAX_FPS, SinkSettings

NO_KEYS: Final[Mapping[str, Any]] = MappingProxyType({})

_UNIVERSE_KEYS: Final = ("universe", "pixels", "address", "sync", "broadcast")


def open_artnet(
    port: str, *, timeout_s: float, keys: Mapping[str, Any] = NO_KEYS, **unused: Any
) -> LedSink:
    """Open ``artnet://host[:6454]?size=...``.

    Parameters
    ----------
    port : str
    timeout_s : float
        How long resolving the name, connecting, and each frame may take.
    keys : mapping
        Settings besides those of the name, which win over them: as of `SinkSettings.from_mapping`.
    **unused
        ``baud`` and ``reset``, of serial lines.

    Raises
    ------
    OpenError
        If the name is wrong, or there is no such receiver.

    """
    del unused
    host, number, settings = _parse(port, artnet.PORT, _UNIVERSE_KEYS, keys)
    with _open_errors(port):
        encoder = artnet.ArtNetEncoder(settings, _first_sequence())
    return _udp(port, host, number, settings, artnet.NAME, encoder, timeout_s)


def open_sacn(
    port: str, *, timeout_s: float, keys: Mapping[str, Any] = NO_KEYS, **unused: Any
) -> LedSink:
    """Open ``sacn://host[:5568]?size=...``: see `open_artnet`.

    With a multicast address each universe is sent to its own group.
    """
    del unused
    host, number, settings = _parse(port, sacn.PORT, (*_UNIVERSE_KEYS, "priority"), keys)
    # Always the same on one machine: pictures of two identifiers would be merged by receivers.
    cid = uuid.uuid5(uuid.NAMESPACE_DNS, f"voxdisplay.{uuid.getnode():012x}").bytes
    with _open_errors(port):
        encoder = sacn.SacnEncoder(settings, cid, sequence=_first_sequence())
    groups = [sacn.multicast_group(universe) for universe in encoder.universes]
    return _udp(port, host, number, settings, sacn.NAME, encoder, timeout_s, groups)


def open_ddp(
    port: str, *, timeout_s: float, keys: Mapping[str, Any] = NO_KEYS, **unused: Any
) -> LedSink:
    """Open ``ddp://host[:4048]?size=...``: see `open_artnet`."""
    del unused
    host, number, settings = _parse(port, ddp.PORT, ("offset", "broadcast"), keys)
    return _udp(port, host, number, settings, ddp.NAME, ddp.DdpEncoder(settings), timeout_s)


def open_wled(
    port: str, *, timeout_s: float, keys: Mapping[str, Any] = NO_KEYS, **unused: Any
) -> LedSink:
    """Open ``wled://host[:21324]?size=...``: see `open_artnet`."""
    del unused
    host, number, settings = _parse(port, wled.PORT, ("offset", "hold", "broadcast"), keys)
    with _open_errors(port):
        encoder = wled.WledEncoder(settings)
    return _udp(port, host, number, settings, wled.NAME, encoder, timeout_s)


def open_opc(
    port: str, *, timeout_s: float, keys: Mapping[str, Any] = NO_KEYS, **unused: Any
) -> LedSink:
    """Open ``opc://host[:7890]?size=...``: see `open_artnet`."""
    del unused
    host, number, settings = _parse(port, opc.PORT, ("channel", "pixels"), keys)
    with _open_errors(port):
        encoder = opc.OpcEncoder(settings)
    output = TcpOutput(port, host, number, timeout_s=timeout_s)
    return LedSink(port, opc.NAME, settings, encoder, output)


def open_adalight(
    port: str, *, timeout_s: float, baud: int | str, reset: bool, keys: Mapping[str, Any] = NO_KEYS
) -> LedSink:
    """Open ``adalight:DEVICE?size=...``.

    Parameters
    ----------
    port : str
    timeout_s, keys
        As of `open_artnet`.
    baud : int
        Bits per second of the line.
    reset : bool
        As of `SerialTransport`.

    Raises
    ------
    OpenError
        If the name is wrong, or the port cannot be opened.

    """
    device, _, query = port.partition(":")[2].partition("?")
    if not isinstance(baud, int):
        raise OpenError(
            f"{port}: no rate can be found out, as nothing answers",
            port=port,
            hint="name the board's rate, such as --baud 500000",
        )
    if not device:
        raise OpenError(
            f"{port} names no serial port",
            port=port,
            hint="such as adalight:/dev/ttyUSB0?size=8x8x8",
        )
    settings = _settings(port, query, (), keys)
    with _open_errors(port):
        encoder = adalight.AdalightEncoder(settings)
    output = SerialOutput(
        device, baud=baud, reset=reset, timeout_s=timeout_s, greeting=adalight.GREETING
    )
    return LedSink(port, adalight.NAME, settings, encoder, output)


def _udp(
    port: str,
    host: str,
    number: int,
    settings: SinkSettings,
    protocol: str,
    encoder: Encoder,
    timeout_s: float,
    groups: Iterable[str] = (),
) -> LedSink:
    output = UdpOutput(
        port, host, number, broadcast=settings.broadcast, groups=list(groups), timeout_s=timeout_s
    )
    return LedSink(port, protocol, settings, encoder, output)


def _parse(
    port: str, default: int, known: Iterable[str], keys: Mapping[str, Any]
) -> tuple[str, int, SinkSettings]:
    """Return host, port number and settings of a URL."""
    scheme = port.partition(":")[0]
    hint = f"write it like {scheme}://192.168.1.50?size=16x16x16"
    try:
        url = urlsplit(port)
        host, number = url.hostname, url.port
    except ValueError as error:
        raise OpenError(f"{port}: {error}", port=port, hint=hint) from error
    if not host or number == 0 or url.path not in {"", "/"} or url.fragment or "@" in url.netloc:
        raise OpenError(f"{port} names no receiver", port=port, hint=hint)
    return host, number or default, _settings(port, url.query, known, keys)


def _settings(port: str, query: str, known: Iterable[str], keys: Mapping[str, Any]) -> SinkSettings:
    with _open_errors(port):
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
        values = dict(pairs)
        if len(values) < len(pairs):
            raise ValueError("a key is named twice")
        return SinkSettings.from_mapping({**keys, **values}, (*LAYOUT_KEYS, *known))


@contextmanager
def _open_errors(port: str) -> Iterator[None]:
    """Have a `ValueError` raised as an `OpenError` of a port."""
    try:
        yield
    except ValueError as error:
        raise OpenError(
            f"{port}: {error}", port=port, hint="docs/led-hardware.md lists the keys"
        ) from error


def _first_sequence() -> int:
    """Return a sequence number that is ahead of those of earlier programs.

    Receivers drop packets whose number they have just seen. No program sends more than `MAX_FPS`
    frames a second, so numbers that begin by the time of day are behind those of the next one.
    """
    return int(time.time() * MAX_FPS)
