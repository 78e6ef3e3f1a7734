"""``voxdisplay view``: a live view of a display or a scene, in a browser or in the terminal."""

from __future__ import annotations

import contextlib
import math
import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

import voxdisplay as vd
from voxdisplay.cli.model_files import ModelOptions, load_shown
from voxdisplay.cli.options import (
    display_size_option,
    open_display,
    port_options,
    quiet_option,
    scene_argument,
)
from voxdisplay.cli.output import note, print_stdout, set_quiet
from voxdisplay.cli.param_types import AddressType, OriginType
from voxdisplay.cli.profile_options import standing_options

if TYPE_CHECKING:
    from voxdisplay.display.baud import Baud
    from voxdisplay.raster.pixel_format import Pixels
    from voxdisplay.shows.show import Show
    from voxdisplay.view.camera import Camera
    from voxdisplay.view.lit_voxels import LitVoxels
    from voxdisplay.view.live.sources import Source
    from voxdisplay.view.terminal import TerminalView

_STOP_TIMEOUT_S = 2.0


@click.command(
    epilog="""\b
    Examples:
      voxdisplay view --port /dev/ttyUSB0
      voxdisplay view curve.json --listen 127.0.0.1:8000 --no-open
      voxdisplay view --port /dev/ttyUSB0 --terminal
      voxdisplay view --terminal curve.json
    """
)
@scene_argument(required=False)
@port_options
@standing_options
@click.option(
    "--listen",
    type=AddressType(),
    default="127.0.0.1:0",
    metavar="HOST:PORT",
    help="Address of the page for the browser; port 0 is any that is free. From elsewhere, better "
    "use ssh -L than an address that everyone can reach.  [default: 127.0.0.1:0]",
)
@click.option(
    "--allow-origin",
    "allow_origins",
    type=OriginType(),
    multiple=True,
    metavar="ORIGIN",
    help="Let pages of another address show it, such as https://cube.example.com behind a reverse "
    "proxy; may be repeated. * is all: then any web page can watch.",
)
@click.option(
    "--no-open", is_flag=True, help="Do not open a browser; the page's address is on stdout."
)
@click.option(
    "--terminal",
    is_flag=True,
    help="Draw in this terminal, over ssh too: arrows turn, + and - zoom, q quits. Colours are "
    "256, and all with COLORTERM=truecolor.",
)
@display_size_option("With SCENE: size of the display in voxels.  [default: the scene's]")
@quiet_option
def view(
    *,
    scene: str | None,
    port: str | None,
    baud: Baud,
    timeout_s: float,
    listen: tuple[str, int],
    allow_origins: tuple[str, ...],
    no_open: bool,
    terminal: bool,
    size: vd.Grid | None,
) -> None:
    """Show a display live, or with SCENE, a JSON file or a recording, what a display would show.

    A scene with a duration is played, again and again. When SCENE is saved, what was saved is
    shown; if it cannot be read, the last picture stays until it is saved again.

    The display is read back: it needs the feature READ, and its port to itself. To watch the
    emulator while others draw on it, start it by voxdisplay-sim --view. Ctrl-C ends it.

    Needs the extra `view`: pip install 'voxdisplay[view]'.
    """
    if not terminal:
        source = _scene_source(scene, size) if scene else _display_source(port, baud, timeout_s)
        with source as ready:
            _serve(ready, listen, allow_origins, open_browser=not no_open)
        return
    from voxdisplay.view.terminal import run  # noqa: PLC0415 - an extra

    opened = _scene_view(scene, size) if scene else _display_view(port, baud, timeout_s)
    with opened as ready:
        try:
            run(ready)
        except ValueError as error:
            raise click.UsageError(f"--terminal: {error}") from error


def _serve(
    source: Source, listen: tuple[str, int], allow_origins: tuple[str, ...], *, open_browser: bool
) -> None:
    from voxdisplay.view.live.run import run  # noqa: PLC0415 - an extra

    listening = False

    def announce(url: str) -> None:
        nonlocal listening
        listening = True
        print_stdout(url)
        if open_browser and "SSH_CONNECTION" not in os.environ:
            import webbrowser  # noqa: PLC0415 - it takes longer than pushing a frame

            webbrowser.open(url)

    try:
        run(source, *listen, announce, allow_origins)
    except OSError as error:
        if listening or isinstance(error, vd.VoxDisplayError):
            raise  # of a port, or of stdout
        where = "{}:{}".format(*listen)
        raise click.BadParameter(
            f"cannot listen at {where}: {error}", param_hint="--listen"
        ) from error


@contextlib.contextmanager
def _scene_source(scene: str, size: vd.Grid | None) -> Iterator[Source]:
    """Yield the source of a scene; while it is used, the file is followed."""
    from voxdisplay.cli.followed_file import FollowedFile, print_failure  # noqa: PLC0415
    from voxdisplay.view.live.followed_source import FollowedSource  # noqa: PLC0415 - an extra

    file, done = FollowedFile(scene), threading.Event()
    source = FollowedSource(_scene_pictures(scene, size), print_failure)
    context = click.get_current_context()

    def follow() -> None:
        with context.scope(cleanup=False):  # for the thread to be quiet if the command is
            file.follow(lambda: source.replace(_scene_pictures(scene, size)), done)

    follower = threading.Thread(target=follow, name="followed file", daemon=True)
    follower.start()
    try:
        yield source
    finally:
        done.set()
        follower.join(_STOP_TIMEOUT_S)


def _scene_pictures(scene: str, size: vd.Grid | None) -> Source:
    """Return the source of what a scene shows now."""
    from voxdisplay.cli.show_films import color_page  # noqa: PLC0415
    from voxdisplay.raster.pixel_map import PixelMap  # noqa: PLC0415
    from voxdisplay.view.live.moving_source import MovingSource  # noqa: PLC0415
    from voxdisplay.view.live.snapshot_message import Snapshot  # noqa: PLC0415 - an extra
    from voxdisplay.view.live.sources import StaticSource  # noqa: PLC0415

    (found, camera), title = _scene_show(scene, size), Path(scene).name
    if isinstance(found, vd.Frame):
        lit, digest = PixelMap(*found.lit()), found.digest()
        return StaticSource(
            Snapshot(lit, found.grid, found.format, 1, title, digest, camera=camera)
        )

    def snapshot(number: int) -> Snapshot:
        frame = found.frame(number)
        page = color_page(frame)
        digest = frame.digest()
        return Snapshot(
            page, frame.grid, vd.PixelFormat.RGB888, number + 1, title, digest, camera=camera
        )

    return MovingSource(found.frame_count, found.fps, snapshot, title)


@contextlib.contextmanager
def _display_source(port: str | None, baud: Baud, timeout_s: float) -> Iterator[Source]:
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

        yield DisplaySource(_ReadbackDisplay(display), info.grid, info.format, counters)


class _ReadbackDisplay:
    """A display read back for a view; notes once if its palette cannot be known."""

    def __init__(self, display: vd.Display) -> None:
        self._display = display
        info = display.info
        self._palette_unknown = info.format is vd.PixelFormat.INDEX8 and "palette" in info.features
        self.port = display.port

    def digest(self) -> int | None:
        """See `Display.digest`."""
        return self._display.digest()

    def read(self) -> Pixels:
        """See `Display.read`. A palette cannot be read; the digest identifies the default one."""
        page = self._display.read()
        if self._palette_unknown:
            meant = self._display.frame()
            meant.set(page)
            dims = meant.output is not None and meant.output.dims
            if not dims and self.digest() != meant.digest():
                self._palette_unknown = False
                note(
                    "this picture has a palette, which cannot be read back: colours are not its own"
                )
        return page


def _scene_show(scene: str, size: vd.Grid | None) -> tuple[vd.Frame | Show, Camera | None]:
    """Return a scene's picture; of one that moves, and of a recording, the show; and its camera."""
    from voxdisplay.cli.scene_drawing import (  # noqa: PLC0415
        best_seen,
        draw_scene,
        load_fitted_scene,
        note_choices,
    )
    from voxdisplay.cli.show_films import is_show_file, open_show_file  # noqa: PLC0415
    from voxdisplay.view.picture import RenderOptions  # noqa: PLC0415 - an extra

    if is_show_file(scene):
        return open_show_file(scene, size, None, "contain"), None
    fitted, grid = load_fitted_scene(load_shown(scene, ModelOptions()), size)
    frame = vd.Frame(grid)
    camera = best_seen(fitted, RenderOptions()).camera if fitted.view else None
    if fitted.duration:
        note_choices(fitted)
        return fitted.show_on(frame, fit="none"), camera
    draw_scene(fitted, frame)
    return frame, camera


@contextlib.contextmanager
def _scene_view(scene: str, size: vd.Grid | None) -> Iterator[TerminalView]:
    """Yield the view of a scene, which follows the file; what fails stands in its status line."""
    from voxdisplay.cli.followed_file import (  # noqa: PLC0415
        POLL_S,
        READ_ERRORS,
        FollowedFile,
        failure_text,
        print_failure,
    )
    from voxdisplay.view.terminal import TerminalView  # noqa: PLC0415

    file, on_screen = FollowedFile(scene), sys.stderr.isatty()
    read = _scene_reader(scene, size)

    def read_saved(view: TerminalView) -> LitVoxels:
        nonlocal read
        try:
            if file.saved():
                read = _scene_reader(scene, size)
                view.remark = ""
            view.read_interval_s = min(POLL_S, read.interval_s)
            view.grid, lit = read.grid, read()
        except READ_ERRORS as error:
            view.remark = failure_text(error).replace(scene, view.title)
            if not on_screen:
                print_failure(error)
            return view.lit
        return lit

    if on_screen:
        set_quiet(click.get_current_context())  # notes would stand in the picture
    view = TerminalView(read.grid, Path(scene).name, read, changes=True)
    view.read = lambda: read_saved(view)
    view.read_interval_s = min(POLL_S, read.interval_s)
    view.camera = read.camera or view.camera
    yield view


class _SceneReader:
    """Lit voxels of a scene, or of the moment of a moving one that is due.

    Attributes
    ----------
    grid : Grid
    camera : Camera or None
        From where it is best seen.
    interval_s : float
        Seconds from picture to picture.

    """

    def __init__(self, found: vd.Frame | Show, camera: Camera | None) -> None:
        self._found = found
        self._began_s = time.monotonic()
        first = found if isinstance(found, vd.Frame) else found.frame(0)
        self._still = self._lit(first) if isinstance(found, vd.Frame) else None
        self.grid, self.camera = first.grid, camera
        self.interval_s = math.inf if isinstance(found, vd.Frame) else 1 / found.fps

    @staticmethod
    def _lit(frame: vd.Frame) -> LitVoxels:
        from voxdisplay.cli.show_films import color_page  # noqa: PLC0415
        from voxdisplay.view.lit_voxels import lit_voxels  # noqa: PLC0415

        return lit_voxels(color_page(frame), frame.grid, vd.PixelFormat.RGB888)

    def __call__(self) -> LitVoxels:
        from voxdisplay.view.live.moving_source import due_ordinal  # noqa: PLC0415

        if self._still is not None or isinstance(self._found, vd.Frame):
            assert self._still is not None  # noqa: S101 - of a frame
            return self._still
        due = due_ordinal(time.monotonic() - self._began_s, self._found.fps)
        return self._lit(self._found.frame(due % self._found.frame_count))


def _scene_reader(scene: str, size: vd.Grid | None) -> _SceneReader:
    return _SceneReader(*_scene_show(scene, size))


@contextlib.contextmanager
def _display_view(port: str | None, baud: Baud, timeout_s: float) -> Iterator[TerminalView]:
    from voxdisplay.view.lit_voxels import lit_voxels  # noqa: PLC0415
    from voxdisplay.view.terminal import TerminalView  # noqa: PLC0415

    with open_display(port, baud, timeout_s) as display:
        info, watched = display.info, _ReadbackDisplay(display)

        def read() -> LitVoxels:
            return lit_voxels(watched.read(), info.grid, info.format)

        yield TerminalView(info.grid, display.port, read, changes=True)
