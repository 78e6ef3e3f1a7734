"""Options that several commands share.

Defaults and limits stand in the help texts as they are written here: what is printed does not
depend on the release of click. Nothing of the driver is imported until a value is used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, TextIO, TypeVar

import click

from voxdisplay.cli.output import note, set_quiet
from voxdisplay.cli.param_types import (
    PIXEL_FORMATS,
    BaudType,
    ImageFileType,
    SizeType,
    seconds_type,
)
from voxdisplay.cli.profile_options import current_profile, profile_fit, profile_port

if TYPE_CHECKING:
    from voxdisplay.display.baud import Baud
    from voxdisplay.display.display import Display

_C = TypeVar("_C", bound=Callable[..., Any])
DEFAULT_PORT: Final = "sim:"
DEFAULT_BAUD_TEXT: Final = "115200"
DEFAULT_SIZE_TEXT: Final = "128x128x128"


def complete_port(context: click.Context, parameter: click.Parameter, typed: str) -> list[str]:
    """Return the ports that can be opened and begin as typed."""
    from voxdisplay.transport.discovery import all_ports  # noqa: PLC0415 - only for completion

    del context, parameter
    return [found.port for found in all_ports() if found.port.startswith(typed)]


def scene_argument(*, required: bool = True) -> Callable[[_C], _C]:
    """Return the argument SCENE."""
    return click.argument("scene", type=click.Path(), required=required)


port_option = click.option(
    "--port",
    "-p",
    envvar="VOXDISPLAY_PORT",
    metavar="PORT",
    shell_complete=complete_port,
    help="sim: | /dev/ttyUSB0 | COM3 | usb: | usb:VID:PID[:SERIAL] | tcp://host:port | "
    "a pyserial URL | artnet:, sacn:, ddp:, opc:, wled://host?size=16x16x16 | "
    "adalight:DEVICE?size=8x8x8 (LED cubes, unproved).  "
    "[default: $VOXDISPLAY_PORT, else sim:, the built-in emulator]",
)


def baud_option(
    default: str | None = DEFAULT_BAUD_TEXT, default_text: str = DEFAULT_BAUD_TEXT
) -> Callable[[_C], _C]:
    """Return ``--baud`` with a default, which the help may describe otherwise."""
    return click.option(
        "--baud",
        type=BaudType(),
        default=default,
        metavar="RATE",
        help="Bits per second of a serial line. auto: the fastest at which the display answers, "
        f"which takes some seconds to find.  [default: {default_text}]",
    )


def timeout_option(default_s: float = 5.0) -> Callable[[_C], _C]:
    """Return ``--timeout`` with a default in seconds."""
    return click.option(
        "--timeout",
        "timeout_s",
        type=seconds_type(0.1),
        default=default_s,
        metavar="SECONDS",
        help=f"Longest silence of the device, 0.1 or more.  [default: {default_s:g}]",
    )


_NO_RESET = "voxdisplay.no_reset"


def _remember_no_reset(context: click.Context, parameter: click.Parameter, value: bool) -> None:
    del parameter
    context.meta[_NO_RESET] = value


# For whoever opens a port, by `no_reset`: no command has any other use for it.
no_reset_option = click.option(
    "--no-reset",
    is_flag=True,
    expose_value=False,
    callback=_remember_no_reset,
    help="Leave DTR and RTS of a serial line alone: many boards restart on them.",
)


def no_reset() -> bool:
    """Return whether the command that runs was given ``--no-reset``."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(_NO_RESET))


def port_options(function: _C) -> _C:
    """Add ``--port``, ``--baud``, ``--no-reset`` and ``--timeout``."""
    for option in (timeout_option(), no_reset_option, baud_option(), port_option):
        function = option(function)
    return function


reconnect_option = click.option(
    "--reconnect",
    "reconnect_s",
    type=seconds_type(0),
    default=0.0,
    metavar="SECONDS",
    help="How long to wait for a display that is not plugged in yet, or is pulled out. When it is "
    "back, its picture is sent again.  [default: do not wait]",
)

on_exit_option = click.option(
    "--on-exit",
    type=click.Choice(["keep", "blank"]),
    default="keep",
    help="What the display shows when the command is ended by Ctrl-C, SIGTERM or a closed "
    "terminal: its last whole picture, or nothing.  [default: keep]",
)

json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")


def _quiet_callback(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if value:
        set_quiet(context)


quiet_option = click.option(
    "--quiet",
    "-q",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_quiet_callback,
    help="Print nothing to stderr but errors.",
)

fit_option = click.option(
    "--fit",
    type=click.Choice(["contain", "none", "content"]),
    default="contain",
    callback=profile_fit,
    help="contain: scale a scene that was composed for another size, and centre it. none: keep its "
    "numbers and clip. content: scale what is there so that it fills the display.  "
    "[default: contain]",
)

capture_option = click.option(
    "--capture",
    type=click.File("w", encoding="utf-8", lazy=False),
    metavar="FILE",
    help="Write all bytes to and from the device to FILE, with times. voxdisplay annotate FILE "
    "explains them.",
)


class _RenamedOption(click.Option):
    """An option whose older names still work, and are not shown."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the help of the first name alone."""
        names, self.opts = self.opts, self.opts[:1]
        try:
            return super().get_help_record(ctx)
        finally:
            self.opts = names


def display_size_option(help_text: str, *, for_two: str = "") -> Callable[[_C], _C]:
    """Return ``--size``, the size of a display in voxels, which was once ``--display-size``."""
    return click.option(
        "--size",
        "--display-size",
        "size",
        cls=_RenamedOption,
        type=SizeType(for_two),
        metavar="NXxNYxNZ",
        help=help_text,
    )


def format_option(help_text: str, default: str | None = None) -> Callable[[_C], _C]:
    """Return ``--format``, the pixel format of a display that is not there."""
    return click.option(
        "--format", "format_", type=click.Choice(PIXEL_FORMATS), default=default, help=help_text
    )


def image_file_option(*names: str, help_text: str, required: bool = False) -> Callable[[_C], _C]:
    """Return an option that names an image file to write."""
    return click.option(
        *names, type=ImageFileType(), metavar="FILE", required=required, help=help_text
    )


def open_display(
    port: str | None,
    baud: Baud,
    timeout_s: float,
    *,
    reconnect_s: float = 0.0,
    capture: TextIO | None = None,
    as_memory: bool = False,
) -> Display:
    """Open what ``--port`` or the profile names, or the emulator, which is noted on stderr.

    With ``as_memory``, pictures are not turned, whatever the profile says.
    """
    import voxdisplay as vd  # noqa: PLC0415 - see above

    profile = current_profile()
    if profile and as_memory:
        profile = profile.upright()
    port = profile_port(port, profile)
    return vd.open(
        port if profile and profile.parts else default_port(port),
        display=profile,
        baud=baud,
        timeout_s=timeout_s,
        reconnect_s=reconnect_s,
        no_reset=no_reset(),
        note=note,
        capture=capture,
    )


def default_port(port: str | None) -> str:
    """Return the port that was named, or that of the emulator with a note."""
    if port is not None:  # an empty one is a mistake of a script, and no default
        return port
    note("no --port: using the built-in emulator, sim:")
    return DEFAULT_PORT
