"""Benchmark of streaming: the share of a line that frames in a row keep busy.

At the other end, in a process of its own, is a device that counts (`stream_reader`). On a line of
12 MBd the figure is the share of time the line was busy; on one without a rate, the bytes per
second against those of a bare write of the same bytes into the same reader. Both depend on other
programs that use the processor; so the first is measured in another way, too: "in time of its own"
is how busy the line would be if only the driver's own processor time passed, and the reader needed
none.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import os
import select
import socket
import struct
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import voxdisplay as vd
from benchmarks import stream_reader
from benchmarks.pictures import SEED, beziers, phantom
from benchmarks.ports import in_another_process
from voxdisplay.display.device_info import device_info
from voxdisplay.errors import TransportClosed
from voxdisplay.frame import Frame
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

LINE_BYTES_PER_S = 1_200_000.0  # 12 MBd
FEATURES = ("line", "box", "dots", "oct", "diff")
MAX_PAYLOAD, RX_BUFFER = 4096, 1 << 16
_HEARD = struct.Struct("<QQd")
_CHUNK = 1 << 16
_FRAMES = 2  # at least


class Pipe:
    """Socket as a transport that keeps what was written, on request."""

    port = "pipe"

    def __init__(self, connection: socket.socket) -> None:
        self._socket = connection
        self.written: list[bytes] | None = None

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        if not select.select([self._socket], [], [], timeout_s)[0]:
            return b""
        if data := self._socket.recv(_CHUNK):
            return data
        raise TransportClosed("the reader has ended")

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        self._socket.settimeout(timeout_s)
        self._socket.sendall(data)
        if self.written is not None:
            self.written.append(data)

    def close(self) -> None:
        """See `Transport.close`."""
        self._socket.close()


@dataclass(frozen=True)
class Reader:
    """Process at the other end: its pipe, and its report of what it received."""

    pipe: Pipe
    connection: socket.socket
    heard: Callable[[], stream_reader.Heard]


class OwnTime:
    """A line and its reader as a transport, and the clock that goes with them: processor time.

    Waiting takes as long as it would, and the reader no time at all. The pipe takes as much as the
    device has room for.
    """

    port = "pipe"

    def __init__(self, info: packets.Info, bytes_per_s: float) -> None:
        self._device = stream_reader.Counting(info)
        self._byte_s = 1 / bytes_per_s
        self._skipped_s = 0.0  # waited, less what the reader took
        self._free_s = 0.0
        self._answers: deque[tuple[float, bytes]] = deque()
        self.bytes = 0

    def monotonic(self) -> float:
        """Return the time in seconds, like ``time.monotonic``."""
        return time.process_time() + self._skipped_s

    def _wait_until(self, moment_s: float) -> None:
        self._skipped_s += max(0.0, moment_s - self.monotonic())

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        del timeout_s
        began_s = time.process_time()
        self._free_s = max(self._free_s, self.monotonic())
        for segment in data.split(b"\0")[:-1]:
            self._free_s += (len(segment) + 1) * self._byte_s
            if answer := self._device.receive(segment + b"\0"):
                self._answers.append((self._free_s, answer))
        self.bytes += len(data)
        self._skipped_s -= time.process_time() - began_s
        self._wait_until(self._free_s - RX_BUFFER * self._byte_s)

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        due_s = self._answers[0][0] if self._answers else math.inf
        self._wait_until(min(self.monotonic() + timeout_s, due_s))
        out = b""
        while self._answers and self._answers[0][0] <= self.monotonic():
            out += self._answers.popleft()[1]
        return out

    def close(self) -> None:
        """See `Transport.close`."""


def busy_in_own_time(frames: list[Frame], bytes_per_s: float, seconds: float) -> float:
    """Return the share of time a line is busy, by the driver's own processor time."""
    pipe = OwnTime(info_for(frames[0]), bytes_per_s)
    display, turns = vd.open(pipe, clock=pipe.monotonic), itertools.cycle(frames)

    def until(end_s: float) -> tuple[int, float]:
        while pipe.monotonic() < end_s:
            display.present(next(turns), wait=False)
        return pipe.bytes, pipe.monotonic()

    before, began_s = until(pipe.monotonic() + min(1.0, seconds))
    after, ended_s = until(pipe.monotonic() + seconds)
    return (after - before) / (bytes_per_s * (ended_s - began_s))


def info_for(frame: Frame) -> packets.Info:
    """Return the INFO of a device that takes such frames."""
    nx, ny, nz = frame.grid
    bits = sum(
        1 << getattr(spec, f"FEATURE_{name.upper()}")
        for name in FEATURES
        if name != "diff" or frame.format.value == "index8"
    )
    return packets.Info(
        major=spec.VERSION_MAJOR, minor=spec.VERSION_MINOR, session=0, boot=1,
        format=frame.format.wire, nx=nx, ny=ny, nz=nz, pages=2, max_payload=MAX_PAYLOAD,
        rx_buffer=RX_BUFFER, refresh=0, features=bits,
    )  # fmt: skip


@contextlib.contextmanager
def reader(frame: Frame, bytes_per_s: float) -> Iterator[Reader]:
    """Run a reader in another process."""
    ours, theirs = socket.socketpair()
    back, tells = os.pipe()

    def serve() -> None:
        ours.close()
        os.close(back)

        def tell(heard: stream_reader.Heard) -> None:
            os.write(tells, _HEARD.pack(heard.bytes, heard.frames, heard.seconds))

        stream_reader.serve(theirs, info_for(frame), bytes_per_s, tell)

    child = in_another_process(serve)
    theirs.close()
    os.close(tells)
    newest = stream_reader.Heard()

    def heard() -> stream_reader.Heard:
        nonlocal newest
        while select.select([back], [], [], 0)[0] and (data := os.read(back, _HEARD.size)):
            newest = stream_reader.Heard(*_HEARD.unpack(data))
        return newest

    try:
        yield Reader(Pipe(ours), ours, heard)
    finally:
        ours.close()
        os.waitpid(child, 0)
        os.close(back)


@dataclass(frozen=True)
class Streamed:
    """Figures of a stream, but for its beginning.

    Attributes
    ----------
    bytes, frames : int
    seconds, work_s : float
        By the clock, and of processor time of the driver.
    written : bytes
        All that was written, the beginning included, if it was asked for.

    """

    bytes: int
    frames: int
    seconds: float
    work_s: float
    written: bytes = b""


def stream(
    frames: list[Frame], bytes_per_s: float, seconds: float, *, keep: bool = False
) -> Streamed:
    """Present frames by turns, as fast as it goes, for so long behind the first second.

    The first frames do not count: nobody knew the line.
    """
    with reader(frames[0], bytes_per_s) as other:
        if keep:
            other.pipe.written = []
        with vd.open(other.pipe) as display:
            turn = 0

            def until(end_s: float) -> tuple[stream_reader.Heard, float]:
                """Return whether the stream goes on: not long enough yet, or too few frames."""
                nonlocal turn
                enough = other.heard().frames + _FRAMES
                while time.perf_counter() < end_s or other.heard().frames < enough:
                    display.present(frames[turn % len(frames)], wait=False)
                    turn += 1
                return other.heard(), time.process_time()

            first, before_s = until(time.perf_counter() + min(1.0, seconds))
            last, after_s = until(time.perf_counter() + seconds)
            written = b"".join(other.pipe.written or [])
    return Streamed(
        last.bytes - first.bytes,
        last.frames - first.frames,
        last.seconds - first.seconds,
        after_s - before_s,
        written,
    )


def bare_bytes_per_s(frame: Frame, data: bytes) -> float:
    """Return the bytes per second of bare writes into a reader, its answers discarded."""
    with reader(frame, 0.0) as other:
        connection = other.connection
        connection.setblocking(False)
        view = memoryview(data)
        while view:
            readable, writable, _ = select.select([connection], [connection], [])
            if readable:
                connection.recv(_CHUNK)
            if writable:
                view = view[connection.send(view[:_CHUNK]) :]
        end_s = time.monotonic() + 1.0
        while time.monotonic() < end_s and select.select([connection], [], [], 0.2)[0]:
            connection.recv(_CHUNK)
        heard = other.heard()
    return heard.bytes / heard.seconds


def pictures(side: int) -> Iterator[tuple[str, list[Frame]]]:
    """Return the streams: for each, two frames that alternate."""
    count = 1000 * side // 128
    for pixels in ("mono1", "rgb888"):
        frames = []
        for turned in (False, True):
            frame = Frame((side, side, side), pixels)
            for sequence in vd.voxelize_many(beziers(side, count, side / 2)):
                frame.draw(sequence.voxels[:, ::-1] if turned else sequence.voxels, "orange")
            frames.append(frame)
        yield f"{count} Beziers, {pixels}", frames
    head = phantom(side)
    frames = [Frame((side, side, side), "index8") for _ in range(2)]
    frames[0].set(head)
    frames[1].set(head[:, :, ::-1])
    yield "head, 8 bit", frames
    for frame, waves in zip(frames, (field(side), field(side)[::-1]), strict=True):
        frame.set(waves)
    yield "full, 8 bit", frames


def field(side: int) -> NDArray[np.uint8]:
    """Return a volume without a dark voxel: slow waves, and a measurement's noise."""
    x, y, z = np.meshgrid(*(np.linspace(0, 7, side),) * 3)
    noise = np.random.default_rng(SEED).normal(0, 3, x.shape)
    waves = 128 + 80 * np.sin(x) * np.cos(y) * np.sin(z + 1)
    return np.asarray((waves + noise).clip(1, 255), dtype=np.uint8)


def bench_stream(repeats: int, *, quick: bool = False) -> None:
    """Print both tables."""
    seconds = 0.3 if quick else float(repeats)
    head = f"{'frames':<24}{'bytes':>9}{'line':>7}{'frames/s':>10}{'MB/s':>8}"
    head += f"{'busy':>8}{'in time of its own':>20}{'of bare':>9}{'work':>7}"
    print(f"streaming, newest wins\n{head}")
    for name, frames in pictures(16 if quick else 128):
        assert device_info(info_for(frames[0])).grid == frames[0].grid  # noqa: S101 - a device's
        for rate in (LINE_BYTES_PER_S, 0.0):
            found = stream(frames, rate, seconds, keep=not rate)
            speed = found.bytes / found.seconds
            if rate:
                own = busy_in_own_time(frames, rate, seconds)
                beside = f"{speed / rate:8.3f}{own:20.3f}{'':9}"
            else:
                beside = f"{'':28}{speed / bare_bytes_per_s(frames[0], found.written):9.3f}"
            print(
                f"{name:<24}{found.bytes // found.frames:>9}{'12 MBd' if rate else '-':>7}"
                f"{found.frames / found.seconds:>10.2f}{speed / 1e6:>8.2f}{beside}"
                f"{found.work_s / found.seconds:>7.2f}",
                flush=True,
            )


if __name__ == "__main__":
    bench_stream(5)
