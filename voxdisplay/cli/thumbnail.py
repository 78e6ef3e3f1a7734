"""Terminal thumbnail printed after ``push`` and ``test-pattern``.

Where it cannot be drawn quickly it is left out without a note.
"""

from __future__ import annotations

import os
import shutil
import sys
from typing import TYPE_CHECKING, Final

import voxdisplay as vd
from voxdisplay.cli.output import is_quiet, print_drawing, print_stderr
from voxdisplay.display.baud import DEFAULT_BAUD, Baud

if TYPE_CHECKING:
    from voxdisplay.raster.pixel_format import Pixels

# As large as the terminal allows, but for the command's own lines and the prompt; of a very large
# terminal no more than is drawn at once, over ssh, too. Wider than this the sides stay dark.
_MAX_ROWS, _MIN_ROWS, _OTHER_ROWS = 44, 6, 6
_COLUMNS_PER_ROW = 2.5
# Reading back costs the device a look at every voxel, and the line some bytes for every lit one:
# at 115 200 baud 0.07 s for a thousand bits. The built-in emulator reads 128^3 in 0.03 to 0.4 s
# and 256^3 rgb888 in 4 s.
_MAX_VOXELS_READ: Final = 1 << 21
# Drawing a million takes a third of a second.
_MAX_VOXELS_DRAWN: Final = 1 << 20
_BITS_PER_VOXEL: Final = 80
_MAX_READ_S: Final = 0.5


def print_thumbnail(
    display: vd.Display,
    frame: vd.Frame,
    page: Pixels | None,
    baud: Baud,
    scene: vd.Scene | None = None,
) -> None:
    """Print a thumbnail, if stderr is a terminal that can show it and Pillow is installed.

    Parameters
    ----------
    display : Display
    frame : Frame
        What it has just shown, proved by its digest.
    page : ndarray or None
        What was read back. If None, it is read now where that is quick, else the frame is drawn.
    baud : int or "auto"
        Rate of the line; a rate found by ``auto`` is taken for the default.
    scene : Scene, optional
        It is seen from where it says.

    """
    if is_quiet() or not _is_supported():
        return
    count = len(frame.lit()[0])
    if count > _MAX_VOXELS_DRAWN:
        return
    from voxdisplay.raster.pixel_map import PixelMap  # noqa: PLC0415

    try:
        from voxdisplay.view.half_blocks import (  # noqa: PLC0415 - an extra
            CAMERA,
            half_blocks,
            has_true_color,
        )
        from voxdisplay.view.lit_voxels import lit_voxels  # noqa: PLC0415
        from voxdisplay.view.picture import RenderOptions  # noqa: PLC0415
    except vd.MissingExtra:
        return
    room = _room(shutil.get_terminal_size())
    if room is None:
        return
    from voxdisplay.cli.scene_drawing import best_seen  # noqa: PLC0415

    options = RenderOptions(camera=CAMERA)
    camera = (best_seen(scene, options) if scene else options).camera
    info = display.info
    rate = DEFAULT_BAUD if baud == "auto" else baud
    if page is None and _is_quick_to_read(info, count, rate):
        page = display.read()
    caption = "what was sent, not read back" if page is None else "read back from the display"
    shown = PixelMap(*frame.lit()) if page is None else page
    lit = lit_voxels(shown, info.grid, info.format, frame.memory.palette)
    for line in half_blocks(lit, info.grid, *room, camera=camera, full=has_true_color()):
        print_drawing(line)
    print_stderr(caption)


def _room(terminal: os.terminal_size) -> tuple[int, int] | None:
    """Return the columns and rows of the picture; None if a terminal is too small for one."""
    rows = min(_MAX_ROWS, terminal.lines - _OTHER_ROWS, (terminal.columns - 1) // 2)
    columns = min(terminal.columns - 1, round(_COLUMNS_PER_ROW * rows))
    return (columns, rows) if rows >= _MIN_ROWS else None


def _is_supported() -> bool:
    return (
        sys.stderr.isatty()
        and "utf" in (sys.stderr.encoding or "").lower()
        and not os.environ.get("NO_COLOR")
        and os.environ.get("TERM", "dumb") != "dumb"
    )


def _is_quick_to_read(info: vd.DeviceInfo, lit: int, baud: int) -> bool:
    return (
        "read" in info.features
        and info.grid.voxels <= _MAX_VOXELS_READ
        and lit * _BITS_PER_VOXEL / baud <= _MAX_READ_S
    )
