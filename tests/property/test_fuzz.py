"""Fuzzing of both receivers with hostile bytes: only documented exceptions, bounded memory.

protocol.md, 12: "A receiver MUST survive any input". The bytes come from seeds: noise,
packets with bits changed on the wire, and packets whose check value holds though their fields are
nonsense, which go deepest.
"""

import gc
import random
import tracemalloc

import document
import pytest

from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.errors import RemoteProtocolError, TransportTimeout
from voxdisplay.link import Link
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

SESSION, BOOT = 0x5A17, 0xB007
HELLO = packets.encode(packets.Hello(session=SESSION))
GROWTH_BYTES = 100_000
IN_CI, BY_HAND = 1_000_000, 100_000_000
SIZES = [
    pytest.param(IN_CI, id="some"),
    pytest.param(BY_HAND, id="many", marks=pytest.mark.slow),
]


def bodies(kind):
    """Header and payload of the vectors' packets that a host, or a device, sends."""
    host = {"DATA", "HELLO", "STATUS", "READ"}
    found = [
        v.hex("packet")[:-4] for v in document.vectors("packet") if (v["type"] in host) == kind
    ]
    if kind:
        found += [bytes((0x15, 0, 0)) + v.hex("ops") for v in document.vectors("ops")]
        found += [bytes((0x15, 0, 0)) + v.hex("ops") for v in document.vectors("refused")]
    return found


class Hostile:
    """An endless source of bytes that are almost, or not at all, what a receiver expects."""

    def __init__(self, seed, samples):
        self.rng = random.Random(seed)
        self.samples = samples

    def next(self):
        return self.rng.choice(
            [self.noise, self.damaged, self.nonsense, self.nonsense, self.zeros]
        )()

    def noise(self):
        return self.rng.randbytes(self.rng.choice([1, 9, 300, 3000]))

    def zeros(self):
        return bytes(self.rng.randrange(1, 5))

    def damaged(self):
        wire = bytearray(document.on_wire(self.rng.choice(self.samples)))
        for _ in range(self.rng.randrange(1, 4)):
            wire[self.rng.randrange(len(wire))] ^= 1 << self.rng.randrange(8)
        return bytes(wire[: self.rng.randrange(len(wire) + 1)] if self.rng.random() < 0.2 else wire)

    def nonsense(self):
        body = bytearray(self.rng.choice(self.samples))
        body[1] = self.rng.choice([body[1], 0, 1, 2, 31, 32, 255, self.rng.randrange(256)])
        body[2] = self.rng.choice([body[2], 0, 1, 255])
        for _ in range(self.rng.randrange(4)):
            at = self.rng.randrange(len(body))
            change = self.rng.randrange(4)
            if change == 0:
                body[at] = self.rng.randrange(256)
            elif change == 1:
                body[at:at] = self.rng.randbytes(self.rng.randrange(1, 40))
            elif change == 2 and len(body) > 4:
                del body[at : at + self.rng.randrange(1, 9)]
            else:
                body += self.rng.choice(self.samples)[3:]
            body[3:] = body[3:] or b"\0"
        return document.on_wire(bytes(body[:3000]))


def feed(size, source, take):
    """Feed so many bytes, in portions of any size; fail if what is held grows and grows."""
    held = []
    fed = 0
    pending = b""
    tracemalloc.start()
    try:
        while fed < size:
            pending += source.next()
            cut = (
                source.rng.randrange(len(pending) + 1)
                if source.rng.random() < 0.3
                else len(pending)
            )
            take(pending[:cut])
            fed += cut
            pending = pending[cut:]
            if fed * 10 // size > len(held):
                gc.collect()  # an exception and its traceback hold each other
                held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert held[-1] - held[1] < GROWTH_BYTES


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("pixel_format", ["index8", "mono1"])
def test_the_device_gets_through_anything(size, pixel_format):
    device = Device(
        Config(grid=(17, 9, 5), pixel_format=pixel_format, refresh=0, rx_buffer=4096, boot=BOOT)
    )
    source = Hostile(1, bodies(kind=True))

    def take(data):
        device.receive(data)
        document.off_wire(device.transmit())  # whatever it says is well-formed
        if source.rng.random() < 0.02:
            device.receive(b"\0" + HELLO)
            assert any(body[0] == 0x90 for body in document.off_wire(device.transmit()))

    feed(size, source, take)
    device.receive(b"\0" + HELLO + document.on_wire(bytes.fromhex("15 00 00 A0")))
    _, ack = document.off_wire(device.transmit())[-2:]
    assert ack[0] == 0x81


@pytest.mark.parametrize("size", SIZES)
def test_the_driver_gets_through_anything(size):
    source = Hostile(2, bodies(kind=False))
    info = next(v.hex("packet")[:-4] for v in document.vectors("packet") if v.name == "info")
    now = 0.0
    link = Link(SESSION, now)

    def opened():
        fresh = Link(SESSION, now)
        fresh.transmit(now)
        fresh.receive(b"\0" + document.on_wire(info), now)
        assert fresh.ready
        fresh.present([b"\xa0"])
        fresh.read(0, 5)
        fresh.transmit(now)
        return fresh

    def take(data):
        nonlocal link, now
        now += 1e-4
        try:
            link.receive(data, now)
            link.transmit(now)
        except (RemoteProtocolError, TransportTimeout):
            link = opened()
        if source.rng.random() < 0.02:
            link = opened()

    feed(size, source, take)
    link = opened()
    assert link.info.serial == "A1"
    assert link.info.has(spec.FEATURE_READ)
