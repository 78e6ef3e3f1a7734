"""Shows the tap in a browser, by a program that another package brings.

The emulator draws nothing itself. A viewer is a module named in the entry point group
``voxdisplay_sim.viewer``; it runs in a process of its own, so that its work is not the device's:
``python -m MODULE --tap HOST:PORT --listen HOST:PORT --title TEXT``, and ``--allow-origin ORIGIN``
for each origin whose pages may watch besides its own. Its first line on stdout is a
JSON object with ``url``, where a browser finds it; without such a line it has failed, and has said
why on stderr. It ends when the tap does.
"""

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterable, Iterator
from importlib.metadata import entry_points
from typing import Final

from firmware_sim.tap import Tap

GROUP: Final = "voxdisplay_sim.viewer"
_WAIT_S: Final = 5  # for the viewer's end; then it is made to


class ViewerError(OSError):
    """There is no viewer, or it did not start."""


@contextlib.contextmanager
def viewer(tap: Tap, address: str, title: str, allow_origins: Iterable[str] = ()) -> Iterator[str]:
    """Run a viewer.

    Parameters
    ----------
    tap
        What it shows.
    address
        Where it listens for browsers, as HOST:PORT; port 0 is any that is free.
    title
        What is written over the picture.
    allow_origins
        Origins whose pages may watch, too, such as ``https://cube.example.com``.

    Yields
    ------
    url : str
        Where a browser finds it.

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
        yield _url(process, module)
    finally:
        process.terminate()
        try:
            process.communicate(timeout=_WAIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def _url(process: subprocess.Popen[bytes], module: str) -> str:
    assert process.stdout is not None  # noqa: S101 - it is a pipe
    line = process.stdout.readline()
    try:
        return str(json.loads(line)["url"])
    except (ValueError, KeyError, TypeError):
        raise ViewerError(f"the viewer {module} did not start; it says why above") from None
