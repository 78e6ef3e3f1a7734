"""Benchmark of playing: frames asked, shown and dropped, and how even their swaps are.

Three shows at 30 frames a second, over real ptys to an emulator in another process that is paced
at a line's rate, and over emulated USB. Four ways: a plain loop that presents without waiting and
sleeps, the same with `Display.clock`, and `Display.play` by the host's clock and by the device's
ticks. "line" is what the line carries of such frames; the processor is shared by all that runs.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

import voxdisplay as vd
from benchmarks.link import SEED
from voxdisplay.display.plan import Line, Receiver, plan

FPS = 30
SIZE = (128, 128, 128)
REFRESH_HZ = 60
BAUDS = (115_200, 1_000_000, 12_000_000)
_TURN_S = 6.0


class BenchShow:
    """A show that picks its pictures by the time."""

    fps = float(FPS)
    loop = False

    def __init__(self, seconds: float) -> None:
        self.duration = seconds
        self.frame_count = round(seconds * FPS)

    def frame(self, number: int) -> vd.Frame:
        """See `Show.frame`."""
        frame = vd.Frame(SIZE)
        self.draw(frame, number / FPS)
        return frame

    def draw(self, frame: vd.Frame, time_s: float) -> None:
        """Draw the picture of a time."""
        raise NotImplementedError


class RotatingCurve(BenchShow):
    """The paper's curve, turning."""

    def draw(self, frame: vd.Frame, time_s: float) -> None:
        """See `BenchShow.draw`."""
        turn = 2 * np.pi * time_s / _TURN_S
        curve = vd.Parametric(
            f"64 + 40*cos(t + {turn})",
            f"64 + 40*sin(t + {turn})",
            "24 + 40*(1 - cos(4*t))",
            t=("-170*deg", "170*deg"),
        )
        frame.draw(curve, "#ff8800")


class MovingBeziers(BenchShow):
    """A hundred cubic Beziers whose control points go round."""

    def __init__(self, seconds: float) -> None:
        super().__init__(seconds)
        chance = np.random.default_rng(SEED)
        self._middle = chance.uniform(16, 112, (100, 1, 3)) + chance.uniform(-24, 24, (100, 4, 3))
        self._phase = chance.uniform(0, 2 * np.pi, (100, 4, 3))

    def draw(self, frame: vd.Frame, time_s: float) -> None:
        """See `BenchShow.draw`."""
        turn = 2 * np.pi * time_s / _TURN_S
        points = (self._middle + 8 * np.sin(self._phase + turn)).clip(0.5, 127.5)
        colors = ("orange", "#0af", "lime", "white")
        frame.draw_all((vd.Bezier(each), colors[n % 4]) for n, each in enumerate(points))


class TumblingTorus(BenchShow):
    """The shell of a torus, sampled by points, tumbling."""

    def __init__(self, seconds: float) -> None:
        super().__init__(seconds)
        u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 700), np.linspace(0, 2 * np.pi, 300))
        ring = 36 + 15 * np.cos(v)
        self._points = np.stack((ring * np.cos(u), ring * np.sin(u), 15 * np.sin(v)), -1)

    def draw(self, frame: vd.Frame, time_s: float) -> None:
        """See `BenchShow.draw`."""
        a, b = 2 * np.pi * time_s / _TURN_S, 4 * np.pi * time_s / _TURN_S
        about_x = [[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]]
        about_z = [[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]]
        turned = self._points.reshape(-1, 3) @ (np.array(about_x) @ np.array(about_z)).T
        voxels = np.floor(turned + 64).astype(np.int64)
        index = np.unique(voxels[:, 0] + 128 * (voxels[:, 1] + 128 * voxels[:, 2]))
        frame.draw(np.stack((index % 128, index // 128 % 128, index // 16384), 1), "cyan")


SHOWS: dict[str, Callable[[float], BenchShow]] = {
    "rotating curve": RotatingCurve,
    "100 moving Beziers": MovingBeziers,
    "tumbling torus": TumblingTorus,
}


@dataclass(frozen=True)
class Played:
    """What became of a show; gaps in milliseconds, ticks as of `PlayReport`."""

    asked: int
    shown: int
    dropped: int
    fps: float
    gaps_ms: tuple[float, ...]
    ticks: dict[str, int]


def _loop(display: vd.Display, show: BenchShow, times: Iterator[float]) -> Played:
    before = display.playback
    for time_s in times:
        frame = display.frame()
        show.draw(frame, time_s)
        display.present(frame, wait=False)
    counts = display.playback
    gaps = (np.percentile(counts.intervals_s or (0.0,), (5, 50, 95)) * 1000).tolist()
    ticks = Counter(str(max(1, round(gap * REFRESH_HZ))) for gap in counts.intervals_s)
    shown = counts.shown - before.shown * (counts.presented > show.frame_count)
    return Played(
        show.frame_count, shown, show.frame_count - shown, counts.fps, tuple(gaps), dict(ticks)
    )


def _sleeping(display: vd.Display, show: BenchShow) -> Played:
    def times() -> Iterator[float]:
        began_s, number = time.monotonic(), 0
        while number < show.frame_count:
            yield number / FPS
            number = max(number + 1, int((time.monotonic() - began_s) * FPS))
            time.sleep(max(0.0, began_s + number / FPS - time.monotonic()))

    return _loop(display, show, times())


def _clocked(display: vd.Display, show: BenchShow) -> Played:
    return _loop(display, show, display.clock(fps=FPS, seconds=show.duration))


def _played(pacing: str) -> Callable[[vd.Display, BenchShow], Played]:
    def run(display: vd.Display, show: BenchShow) -> Played:
        report = display.play(show, clock="host" if pacing == "host" else "device")
        gap = report.gap_ms
        return Played(
            report.frames, report.shown, report.dropped, report.fps,
            (gap["p5"], gap["p50"], gap["p95"]), report.ticks,
        )  # fmt: skip

    return run


WAYS: dict[str, Callable[[vd.Display, BenchShow], Played]] = {
    "loop, sleep": _sleeping,
    "loop, clock": _clocked,
    "play, host": _played("host"),
    "play, device": _played("device"),
}


@contextlib.contextmanager
def _port(baud: int) -> Iterator[str]:
    """Yield a port: a pty to an emulator in another process; for 0 Bd, USB in this one."""
    size = "x".join(map(str, SIZE))
    if not baud:
        yield f"sim-usb:?size={size}&refresh={REFRESH_HZ}"
        return
    command = [sys.executable, "-m", "firmware_sim", "--pty", "--size", size]
    command += ["--baud", str(baud), "--refresh", str(REFRESH_HZ)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        try:
            yield json.loads(process.stdout.readline())["port"]
        finally:
            process.terminate()


def bench_play(repeats: int, *, quick: bool = False) -> None:
    """Print the table: each show, line and way, for twice as many seconds as repeats."""
    seconds = 0.4 if quick else 2.0 * repeats
    print(f"shows of {FPS} frames a second, {REFRESH_HZ} Hz, {seconds:g} s each")
    print(f"{'show':<20}{'line':>12}{'line fps':>9}  {'way':<14}{'asked':>6}{'shown':>6}"
          f"{'dropped':>8}{'fps':>7}{'gap ms p5':>10}{'p50':>7}{'p95':>7}  ticks")  # fmt: skip
    for name, kind in SHOWS.items():
        show = kind(seconds)
        show.frame(0)  # what is loaded with the first picture does not count
        for baud in (12_000_000,) if quick else (*BAUDS, 0):
            line = Line.of_baud(baud) if baud else Line("USB", 13 * 512 * 8000.0)
            most = plan(show.frame(1), line, Receiver(refresh_hz=REFRESH_HZ)).frames_per_s
            for way, run in WAYS.items():
                with _port(baud) as port, vd.open(port) as display:
                    found = run(display, show)
                ticks = " ".join(f"{n}:{found.ticks[n]}" for n in sorted(found.ticks, key=int)[:6])
                low, middle, high = found.gaps_ms
                print(f"{name:<20}{line.name:>12}{min(most, FPS):>9.1f}  {way:<14}{found.asked:>6}"
                      f"{found.shown:>6}{found.dropped:>8}{found.fps:>7.1f}{low:>10.1f}"
                      f"{middle:>7.1f}{high:>7.1f}  {ticks}", flush=True)  # fmt: skip


if __name__ == "__main__":
    bench_play(5)
