"""Pictures of files that are dropped on the page: scenes, meshes, volumes, recordings.

A file is not trusted. ``voxdisplay preview`` reads it in a process of its own, whose time, memory
and output are limited; what that writes is a page with frames, of which the frames are sent. Must
not know what kinds of file there are.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from voxdisplay.printable_text import printable
from voxdisplay.view.html_export import embedded_frames

MAX_FILE_BYTES = 32 << 20
_MAX_PAGE_BYTES = 128 << 20
_MAX_MEMORY_BYTES = 4 << 30
_MAX_SECONDS = 60.0
_MAX_MESSAGE = 600  # characters of an error

_PREVIEW = f"""
import sys
try:
    import resource
except ImportError:  # not on Windows
    pass
else:
    resource.setrlimit(resource.RLIMIT_AS, ({_MAX_MEMORY_BYTES}, {_MAX_MEMORY_BYTES}))
    resource.setrlimit(resource.RLIMIT_FSIZE, ({_MAX_PAGE_BYTES}, {_MAX_PAGE_BYTES}))
from voxdisplay.__main__ import main
sys.exit(main())
"""


class DroppedFileError(Exception):
    """A file cannot be shown; its message is for the page."""


def frames_of_file(name: str, data: bytes) -> str:
    """Return the frames of a file as a page embeds them: JSON with ``fps`` and ``frames``.

    Parameters
    ----------
    name : str
        The file's name, whose suffix tells its kind. It is not trusted.
    data : bytes

    Raises
    ------
    DroppedFileError
        If it cannot be shown; the message says why.

    """
    if len(data) > MAX_FILE_BYTES:
        raise DroppedFileError(f"the file is larger than {MAX_FILE_BYTES >> 20} MiB")
    plain = re.sub(r"[^\w. -]", "_", name)[-80:].lstrip(". -") or "file"
    with tempfile.TemporaryDirectory(prefix="voxdisplay-") as place:
        folder = Path(place)
        (folder / "of").mkdir()  # what the file names beside it is not there
        (folder / "of" / plain).write_bytes(data)
        message = _preview(folder / "of", plain)
        page = folder / "page.html"
        if not page.exists():
            raise DroppedFileError(_shortened(message) or f"{plain} cannot be read")
        return embedded_frames(page.read_text(encoding="utf-8"))


def _preview(folder: Path, name: str) -> str:
    """Run the command in a folder; return what it writes to stderr."""
    command = [sys.executable, "-c", _PREVIEW, "preview", "-q", f"./{name}", "-o", "../page.html"]
    written = folder.parent / "messages"
    try:
        with written.open("wb") as messages:
            subprocess.run(  # noqa: S603 - no shell
                command,
                check=False,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=messages,
                timeout=_MAX_SECONDS,
            )
    except subprocess.TimeoutExpired:
        raise DroppedFileError(
            f"{name} takes longer than {_MAX_SECONDS:.0f} s: draw it by voxdisplay preview"
        ) from None
    with written.open("rb") as messages:
        return messages.read(1 << 16).decode(errors="replace")


def _shortened(message: str) -> str:
    """Return an error of the command in one line, without the command's usage."""
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    start = next((i for i, line in enumerate(lines) if line.startswith("Error:")), 0)
    text = printable(" ".join(lines[start:])).removeprefix("Error: ").replace("./", "")
    return text[:_MAX_MESSAGE]
