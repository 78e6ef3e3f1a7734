"""A page as a ``.npy`` file, format version 1.0, for whoever looks on with numpy.

It knows nothing of the device but the snapshot that it is given.
"""

import os
import struct
from pathlib import Path
from typing import Final

from firmware_sim.bench import Snapshot

_MAGIC: Final = b"\x93NUMPY\x01\x00"
_ALIGN: Final = 64  # the data begin at a multiple of this
_DTYPES: Final = {
    "mono1": ("|u1", ()),
    "index8": ("|u1", ()),
    "rgb565": ("<u2", ()),
    "rgb888": ("|u1", (3,)),
}


def npy_header(snapshot: Snapshot) -> bytes:
    """Return what stands in the file before the pixels.

    The array has the shape (nz, ny, nx), for RGB888 (nz, ny, nx, 3).
    """
    dtype, channels = _DTYPES[snapshot.pixel_format]
    shape = (*reversed(snapshot.grid), *channels)
    text = repr({"descr": dtype, "fortran_order": False, "shape": shape}).encode()
    fixed = len(_MAGIC) + 2 + 1  # a u16 and the newline
    text += b" " * (-(fixed + len(text)) % _ALIGN) + b"\n"
    return _MAGIC + struct.pack("<H", len(text)) + text


def write_npy(path: Path, snapshot: Snapshot) -> None:
    """Write a snapshot to a file, at once for all who read it.

    Parameters
    ----------
    path
        The file. It is written beside its place first and then put there.
    snapshot
        What was on display.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with beside.open("wb") as file:
            file.write(npy_header(snapshot))
            file.write(snapshot.pixels)
        beside.replace(path)
    except OSError:
        beside.unlink(missing_ok=True)
        raise
