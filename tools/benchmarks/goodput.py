"""Benchmark of goodput under bit errors: the real link and an emulated device, on virtual time.

Time is counted, not measured, so that the figures are the same on every machine. Beside each stands
the limit of selective repeat: payload / (payload + 9) of the line, times the probability that no
bit of the packet is hit.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.frame import Frame
from voxdisplay.link import Link
from voxdisplay.link.payload_size import OVERHEAD_BYTES

GRID = (64, 64, 32)
LINES = ((115_200, 0.004), (921_600, 0.004), (3_000_000, 0.004), (12_000_000, 0.001))
BIT_ERROR_RATES = (0.0, 1e-7, 1e-6, 1e-5, 1e-4)
BITS_PER_BYTE = 10  # of a serial line: a start and a stop bit
# Frames that are counted, after as many in which the link has come to know the line: rare errors
# take longer to tell.
FRAMES = {0.0: 16, 1e-7: 160, 1e-6: 144, 1e-5: 16, 1e-4: 24}
SEED = 4


class Line:
    """One direction of a line with a rate, a delay and bit errors."""

    def __init__(self, baud: float, delay_s: float, error_rate: float, seed: int) -> None:
        self._byte_s = BITS_PER_BYTE / baud
        self._delay_s = delay_s
        # A wrong start or stop bit spoils its byte as well.
        self._byte_rate = -math.expm1(BITS_PER_BYTE * math.log1p(-error_rate))
        self._chance = np.random.default_rng(seed)
        self._free_s = 0.0
        self._queue: deque[tuple[float, bytes]] = deque()

    def put(self, data: bytes, now: float) -> None:
        """Queue bytes behind those that are still being sent."""
        for segment in data.split(b"\0")[:-1]:
            ended = np.frombuffer(segment + b"\0", dtype=np.uint8).copy()
            hit = self._chance.random(len(ended)) < self._byte_rate
            ended[hit] ^= self._chance.integers(1, 256, int(hit.sum()), dtype=np.uint8)
            self._free_s = max(self._free_s, now) + len(ended) * self._byte_s
            self._queue.append((self._free_s + self._delay_s, ended.tobytes()))

    @property
    def due_s(self) -> float:
        """Arrival time of the next packet."""
        return self._queue[0][0] if self._queue else math.inf

    def get(self, now: float) -> bytes:
        """Return the bytes that have arrived."""
        out = b""
        while self.due_s <= now:
            out += self._queue.popleft()[1]
        return out


@dataclass
class Goodput:
    """Result of one line.

    Attributes
    ----------
    share : float
        Bytes of ops by what the line could carry in the same time.
    payload : int
        Bytes of payload that the link came to use.
    sent_again : float
        Packets sent again, by all.

    """

    share: float
    payload: int
    sent_again: float


def goodput(baud: int, round_trip_s: float, error_rate: float) -> Goodput:
    """Stream dense frames over a line, both of whose directions are bad."""
    device = Device(Config(grid=GRID, pixel_format="index8", refresh=0, rx_buffer=1 << 17,
                           max_payload=4096))  # fmt: skip
    down = Line(baud, round_trip_s / 2, error_rate, SEED)
    up = Line(baud, round_trip_s / 2, error_rate, SEED + 1)
    link = Link(1, 0.0)
    frame = Frame(GRID, "index8")
    noise = np.random.default_rng(SEED).integers(0, 256, frame.array().shape, dtype=np.uint8)
    frame.set(noise)
    now, shown, presented = 0.0, 0, 0
    marks: list[tuple[float, int, int]] = []
    op_bytes = deque[int]()
    through = 0
    frames = FRAMES[error_rate]
    while shown < 2 * frames:
        if link.ready and link.backlog < 3:
            payloads = frame.payloads(link.payload_bytes)
            op_bytes.append(sum(map(len, payloads)))
            link.present(payloads)
            presented += 1
        if out := link.transmit(now):
            down.put(out, now)
        timeout_s = link.next_timeout(now)
        now = min(down.due_s, up.due_s, math.inf if timeout_s is None else now + timeout_s)
        device.receive(down.get(now))
        if answer := device.transmit():
            up.put(answer, now)
        link.receive(up.get(now), now)
        for _ in range(presented - link.backlog - shown):
            shown += 1
            through += op_bytes.popleft()
            if shown in (frames, 2 * frames):
                marks.append((now, through, link.counters.retransmitted))
    (began_s, before, again), (ended_s, after, again_after) = marks
    packets = (after - before) / link.payload_bytes
    return Goodput(
        share=(after - before) * BITS_PER_BYTE / (baud * (ended_s - began_s)),
        payload=link.payload_bytes,
        sent_again=(again_after - again) / packets,
    )


def at_best(payload: int, error_rate: float) -> float:
    """Return the share of the line that selective repeat leaves for payloads of this size."""
    size = payload + OVERHEAD_BYTES + payload // 254
    return payload / size * (1 - error_rate) ** (BITS_PER_BYTE * size)


def rows(*, quick: bool) -> Iterator[tuple[int, float, float, Goodput, float]]:
    """Return (baud, round trip, bit error rate, goodput, at best) of every line, or of one."""
    for baud, round_trip_s in LINES[:1] if quick else LINES:
        for error_rate in BIT_ERROR_RATES[-1:] if quick else BIT_ERROR_RATES:
            found = goodput(baud, round_trip_s, error_rate)
            yield baud, round_trip_s, error_rate, found, at_best(found.payload, error_rate)


def bench_goodput(_repeats: int = 1, *, quick: bool = False) -> None:
    """Print the table; repeated, it would be the same."""
    print("goodput: bytes of ops by what the line carries; both directions with bit errors")
    print(f"{'Bd':>10} {'round trip':>11} {'errors':>8} {'payload':>8} {'again':>7} "
          f"{'goodput':>8} {'at best':>8}")  # fmt: skip
    for baud, round_trip_s, error_rate, found, best in rows(quick=quick):
        print(
            f"{baud:>10} {round_trip_s * 1000:>8.0f} ms {error_rate:>8.0e} {found.payload:>8} "
            f"{found.sent_again:>7.3f} {found.share:>8.3f} {best:>8.3f}"
        )


if __name__ == "__main__":
    bench_goodput()
