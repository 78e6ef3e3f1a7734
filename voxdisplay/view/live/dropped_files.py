"""Pictures of files that are dropped on the page: scenes, meshes, volumes, recordings.

A file is not trusted. ``voxdisplay preview`` reads it in a process of its own, whose time, memory
and output are limited; what that writes is a page with frames, of which the frames are sent. Must
not know what kinds of file there are.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
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


async def frames_of_file(name: str, data: bytes) -> str:
    """Return the frames of a file as a page embeds them: JSON with ``fps`` and ``frames``.

    Cancelled, it ends the process that reads the file.

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
        page = Path(place, "page.html")
        await asyncio.to_thread(Path(place, plain).write_bytes, data)
        message = await _preview(place, plain, page.name)
        return await asyncio.to_thread(_frames_of_page, page, message, plain)


async def _preview(folder: str, name: str, page: str) -> str:
    """Run the command in a folder; return the beginning of what it writes to stderr."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", _PREVIEW, "preview", "-q", f"./{name}", "-o", page,
        cwd=folder,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
    )  # fmt: skip
    assert process.stderr is not None  # noqa: S101 - it is a pipe
    message = b""
    try:
        async with asyncio.timeout(_MAX_SECONDS):
            while part := await process.stderr.read(1 << 16):
                message = (message + part)[: 1 << 16]
            await process.wait()
    except TimeoutError:
        raise DroppedFileError(
            f"{name} takes longer than {_MAX_SECONDS:.0f} s: draw it by voxdisplay preview"
        ) from None
    finally:
        with contextlib.suppress(ProcessLookupError):  # it has ended
            process.kill()
        await process.wait()
    return message.decode(errors="replace")


def _frames_of_page(page: Path, message: str, name: str) -> str:
    if not page.exists():
        raise DroppedFileError(_shortened(message) or f"{name} cannot be read")
    return embedded_frames(page.read_text(encoding="utf-8"))


def _shortened(message: str) -> str:
    """Return an error of the command in one line, without the command's usage."""
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    start = next((i for i, line in enumerate(lines) if line.startswith("Error:")), 0)
    text = printable(" ".join(lines[start:])).removeprefix("Error: ").replace("./", "")
    return text[:_MAX_MESSAGE]
