"""Random packets to the reference device in C and to the emulator's process: the same answers.

Valid, nearly valid and senseless. Behind each comes a STATUS, so that the state of both is compared
after each: what has been received, what is on display, its digest, and the count of damage.
"""

from __future__ import annotations

import json
import os
import random
import select
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import c_device
import document
import pytest
from c_device import FORMATS, HELLO, Grid, ScriptedDevice, all_features, build

pytestmark = pytest.mark.skipif(c_device.COMPILER is None, reason="no C compiler (cc)")

ACK, PAGE, ERROR = 0x8, 0xA, 0xB
ASKED = 4
BACK = 1
COUNT = int(os.environ.get("FIRMWARE_PACKETS", "1200"))
SEED = int(os.environ.get("FIRMWARE_SEED", "20"))


def status(tag: int) -> bytes:
    """A STATUS on the wire."""
    return document.on_wire(bytes((0x40, tag, 0)))


class EmulatorOnTerminal:
    """The emulator as its users start it, on its pseudo-terminal."""

    def __init__(self, port: str) -> None:
        self.file = os.open(port, os.O_RDWR | os.O_NOCTTY)
        self.rest = b""

    def send_raw(self, data: bytes, tag: int) -> list[bytes]:
        """Send bytes that end with a STATUS of this tag; return all answers up to its own."""
        os.write(self.file, data)
        found: list[bytes] = []
        while True:
            ready, _, _ = select.select([self.file], [], [], 20)
            assert ready, "the emulator is silent"
            self.rest += os.read(self.file, 65536)
            whole, zero, self.rest = self.rest.rpartition(b"\0")
            found += document.off_wire(whole + zero)
            if found and is_answer_to_status(found[-1], tag):
                return found


def is_answer_to_status(packet: bytes, tag: int) -> bool:
    kind = packet[0] >> 4
    if kind == ACK:
        return bool(packet[0] & ASKED) and packet[3] == tag
    return kind == ERROR and packet[1] == tag and packet[3] == 1


class Packets:
    """Random packets of a session that knows its numbers, and often keeps to them."""

    def __init__(self, grid: Grid, pixel_format: str, seed: int) -> None:
        self.random = random.Random(seed)
        self.grid = grid
        self.wide = max(grid) > 256
        self.size = (1, 1, 2, 3)[FORMATS.index(pixel_format)]
        self.mono = pixel_format == "mono1"
        self.volume = grid[0] * grid[1] * grid[2]
        self.number = 0
        self.frame = 0
        self.clear = 1
        self.sent: list[bytes] = []

    def xyz(self) -> bytes:
        slack = self.random.random() < 0.02
        width = 2 if self.wide else 1
        return b"".join(
            self.random.randrange(side + slack).to_bytes(width, "little") for side in self.grid
        )

    def pixel(self) -> bytes:
        if self.mono:
            return bytes((self.random.randrange(2),))
        return self.random.randbytes(self.size)

    def count(self, op: int) -> tuple[bytes, int]:
        n = self.random.choice((1, 2, 3, 5, 9, 31, 32, 40, 200))
        return (bytes((op + n - 1,)) if n < 32 else bytes((op + 31,)) + leb128(n - 32)), n

    def op(self) -> bytes:
        makers = [self.simple, self.chain, self.run, self.run, self.last]
        return self.random.choice(makers if self.mono else [*makers, self.fade])()

    def simple(self) -> bytes:
        r = self.random
        kind = r.randrange(1, 7)
        if kind == 1:
            return b"\1" + self.pixel()
        if kind == 5:
            n = r.randrange(1, 9)
            return bytes((5, n - 1)) + b"".join(self.xyz() for _ in range(n))
        if kind == 6:
            n = r.randrange(1, 5)
            return bytes((6, r.randrange(250), n - 1)) + r.randbytes(3 * n)
        return bytes((kind,)) + self.xyz()

    def chain(self) -> bytes:
        r = self.random
        n = r.randrange(1, 4)
        start = self.xyz() if r.randrange(2) else b""
        op = (0x40 if start else 0x20) + r.randrange(24)
        return bytes((op,)) + start + bytes((n - 1, r.randrange(4**n)))

    def run(self) -> bytes:
        """SKIP, RUN, LIT or DIFF."""
        r = self.random
        kind = r.choice((0x80, 0xA0, 0xC0, 0xE0))
        op, n = self.count(kind)
        if kind == 0xC0 and not self.mono:
            return op + r.randbytes(n * self.size)
        bits = {0xC0: 1, 0xE0: 4}.get(kind, 0) * n
        return op + r.getrandbits(bits).to_bytes((bits + 7) // 8, "little")

    def fade(self) -> bytes:
        """FADE or RAMP, and a chain."""
        r = self.random
        k = r.randrange(1, 5)
        if r.randrange(2):
            colors = r.randbytes(3 * k)
            return bytes((9, r.randrange(250), r.randrange(7), k - 1)) + colors
        n = r.choice((1, 2, 5, 300))
        colors = r.randbytes((1 if self.size == 1 else 3) * k)
        return bytes((8, k - 1)) + leb128(n - 1) + leb128(r.randrange(n)) + colors + self.chain()

    def last(self) -> bytes:
        """OCT, or a range-coded op, which seldom end well here."""
        r = self.random
        if r.randrange(2):
            return bytes((r.randrange(0x58, 0x5B),)) + r.randbytes(r.randrange(12))
        place = bytes(6 if self.wide else 3)
        return bytes((0x60 + r.randrange(3),)) + place + r.randbytes(r.randrange(4))

    def ops(self) -> bytes:
        """Ops of which many fit: each begins anew with MOVE, so that cursors stay on the grid."""
        return b"".join(
            b"\2" + self.xyz() + self.op() for _ in range(self.random.choice((0, 1, 1, 1, 2, 3)))
        )

    def data(self) -> bytes:
        r = self.random
        if self.sent and r.random() < 0.1:
            return r.choice(self.sent[-8:])
        commit = 4 * (r.random() < 0.4)
        number = self.number
        if r.random() < 0.1:
            number += r.choice((1, 1, 2, 3, 31, 32, 40, 255, 128))
        flags = self.clear | commit
        if r.random() < 0.01:
            flags ^= 1 << r.randrange(4)
        frame = self.frame
        if r.random() < 0.06:
            frame += r.choice((1, 1, 1, 2, 255))
        packet = bytes((0x10 | flags, number % 256, frame % 256)) + self.ops()
        self.sent.append(packet)
        return packet

    def mutated(self, packet: bytes) -> bytes:
        at = self.random.randrange(len(packet))
        kind = self.random.randrange(3)
        if kind == 0:
            return packet[:at] + self.random.randbytes(1) + packet[at + 1 :]
        if kind == 1:
            return packet[:at] + packet[at + 1 :] if len(packet) > 3 else packet
        return packet[:at] + self.random.randbytes(1) + packet[at:]

    def wire(self) -> bytes:
        r = self.random
        kind = r.random()
        if kind < 0.02:
            return document.on_wire(
                r.choice((HELLO, HELLO + b"more", HELLO[:7], HELLO[:4] + bytes(4)))
            )
        if kind < 0.03:
            return document.on_wire(b"\x30\0\0\2\5\6\0\0")
        if kind < 0.10:
            start = r.randrange(self.volume + 1)
            body = bytes((0x50 + r.randrange(2), 7, 0, 0)) + start.to_bytes(4, "little")
            packet = body + r.randrange(self.volume + 1).to_bytes(4, "little")
        elif kind < 0.12:
            packet = r.randbytes(r.randrange(3, 40))
        elif kind < 0.15:
            return r.randbytes(r.randrange(1, 40)).replace(b"\0", b"\1") + b"\0"
        else:
            packet = self.data()
        if r.random() < 0.05:
            packet = self.mutated(packet)
        wire = document.on_wire(packet)
        if r.random() < 0.02:
            at = r.randrange(len(wire) - 1)
            wire = wire[:at] + bytes((wire[at] ^ (1 << r.randrange(8)),)) + wire[at + 1 :]
        return wire

    def learn(self, status: bytes) -> None:
        """Follow the state that the answer to STATUS gives."""
        if status[0] >> 4 == ACK:
            self.number = status[1]
            if status[0] & 1 and status[2] == self.frame % 256:
                self.frame += 1
                self.clear = self.random.randrange(2)


def leb128(k: int) -> bytes:
    out = bytearray()
    while k > 127:
        out.append(k % 128 + 128)
        k //= 128
    return bytes((*out, k))


def comparable(answers: list[bytes], size: int) -> list[tuple[Any, ...]]:
    """Return what two devices must answer alike: no texts, no name, and voxels, not their code."""
    found: list[tuple[Any, ...]] = []
    for packet in answers:
        kind = packet[0] >> 4
        if kind == ACK and not packet[0] & ASKED:
            continue  # which a device may leave out
        if kind == ERROR:
            found.append(tuple(packet[:8]))
        elif kind == PAGE:
            found.append(tuple(packet[:8]))
            pixels = decode(packet[12:], size, int.from_bytes(packet[8:12], "little"))
            if not packet[0] & BACK:  # whose contents are undefined before a frame begins
                found.append(tuple(pixels[:20]))
        else:
            found.append(tuple(packet[:32]))
    return found


def decode(ops: bytes, size: int, count: int) -> list[bytes]:
    """Decode PEN, SKIP, RUN and LIT (size 0: MONO1)."""
    width = max(size, 1)
    pixels: list[bytes] = []
    pen = b"\1" if size == 0 else b"\xff" * size
    at = 0
    while at < len(ops):
        op = ops[at]
        at += 1
        if op == 0:
            break
        if op == 1:
            pen = ops[at : at + width]
            at += width
            continue
        n = op % 32 + 1
        if op % 32 == 31:
            shift = 0
            while True:
                n += (ops[at] & 127) << shift
                shift += 7
                at += 1
                if ops[at - 1] < 128:
                    break
        if op >> 5 == 4:
            pixels += [bytes(width)] * n
        elif op >> 5 == 5:
            pixels += [pen] * n
        elif size == 0:
            pixels += [bytes((ops[at + i // 8] >> i % 8 & 1,)) for i in range(n)]
            at += (n + 7) // 8
            pen = pixels[-1]
        else:
            pixels += [ops[at + size * i : at + size * i + size] for i in range(n)]
            at += size * n
            pen = pixels[-1]
    assert len(pixels) == count
    return pixels


@pytest.fixture
def emulator() -> Iterator[Callable[[Grid, str], EmulatorOnTerminal]]:
    """Start an emulator that swaps at once; end it after the test."""
    with ExitStack() as running:

        def start(grid: Grid, pixel_format: str) -> EmulatorOnTerminal:
            size = ",".join(map(str, grid))
            command = [sys.executable, "-m", "firmware_sim", "--refresh", "0"]
            command += ["--size", size, "--format", pixel_format]
            command += ["--features", ",".join(sorted(all_features(pixel_format))).lower()]
            process = subprocess.Popen(
                command,
                stdout=subprocess.PIPE,
            )
            running.enter_context(process)
            running.callback(process.terminate)
            assert process.stdout is not None
            device = EmulatorOnTerminal(json.loads(process.stdout.readline())["port"])
            running.callback(os.close, device.file)
            return device

        yield start


@pytest.mark.parametrize(
    ("grid", "pixel_format"),
    [((3, 5, 7), "index8"), ((4, 4, 4), "mono1"), ((300, 2, 2), "rgb565"), ((3, 5, 7), "rgb888")],
    ids=str,
)
def test_both_answer_alike(
    emulator: Callable[[Grid, str], EmulatorOnTerminal], grid: Grid, pixel_format: str
) -> None:
    size = (0, 1, 2, 3)[FORMATS.index(pixel_format)]
    packets = Packets(grid, pixel_format, SEED)
    other = emulator(grid, pixel_format)
    hello = document.on_wire(HELLO)
    info, _ = other.send_raw(b"\0" + hello + status(0), 0)
    program = build(grid, pixel_format, all_features(pixel_format))
    ended, digests = 0, set()
    with ScriptedDevice(program, refresh=0, boot=int.from_bytes(info[6:8], "little")) as device:
        device.send(HELLO)
        for number in range(COUNT):
            tag = number % 200
            data = packets.wire() + status(tag)
            theirs = other.send_raw(data, tag)
            ours = device.send_raw(data)
            assert comparable(ours, size) == comparable(theirs, size), (number, data.hex(" "))
            packets.learn(theirs[-1])
            if theirs[-1][0] >> 4 == ACK:
                digests.add(theirs[-1][16:20])
            else:
                ended += 1
                other.send_raw(hello + status(201), 201)
                device.send(HELLO)
                packets.number = packets.frame = 0
    # The packets reach what they are meant to reach.
    assert len(digests) > COUNT // 50
    assert COUNT // 50 < ended < COUNT // 2
