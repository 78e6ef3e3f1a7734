"""``voxdisplay view``: what a display shows, live; in a browser or in the terminal."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import voxdisplay as vd
from voxdisplay.cli.options import (
    SizeType,
    open_display,
    port_options,
)
from voxdisplay.cli.output import (
    note,
)
from voxdisplay.cli.scene_drawing import draw
from voxdisplay.display.baud import Baud
from voxdisplay.raster.pixel_format import Pixels

if TYPE_CHECKING:
    from voxdisplay.view.live.sources import Source
    from voxdisplay.view.terminal import TerminalView

_DEFAULT_GRID = vd.Grid(128, 128, 128)


class AddressType(click.ParamType[tuple[str, int]]):
    """Where to listen, such as 127.0.0.1:8000 or [::1]:8000."""

    name = "address"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, int]:
        """Read it, or fail with a message."""
        if isinstance(value, tuple):
            return value
        from voxdisplay.view.live.address import parse_address  # noqa: PLC0415

        try:
            return parse_address(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


@click.command(
    epilog="""\b
    Examples:
      voxdisplay view --port /dev/ttyUSB0
      voxdisplay view curve.json --listen 127.0.0.1:8000 --no-open
      voxdisplay view --port /dev/ttyUSB0 --terminal
      voxdisplay view --terminal curve.json
    """
)
@click.argument("scene", type=click.Path(), required=False)
@port_options
@click.option(
    "--listen",
    type=AddressType(),
    default="127.0.0.1:0",
    metavar="HOST:PORT",
    show_default=True,
    help="Where the page for the browser is; port 0 is any that is free. From elsewhere, better "
    "use ssh -L than an address that everyone can reach.",
)
@click.option("--no-open", is_flag=True, help="Do not open a browser; its address is on stdout.")
@click.option(
    "--terminal",
    is_flag=True,
    help="Draw in this terminal, over ssh too: arrows turn, + and - zoom, q quits. Colours are "
    "256, and all with COLORTERM=truecolor.",
)
@click.option(
    "--display-size",
    type=SizeType(),
    metavar="NX,NY,NZ",
    help="With SCENE: the size of the display, in voxels.  [default: the scene's]",
)
def view(
    *,
    scene: str | None,
    port: str | None,
    baud: Baud,
    timeout_s: float,
    listen: tuple[str, int],
    no_open: bool,
    terminal: bool,
    display_size: vd.Grid | None,
) -> None:
    """Watch what a display shows; with SCENE, what it would show of a JSON file.

    The display is asked and read back: it needs the feature READ, and its port to itself. To
    watch the emulator while others draw on it, start it by voxdisplay-sim --view. Ctrl-C ends it.

    Needs the extra `view`: pip install 'voxdisplay[view]'.
    """
    if not terminal:
        source = _still(scene, display_size) if scene else _readback(port, baud, timeout_s)
        with source as ready:
            _serve(ready, listen, open_browser=not no_open)
        return
    from voxdisplay.view.terminal import run  # noqa: PLC0415 - an extra

    what = _of_scene(scene, display_size) if scene else _of_display(port, baud, timeout_s)
    with what as ready:
        try:
            run(ready)
        except ValueError as error:
            raise click.UsageError(f"--terminal: {error}") from error


def _serve(source: Source, listen: tuple[str, int], *, open_browser: bool) -> None:
    from voxdisplay.view.live.run import run  # noqa: PLC0415 - an extra

    def announce(url: str) -> None:
        click.echo(url)
        if open_browser and "SSH_CONNECTION" not in os.environ:
            import webbrowser  # noqa: PLC0415 - it takes longer than pushing a frame

            webbrowser.open(url)

    try:
        run(source, *listen, announce)
    except OSError as error:
        if isinstance(error, vd.VoxDisplayError):
            raise
        where = "{}:{}".format(*listen)
        raise click.BadParameter(
            f"cannot listen at {where}: {error}", param_hint="--listen"
        ) from error


@contextlib.contextmanager
def _still(scene: str, display_size: vd.Grid | None) -> Iterator[Source]:
    from voxdisplay.view.live.message import Snapshot  # noqa: PLC0415 - an extra
    from voxdisplay.view.live.sources import StaticSource  # noqa: PLC0415

    frame, title = _frame(scene, display_size), Path(scene).name
    yield StaticSource(Snapshot(frame.array(), frame.grid, frame.format, 1, title, frame.digest()))


@contextlib.contextmanager
def _readback(port: str | None, baud: Baud, timeout_s: float) -> Iterator[Source]:
    from voxdisplay.view.live.sources import DisplaySource  # noqa: PLC0415 - an extra

    with open_display(port, baud, timeout_s) as display:
        info = display.info
        if "read" not in info.features:
            raise vd.IncompatibleDevice(
                "this display cannot read its memory back: it cannot be watched"
            )

        def counters() -> dict[str, int]:
            counted = display.counters
            return {"Bytes sent": counted.wire_bytes, "Damaged": counted.device_damaged}

        yield DisplaySource(_Watched(display), info.grid, info.format, counters)


class _Watched:
    """A display that is read back, and of which is said, once, if its colours cannot be known."""

    def __init__(self, display: vd.Display) -> None:
        self._display = display
        info = display.info
        self._in_doubt = info.format is vd.PixelFormat.INDEX8 and "palette" in info.features
        self.port = display.port

    def digest(self) -> int | None:
        """See `Display.digest`."""
        return self._display.digest()

    def read(self) -> Pixels:
        """See `Display.read`. A palette cannot be read, but the digest tells the default one."""
        page = self._display.read()
        if self._in_doubt:
            meant = vd.Frame(self._display.info.grid, vd.PixelFormat.INDEX8)
            meant.set(page)
            if self.digest() != meant.digest():
                self._in_doubt = False
                note(
                    "this picture has a palette, which cannot be read back: colours are not its own"
                )
        return page


def _frame(scene: str, display_size: vd.Grid | None) -> vd.Frame:
    loaded = vd.load_scene(scene)
    frame = vd.Frame(display_size or loaded.size or _DEFAULT_GRID)
    fitted, remark = loaded.fitted(frame.grid)
    if remark:
        note(remark)
    draw(fitted, frame)
    return frame


@contextlib.contextmanager
def _of_scene(scene: str, display_size: vd.Grid | None) -> Iterator[TerminalView]:
    from voxdisplay.view.lit_voxels import lit_voxels  # noqa: PLC0415
    from voxdisplay.view.terminal import TerminalView  # noqa: PLC0415

    frame = _frame(scene, display_size)
    lit = lit_voxels(frame.array(), frame.grid, frame.format)
    yield TerminalView(frame.grid, Path(scene).name, lambda: lit, changes=False)


@contextlib.contextmanager
def _of_display(port: str | None, baud: Baud, timeout_s: float) -> Iterator[TerminalView]:
    from voxdisplay.view.lit_voxels import LitVoxels, lit_voxels  # noqa: PLC0415
    from voxdisplay.view.terminal import TerminalView  # noqa: PLC0415

    with open_display(port, baud, timeout_s) as display:
        info, watched = display.info, _Watched(display)

        def read() -> LitVoxels:
            return lit_voxels(watched.read(), info.grid, info.format)

        yield TerminalView(info.grid, display.port, read, changes=True)
