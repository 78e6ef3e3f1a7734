"""Simulation of a link and an emulated device over a line with delay, damage and loss.

The clock is a number, and every fault comes from a seed.
"""

from __future__ import annotations

import random
import re
from collections import deque

import document
import numpy as np

from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.frame import Frame
from voxdisplay.link import FrameShown, Link, SessionLost
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.packet_stream import PacketStream

GRID = (17, 9, 5)


def random_frame(rng, pixel_format="index8", density=0.5):
    """A frame of many packets, or of few, or of none."""
    frame = Frame(GRID, pixel_format)
    if density:
        numbers = np.random.default_rng(rng.getrandbits(32))
        array = frame.array()
        top = 2 if pixel_format == "mono1" else np.iinfo(array.dtype).max
        frame.set(
            (
                numbers.integers(1, top, array.shape) * (numbers.random(array.shape) < density)
            ).astype(array.dtype)
        )
    return frame


class Faults:
    """Faults of a line; rates are for each byte, ``packet`` for each segment."""

    def __init__(self, seed, *, flip=0.0, drop=0.0, packet=0.0, delimiter=0.0):
        self.rng = random.Random(seed)
        self.flip, self.drop, self.packet, self.delimiter = flip, drop, packet, delimiter

    def carry(self, data):
        out = bytearray()
        for segment in data.split(b"\0")[:-1]:
            if self.rng.random() < self.packet:
                continue
            ended = segment + (b"" if self.rng.random() < self.delimiter else b"\0")
            for byte in ended:
                if self.rng.random() >= self.drop:
                    hit = self.rng.random() < self.flip
                    out.append(byte ^ 1 << self.rng.randrange(8) if hit else byte)
        return bytes(out)


class Line:
    """One direction: bytes arrive in order, ``delay_s`` after they were sent or later.

    A byte takes ``byte_s``; a segment arrives with its last.
    """

    def __init__(self, delay_s, jitter_s, byte_s, rng):
        self.delay_s, self.jitter_s, self.byte_s, self.rng = delay_s, jitter_s, byte_s, rng
        self.faults = None
        self.stalled_until_s = 0.0
        self._last_s = 0.0
        self._queue = deque()

    def put(self, data, now):
        if self.faults:
            data = self.faults.carry(data)
        at_s = now + self.delay_s + self.rng.random() * self.jitter_s
        self._last_s = max(self._last_s, at_s, self.stalled_until_s)
        for segment in re.findall(rb"[^\0]*\0|[^\0]+", data):
            self._last_s += len(segment) * self.byte_s
            self._queue.append((self._last_s, segment))

    @property
    def due_s(self):
        return self._queue[0][0] if self._queue else float("inf")

    def get(self, now):
        out = b""
        while self._queue and self.due_s <= now:
            out += self._queue.popleft()[1]
        return out


class Rig:
    """Link, line and device. ``step`` goes to the next moment at which anything happens."""

    def __init__(self, *, seed=0, delay_s=0.001, jitter_s=0.0, byte_s=0.0, timeout_s=5.0, **config):
        self.rng = random.Random(seed)
        self.now = 0.0
        config = {"grid": GRID, "pixel_format": "index8", "refresh": 0, "max_payload": 64} | config
        config = {"name": "", "firmware": "", "boot": 7, "rx_buffer": 512} | config
        self.device = Device(Config(**config))
        self.bench = Bench(self.device)
        self.alive = True
        self.down = Line(delay_s, jitter_s, byte_s, self.rng)
        self.up = Line(delay_s, jitter_s, byte_s, self.rng)
        self.link = Link(self.rng.randrange(1, 65536), self.now, timeout_s=timeout_s)
        self.events = []
        self.sent = []  # packets, in order
        self._heard = PacketStream()
        self._asked = []  # tags of STATUS without answer
        self.refusals = {"NO_SESSION"}  # refusals that are allowed: that of a device that restarted
        self._pages = {self.bench.snapshot().pixels}  # all that may be seen
        self._tickets = {}

    # -- what the host does

    def present(self, frame, *, clear=True):
        self._pages.add(frame.array().tobytes())
        ticket = self.link.present(frame.payloads(self.device.config.max_payload), clear=clear)
        self._tickets[ticket] = frame
        return ticket

    def present_difference(self, base, frame):
        """Present a frame as its difference from another, which is on display."""
        most = self.device.config.max_payload
        self._pages.add(frame.array().tobytes())
        ticket = self.link.present_difference(
            self.link.displayed, frame.difference(base, most), lambda: frame.payloads(most)
        )
        self._tickets[ticket] = frame
        return ticket

    def power_cycle(self):
        self.check()
        self.bench.power_cycle()
        self._pages.add(self.bench.snapshot().pixels)

    @property
    def shown(self):
        return [event.ticket for event in self.events if isinstance(event, FrameShown)]

    # -- time

    def step(self):
        out = self.link.transmit(self.now)
        if out:
            self._note_sent(out)
            self.down.put(out, self.now)
        self.now = max(self.now + 1e-6, self._next_s())
        data = self.down.get(self.now)
        if self.alive:
            self.device.receive(data)
        self._tick()
        while self.alive and (data := self.device.transmit()):
            self.up.put(data, self.now)
        if data := self.up.get(self.now):
            self._note_heard(data)
            self.events += self.link.receive(data, self.now)
        self.check()

    def _next_s(self):
        times = [self.down.due_s, self.up.due_s]
        timeout_s = self.link.next_timeout(self.now)
        if timeout_s is not None:
            times.append(self.now + timeout_s)
        if self.alive and self.device.pending:
            times.append(self._tick_after(self.now))
        return min([*times, self.now + 0.5])  # somebody looks in now and then

    def _tick_after(self, now):
        period_s = 1000 / self.device.config.refresh
        return (now // period_s + 1) * period_s

    _next_tick_s = None

    def _tick(self):
        """A pending frame waits for the first refresh tick behind it."""
        if not (self.alive and self.device.pending):
            self._next_tick_s = None
            return
        if self._next_tick_s is None:
            self._next_tick_s = self._tick_after(self.now)
        elif self.now >= self._next_tick_s - 1e-9:
            self._next_tick_s = None
            self.device.tick()
            self._tick()

    def run(self, done=None, *, steps=3000):
        """Step until all is done; fail if that takes too many steps."""
        done = done or (lambda: self.link.ready and self.link.idle)
        for _ in range(steps):
            if done():
                return self
            self.step()
        raise AssertionError(f"not done in {steps} steps, at {self.now:.3f} s")

    def run_until(self, moment_s):
        while self.now < moment_s:
            self.step()

    # -- what must hold at any time

    def check(self):
        assert self.bench.snapshot().pixels in self._pages, "a page that nobody presented"
        assert set(self.bench.counters().refused) <= self.refusals, self.bench.counters()
        assert len(self._asked) <= spec.LIMIT_MAX_STATUS, "too many STATUS without answer"

    def assert_shows(self, frame):
        snapshot = self.bench.snapshot()
        assert snapshot.pixels == frame.array().tobytes()
        assert snapshot.digest == frame.digest()

    def assert_reported(self, ticket):
        """Check that a frame was reported as displayed, with its digest, and none twice."""
        assert len(set(self.shown)) == len(self.shown)
        last = [event for event in self.events if isinstance(event, FrameShown)][-1]
        assert (last.ticket, last.digest) == (ticket, self._tickets[ticket].digest())

    @property
    def restarts(self):
        return sum(isinstance(event, SessionLost) for event in self.events)

    def _note_sent(self, out):
        for body in document.off_wire(out.replace(b"\0\0", b"\0").lstrip(b"\0")):
            self.sent.append(body)
            if body[0] >> 4 == spec.TYPE_STATUS:
                self._asked.append(body[1])
            elif body[0] >> 4 == spec.TYPE_HELLO:
                self._asked.clear()

    def _note_heard(self, data):
        for packet in self._heard.feed(data):
            asked = isinstance(packet, packets.Ack) and packet.flags & spec.ACK_FLAG_ASKED
            if asked and packet.last in self._asked:
                del self._asked[: self._asked.index(packet.last) + 1]


def frames(rng, count, pixel_format="index8"):
    return [random_frame(rng, pixel_format, rng.choice([0, 0.02, 0.3, 0.9])) for _ in range(count)]
