"""Pushes over a line with all kinds of faults: only whole frames, and the host knows which.

The display and the emulator are the real ones; their clock is a number, so that hours of stalls
pass at once.
"""

import random

import numpy as np
import pytest

import voxdisplay as vd
from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.faults import parse_faults
from voxdisplay.errors import TransportClosed

GRID = (17, 9, 5)
FORMATS = ["mono1", "index8", "rgb565", "rgb888"]
# Rates at which most pushes succeed, and some do not.
FAULTS = {
    "flip": ["1e-4", "1e-3", "4e-3"],
    "drop": ["1e-4", "3e-3"],
    "double": ["1e-4", "3e-3"],
    "insert": ["1e-4", "3e-3"],
    "lose": ["0.01", "0.1"],
    "delay": ["0.05@0.02", "1@0.01"],
    "short": ["0.2"],
    "stall": ["0.2@1e-3", "3@1e-4"],
    "reboot": ["1e-4", "1e-3"],
    "unplug": ["1e-4"],
}


class Line:
    """A transport with a device behind it, on a clock that moves when somebody waits."""

    port = "line:"

    def __init__(self, device, faults, seed):
        self.now = 0.0
        self.bench = Bench(device)
        self.wire = DeviceOnLine(
            device, parse_faults(faults) if faults else (), seed, self.monotonic
        )

    def monotonic(self):
        return self.now

    def read(self, timeout_s):
        try:
            deadline_s = self.now + timeout_s
            while not (data := self.wire.transmit()) and self.now < deadline_s:
                next_s = self.wire.next_event_s()
                step_s = deadline_s - self.now
                self.now += step_s if next_s is None else max(min(step_s, next_s), 1e-9)
        except ConnectionError as error:
            raise TransportClosed(f"{self.port}: {error}") from error
        return data

    def write(self, data, timeout_s):
        assert timeout_s > 0
        try:
            self.wire.receive(data)
        except ConnectionError as error:
            raise TransportClosed(f"{self.port}: {error}") from error

    def close(self):
        """Let somebody plug it in again."""
        self.wire.disconnect()


def faults_of(rng):
    kinds = rng.sample(sorted(FAULTS), rng.choice([1, 1, 2, 3]))
    return ",".join(
        f"{rng.choice(['', '', 'down.', 'up.'])}{k}={rng.choice(FAULTS[k])}" for k in kinds
    )


def random_frame(rng, display):
    frame = display.frame()
    array = frame.array()
    numbers = np.random.default_rng(rng.getrandbits(32))
    lit = numbers.random(array.shape[:3]) < rng.choice([0.0, 0.01, 0.1, 0.6])
    top = 2 if frame.format.value == "mono1" else np.iinfo(array.dtype).max
    array[lit] = numbers.integers(1, top, array[lit].shape)
    frame.set(array)
    return frame


class Oracle:
    """Pages that may be displayed, and the outcomes that the host was given."""

    def __init__(self, line):
        self.line = line
        self.pages = {self.front}
        self.counts = {"shown": 0, "failed": 0}

    @property
    def front(self):
        return self.line.bench.snapshot().pixels

    def push(self, display, frame):
        meant = frame.array().tobytes()
        self.pages.add(meant)
        try:
            receipt = display.present(frame)
        except vd.VoxDisplayError:
            self.counts["failed"] += 1
            assert self.front in self.pages, "a page that nobody presented"
            raise
        self.counts["shown"] += 1
        assert receipt.digest == frame.digest()
        if display.info.boot == self.line.wire.device.boot:
            assert self.front == meant, "reported as shown, but something else is"
        else:  # shown, and then switched off
            assert not any(self.front)


def session(seed, pushes):
    """Push frames over one bad line; whoever is thrown out opens the port again."""
    rng = random.Random(seed)
    config = {
        "grid": GRID,
        "pixel_format": rng.choice(FORMATS),
        "refresh": rng.choice([0, 30_000, 1_000_000]),
        "max_payload": rng.choice([64, 128, 300]),
        "rx_buffer": rng.choice([512, 4096]),
    }
    faults = faults_of(rng)
    line = Line(Device(Config(**config)), faults, seed)
    oracle = Oracle(line)
    oracle.pages.add(bytes(len(oracle.front)))  # dark: after a start
    display, left, opened = None, pushes, 0
    while left:
        try:
            if display is None:
                opened += 1
                assert opened < 40 * pushes, f"{faults}: nothing gets through"
                display = vd.open(line, timeout_s=2.0, clock=line.monotonic)
            left -= 1
            oracle.push(display, random_frame(rng, display))
        except vd.VoxDisplayError:
            line.close()
            display = None
    return oracle.counts, faults


@pytest.mark.parametrize("seed", range(60))
def test_whatever_happens_to_the_line(seed):
    counts, faults = session(seed, 5)
    assert sum(counts.values()) == 5, faults


@pytest.mark.slow
def test_ten_thousand_pushes():
    shown = failed = 0
    for seed in range(1000, 3000):
        counts, _ = session(seed, 5)
        shown, failed = shown + counts["shown"], failed + counts["failed"]
    assert shown + failed == 10_000
    assert shown > 8000
    assert failed > 100
