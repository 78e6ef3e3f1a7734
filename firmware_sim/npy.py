"""Export of a page as a ``.npy`` file, format version 1.0, for numpy.

Knows nothing of the device but the snapshot that it is given.
"""

import secrets
import stat
import struct
from pathlib import Path
from typing import Final

from firmware_sim.bench import Snapshot

_MAGIC: Final = b"\x93NUMPY\x01\x00"
_ALIGN: Final = 64  # the data begin at a multiple of this offset
_DTYPES: Final = {
    "mono1": ("|u1", ()),
    "index8": ("|u1", ()),
    "rgb565": ("<u2", ()),
    "rgb888": ("|u1", (3,)),
}


def npy_header(snapshot: Snapshot) -> bytes:
    """Return the header of the file, before the pixels.

    The array has the shape (nz, ny, nx), for RGB888 (nz, ny, nx, 3).
    """
    dtype, channels = _DTYPES[snapshot.pixel_format]
    shape = (*reversed(snapshot.grid), *channels)
    text = repr({"descr": dtype, "fortran_order": False, "shape": shape}).encode()
    fixed = len(_MAGIC) + 2 + 1  # a u16 and the newline
    text += b" " * (-(fixed + len(text)) % _ALIGN) + b"\n"
    return _MAGIC + struct.pack("<H", len(text)) + text


def write_npy(path: Path, snapshot: Snapshot) -> None:
    """Write a snapshot to a file, atomically for all who read it.

    Parameters
    ----------
    path
        The file. It is written under another name beside it first, then renamed.
    snapshot
        What was on display.

    Raises
    ------
    OSError
        If the file cannot be written, or if the path is not that of a file: a device such as
        /dev/null would be replaced, too.
    """
    if path.exists() and not stat.S_ISREG(path.stat().st_mode):
        raise FileExistsError(f"{path} exists and is no regular file: take another path")
    # A new file under a name that nobody can guess: no link laid there beforehand is followed.
    beside = path.with_name(f".{path.name}.{secrets.token_hex(6)}.tmp")
    try:
        with beside.open("xb") as file:  # exclusive: fails if anything is there
            header = npy_header(snapshot)
            file.write(header)
            stored = snapshot.stored
            # The system keeps what is left out as a hole, which takes no space.
            for start, pixels in stored.pieces():
                file.seek(len(header) + start * stored.pixel_size)
                file.write(pixels)
            file.truncate(len(header) + stored.volume * stored.pixel_size)
        beside.replace(path)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise OSError(f"{path} cannot be written: {error.strerror or error}") from error
