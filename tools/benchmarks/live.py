"""Benchmark of the live view: frames per second in a real browser, and what the tap costs.

The frames come from a source in this process, all voxels of all frames different; Chromium paints
them, in software if there is no graphics processor, and counts them. The emulator decodes here too,
while its tap is read in another process as fast as the tap allows.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Hashable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.tap import Tap
from voxdisplay.view.live.page import page_html
from voxdisplay.view.live.server import open_server
from voxdisplay.view.live.snapshot_message import Snapshot, encode
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
from browser import PROGRAM, Browser

GRID = vd.Grid(128, 128, 128)
_PICTURES = 24
_SECONDS = 4.0


def helix(phase: float) -> vd.Frame:
    """Return the paper's curve, turned."""
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
    """Return a thick surface that moves: ``count`` voxels, each of another colour."""
    frame = vd.Frame(GRID)
    x, y, layer = np.unravel_index(np.arange(count), (128, 128, 16), order="F")
    z = 56 + 40 * np.sin(np.hypot(x - 64, y - 64) / 8 + phase) + layer
    voxels = np.stack((x, y, z), axis=1).astype(np.int64)
    colors = np.stack((x * 2, y * 2, 255 - z), axis=1).astype(np.uint8)
    frame.draw(voxels, colors)
    return frame


class Film:
    """Endless source of pictures."""

    def __init__(self, frames: list[vd.Frame]) -> None:
        self._moments = [
            Snapshot(f.array(), f.grid, f.format, n, "bench", f.digest())
            for n, f in enumerate(frames)
        ]
        self._turns = itertools.count()

    def next(self) -> tuple[Hashable, Snapshot]:
        """See `Source`."""
        turn = next(self._turns)
        return turn, self._moments[turn % len(self._moments)]

    def resend(self) -> None:
        """See `Source`."""

    def check_alive(self) -> None:
        """See `Source`."""

    def close(self) -> None:
        """See `Source`."""


@contextlib.contextmanager
def served(source: Any) -> Iterator[str]:
    """Serve a source in a thread; yield the URL."""
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


def bench_browser(repeats: int, *, quick: bool) -> None:
    """Print frames a second in Chromium."""
    if PROGRAM is None:
        print("no Chromium: no frames a second")
        return
    phases = np.linspace(0, 2 * np.pi, _PICTURES, endpoint=False)
    films = {
        "paper curve": [helix(p) for p in phases],
        "50k voxels": [ripple(p, 50_000) for p in phases],
        "200k voxels": [ripple(p, 200_000) for p in phases[:8]],
    }
    ways = ("2d",) if quick else ("2d", "gl")
    with tempfile.TemporaryDirectory() as folder, contextlib.closing(Browser(Path(folder))) as one:
        for (name, frames), way in itertools.product(films.items(), ways):
            with served(Film(frames)) as url:
                tab = one.tab(f"{url}?r={way}", width=1080, height=700)
                rate = statistics.median(_rate(tab) for _ in range(repeats))
                size = tab.run("`${canvas.width}x${canvas.height}`")
                tab.close()
            lit = len(frames[0].lit()[0])
            print(f"{name:<12} {way}  {lit:7d} lit  {size}  {rate:6.1f} frames/s", flush=True)


def _rate(tab: Any) -> float:
    """Count the pictures that are painted in a second."""
    tab.wait("painted > 3")
    before, began_s = tab.run("painted"), time.perf_counter()
    time.sleep(_SECONDS)
    return float((tab.run("painted") - before) / (time.perf_counter() - began_s))


def bench_tap(repeats: int) -> None:
    """Print how fast the emulator decodes, with a watcher on its tap and without, in turns."""
    for name, frame in (("paper curve", helix(0)), ("50k voxels", ripple(0, 50_000))):
        payloads = frame.payloads(1024)
        alone, watched, seen = [], [], []
        for _ in range(2 * repeats):
            alone.append(_decode(Device(Config(GRID, refresh=0)), payloads))
            device = Device(Config(GRID, refresh=0))
            with Tap(device) as tap, _watching(tap) as counted:
                device.on_swap = tap.notify_swap
                watched.append(_decode(device, payloads))
            seen.append(counted[0] / _SECONDS)
        for which, clock in enumerate(("CPU time", "time")):
            pairs = [(a[which], w[which]) for a, w in zip(alone, watched, strict=True)]
            plain, slowed = (statistics.median(pair[k] for pair in pairs) for k in (0, 1))
            share = statistics.median(100 * w / a for a, w in pairs)
            print(
                f"{name}: the emulator decodes {plain:.1f} frames a second of {clock} alone, "
                f"{slowed:.1f} watched ({share:.0f} %); {statistics.median(seen):.1f} are seen",
                flush=True,
            )


@contextlib.contextmanager
def _watching(tap: Tap) -> Iterator[list[int]]:
    """Read a tap in another process; return the number of pictures read."""
    command, counted = [sys.executable, "-c", _WATCHER, tap.address], [0]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as watcher:
        assert watcher.stdout is not None  # noqa: S101 - it is a pipe
        watcher.stdout.readline()
        try:
            yield counted
        finally:
            tap.close()
            counted[0] = int(watcher.stdout.readline())


_WATCHER = """
import sys
from voxdisplay.errors import TransportClosed
from voxdisplay.view.live.snapshot_message import encode
from voxdisplay.view.live.sources import TapSource
host, port = sys.argv[1].split(":")
source, seen = TapSource(host, int(port), ""), 0
print(flush=True)
try:
    while True:
        encode(source.next()[1])
        seen += 1
except TransportClosed:
    print(seen)
"""


def _decode(device: Device, payloads: list[bytes]) -> tuple[float, float]:
    """Return frames per second of CPU time, and of time, of a device that decodes one frame.

    On a busy machine the watcher takes time from everybody; CPU time is the device's own.
    """
    device.receive(b"\0" + packets.encode(packets.Hello(session=1)))
    device.transmit()
    seconds, cpu_s, seq = 0.0, 0.0, 0
    end_s = time.monotonic() + _SECONDS
    while time.monotonic() < end_s:
        for number, ops in enumerate(payloads, 1):
            flags = spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT * (number == len(payloads))
            frame = device.swaps % 256
            wire = packets.encode(packets.Data(seq=seq % 256, frame=frame, flags=flags, ops=ops))
            began_s, began_cpu_s = time.perf_counter(), time.thread_time()
            device.receive(wire)
            seconds += time.perf_counter() - began_s
            cpu_s += time.thread_time() - began_cpu_s
            device.transmit()
            seq += 1
    return device.swaps / cpu_s, device.swaps / seconds


def bench_live(repeats: int, *, quick: bool) -> None:
    """Print all of it."""
    snapshot = Film([ripple(0, 50_000)]).next()[1]
    encode(snapshot)
    began_s = time.perf_counter()
    size = len(encode(snapshot))
    took_ms = (time.perf_counter() - began_s) * 1000
    page_bytes = len(page_html().encode())
    print(f"page: {page_bytes} bytes; 50k voxels: {size} bytes, made in {took_ms:.1f} ms")
    bench_tap(repeats)
    bench_browser(1 if quick else repeats, quick=quick)
