"""Measures the live view: frames a second in a real browser, and what the tap costs the emulator.

The frames come from a source in this process, all voxels of all frames different; they are painted
by Chromium without a graphics processor, and counted there.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Hashable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import voxdisplay as vd
from voxdisplay.view.live.message import Moment, encode
from voxdisplay.view.live.page import page
from voxdisplay.view.live.server import open_server

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from browser import Browser  # noqa: E402 - the tests' own

GRID = vd.Grid(128, 128, 128)
_PICTURES = 24
_SECONDS = 5.0


def helix(phase: float) -> vd.Frame:
    """Give the paper's curve, turned."""
    frame = vd.Frame(GRID)
    curve = vd.Parametric(
        f"64 + 40*cos(t + {phase})",
        f"64 + 40*sin(t + {phase})",
        "50 + 40*(1 - cos(4*t))",
        t=("-170*deg", "170*deg"),
    )
    frame.draw(curve, color="#ff8800")
    return frame


def ripple(phase: float, count: int) -> vd.Frame:
    """Give a thick surface that moves: ``count`` voxels, each of another colour."""
    frame = vd.Frame(GRID)
    x, y, layer = np.unravel_index(np.arange(count), (128, 128, 16), order="F")
    z = 56 + 40 * np.sin(np.hypot(x - 64, y - 64) / 8 + phase) + layer
    voxels = np.stack((x, y, z), axis=1).astype(np.int64)
    colors = np.stack((x * 2, y * 2, 255 - z), axis=1).astype(np.uint8)
    frame.draw(voxels, colors)
    return frame


class Film:
    """A source whose pictures never end."""

    def __init__(self, frames: list[vd.Frame]) -> None:
        self._moments = [
            Moment(f.array(), f.grid, f.format, n, "bench", f.digest())
            for n, f in enumerate(frames)
        ]
        self._turns = itertools.count()

    def next(self) -> tuple[Hashable, Moment]:
        """See `Source`."""
        turn = next(self._turns)
        return turn, self._moments[turn % len(self._moments)]

    def forget(self) -> None:
        """See `Source`."""

    def check(self) -> None:
        """See `Source`."""

    def close(self) -> None:
        """See `Source`."""


@contextlib.contextmanager
def served(source: Any) -> Iterator[str]:
    """Serve a source in a thread; give the URL."""
    ready, place = threading.Event(), {}

    async def serve() -> None:
        async with open_server(source, "127.0.0.1", 0) as server:
            place["url"], place["end"] = server.url, asyncio.Event()
            place["loop"] = asyncio.get_running_loop()
            ready.set()
            await place["end"].wait()

    thread = threading.Thread(target=asyncio.run, args=(serve(),))
    thread.start()
    ready.wait()
    try:
        yield place["url"]
    finally:
        place["loop"].call_soon_threadsafe(place["end"].set)
        thread.join()


def bench_browser(repeats: int) -> None:
    """Print frames a second in Chromium."""
    phases = np.linspace(0, 2 * np.pi, _PICTURES, endpoint=False)
    films = {
        "paper curve": [helix(p) for p in phases],
        "50k voxels": [ripple(p, 50_000) for p in phases],
        "200k voxels": [ripple(p, 200_000) for p in phases[:8]],
    }
    with tempfile.TemporaryDirectory() as folder:
        browser = Browser(Path(folder))
        try:
            for (name, frames), way in itertools.product(films.items(), ("2d", "gl")):
                with served(Film(frames)) as url:
                    tab = browser.tab(f"{url}?r={way}", width=1080, height=700)
                    tab.wait("painted > 3")
                    counts = []
                    for _ in range(repeats):
                        before, began_s = tab.run("painted"), time.perf_counter()
                        time.sleep(_SECONDS)
                        counts.append(
                            (tab.run("painted") - before) / (time.perf_counter() - began_s)
                        )
                    size = tab.run("`${canvas.width}x${canvas.height}`")
                    tab.close()
                shown = len(frames[0].lit()[0])
                print(
                    f"{name:<12} {way}  {shown:7d} lit  {size}  {statistics.median(counts):6.1f} frames/s",
                    flush=True,
                )
        finally:
            browser.close()
    moment = Film(films["50k voxels"]).next()[1]
    began_s = time.perf_counter()
    size = len(encode(moment))
    print(
        f"a message of 50k voxels: {size} bytes in {(time.perf_counter() - began_s) * 1000:.1f} ms; page {len(page().encode())} bytes"
    )
