"""Export of pages to one HTML file that needs no server: it can be turned and played.

It is the page of the live view with embedded frames, each a message of
`voxdisplay.view.live.snapshot_message`. It loads nothing from elsewhere, and its policy forbids
that.
"""

from __future__ import annotations

import base64
import html
import json
import math
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from voxdisplay.printable_text import printable
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Colors
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.view.atomic_write import atomic_write
from voxdisplay.view.camera import Camera
from voxdisplay.view.live.page import content_security_policy, page_html
from voxdisplay.view.live.snapshot_message import Snapshot, encode

_LEVEL = 9
_HEAD = '<meta charset="utf-8">\n'
_TITLE = "<title>voxdisplay</title>"
_PLACE = '<script type="application/octet-stream" id="embedded">'


def save_html(
    path: Path | str,
    pages: Sequence[NDArray[np.integer] | PixelMap],
    grid: Grid,
    format: PixelFormat,  # noqa: A002 - as the option --format
    *,
    title: str = "voxdisplay",
    fps: float = 20.0,
    palette: Colors | None = None,
    camera: Camera | None = None,
) -> None:
    """Write pages as one HTML file, which replaces another only when it is complete.

    Parameters
    ----------
    path : Path or str
    pages : sequence of ndarray or PixelMap
        As from `Display.read` or `Frame.array`, indexed [z, y, x], or the lit pixels alone; at
        least one.
    grid : Grid
    format : PixelFormat
    title : str
    fps : float
        Pages per second, 0.1 to 120.
    palette : (256, 3) uint8 array, optional
        Of index8 pages; by default the default one.
    camera : Camera, optional
        From where the pages are seen first.

    Raises
    ------
    ValueError
        If there is no page, one is not of this grid and format, or the rate is out of range.
    OSError
        If the file cannot be written.

    """
    if not len(pages):
        raise ValueError("pages is empty: there is nothing to write")
    if not (math.isfinite(fps) and 0.1 <= fps <= 120):
        raise ValueError(f"{fps} pages per second: the rate must be 0.1 to 120")
    grid = Grid(*grid)
    frames = [
        Snapshot(
            one if isinstance(one, PixelMap) else np.asarray(one),
            grid,
            format,
            number,
            title,
            palette=palette,
            camera=camera,
        )
        for number, one in enumerate(pages, 1)
    ]
    packed = [zlib.compress(encode(frame), _LEVEL) for frame in frames]
    data = json.dumps({"fps": fps, "frames": [base64.b64encode(f).decode() for f in packed]})
    text = page_html()
    for mark, more in (
        (
            _HEAD,
            f'<meta http-equiv="Content-Security-Policy" content="{content_security_policy()}">\n',
        ),
        (_PLACE, data),  # base64 and numbers: nothing in it ends the script
    ):
        text = text.replace(mark, mark + more, 1)
    text = text.replace(_TITLE, f"<title>{html.escape(printable(title))}</title>", 1)
    with atomic_write(Path(path)) as unfinished:
        unfinished.write_text(text, encoding="utf-8")
