"""What several commands share: options, and how things are printed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

import click

import voxdisplay as vd
from voxdisplay.cli.output import note
from voxdisplay.display.baud import DEFAULT_BAUD, RATES, Baud
from voxdisplay.transport.discovery import all_ports

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

_C = TypeVar("_C", bound=Callable[..., Any])
DEFAULT_PORT = "sim:"
_LONGEST_S = 1e6


class SecondsType(click.FloatRange):
    """A time that the system can wait for."""

    name = "seconds"

    def __init__(self, least: float) -> None:
        super().__init__(min=least, max=_LONGEST_S)

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read it, or fail with a message."""
        seconds: float = super().convert(value, param, ctx)
        if math.isnan(seconds):
            self.fail(f"{value!r} is no time: write one like 5", param, ctx)
        return seconds


class BaudType(click.ParamType[Baud]):
    """A rate in bits per second, or ``auto``."""

    name = "rate"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Baud:
        """Read it, or fail with a message."""
        if str(value).lower() == "auto":
            return "auto"
        try:
            baud = int(value)
        except ValueError:
            self.fail(f"{value!r} is no rate: write one like 115200, or auto", param, ctx)
        if not 50 <= baud < 1 << 32:
            self.fail(f"{baud} is no rate of a serial line: write one like 115200", param, ctx)
        return baud

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Offer what is common."""
        from click.shell_completion import CompletionItem  # noqa: PLC0415 - only for this

        del ctx, param
        rates = ["auto", *map(str, RATES)]
        return [CompletionItem(rate) for rate in rates if rate.startswith(incomplete)]


def complete_port(context: click.Context, parameter: click.Parameter, typed: str) -> list[str]:
    """Offer what can be opened."""
    del context, parameter
    return [found.port for found in all_ports() if found.port.startswith(typed)]


port_option = click.option(
    "--port",
    "-p",
    envvar="VOXDISPLAY_PORT",
    metavar="PORT",
    shell_complete=complete_port,
    help="sim: | /dev/ttyUSB0 | COM3 | usb: | usb:VID:PID[:SERIAL] | tcp://host:port | "
    "a pyserial URL. Default: $VOXDISPLAY_PORT, else sim:, the built-in emulator.",
)


_RATE = BaudType()


def baud_option(default: Baud | None = DEFAULT_BAUD, otherwise: str = "") -> Callable[[_C], _C]:
    """Give ``--baud``, with its default, or what is done without it."""
    return click.option(
        "--baud",
        type=_RATE,
        default=None if default is None else str(default),
        metavar="RATE",
        show_default=otherwise or True,
        help="Bits per second of a serial line; auto: the fastest at which the display answers, "
        "which takes some seconds to find.",
    )


def timeout_option(default_s: float = 5.0) -> Callable[[_C], _C]:
    """Give ``--timeout``, with the default of a command that waits for many devices or answers."""
    return click.option(
        "--timeout",
        "timeout_s",
        type=SecondsType(0.1),
        default=default_s,
        metavar="SECONDS",
        show_default=True,
        help="How long the device may be silent.",
    )


def port_options(function: _C) -> _C:
    """Add ``--port``, ``--baud`` and ``--timeout``."""
    for option in (timeout_option(), baud_option(), port_option):
        function = option(function)
    return function


reconnect_option = click.option(
    "--reconnect",
    "reconnect_s",
    type=SecondsType(0),
    default=0.0,
    metavar="SECONDS",
    help="How long a display that is pulled out is waited for. When it is back, it gets its "
    "picture again.  [default: not at all]",
)

json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")


fit_option = click.option(
    "--fit",
    type=click.Choice(["contain", "none"]),
    default="contain",
    show_default=True,
    help="Scale a scene that was composed for another size and centre it, or keep its numbers "
    "and clip.",
)


capture_option = click.option(
    "--capture",
    type=click.File("w", encoding="utf-8", lazy=False),
    metavar="FILE",
    help="Write all bytes to and from the device to FILE, with times: see tools/annotate.py.",
)


def open_display(
    port: str | None,
    baud: Baud,
    timeout_s: float,
    *,
    reconnect_s: float = 0.0,
    capture: TextIO | None = None,
) -> vd.Display:
    """Open what ``--port`` names, or the emulator, and say so."""
    if port is None:  # and not an empty one, which a script has by mistake
        note("no --port: using the built-in emulator, sim:")
        port = DEFAULT_PORT
    return vd.open(
        port, baud=baud, timeout_s=timeout_s, reconnect_s=reconnect_s, note=note, capture=capture
    )


class SizeType(click.ParamType[vd.Grid]):
    """A size such as 128x128x128 or 128,128,128."""

    name = "size"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> vd.Grid:
        """Read it, or fail with a message."""
        try:
            return vd.Grid.parse(str(value).replace(",", "x"))
        except ValueError as error:
            self.fail(str(error), param, ctx)
