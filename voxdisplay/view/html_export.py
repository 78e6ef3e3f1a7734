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
from collections.abc import Mapping, Sequence
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
_SCRIPT_END = "</script>"
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
    text = page_with({"fps": fps, "frames": [packed_text(frame) for frame in frames]}, title)
    with atomic_write(Path(path)) as unfinished:
        unfinished.write_text(text, encoding="utf-8")


def packed_text(snapshot: Snapshot, level: int = _LEVEL) -> str:
    """Return a snapshot's message, deflated at a level of zlib, in base64."""
    return base64.b64encode(zlib.compress(encode(snapshot), level)).decode()


def page_with(embedded: Mapping[str, object], title: str) -> str:
    """Return the page with what is embedded in it, and a policy that lets it load nothing.

    Parameters
    ----------
    embedded : mapping
        ``frames``: list of `packed_text`, and ``fps``, their rate. ``cell``: true for the page in
        a cell of a notebook; without frames, it takes those that the widget around it sends.
    title : str

    """
    text = page_html()
    for mark, more in (
        (
            _HEAD,
            f'<meta http-equiv="Content-Security-Policy" content="{content_security_policy()}">\n',
        ),
        (_PLACE, json.dumps(embedded)),  # base64, numbers and words: nothing ends the script
    ):
        text = text.replace(mark, mark + more, 1)
    return text.replace(_TITLE, f"<title>{html.escape(printable(title))}</title>", 1)


def embedded_frames(text: str) -> str:
    """Return the frames in the text of a file that `save_html` wrote: JSON."""
    return text.partition(_PLACE)[2].partition(_SCRIPT_END)[0]
