"""Benchmark of scale: time and memory by the size of the volume, and by what is lit in it.

The first table pushes a torus knot that fills the volume, from a cold start: seconds and peak
memory with the emulator in the same process, then peak memory of the driver and of the emulator in
processes of their own, over a pty. The others show moving pictures to an emulator in the same
process, the same number of lit voxels in each volume: in the middle of it as in the smallest (the
same voxels), or as small circles all over it (spread). A ratio is that to the smallest volume with
as many voxels lit. The last table reads, voxelises and draws scenes of many circles, and of as many
open arcs that are as long, each in a process of its own; there a ratio is that of circles to arcs,
of what is voxelised and drawn. More objects than a scene may have are several scenes on one frame.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import voxdisplay as vd
from firmware_sim.device_on_line import DeviceOnLine
from voxdisplay.scene.builder import MAX_ITEMS

SEED = 24
SIDES, FORMATS = (128, 256, 512, 1024), ("mono1", "rgb888")
LIT = (200, 2000, 20_000, 200_000)
MANY = (20_000, 200_000)  # objects
_MEGABYTE = 1 << 20
_RADIUS = 8  # voxels, of the circles that are spread
_MOVES = 8  # voxels that a picture moves by at most


def knot(side: int) -> dict[str, Any]:
    """Return the scene of a torus knot that fills a cube."""
    return {
        "type": "torus_knot",
        "p": 3,
        "q": 7,
        "center": [side / 2] * 3,
        "major": 0.3 * side,
        "minor": 0.15 * side,
        "color": "orange",
    }


def pushed(side: int, pixels: str, repeats: int) -> tuple[float, float, int, int, int]:
    """Push a knot cold.

    Returns medians in seconds by the clock and of the processor, and peak memory in bytes: of both
    in one process, of the driver, and of the emulator.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "knot.json")
        scene.write_text(json.dumps(knot(side)))
        port = f"sim:?size={side}x{side}x{side}&format={pixels}"
        runs = [measured_push(scene, port) for _ in range(repeats)]
        command = [sys.executable, "-m", "firmware_sim", "--pty", "--size", f"{side},{side},{side}"]
        command += ["--format", pixels]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as emulator:
            assert emulator.stdout is not None  # noqa: S101 - it is a pipe
            try:
                *_, driver = measured_push(scene, json.loads(emulator.stdout.readline())["port"])
                other = peak_of(emulator.pid)
            finally:
                emulator.terminate()
    seconds, work_s, peaks = zip(*runs, strict=True)
    return statistics.median(seconds), statistics.median(work_s), max(peaks), driver, other


def measured_push(scene: Path, port: str) -> tuple[float, float, int]:
    """Push a scene in a process of its own.

    Returns seconds by the clock and of the processor, and peak memory in bytes.
    """
    command = [sys.executable, "-m", "voxdisplay", "push", str(scene), "--port", port]
    began_s = time.perf_counter()
    # wait4 reports the memory of this child alone; what it says goes to our stderr.
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - began_s
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"push to {port} ended with {process.returncode}")
    return seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss << 10


def peak_of(process: int) -> int:
    """Return the peak memory of a running process in bytes, 0 if the system does not tell."""
    status = Path(f"/proc/{process}/status")
    lines = status.read_text().splitlines() if status.exists() else []
    return next((int(line.split()[1]) << 10 for line in lines if line.startswith("VmHWM")), 0)


def picture(side: int, smallest: int, lit: int, *, spread: bool) -> list[NDArray[np.int32]]:
    """Return the voxels of curves: `lit` of them or a few more, with room for the moves."""
    rng = np.random.default_rng(SEED)
    box = side if spread else smallest
    low, high = _RADIUS + 1, box - _RADIUS - _MOVES - 1
    curves, seen = [], np.empty(0, dtype=np.int64)
    while len(seen) < lit:
        centres = rng.uniform(low, high, (max(1, (lit - len(seen)) // 45), 3))
        circles = vd.voxelize_many(
            vd.Circle(tuple(centre), _RADIUS, normal=tuple(rng.normal(size=3)))
            for centre in centres
        )
        new = [sequence.voxels for sequence in circles]
        curves += new
        places = np.concatenate(new).astype(np.int64) @ [1, box, box * box]
        seen = np.union1d(seen, places)
    middle = (side - box) // 2
    return [np.asarray(voxels + middle, dtype=np.int32) for voxels in curves]


def frames(
    side: int, smallest: int, pixels: str, lit: int, count: int, *, spread: bool
) -> dict[str, float]:
    """Show a picture that moves by one voxel a frame; return medians in seconds, and peak bytes."""
    curves = picture(side, smallest, lit, spread=spread)
    in_emulator = 0.0

    def watched(method: Any) -> Any:
        def timed(*arguments: Any) -> Any:
            nonlocal in_emulator
            began_s = time.process_time()
            try:
                return method(*arguments)
            finally:
                in_emulator += time.process_time() - began_s

        return timed

    DeviceOnLine.receive = watched(DeviceOnLine.receive)  # type: ignore[method-assign]
    DeviceOnLine.transmit = watched(DeviceOnLine.transmit)  # type: ignore[method-assign]
    whole, emulator = [], []
    with vd.open(f"sim:?size={side}x{side}x{side}&format={pixels}&refresh=0") as display:
        for number in range(count + 2):
            in_emulator, began_s = 0.0, time.process_time()
            frame = display.frame()
            for voxels in curves:
                frame.draw(voxels + number % _MOVES, "orange")
            display.present(frame)
            whole.append(time.process_time() - began_s)
            emulator.append(in_emulator)
    return {
        "voxels": sum(map(len, curves)),
        "seconds": statistics.median(whole[2:]),  # the first two allocate
        "emulator_s": statistics.median(emulator[2:]),
        "peak_bytes": peak_of(os.getpid()),
    }


def apart(name: str, *case: object) -> dict[str, float]:
    """Run a measurement of this module in a process of its own, so that its memory is its own."""
    command = [sys.executable, __file__, json.dumps([name, *case])]
    run = subprocess.run(command, check=True, stdout=subprocess.PIPE)
    found: dict[str, float] = json.loads(run.stdout)
    return found


def many_objects(kind: str, count: int) -> dict[str, float]:
    """Read, voxelise and draw scenes of circles or arcs; return processor seconds and bytes."""
    vd.read_scene(json.dumps({"size": [8, 8, 8], "objects": _objects(kind, 2)}))  # imports
    texts = [
        json.dumps({"size": [512] * 3, "objects": _objects(kind, min(count - low, MAX_ITEMS))})
        for low in range(0, count, MAX_ITEMS)
    ]
    frame = vd.Frame((512, 512, 512))
    read_s = drawn_s = voxels = 0.0
    while texts:
        began_s = time.process_time()
        scene = vd.read_scene(texts.pop())
        read_s += time.process_time() - began_s
        began_s = time.process_time()
        voxels += frame.draw(scene).voxels
        drawn_s += time.process_time() - began_s
        del scene
    began_s = time.process_time()
    frame.lit()
    drawn_s += time.process_time() - began_s
    return {
        "voxels": voxels,
        "read_s": read_s,
        "drawn_s": drawn_s,
        "peak_bytes": peak_of(os.getpid()),
    }


def _objects(kind: str, count: int) -> list[dict[str, Any]]:
    """Return circles of radius 3.5 all over the volume, or arcs that are all but closed."""
    rng = np.random.default_rng(SEED)
    centres = rng.uniform(10, 502, (count, 3)).round(3).tolist()
    normals = rng.normal(size=(count, 3)).round(3).tolist()
    ends = {"start": 0.0, "end": 6.2} if kind == "arc" else {}
    return [
        {"type": kind, "center": center, "normal": normal, "radius": 3.5, "color": "orange"} | ends
        for center, normal in zip(centres, normals, strict=True)
    ]


def bench_many(repeats: int, *, quick: bool) -> None:
    """Print the table of scenes of many objects."""
    print(
        f"\n{'many objects':<24}{'voxels':>9}{'read s':>9}{'draw s':>9}{'ratio':>7}{'peak MB':>9}"
    )
    for count in (200,) if quick else MANY:
        open_s = 0.0
        for kind in ("arc", "circle"):
            runs = [apart("many_objects", kind, count) for _ in range(1 if quick else repeats)]
            best = {name: min(run[name] for run in runs) for name in runs[0]}
            open_s = open_s or best["drawn_s"]
            print(
                f"{f'{count} {kind}s':<24}{best['voxels']:9.0f}{best['read_s']:9.2f}"
                f"{best['drawn_s']:9.2f}{best['drawn_s'] / open_s:7.2f}"
                f"{best['peak_bytes'] / _MEGABYTE:9.0f}",
                flush=True,
            )


def bench_scale(repeats: int, *, quick: bool = False) -> None:
    """Print the tables."""
    sides, lits = ((32, 48), (200,)) if quick else (SIDES, LIT)
    head = f"{'push from a cold start':<24}{'s':>7}{'work s':>8}{'ratio':>7}{'peak MB':>9}"
    print(f"{head}{'driver':>8}{'emulator':>10}")
    for pixels in FORMATS:
        first = 0.0
        for side in sides:
            seconds, work_s, *peaks = pushed(side, pixels, 1 if quick else repeats)
            first = first or work_s
            both, driver, emulator = (peak / _MEGABYTE for peak in peaks)
            print(
                f"{f'{side}^3 {pixels}':<24}{seconds:7.2f}{work_s:8.2f}{work_s / first:7.2f}"
                f"{both:9.0f}{driver:8.0f}{emulator:10.0f}",
                flush=True,
            )
    for spread in (False, True):
        title = "moving, spread" if spread else "moving, the same voxels"
        print(
            f"\n{title:<24}{'lit':>8}{'ms':>9}{'ratio':>7}{'emulator':>10}{'frames/s':>10}"
            f"{'peak MB':>9}"
        )
        for pixels in FORMATS:
            for lit in lits:
                first = 0.0
                for side in sides:
                    count = 1 if quick else max(repeats, min(30, 60_000 // lit))
                    found = apart("frames", side, sides[0], pixels, lit, count, spread)
                    first = first or found["seconds"]
                    print(
                        f"{f'{side}^3 {pixels}':<24}{found['voxels']:8.0f}"
                        f"{found['seconds'] * 1000:9.1f}{found['seconds'] / first:7.2f}"
                        f"{found['emulator_s'] * 1000:10.1f}{1 / found['seconds']:10.1f}"
                        f"{found['peak_bytes'] / _MEGABYTE:9.0f}",
                        flush=True,
                    )

    bench_many(repeats, quick=quick)


if __name__ == "__main__":
    measurement, *given = json.loads(sys.argv[1])
    if measurement == "frames":
        *given, is_spread = given
        json.dump(frames(*given, spread=is_spread), sys.stdout)
    else:
        json.dump(many_objects(*given), sys.stdout)
