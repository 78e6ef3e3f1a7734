"""Display over an in-memory pipe to an emulated device, with a virtual clock."""

import numpy as np

import voxdisplay as vd
from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.wire import packet as packets
from voxdisplay.wire.packet_stream import PacketStream

GRID = (17, 9, 5)


class Pipe:
    """A transport: bytes arrive at once, waiting for what does not come takes virtual time."""

    port = "pipe:"

    def __init__(self, **config):
        config = {"grid": GRID, "pixel_format": "rgb888", "refresh": 30_000} | config
        self.device = Device(Config(max_payload=128, rx_buffer=512, **config))
        self.bench = Bench(self.device)
        self.now = 0.0
        self.closed = 0
        self.answers = lambda data: data  # what becomes of what the device says
        self.before_write = self.before_read = lambda: None

    def read(self, timeout_s):
        self.before_read()
        data = self.device.transmit()
        if not data and timeout_s:
            self.now += timeout_s
            self.device.tick()
            data = self.device.transmit()
        return self.answers(data)

    def write(self, data, timeout_s):
        assert timeout_s > 0
        self.before_write()
        self.device.receive(data)

    def close(self):
        self.closed += 1


def open_display(pipe=None, **config):
    """Open a display on a device, or on a new one: (display, pipe)."""
    pipe = pipe or Pipe(**config)
    return vd.open(pipe, timeout_s=2.0, clock=lambda: pipe.now), pipe


def random_frame(display, seed=0, density=0.3):
    rng = np.random.default_rng(seed)
    frame = display.frame()
    array = frame.array()
    lit = rng.random(array.shape[:3]) < density
    array[lit] = rng.integers(1, 256 if frame.format.value != "mono1" else 2, array[lit].shape)
    frame.set(array)
    return frame


def payloads_of(display, frame):
    return frame.payloads(display._connection.link.payload_bytes, display.info.features)


def assert_shows(pipe, frame):
    assert pipe.bench.snapshot().pixels == frame.array().tobytes()


def changed(change):
    """An ``answers`` that changes some packets of the device."""
    stream = PacketStream()
    return lambda data: b"".join(packets.encode(change(packet)) for packet in stream.feed(data))
