"""``vd.open``: a display by the name of its port. Must not know frames."""

from __future__ import annotations

import io
import os
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, Literal, TextIO

from voxdisplay.argument_checks import duration, flag, function, whole_number, wrong_kind
from voxdisplay.display.baud import DEFAULT_BAUD, open_at_rate
from voxdisplay.display.connection import Clock
from voxdisplay.display.display import Display
from voxdisplay.display.reconnect import Reconnector, open_when_available
from voxdisplay.display.shared_display import TIMEOUT_S
from voxdisplay.display.sink_ports import SinkPortSettings, sink_opener
from voxdisplay.errors import ProfileError
from voxdisplay.transport import Transport

if TYPE_CHECKING:
    from voxdisplay.display.part_profile import PartProfile
    from voxdisplay.display.profile import DisplayProfile

DEFAULT_PORT: Final = "sim:"
PORT_VARIABLE: Final = "VOXDISPLAY_PORT"

_MAX_BAUD = 2**32 - 1  # as of --baud; a system may take less


def open(  # noqa: A001 - as the built-in: vd.open(port)
    port: str | os.PathLike[str] | Transport | None = None,
    *,
    display: str | os.PathLike[str] | Mapping[str, Any] | DisplayProfile | None = None,
    baud: int | Literal["auto"] = DEFAULT_BAUD,
    timeout_s: float = TIMEOUT_S,
    reconnect_s: float = 0.0,
    no_reset: bool = False,
    note: Callable[[str], None] | None = None,
    capture: TextIO | None = None,
    clock: Clock = time.monotonic,
) -> Display:
    """Open a display: the port, and a session with the device behind it.

    Parameters
    ----------
    port : str, path or Transport, optional
        ``sim:``, ``/dev/ttyUSB0``, ``COM3``, ``tcp://host:port``, a URL of pyserial, an entry of a
        list of ports, or an open pipe, which is closed with the display; or an LED cube behind a
        lighting protocol, such as ``artnet://host?size=16x16x16``, on which nothing answers:
        docs/led-hardware.md lists them. By default what the profile of ``display`` names, else what
        the environment variable VOXDISPLAY_PORT names, else ``sim:``, the built-in emulator.
    display : str, path or mapping, optional
        Profile of the display: how it stands, and what it can show. The name of a file in the
        user's folder of profiles, a path that ends in ``.toml``, or its keys, such as
        ``{"axes": "x,-z,y", "brightness": 0.6}``. Its ``fit`` is for commands. With ``parts``,
        several displays are one: docs/displays.md.
    baud : int or "auto"
        Bits per second of a serial line; ``"auto"`` for the fastest common one at which the device
        answers: see `voxdisplay.display.baud`.
    timeout_s : float
        How long the device may be silent.
    reconnect_s : float
        How long a device that is not there is waited for: when the display is opened, and when it
        is unplugged later. When the same device is back, it gets its picture again, whole, and all
        goes on. 0: it is not waited for.
    no_reset : bool
        Leave DTR and RTS of a serial line alone, on which many boards restart. (Linux raises both
        all the same when a port is opened for the first time.)
    note : callable, optional
        Called with a line of text when a device is lost, waited for or back, when a rate was found,
        and when `Display.close` could not show the last frame.
    capture : text file, optional
        Receives all bytes to and from the device, with times: see `voxdisplay.transport.capture`.
    clock : callable
        Returns seconds, on any monotonic clock.

    Returns
    -------
    Display
        For an LED cube a `voxdisplay.display.sink_display.SinkDisplay`: its `Display.answers` is
        False. For several displays a `voxdisplay.display.tiled_display.TiledDisplay`.

    Raises
    ------
    OpenError
        If the port cannot be opened.
    TransportTimeout
        If nothing behind it answers HELLO.
    IncompatibleDevice
        If the device speaks another protocol major, has an unknown pixel format, or another serial
        number than the profile.
    ProfileError
        If the profile is not there, or wrong.

    """
    profile = _profile_of(display)
    if profile is not None and port is None:
        port = profile.port
    opened = _as_port(port)
    if not (isinstance(baud, str) and baud == "auto"):
        whole_number("baud", baud, 1, _MAX_BAUD)
    timeout_s, reconnect_s = duration("timeout_s", timeout_s), duration("reconnect_s", reconnect_s)
    no_reset = flag("no_reset", no_reset)
    function("note", note)
    note_or_not = _ignore if note is None else note  # a callable may be falsy
    _check_clock_and_capture(clock, capture)
    if profile is not None and profile.parts:
        _check_alone(port, capture)
        return _open_parts(
            profile, note, clock, baud=baud, timeout_s=timeout_s, reconnect_s=reconnect_s,
            no_reset=no_reset,
        )  # fmt: skip

    def attempt_device() -> Display:
        if isinstance(opened, str):
            transport = open_at_rate(opened, baud, timeout_s, note_or_not, reset=not no_reset)
        else:
            transport = opened
        try:
            reconnector = None
            if reconnect_s:
                rate = getattr(transport, "baud", DEFAULT_BAUD)
                reconnector = Reconnector(
                    transport.port, reconnect_s, baud=rate, note=note_or_not, reset=not no_reset
                )
            return Display(
                transport,
                timeout_s=timeout_s,
                reconnector=reconnector,
                note=note,
                capture=capture,
                clock=clock,
            )
        except BaseException:
            transport.close()
            raise

    keys = None if profile is None else profile.sink
    settings = SinkPortSettings(timeout_s, baud, not no_reset, note, capture, clock, keys)
    attempt = sink_opener(opened, settings) or attempt_device
    if reconnect_s and isinstance(opened, str):
        found = open_when_available(attempt, reconnect_s, note_or_not)
    else:
        found = attempt()
    return found if profile is None else profile.applied(found, note_or_not)


def _check_clock_and_capture(clock: object, capture: object) -> None:
    if not callable(clock):
        raise wrong_kind("clock", "a callable", clock)
    binary = isinstance(capture, io.RawIOBase | io.BufferedIOBase)
    if capture is not None and (binary or not callable(getattr(capture, "write", None))):
        raise wrong_kind("capture", "a text file or None", capture)


def _check_alone(port: object, capture: object) -> None:
    """Raise `ProfileError` if a display of several parts is to be opened by one port."""
    for name, value in (("port", port), ("capture", capture)):
        if value is not None:
            raise ProfileError(
                f"{name}: this display is made of several parts, each with a port of its own",
                hint=f"leave {name} out, or open one of the parts by its port",
            )


def _open_parts(
    profile: DisplayProfile, note: Callable[[str], None] | None, clock: Clock, **settings: Any
) -> Display:
    """Open a display that is made of several, with settings of `open` for each of them."""
    from voxdisplay.display.tiled_display import (  # noqa: PLC0415 - few are
        open_tiled,
        part_display_profile,
    )

    def opener(part: PartProfile, part_note: Callable[[str], None]) -> Display:
        alone = part_display_profile(profile, profile.parts.index(part))
        return open(part.port, display=alone, note=part_note, clock=clock, **settings)

    return profile.applied(open_tiled(profile, opener, note, clock), note or _ignore)


def _profile_of(display: Any) -> DisplayProfile | None:
    if display is None:
        return None
    from voxdisplay.display.profile_files import as_profile  # noqa: PLC0415 - few have one

    return as_profile(display)


def _ignore(text: str) -> None:
    del text


def _as_port(port: Any) -> str | Transport:
    """Return the name of a port, or an open pipe; raise `TypeError` for anything else."""
    if port is None:
        return os.environ.get(PORT_VARIABLE) or DEFAULT_PORT
    if isinstance(port, str):
        return port
    if isinstance(port, os.PathLike):
        return os.fsdecode(port)
    if type(port).__module__.partition(".")[0] != "serial" and all(
        hasattr(port, name) for name in ("port", "read", "write", "close")
    ):
        pipe: Transport = port
        return pipe
    # Entries of lists of ports: of pyserial's, and of `voxdisplay.transport.discovery`.
    for name in ("device", "port"):
        if isinstance(listed := getattr(port, name, None), str) and not hasattr(port, "write"):
            return listed
    raise TypeError(
        f"port is a {type(port).__name__}: name it by text, such as 'sim:' or '/dev/ttyUSB0', or "
        "give an open voxdisplay transport"
    )
