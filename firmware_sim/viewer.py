"""Start of a viewer: a program of another package that shows the tap in a browser.

The emulator renders nothing itself. A viewer is a module named in the entry point group
``voxdisplay_sim.viewer``. It runs in a process of its own, so that it takes no time of the device:
``python -m MODULE --tap HOST:PORT --listen HOST:PORT --title TEXT``, and ``--allow-origin ORIGIN``
for each further origin whose pages may show it. Its first line on stdout is a JSON object with
``url``, the address for the browser; without such a line it has failed, and has reported why on
stderr. It ends when the tap does.
"""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from importlib.metadata import entry_points
from typing import Final

from firmware_sim.readiness import wait_ready
from firmware_sim.tap import Tap

GROUP: Final = "voxdisplay_sim.viewer"
_WAIT_S: Final = 5  # for the viewer to end; then it is killed
_MAX_LINE_BYTES: Final = 4096


class ViewerError(OSError):
    """No viewer is installed, or it did not start."""


@contextlib.contextmanager
def viewer(
    tap: Tap, address: str, title: str, stop: int, allow_origins: Iterable[str] = ()
) -> Iterator[str]:
    """Run a viewer.

    Parameters
    ----------
    tap
        What it shows.
    address
        Where it listens for browsers, as HOST:PORT; port 0 is any that is free.
    title
        Title of the page.
    stop
        File descriptor that becomes readable when it is time to stop.
    allow_origins
        Further origins whose pages may show it, such as ``https://cube.example.com``.

    Yields
    ------
    url : str
        Address for the browser; empty if it was told to stop before the viewer started.

    Raises
    ------
    ViewerError
        If none is installed, or it did not start.
    """
    module = next((entry.module for entry in entry_points(group=GROUP)), None)
    if module is None:
        raise ViewerError("no viewer is installed: pip install 'voxdisplay[view]'")
    command = [sys.executable, "-m", module]
    command += ["--tap", tap.address, "--listen", address, "--title", title]
    for origin in allow_origins:
        command += ["--allow-origin", origin]
    # In a session of its own: it is ours to end, not the terminal's.
    process = subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True)  # noqa: S603 - no shell
    try:
        yield _url(process, module, stop)
    finally:
        process.terminate()
        try:
            process.communicate(timeout=_WAIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def _url(process: subprocess.Popen[bytes], module: str, stop: int) -> str:
    assert process.stdout is not None  # noqa: S101 - it is a pipe
    output = process.stdout.fileno()
    line = b""
    while b"\n" not in line and len(line) < _MAX_LINE_BYTES:
        readable, _ = wait_ready([output, stop])
        if stop in readable:
            return ""
        data = os.read(output, _MAX_LINE_BYTES)
        if not data:
            break
        line += data
    try:
        return str(json.loads(line)["url"])
    except (ValueError, KeyError, TypeError):
        raise ViewerError(f"the viewer {module} did not start; see its message above") from None
