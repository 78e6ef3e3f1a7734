"""Conformance kit on ports without a device, and on one that answers by chance or falls silent."""

import random
import struct
import time

import pytest
from kit_runs import by_verdict, emulated_port, examined, info_of

from voxdisplay.conformance import CHECKS, ops, packets
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.run import Verdict, run_checks
from voxdisplay.errors import TransportClosed
from voxdisplay.wire import spec


class Pipe:
    """A pipe with something at its other end that is no device."""

    port = "nothing"

    def __init__(self, say):
        self._say = say
        self.read_bytes = 0

    def read(self, timeout_s):
        if not (device := self._say(self)):
            time.sleep(min(timeout_s, 0.05))
        self.read_bytes += len(device)
        return device

    def write(self, data, timeout_s):
        pass

    def close(self):
        pass


def gone(_pipe):
    raise TransportClosed("it was pulled out")


@pytest.mark.parametrize(
    "say",
    [
        lambda _pipe: b"",
        lambda _pipe: b"\x55" * 997,
        lambda _pipe: bytes(1000),
        lambda _pipe: packets.encode(packets.body(8, payload=bytes(19))) * 50,
        gone,
    ],
    ids=["silent", "babbling", "zeros", "answering-unasked", "gone"],
)
def test_what_is_no_device_ends_soon(say):
    report = run_checks(Pipe(say), timeout_s=0.05, opening_s=0.1)
    assert not report.holds
    assert report.device is None
    assert len(report.results) == len(CHECKS) + 1


class Fickle(Pipe):
    """Answers HELLO well, and everything else by chance."""

    def __init__(self, seed):
        super().__init__(lambda pipe: pipe.out.pop(0) if pipe.out else b"")
        self.rng = random.Random(seed)
        self.out = []
        self.inner = emulated_port(refresh=0)

    def write(self, data, timeout_s):
        self.inner.write(data, timeout_s)
        self.out += filter(None, [self.inner.read(0)])
        for segment in data.split(b"\0"):
            asked = packets.decode_segment(segment) if len(segment) >= 8 else None
            if asked and asked[0] >> 4 != spec.TYPE_HELLO and self.rng.random() < 0.5:
                kind = self.rng.choice([8, 8, 9, 10, 11, 3])
                seq = self.rng.choice([asked[1], self.rng.randrange(256)])
                rest = self.rng.randbytes(self.rng.randint(0, 40))
                answer = bytes((kind << 4 | self.rng.randrange(16), seq, 0, asked[1])) + rest
                self.out.append(packets.encode(answer) + self.rng.choice([b"", b"\0", b"noise\0"]))
        self.rng.shuffle(self.out)


@pytest.mark.parametrize("seed", range(3))
def test_whatever_a_device_answers_the_kit_ends_well(seed):
    report = run_checks(Fickle(seed), timeout_s=0.01, opening_s=1)
    assert not report.holds
    assert len(report.results) >= len(CHECKS)


def test_a_device_that_falls_silent_is_given_up():
    port = emulated_port()
    inner = port.write
    written = 0

    def write(data, timeout_s):
        nonlocal written
        written += 1
        if written < 60:
            inner(data, timeout_s)

    port.write = write
    report = examined(port)
    assert by_verdict(report, Verdict.BROKEN)
    assert len(by_verdict(report, Verdict.NOT_RUN)) > 100
    assert report.display_state.startswith("unknown")


@pytest.mark.parametrize(
    "changes",
    [{"nx": 0}, {"format": 9}, {"max_payload": 20}],
    ids=lambda changes: next(iter(changes)),
)
def test_an_impossible_info_ends_it(changes):
    fields = {"format": 2, "nx": 3, "ny": 5, "nz": 7, "max_payload": 96} | changes
    body = struct.pack(
        "<BHHBBHHHBBHIII",
        *(1, 0x1234, 7, 0, fields["format"], fields["nx"], fields["ny"], fields["nz"]),
        *(2, 0, fields["max_payload"], 512, 0, 0),
    )

    class Odd(Pipe):
        def write(self, data, _timeout_s):
            session = packets.decode_segment(data.strip(b"\0"))
            if session:
                self.answer = body[:1] + session[4:6] + body[3:] + bytes(3)

    pipe = Odd(
        lambda pipe: packets.encode(packets.body(9, payload=pipe.__dict__.pop("answer", b"")))
    )
    pipe.answer = body + bytes(3)
    report = run_checks(pipe, timeout_s=0.05, opening_s=0.3)
    assert not report.holds
    assert report.results[0].check.id == "5/answers"
    assert by_verdict(report, Verdict.NOT_RUN)


def test_an_interrupted_examination_puts_the_picture_back():
    port = emulated_port(refresh=0)
    device = AnnouncedDevice.from_info(info_of(port))
    port.write(packets.encode(packets.data(0, 0, ops.run(3), packets.CLEAR | packets.COMMIT)), 1)
    before = port.bench.snapshot().pixels
    assert before.count(0xFF) == 3 < device.voxel_count

    def enough(_result):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        examined(port, ["7/move"], on_result=enough)
    assert port.bench.snapshot().pixels == before
