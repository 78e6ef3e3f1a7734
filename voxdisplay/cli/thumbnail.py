"""A small picture under what ``voxdisplay push`` says, for a person at a terminal.

It is a courtesy: where it cannot be had quickly, there is none, and nobody is told.
"""

from __future__ import annotations

import os
import shutil
import sys

import click

import voxdisplay as vd
from voxdisplay.display.baud import DEFAULT_BAUD, Baud
from voxdisplay.raster.pixel_format import Pixels

_COLUMNS, _ROWS = 56, 18
# Reading back costs the device a look at every voxel, and the line some bytes for every lit one:
# at 115 200 baud 0.07 s for a thousand bits. The built-in emulator reads 128^3 in 0.03 to 0.4 s
# and 256^3 rgb888 in 4 s.
_MOST_VOXELS = 1 << 21
# Drawing a million takes a third of a second.
_MOST_DRAWN = 1 << 20
_BITS_A_VOXEL = 80
_PATIENCE_S = 0.5


def print_thumbnail(display: vd.Display, frame: vd.Frame, page: Pixels | None, baud: Baud) -> None:
    """Draw what is on display, if stderr is a terminal that can show it and Pillow is installed.

    Parameters
    ----------
    display : Display
    frame : Frame
        What it has just shown, and proved by its digest.
    page : ndarray or None
        What was read back, if it was. If not, it is now, if that is cheap; else the frame is drawn.
    baud : int or "auto"
        Speed of the line; found by asking, it is taken for the usual one.

    """
    if not _can_show():
        return
    count = len(frame.lit()[0])
    if count > _MOST_DRAWN:
        return
    try:
        from voxdisplay.view.half_blocks import half_blocks, has_true_color  # noqa: PLC0415 - an extra
        from voxdisplay.view.lit_voxels import lit_voxels  # noqa: PLC0415
    except vd.MissingExtra:
        return
    info = display.info
    rate = DEFAULT_BAUD if baud == "auto" else baud
    if page is None and _cheap(info, count, rate):
        page = display.read()
    what = "what was sent, not read back" if page is None else "read back from the display"
    shown = frame.array() if page is None else page
    lit = lit_voxels(shown, info.grid, info.format, frame.palette)
    room = shutil.get_terminal_size()
    columns, rows = min(_COLUMNS, room.columns - 1), min(_ROWS, room.lines - 5)
    if columns < 2 * rows or rows < 6:
        return
    for line in half_blocks(lit, info.grid, columns, rows, full=has_true_color()):
        click.echo(line, err=True, color=True)
    click.echo(what, err=True)


def _can_show() -> bool:
    return (
        sys.stderr.isatty()
        and "utf" in (sys.stderr.encoding or "").lower()
        and not os.environ.get("NO_COLOR")
        and os.environ.get("TERM", "dumb") != "dumb"
    )


def _cheap(info: vd.DeviceInfo, lit: int, baud: int) -> bool:
    return (
        "read" in info.features
        and info.grid.voxels <= _MOST_VOXELS
        and lit * _BITS_A_VOXEL / baud <= _PATIENCE_S
    )
