"""Random ops read three times: by the reference device in C, the emulator, and the kit's decoder.

Ops of every kind, the range-coded ones and fades among them: valid, nearly valid and hostile. The
three are written apart from protocol.md; where two differ, one of them is wrong, or the document.
"""

from __future__ import annotations

import os
import random
from collections import Counter
from collections.abc import Iterator

import c_device
import document
import pytest
from c_device import HELLO, Grid, ScriptedDevice, all_features, build
from vector_device import VectorDevice

from voxdisplay.conformance import ops, range_coded_chains, second_chains
from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.checks.range_coded_slabs import ball_in, encode_fitting, random_box
from voxdisplay.conformance.packets import Response
from voxdisplay.conformance.reference_decoder import ReferenceDecoder, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

pytestmark = pytest.mark.skipif(c_device.COMPILER is None, reason="no C compiler (cc)")

COUNT = int(os.environ.get("FIRMWARE_PACKETS", "100"))
SEED = int(os.environ.get("FIRMWARE_SEED", "11"))
LAST_OPS = (spec.OP_ARC, spec.OP_SLABS, spec.OP_ARC2)


class Payloads:
    """Random payloads of a device: valid, nearly valid, and hostile."""

    def __init__(self, device: AnnouncedDevice, seed: int) -> None:
        self.device = device
        self.random = random.Random(seed)

    def __iter__(self) -> Iterator[bytes]:
        while True:
            payload = self.valid()
            if self.random.random() < 0.4:
                payload = self.mutated(payload)
            elif self.random.random() < 0.2:
                payload += bytes((self.random.choice(LAST_OPS),)) + self.hostile_bits()
            yield payload

    def valid(self) -> bytes:
        """Ops, and half of the time a range-coded one behind them."""
        head = ops.random_ops(self.device, self.random, self.random.choice((12, 60, 200)))
        if self.device.has("FADE") and self.random.random() < 0.3:
            head += ops.random_fade(self.device, self.random)
        last = (bytes, bytes, self.slabs, self.chains, self.second_chains)
        return head + self.random.choice(last)()

    def slabs(self) -> bytes:
        rng = self.random
        box = random_box(self.device, rng)
        voxels = ball_in(self.device, box, rng, hollow=rng.random() < 0.7)
        return encode_fitting(self.device, voxels, [box] * rng.choice((1, 1, 2)))

    def walk(self) -> tuple[Voxel, ...]:
        """A start, and steps to neighbours on the grid, with some straight parts."""
        rng = self.random
        places = [ops.random_voxel(self.device, rng)]
        step = (1, 0, 0)
        for _ in range(rng.choice((0, 1, 5, 30, 300))):
            if rng.random() < 0.3:
                step = (rng.randint(-1, 1), rng.randint(-1, 1), rng.randint(-1, 1))
            x, y, z = (
                min(max(a + s, 0), side - 1)
                for a, s, side in zip(places[-1], step, self.device.grid, strict=True)
            )
            if (x, y, z) != places[-1]:
                places.append((x, y, z))
        return tuple(places)

    def chains(self) -> bytes:
        pieces = [
            range_coded_chains.Piece(
                self.walk(), self.random.choice((None, ops.random_pixel(self.device, self.random)))
            )
            for _ in range(self.random.randint(1, 4))
        ]
        return range_coded_chains.encode(self.device, pieces)

    def second_chains(self) -> bytes:
        rng = self.random
        pieces = []
        for _ in range(rng.randint(1, 6)):
            ink: second_chains.Ink = rng.choice((None, ops.random_pixel(self.device, rng)))
            if self.device.format != spec.FORMAT_MONO1 and rng.random() < 0.4:
                count = rng.choice((1, 2, 40, 60_000))
                ink = second_chains.FadeInk(ops.random_stops(rng), count, rng.randrange(count))
            pieces.append(second_chains.InkedPiece(self.walk(), ink))
        return second_chains.encode(self.device, pieces, near=rng.random() < 0.8)

    def mutated(self, payload: bytes) -> bytes:
        at = self.random.randrange(len(payload))
        return self.random.choice(
            (
                payload[:at],
                payload[:at] + self.random.randbytes(1) + payload[at + 1 :],
                payload[:at]
                + bytes((payload[at] ^ 1 << self.random.randrange(8),))
                + payload[at + 1 :],
                payload + b"\0",
            )
        )

    def hostile_bits(self) -> bytes:
        """Bits that lead the models to their ends, or nowhere."""
        rng = self.random
        count = rng.choice((0, 3, 20, 200))
        kind = rng.randrange(4)
        if kind == 0:
            return rng.randbytes(count)
        if kind == 1:
            return bytes((rng.choice((0x7F, 0x80, 0xFF)),)) + bytes(count)
        if kind == 2:
            return bytes(rng.choice((0xFF, 0xFF, 0xFE, 0)) for _ in range(count))
        return rng.randbytes(3) + bytes((rng.randrange(256),)) * count


def verdict(answer: bytes) -> tuple[str, int, int]:
    """What a device says of a payload: the digest on display, or a code with its offset."""
    if answer[0] >> 4 == spec.TYPE_ERROR:
        return "refused", answer[3], int.from_bytes(answer[6:8], "little")
    return "drawn", int.from_bytes(answer[16:20], "little"), 0


def verdict_of_the_kit(device: AnnouncedDevice, payload: bytes) -> tuple[str, int, int]:
    page = Page()
    try:
        ReferenceDecoder(device, page).draw(payload)
    except Refused as refused:
        return "refused", refused.code, refused.at + 3
    return "drawn", page.digest(device), 0


@pytest.mark.parametrize(
    ("grid", "pixel_format"),
    [
        ((19, 5, 7), "index8"),
        ((9, 13, 6), "mono1"),
        ((300, 9, 2), "rgb565"),
        ((1030, 2, 3), "rgb888"),
        ((70, 8, 9), "rgb888"),
    ],
    ids=str,
)
def test_all_three_read_alike(grid: Grid, pixel_format: str) -> None:
    emulator = VectorDevice(grid, pixel_format, features=all_features(pixel_format))
    (info,) = emulator.send(HELLO)
    announced = AnnouncedDevice.from_info(Response(info))
    program = build(grid, pixel_format, all_features(pixel_format))
    payloads = iter(Payloads(announced, SEED))
    found: Counter[tuple[str, int]] = Counter()
    with ScriptedDevice(program, refresh=0) as device:
        device.send(HELLO)
        number = 0
        for _ in range(COUNT):
            payload = next(payloads)
            packet = bytes((0x15, number, number)) + payload
            wire = document.on_wire(packet)
            (ours,), (theirs,) = device.send_raw(wire), emulator.send_raw(wire)
            wanted = verdict_of_the_kit(announced, payload)
            assert verdict(ours) == verdict(theirs) == wanted, payload.hex(" ")
            found[wanted[0], wanted[1] if wanted[0] == "refused" else 0] += 1
            number = (number + 1) % 256
            if wanted[0] == "refused":
                device.send(HELLO)
                emulator.send(HELLO)
                number = 0
    # The payloads reach what they are meant to reach.
    assert found["drawn", 0] > COUNT // 4
    for code in (spec.CODE_TRUNCATED, spec.CODE_PADDING, spec.CODE_OUTSIDE):
        assert found["refused", code] > COUNT // 50, found
