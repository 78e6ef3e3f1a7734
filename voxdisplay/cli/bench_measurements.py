"""Speed measurements of generation, coding and link, for ``voxdisplay bench``.

All times are medians of repetitions within a fixed budget. Prints nothing.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final

import numpy as np

import voxdisplay as vd
from voxdisplay.compute import kernel_backend
from voxdisplay.display.handshake import request_info
from voxdisplay.scene.model import Scene
from voxdisplay.transport import Transport
from voxdisplay.wire import spec
from voxdisplay.wire.features import select_features
from voxdisplay.wire.packet import Info

_BUDGET_S: Final = 0.4  # for the repetitions of one measurement
_MAX_REPETITIONS: Final = 50
_RAW_BUDGET_S: Final = 0.5
_MAX_RAW_S: Final = 3.0
_MAX_RAW_BYTES: Final = 4 << 20
_DROPPED_SEGMENT: Final = b"\x55" * 7 + b"\0"
_NOISE_BUDGET_S: Final = 1.5
_MIN_NOISE_BYTES: Final = 256
_MAX_NOISE_BYTES: Final = 2 << 20
_ROUND_TRIPS: Final = 5
_MAX_QUICK_S: Final = 0.1
_QUIET_S: Final = 0.05
_CURVES: Final = 100
_SEED: Final = 20


@dataclass(frozen=True)
class Generation:
    """Speed of voxelising a scene.

    Attributes
    ----------
    scene : str
    voxels : int
        Of all its sequences.
    seconds : float

    """

    scene: str
    voxels: int
    seconds: float


@dataclass(frozen=True)
class Coding:
    """Speed and yield of coding a frame into payloads of DATA packets.

    Attributes
    ----------
    scene : str
    voxels : int
        Lit voxels.
    payload_bytes : int
    seconds : float

    """

    scene: str
    voxels: int
    payload_bytes: int
    seconds: float


@dataclass(frozen=True)
class RawPipe:
    """Speed of the bare pipe: bytes that a device drops, with a HELLO behind them.

    Attributes
    ----------
    round_trip_s : float
        From a HELLO to its INFO.
    bytes_per_s : float
        Towards the device.

    """

    round_trip_s: float
    bytes_per_s: float


@dataclass(frozen=True)
class LinkSpeed:
    """Speed of frames over the link.

    Attributes
    ----------
    present_s : float
        From a frame of one curve to the proof that it is on display.
    noise_bytes : int
        Bytes on the wire of a frame of noise.
    noise_s : float
        From that frame to its proof, coding included.

    """

    present_s: float
    noise_bytes: int
    noise_s: float

    @property
    def bytes_per_s(self) -> float:
        """Bytes on the wire per second of the frame of noise."""
        return self.noise_bytes / self.noise_s


def scenes(grid: vd.Grid) -> Iterator[tuple[str, Scene]]:
    """Yield the scenes that are voxelised and coded, fitted to a grid, with their names."""
    text = """{"size": [128, 128, 128], "objects": [{"type": "parametric", "x": "50 + 40*cos(t)",
        "y": "50 + 40*sin(t)", "z": "50 + 40*(1 - cos(4*t))", "t": ["-170*deg", "170*deg"],
        "color": "#ff8800"}]}"""
    yield "one curve", vd.read_scene(text).fitted(grid)[0]
    chance = np.random.default_rng(_SEED)
    objects = []
    for _ in range(_CURVES):
        middle, first, second = chance.uniform((24, 4, 4), (104, 12, 12), (3, 3)).T
        phase = chance.uniform(0, 6.3, (3, 2))
        axes = {
            axis: f"{middle[i]:.3f} + {first[i]:.3f}*sin(t + {phase[i, 0]:.3f})"
            f" + {second[i]:.3f}*sin(2*t + {phase[i, 1]:.3f})"
            for i, axis in enumerate("xyz")
        }
        color = '"#{:02x}{:02x}{:02x}"'.format(*chance.integers(64, 256, 3))
        formulas = ", ".join(f'"{axis}": "{formula}"' for axis, formula in axes.items())
        objects.append(f'{{"type": "parametric", {formulas}, "t": [0, "pi"], "color": {color}}}')
    text = f'{{"size": [128, 128, 128], "objects": [{", ".join(objects)}]}}'
    yield f"{_CURVES} curves", vd.read_scene(text).fitted(grid)[0]


def measure_generation(name: str, scene: Scene) -> Generation:
    """Measure voxelising with numpy; the kernels of the extra ``fast`` take long to compile."""
    curves = [item.curve for item in scene.items]
    before = kernel_backend.set_enabled(False)
    try:
        seconds, sequences = _median_time(lambda: vd.voxelize_many(curves))
    finally:
        kernel_backend.set_enabled(before)
    return Generation(name, sum(map(len, sequences)), seconds)


def measure_coding(name: str, frame: vd.Frame, info: vd.DeviceInfo, bytes_per_s: float) -> Coding:
    """Measure coding a frame for a device behind a line, as the driver codes it."""
    features = select_features(info.features, bytes_per_s)

    def code() -> int:
        payloads = frame.iter_payloads(info.max_payload_bytes, features, bytes_per_s)
        return sum(map(len, chain.from_iterable(payloads)))

    seconds, size = _median_time(code)
    return Coding(name, len(frame.lit()[0]), size, seconds)


def noise_frame(display_info: vd.DeviceInfo, size: int, seed: int) -> vd.Frame:
    """Return a frame whose first voxels in scan order are random, of about so many bytes."""
    frame = vd.Frame(display_info.grid, display_info.format)
    array = frame.array()
    flat = array.reshape(-1)
    bits = 1 if display_info.format is vd.PixelFormat.MONO1 else 8 * array.itemsize
    count = min(len(flat), max(1, size * 8 // bits))
    high = min(1 << bits, 1 << 16)
    chance = np.random.default_rng(seed)
    flat[:count] = chance.integers(0, high, count, dtype=np.uint32).astype(array.dtype)
    frame.set(array)
    return frame


def measure_raw_pipe(transport: Transport, info: Info, timeout_s: float) -> RawPipe:
    """Measure the bare pipe below the link.

    Segments of fewer than 8 bytes are dropped by a device (protocol.md, section 3). As many as the
    credit allows are sent, with a HELLO behind them, until they have taken long enough.
    """
    _drain(transport, timeout_s)
    round_trips: list[float] = []
    while len(round_trips) < _ROUND_TRIPS and sum(round_trips) < _RAW_BUDGET_S:
        round_trips.append(_exchange(transport, b"", timeout_s))
    round_trip_s = statistics.median(round_trips)
    room = min(info.rx_buffer - spec.LIMIT_RESERVE, _MAX_RAW_BYTES)
    size, sent, total_s, busy_s = 8 * len(_DROPPED_SEGMENT), 0, 0.0, 0.0
    while busy_s < _RAW_BUDGET_S and total_s < _MAX_RAW_S and sent < _MAX_RAW_BYTES:
        data = _DROPPED_SEGMENT * (size // len(_DROPPED_SEGMENT))
        took_s = _exchange(transport, data, timeout_s + _RAW_BUDGET_S)
        # Where nearly all is waiting for the answer, not more than that is subtracted.
        busy_s += max(took_s - round_trip_s, took_s / 4)
        total_s, sent = total_s + took_s, sent + len(data)
        if took_s - round_trip_s < _RAW_BUDGET_S / 8:
            size = min(size * 4, room)
    return RawPipe(round_trip_s, sent / busy_s)


def _exchange(transport: Transport, data: bytes, timeout_s: float) -> float:
    """Return the seconds from the first byte of data and a HELLO to the INFO."""
    began_s = time.perf_counter()
    if data:
        transport.write(data, timeout_s)
    request_info(transport, timeout_s)
    took_s = time.perf_counter() - began_s
    if took_s > _MAX_QUICK_S:
        _drain(transport, timeout_s)
    return took_s


def _drain(transport: Transport, timeout_s: float) -> None:
    """Drop what still comes: on a slow line HELLO is repeated, and so are its answers."""
    end_s = time.monotonic() + timeout_s
    while transport.read(_QUIET_S) and time.monotonic() < end_s:
        continue


def measure_link(display: vd.Display, frame: vd.Frame, raw: RawPipe) -> LinkSpeed:
    """Measure frames over the link.

    Parameters
    ----------
    display : Display
    frame : Frame
        Of one curve.
    raw : RawPipe
        The frame of noise is as long as the pipe carries within the budget.

    """
    blank = display.frame()

    def show() -> None:
        display.present(frame)

    seconds: list[float] = []
    end_s = time.monotonic() + 2 * _BUDGET_S
    while not seconds or (time.monotonic() < end_s and len(seconds) < _MAX_REPETITIONS):
        seconds.append(_timed(show))
        display.present(blank)
    budget = int(raw.bytes_per_s * _NOISE_BUDGET_S)
    size = max(_MIN_NOISE_BYTES, min(budget, _MAX_NOISE_BYTES))
    noise_s, noise_bytes = [], []
    for seed in range(2):
        noise = noise_frame(display.info, size, seed)
        receipt: Any = None
        began_s = time.perf_counter()
        receipt = display.present(noise)
        noise_s.append(time.perf_counter() - began_s)
        noise_bytes.append(receipt.wire_bytes)
        if noise_s[0] > _NOISE_BUDGET_S:
            break
    best = int(np.argmin(noise_s))
    return LinkSpeed(statistics.median(seconds), noise_bytes[best], noise_s[best])


def _timed(function: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    function()
    return time.perf_counter() - began_s


def _median_time(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the median time of calls within the budget, and the last result."""
    result = function()  # warm
    seconds: list[float] = []
    end_s = time.monotonic() + _BUDGET_S
    while not seconds or (time.monotonic() < end_s and len(seconds) < _MAX_REPETITIONS):
        began_s = time.perf_counter()
        result = function()
        seconds.append(time.perf_counter() - began_s)
    return statistics.median(seconds), result
