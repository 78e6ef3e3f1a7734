"""Benchmark of playing: frames asked, shown and dropped, and how even their swaps are.

Three shows at 30 frames a second, over real ptys to an emulator in another process that is paced
at a line's rate, and over emulated USB. Each is played as an object of Python, a scene file, a
recording of that, and a playlist of both. Ways: `Display.play` by the host's clock and by the
device's ticks; for objects also a plain loop that presents without waiting and sleeps, and the same
with `Display.clock`. "line" is what the line carries of such frames, 30 at most; "of it" is the
share that was shown. The processor is shared by all that runs.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import voxdisplay as vd
from benchmarks.pictures import SEED
from voxdisplay.display.plan import Line, Receiver
from voxdisplay.display.show_plan import plan_show
from voxdisplay.shows.playable import Playable, bind_schedule
from voxdisplay.shows.record import record
from voxdisplay.shows.recording_writer import RecordingFormat, drawing_features
from voxdisplay.shows.rendering import Rendering

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


def curve_scene() -> list[dict[str, Any]]:
    """Return the objects of the paper's curve, turning."""
    return [
        {
            "type": "parametric",
            "x": "64 + 40*cos(t + a)",
            "y": "64 + 40*sin(t + a)",
            "z": "24 + 40*(1 - cos(4*t))",
            "t": ["-170*deg", "170*deg"],
            "color": "#ff8800",
        }
    ]


def bezier_scene() -> list[dict[str, Any]]:
    """Return a hundred Beziers of 1200 expressions."""
    chance = np.random.default_rng(SEED)
    middle = chance.uniform(16, 112, (100, 1, 3)) + chance.uniform(-24, 24, (100, 4, 3))
    phase = chance.uniform(0, 2 * np.pi, (100, 4, 3))

    def point(curve: int, row: int) -> list[str]:
        pairs = zip(middle[curve, row], phase[curve, row], strict=True)
        return [f"clamp({m:.3f} + 8*sin({p:.3f} + a), 0.5, 127.5)" for m, p in pairs]

    colors = ("orange", "#0af", "lime", "white")
    return [
        {"type": "bezier", "points": [point(n, row) for row in range(4)], "color": colors[n % 4]}
        for n in range(100)
    ]


def torus_scene() -> list[dict[str, Any]]:
    """Return the shell of a torus, tumbling."""
    about = [64, 64, 64]
    turns = [
        {"rotate": [1, 0, 0], "angle": "a", "about": about},
        {"rotate": [0, 0, 1], "angle": "2*a", "about": about},
    ]
    torus = {"type": "torus", "center": about, "major": 36, "minor": 15, "color": "cyan"}
    return [torus | {"transform": turns}]


SHOWS: dict[str, tuple[Callable[[float], BenchShow], Callable[[], list[dict[str, Any]]]]] = {
    "rotating curve": (RotatingCurve, curve_scene),
    "100 moving Beziers": (MovingBeziers, bezier_scene),
    "tumbling torus": (TumblingTorus, torus_scene),
}


def files_of(
    objects: list[dict[str, Any]], seconds: float, folder: Path
) -> dict[str, Callable[[], Playable]]:
    """Write a scene, a recording and a playlist; return readers of them, by their kinds."""
    scene = {
        "size": SIZE,
        "duration": seconds,
        "fps": FPS,
        "params": {"a": f"tau*time/{_TURN_S}"},
        "objects": objects,
    }
    paths = {kind: folder / f"{kind}.json" for kind in ("scene", "playlist")}
    paths["recording"] = folder / "recording.vxs"
    paths["scene"].write_text(json.dumps(scene))
    half = seconds / 2
    entries = [
        {"show": "scene.json", "until": half},
        {"show": "recording.vxs", "from": half},
    ]
    paths["playlist"].write_text(json.dumps({"playlist": entries}))
    kind = vd.PixelFormat.RGB888
    wanted = RecordingFormat(vd.Grid(*SIZE), kind, FPS * 1000, drawing_features(kind))
    record(Rendering(vd.load_scene(paths["scene"]), wanted), paths["recording"])
    return {kind: partial(vd.load_show, paths[kind]) for kind in ("scene", "recording", "playlist")}


@dataclass(frozen=True)
class Played:
    """Figures of a show that was played; gaps in milliseconds, ticks as of `PlayReport`."""

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


def _played(pacing: str) -> Callable[[vd.Display, Any], Played]:
    def run(display: vd.Display, show: Any) -> Played:
        report = display.play(show, clock="host" if pacing == "host" else "device")
        gap = report.gap_ms
        return Played(
            report.frames, report.shown, report.dropped, report.fps,
            (gap["p5"], gap["p50"], gap["p95"]), report.ticks,
        )  # fmt: skip

    return run


LOOPS: dict[str, Callable[[vd.Display, BenchShow], Played]] = {
    "loop, sleep": _sleeping,
    "loop, clock": _clocked,
}
WAYS: dict[str, Callable[[vd.Display, Any], Played]] = {
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


def _carried(show: Any, line: Line) -> float:
    """Return the frames per second that a line carries of a show."""
    source = bind_schedule(show, vd.Frame(SIZE), loop=False).segments[-1].show
    costs = plan_show(Stretch(source), (line,), Receiver(refresh_hz=REFRESH_HZ))
    bytes_of_all = costs.mean_bytes[0]
    return min(line.bytes_per_s / max(bytes_of_all, costs.worst_plans[0].answer_bytes), REFRESH_HZ)


class Stretch:
    """The first frames of a show, so that little is planned."""

    loop = False

    def __init__(self, show: Any) -> None:
        self.frame, self.fps = show.frame, show.fps
        self.frame_count = min(show.frame_count, 8)
        self.duration = self.frame_count / self.fps
        if hasattr(show, "encoded_frame"):
            self.encoded_frame = show.encoded_frame


def bench_play(repeats: int, *, quick: bool = False) -> None:
    """Print the table: each show, kind, line and way, for twice as many seconds as repeats."""
    seconds = 0.4 if quick else 2.0 * repeats
    print(f"shows of {FPS} frames a second, {REFRESH_HZ} Hz, {seconds:g} s each")
    print(f"{'show':<19}{'as':<10}{'line':>12}{'line fps':>9}  {'way':<13}{'asked':>6}{'shown':>6}"
          f"{'dropped':>8}{'fps':>6}{'of it':>7}{'gap ms p5':>10}{'p50':>7}{'p95':>7}  "
          "ticks")  # fmt: skip
    for name, (kind, objects) in SHOWS.items():
        show = kind(seconds)
        show.frame(0)  # what is loaded with the first picture does not count
        with tempfile.TemporaryDirectory() as folder:
            kinds: dict[str, Callable[[], Any]] = {"object": partial(_same, show)}
            kinds |= files_of(objects(), seconds, Path(folder))
            for baud in (12_000_000,) if quick else (*BAUDS, 0):
                for as_, loaded in kinds.items():
                    _bench_line(name, as_, loaded, baud)


def _same(show: Any) -> Any:
    return show


def _bench_line(name: str, as_: str, loaded: Callable[[], Any], baud: int) -> None:
    """Print the rows of one kind of a show on one line."""
    line = Line.of_baud(baud) if baud else Line("USB", 13 * 512 * 8000.0)
    most = min(_carried(loaded(), line), FPS)
    for way, run in ({**LOOPS, **WAYS} if as_ == "object" else WAYS).items():
        with _port(baud) as port, vd.open(port) as display:
            found = run(display, loaded())
        ticks = " ".join(f"{n}:{found.ticks[n]}" for n in sorted(found.ticks, key=int)[:6])
        low, middle, high = found.gaps_ms
        print(f"{name:<19}{as_:<10}{line.name:>12}{most:>9.1f}  {way:<13}{found.asked:>6}"
              f"{found.shown:>6}{found.dropped:>8}{found.fps:>6.1f}{found.fps / most:>7.0%}"
              f"{low:>10.1f}{middle:>7.1f}{high:>7.1f}  {ticks}", flush=True)  # fmt: skip


if __name__ == "__main__":
    bench_play(5)
