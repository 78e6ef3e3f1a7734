"""Reading of regular files of bounded size, and of such that must lie in a certain folder.

Must not know what is in the files.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path, PureWindowsPath

from voxdisplay.errors import BodyError, similar_file
from voxdisplay.files.contents import MAX_BYTES

_NAMED = 120  # characters of a name that an error shows
_COMPARED = 1000  # names in a folder that are compared with one that is not there


def short_name(name: str | os.PathLike[str]) -> str:
    """Return a file's name as errors show it: printable, its end if it is long."""
    text = str(name)
    text = text if text.isprintable() else ascii(text)[1:-1]
    return text if len(text) <= _NAMED else f"...{text[-_NAMED:]}"


def read_inside(folder: Path, name: str, most: int = MAX_BYTES) -> bytes:
    """Read a file in a folder, or below it.

    Parameters
    ----------
    folder : Path
    name : str
        Relative to it.
    most : int
        Most bytes.

    Raises
    ------
    BodyError
        If the file lies elsewhere (links are followed first), or as `read_file`.

    """
    return read_file(path_inside(folder, name), most)


def path_inside(folder: Path, name: str) -> Path:
    """Return the path of a file in a folder or below it; raise `BodyError` otherwise."""
    parts = PureWindowsPath(name)  # knows / and \ and drives, on any system
    if parts.is_absolute() or parts.anchor or ".." in parts.parts or "\0" in name:
        raise BodyError(f"{short_name(name)} is outside the folder {short_name(folder)}")
    try:
        root = folder.resolve()
        path = (root / name).resolve()
    except (OSError, RuntimeError) as error:  # of links in a loop
        raise _unreadable(name, error) from None
    if not path.is_relative_to(root):
        raise BodyError(f"{short_name(name)} leads outside the folder {short_name(folder)}")
    return path


def read_file(path: Path, most: int = MAX_BYTES) -> bytes:
    """Read a whole regular file.

    Raises
    ------
    BodyError
        If it is missing, cannot be read, is no regular file, or has more than `most` bytes.

    """
    # Not blocking: else opening a pipe would wait for a writer.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    try:
        handle = os.open(path, flags)
        with os.fdopen(handle, "rb") as file:
            status = os.fstat(handle)
            if not stat.S_ISREG(status.st_mode):
                raise BodyError(f"{short_name(path)} is not a regular file")
            data = file.read(most + 1) if status.st_size <= most else b""
    except FileNotFoundError:
        raise _missing(path) from None
    except IsADirectoryError:
        raise BodyError(f"{short_name(path)} is a folder") from None
    except (OSError, ValueError, MemoryError) as error:
        raise _unreadable(path, error) from None
    if max(len(data), status.st_size) > most:
        raise BodyError(f"{short_name(path)} is larger than {most >> 20} MiB")
    return data


def names_in(folder: Path, most: int = _COMPARED) -> list[str]:
    """Return the names of at most `most` files in a folder, in no order."""
    with os.scandir(folder) as entries:
        return [entry.name for entry, _ in zip(entries, range(most), strict=False)]


def _missing(path: Path) -> BodyError:
    try:
        hint = similar_file(path.name, names_in(path.parent))
    except OSError:
        hint = f"there is no folder {short_name(path.parent)}"
    return BodyError(f"there is no file {short_name(path)}", hint=hint)


def _unreadable(name: str | os.PathLike[str], error: Exception) -> BodyError:
    what = (error.strerror if isinstance(error, OSError) else None) or error
    return BodyError(f"cannot read {short_name(name)}: {what}")
