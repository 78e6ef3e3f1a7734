"""Benchmarks of the project: medians and ratios of one run, printed as one table.

``push`` times a frame stage by stage, over a pty to an emulator in its own process; ``cold`` the
command from a cold start; ``curves`` voxelisation beside other methods; ``bodies`` that of meshes;
``link`` the encoders beside other codings; ``view`` pictures and the live view; ``ports`` each kind
of port beside the bare pipe below it; ``stream`` how busy streaming keeps a line; ``goodput`` what
bit errors leave of one; ``scale`` time and memory by the size of the volume and by what is lit;
``play`` how evenly shows play by line rate. Each of these is a module in `benchmarks`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import statistics
import subprocess
import sys
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from benchmarks.bodies import bench_bodies
from benchmarks.curves import bench_curves
from benchmarks.goodput import bench_goodput
from benchmarks.link import bench_link
from benchmarks.live import bench_live
from benchmarks.play import bench_play
from benchmarks.ports import bench_ports
from benchmarks.scale import bench_scale
from benchmarks.stream import bench_stream
from benchmarks.view import bench_view

import voxdisplay as vd

ROOT = Path(__file__).resolve().parents[1]
SEED = 20


def paper_scene(radius: int, w: int) -> dict[str, Any]:
    """Return the paper's curve: radius and amplitude, and oscillations a turn."""
    params = {"R": radius, "A": radius, "w": w, "o": 50 * radius // 40}
    curve = {
        "type": "parametric",
        "x": "o + R*cos(t)",
        "y": "o + R*sin(t)",
        "z": "o + A*(1 - cos(w*t))",
        "t": ["-170*deg", "170*deg"],
        "color": "#ff8800",
    }
    return {"params": params, "objects": [curve]}


def random_scene(count: int) -> dict[str, Any]:
    """Return random parametric curves that fill a volume of 128^3: sums of two harmonics."""
    chance = random.Random(SEED)

    def formula() -> str:
        middle = chance.uniform(24, 104)
        terms = [
            f"{chance.uniform(4, 12):.3f}*sin({k}*t + {chance.uniform(0, 6.3):.3f})" for k in (1, 2)
        ]
        return f"{middle:.3f} + " + " + ".join(terms)

    return {
        "objects": [
            {
                "type": "parametric",
                **{axis: formula() for axis in "xyz"},
                "t": [0, "pi"],
                "color": chance.choice(["orange", "#0af", "lime", "white"]),
            }
            for _ in range(count)
        ]
    }


# By the size of the display: the paper's two, and its curves for each (table I).
SCENES = {
    "128x128x128": {
        "paper R=40 w=2": paper_scene(40, 2),
        "paper R=40 w=4": paper_scene(40, 4),
        "1000 random": random_scene(1000),
    },
    "256x256x256": {
        "paper R=80 w=2": paper_scene(80, 2),
        "paper R=80 w=4": paper_scene(80, 4),
    },
}


@contextlib.contextmanager
def emulator(*arguments: str) -> Iterator[str]:
    """Run an emulator in its own process; yield its port."""
    command = [sys.executable, "-m", "firmware_sim", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        try:
            yield json.loads(process.stdout.readline())["port"]
        finally:
            process.terminate()


class Stopwatch:
    """Stopwatch that sums the times of calls."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def wrap(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function with its time added to the sum."""

        def timed(*arguments: Any, **named: Any) -> Any:
            began_s = time.perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                self.seconds += time.perf_counter() - began_s

        return timed


def push_once(data: bytes, display: vd.Display, link: Stopwatch) -> dict[str, float]:
    """Push a scene once; return seconds by stage, and sizes."""
    marks = [time.perf_counter()]
    items = vd.read_scene(data).items
    marks.append(time.perf_counter())
    sequences = vd.voxelize_many(item.curve for item in items)
    marks.append(time.perf_counter())
    frame = display.frame()
    for sequence, item in zip(sequences, items, strict=True):
        frame.draw(sequence, item.color)
    marks.append(time.perf_counter())
    payloads = frame.payloads(display.info.max_payload_bytes, display.info.features)
    marks.append(time.perf_counter())
    frame.digest()
    marks.append(time.perf_counter())
    link.seconds = 0.0
    ticket = display._connection.link.present(payloads)  # noqa: SLF001 - a stage of present()
    while not display._operations.queue.is_shown(ticket):  # noqa: SLF001
        display._operations.pump()  # noqa: SLF001
    marks.append(time.perf_counter())
    names = ("parse", "voxelise", "draw", "encode", "digest", "pipe")
    stages = {
        name: after - before for name, before, after in zip(names, marks, marks[1:], strict=False)
    }
    stages["link"] = link.seconds
    stages["pipe"] -= link.seconds
    stages["voxels"] = sum(map(len, sequences))
    stages["packets"] = len(payloads)
    stages["bytes"] = sum(map(len, payloads))
    return stages


def raw_pipe(size: int) -> float:
    """Return the time of a bare transfer of ``size`` bytes through a pty, in seconds."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    if os.fork() == 0:
        got = 0
        while got < size:
            got += len(os.read(ours, 65536))
        os.write(ours, b"!")
        os._exit(0)
    began_s = time.perf_counter()
    data = bytes(size)
    while data:
        data = data[os.write(theirs, data) :]
    os.read(theirs, 1)
    seconds = time.perf_counter() - began_s
    os.wait()
    os.close(ours)
    os.close(theirs)
    return seconds


STAGES = ("parse", "voxelise", "draw", "encode", "digest", "link", "pipe")


def bench_push(repeats: int) -> None:
    """Print the cost of a frame, stage by stage."""
    head = [f"{name + ' ms':>12}" for name in (*STAGES, "raw pipe")]
    print(f"{'scene':<16}{'voxels':>8}{'packets':>8}{'op bytes':>9}{'bit/vox':>8}", *head, sep="")
    for size, scenes in SCENES.items():
        bench_scenes(size, scenes, repeats)


def bench_scenes(size: str, scenes: dict[str, dict[str, Any]], repeats: int) -> None:
    """Print a line for each scene, on an emulator of a size."""
    with emulator("--pty", "--size", size, "--refresh", "0") as port, vd.open(port) as display:
        link = Stopwatch()
        watched = display._connection.link  # noqa: SLF001
        watched.transmit = link.wrap(watched.transmit)  # type: ignore[method-assign]
        watched.receive = link.wrap(watched.receive)  # type: ignore[method-assign]
        for name, scene in scenes.items():
            data = json.dumps(scene).encode()
            push_once(data, display, link)
            runs = [push_once(data, display, link) for _ in range(repeats)]
            median = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
            ops = int(median["bytes"])
            raw = statistics.median(raw_pipe(ops) for _ in range(repeats))
            shown = [f"{seconds * 1000:12.2f}" for seconds in (*(median[s] for s in STAGES), raw)]
            print(
                f"{name:<16}{median['voxels']:8.0f}{median['packets']:8.0f}{ops:9d}"
                f"{ops * 8 / median['voxels']:8.2f}",
                *shown,
                sep="",
            )


def bench_cold(repeats: int) -> None:
    """Print the cost of the command from a cold start."""
    command = [sys.executable, "-m", "voxdisplay", "push", "examples/paper-curve.json"]
    bare = [sys.executable, "-c", "import numpy"]
    for name, arguments in (("push --port sim:", [*command, "--port", "sim:"]), ("numpy", bare)):
        seconds = []
        for _ in range(repeats):
            began_s = time.perf_counter()
            subprocess.run(arguments, cwd=ROOT, check=True, capture_output=True)
            seconds.append(time.perf_counter() - began_s)
        print(f"cold start, {name:<18} median of {repeats}: {statistics.median(seconds):.3f} s")


def bench_views(repeats: int, *, quick: bool) -> None:
    """Print the cost of pictures and the speed of the live view."""
    bench_view(repeats, quick=quick)
    bench_live(repeats, quick=quick)


TABLES = {
    "bodies": bench_bodies,
    "curves": bench_curves,
    "link": bench_link,
    "view": bench_views,
    "ports": bench_ports,
    "stream": bench_stream,
    "goodput": bench_goodput,
    "scale": bench_scale,
    "play": bench_play,
}


def main() -> None:
    """Run the benchmark that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=[*TABLES, "push", "cold"])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="only a little; not of push and cold")
    options = parser.parse_args()
    if table := TABLES.get(options.what):
        table(options.repeats, quick=options.quick)
    else:
        {"push": bench_push, "cold": bench_cold}[options.what](options.repeats)


if __name__ == "__main__":
    main()
