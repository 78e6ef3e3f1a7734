"""``voxdisplay view``: what a display shows, live; in a browser or in the terminal."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

import voxdisplay as vd
from voxdisplay.cli.options import SizeType, note, open_display, port_options
from voxdisplay.cli.scenes import draw

if TYPE_CHECKING:
    from voxdisplay.view.terminal import View

_DEFAULT_GRID = vd.Grid(128, 128, 128)


@click.command(
    epilog="""\b
    Examples:
      voxdisplay view --port /dev/ttyUSB0 --terminal
      voxdisplay view --terminal curve.json
    """
)
@click.argument("scene", type=click.Path(), required=False)
@port_options
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
    baud: int,
    timeout_s: float,
    terminal: bool,
    display_size: vd.Grid | None,
) -> None:
    """Watch what a display shows; with SCENE, what it would show of a JSON file.

    Needs the extra `view`: pip install 'voxdisplay[view]'.
    """
    if not terminal:
        from voxdisplay.view.live import serve  # noqa: PLC0415 - an extra

        serve(port=port, baud=baud, timeout_s=timeout_s, scene=scene)
        return
    from voxdisplay.view.terminal import show  # noqa: PLC0415 - an extra

    what = _of_scene(scene, display_size) if scene else _of_display(port, baud, timeout_s)
    with what as ready:
        try:
            show(ready)
        except ValueError as error:
            raise click.UsageError(f"--terminal: {error}") from error


@contextlib.contextmanager
def _of_scene(scene: str, display_size: vd.Grid | None) -> Iterator[View]:
    from voxdisplay.view.terminal import View  # noqa: PLC0415
    from voxdisplay.view.voxels import lit_voxels  # noqa: PLC0415

    loaded = vd.load_scene(scene)
    frame = vd.Frame(display_size or loaded.size or _DEFAULT_GRID)
    fitted, remark = loaded.fitted(frame.grid)
    if remark:
        note(remark)
    draw(fitted, frame)
    lit = lit_voxels(frame.array(), frame.grid, frame.format)
    yield View(frame.grid, Path(scene).name, lambda: lit, changes=False)


@contextlib.contextmanager
def _of_display(port: str | None, baud: int, timeout_s: float) -> Iterator[View]:
    from voxdisplay.view.terminal import View  # noqa: PLC0415
    from voxdisplay.view.voxels import Lit, lit_voxels  # noqa: PLC0415

    with open_display(port, baud, timeout_s) as display:
        info = display.info

        def read() -> Lit:
            return lit_voxels(display.read(), info.grid, info.format)

        yield View(info.grid, display.port, read, changes=True)
