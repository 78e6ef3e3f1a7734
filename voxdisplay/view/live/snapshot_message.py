"""Snapshot message to a browser: one picture as lit voxels with their pixel values.

A message is a u32 (the offset of the data, a multiple of 8), a JSON object filled up with spaces,
and planes of bytes, all little-endian::

    bitmap       ceil(nx*ny*nz / 8) bytes in scan order, bit 0 first, if ``bitmap`` is true; else
    x, y, z      three planes with a u8 for each lit voxel, or a u16 if ``wide`` is true
    pixel        no plane for mono1, one for index8, two for rgb565 (low byte first), three for
                 rgb888 (red, green, blue)
    palette      for index8: three planes of 256, red, green and blue of each pixel value

Lit voxels are in scan order, which deflates well. The JSON has ``number``, ``title``, ``size``,
``format``, ``voxels``, ``digest`` (hex, or null), ``counters``, ``bitmap``, ``wide``, ``own``:
which entries are not those of the default palette; and ``view``: from where it is best seen, [yaw
and pitch in radians, zoom], or null; and ``port``, to which others can push meanwhile, or null.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from voxdisplay.printable_text import printable
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import DEFAULT, Colors, Palette
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.view.camera import Camera
from voxdisplay.view.lit_voxels import lit_voxels

_OFFSET = struct.Struct("<I")


@dataclass(frozen=True)
class Snapshot:
    """Page of a display at one time, with what is known of it.

    Attributes
    ----------
    page : ndarray or PixelMap
        As from `Display.read`, indexed [z, y, x]; or the lit pixels alone.
    grid : Grid
    format : PixelFormat
    number : int
        Number of the picture, counted by its source.
    title : str
        Heading of the picture.
    digest : int or None
        Digest of the page by the device (protocol.md, section 8).
    counters : mapping of str to int
        Further figures of the source, by names for users.
    palette : (256, 3) uint8 array or None
        Of an index8 page; None for the default one.
    camera : Camera or None
        From where it is best seen.
    port : str or None
        Where others can show something on the display, while it is watched.

    """

    page: NDArray[np.integer] | PixelMap
    grid: Grid
    format: PixelFormat
    number: int
    title: str
    digest: int | None = None
    counters: Mapping[str, int] = field(default_factory=dict)
    palette: Colors | None = None
    camera: Camera | None = None
    port: str | None = None


def encode(snapshot: Snapshot) -> bytes:
    """Return the message for a snapshot."""
    grid = snapshot.grid
    voxels = lit_voxels(snapshot.page, grid, snapshot.format).positions
    wide = max(grid) > 256
    bitmap = grid.voxels / 8 < voxels.nbytes / (1 if wide else 2)
    if bitmap:
        lit = np.zeros(grid.voxels, dtype=bool)
        lit[grid.index_of(voxels)] = True
        places = np.packbits(lit, bitorder="little").tobytes()
    else:
        places = voxels.T.astype("<u2" if wide else "u1").tobytes()
    palette, camera = Palette(snapshot.palette), snapshot.camera
    head = json.dumps(
        {
            "number": snapshot.number,
            "title": printable(snapshot.title),
            "size": list(grid),
            "format": snapshot.format.value,
            "voxels": len(voxels),
            "digest": None if snapshot.digest is None else f"{snapshot.digest:08x}",
            "counters": dict(snapshot.counters),
            "bitmap": bitmap,
            "wide": wide,
            "own": palette.entries_differing(DEFAULT).tolist(),
            "port": None if snapshot.port is None else printable(snapshot.port),
            "view": [camera.yaw, camera.pitch, camera.zoom] if camera else None,
        }
    ).encode()
    head += b" " * (-(len(head) + _OFFSET.size) % 8)
    return (
        _OFFSET.pack(_OFFSET.size + len(head)) + head + places + _planes(snapshot, voxels, palette)
    )


def _planes(snapshot: Snapshot, voxels: NDArray[np.integer], palette: Palette) -> bytes:
    """Return the planes of pixel values, and the palette of index8."""
    if snapshot.format is PixelFormat.MONO1:
        return b""
    if isinstance(snapshot.page, PixelMap):
        values = snapshot.format.pixels(snapshot.page.values).T
    else:
        x, y, z = voxels.T
        values = snapshot.page[z, y, x].T
    if snapshot.format is PixelFormat.RGB565:
        values = np.stack((values & 0xFF, values >> 8))
    planes = bytes(values.astype("u1").tobytes())
    return planes + palette.colors.T.tobytes() if snapshot.format is PixelFormat.INDEX8 else planes
