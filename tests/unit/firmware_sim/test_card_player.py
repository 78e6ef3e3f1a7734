"""Player of recordings in the device: cadence, digests, loops, and hosts that take over."""

from __future__ import annotations

import io
import struct
from collections import Counter

import document
import pytest
from recordings import Spin, write_recording

from firmware_sim import spec
from firmware_sim.card_player import CardPlayer, Packets, read_head
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from voxdisplay.shows.recording_packets import encode_segment, segments


class Show(Spin):
    """A show of another rate, loop or length."""

    def __init__(self, fps, frame_count=60, *, loop=False, format_="mono1"):
        super().__init__(frame_count, format_)
        self.fps, self.loop = fps, loop


class Bench:
    """A device that plays a recording in virtual time."""

    def __init__(self, data, refresh_hz, loop=None, format_="mono1", **config):
        self.now = 0.0
        config = Config((12, 10, 9), format_, round(refresh_hz * 1000), **config)
        self.device = Device(config)
        self.player = CardPlayer(self.device, io.BytesIO(data), loop)
        self.digests = []
        self.times = []
        self.device.on_swap = self._swapped
        self.wire = DeviceOnLine(self.device, clock=lambda: self.now, player=self.player)

    def _swapped(self):
        self.player.exchanged()
        self.times.append(self.now)
        self.digests.append(self.device.memory.front.digest)

    def run(self, until_s):
        while (pause := self.wire.next_event_s()) is not None and self.now + pause <= until_s:
            self.now += pause
            self.wire.advance()
        self.now = until_s

    def intervals(self, unit_s):
        pairs = zip(self.times, self.times[1:], strict=False)
        return Counter(round((b - a) / unit_s) for a, b in pairs)


@pytest.fixture(scope="module")
def data_of(tmp_path_factory):
    """Return the bytes and digests of a show's recording."""
    folder = tmp_path_factory.mktemp("card")
    kept = {}

    def make(fps, **named):
        key = (fps, *sorted(named.items()))
        if key not in kept:
            path = folder / f"{len(kept)}.vxs"
            frames = write_recording(path, Show(fps, **named))
            kept[key] = path.read_bytes(), [frame.digest() for frame in frames]
        return kept[key]

    return make


@pytest.mark.parametrize(
    ("fps", "refresh_hz", "ticks"),
    [
        (30, 60, {2: 59}),
        (25, 50, {2: 59}),
        (24, 60, {2: 29, 3: 30}),
        (60, 60, {1: 59}),
        (30, 30, {1: 59}),
        (29.97, 59.94, {2: 59}),
    ],
)
def test_every_frame_is_shown_at_its_tick(data_of, fps, refresh_hz, ticks):
    data, digests = data_of(fps)
    bench = Bench(data, refresh_hz)
    bench.run(10)
    assert bench.digests == digests
    assert bench.intervals(1 / refresh_hz) == ticks
    assert (bench.player.shown, bench.player.wrong, bench.player.skipped) == (60, 0, 0)
    assert bench.device.errors_by_code == {}


def test_a_device_without_ticks_goes_by_time(data_of):
    data, digests = data_of(30)
    bench = Bench(data, 0)
    bench.run(10)
    assert bench.digests == digests
    assert bench.intervals(1 / 30) == {1: 59}


def test_of_frames_at_one_tick_the_last_is_shown(data_of):
    data, digests = data_of(60)
    bench = Bench(data, 30)
    bench.run(10)
    assert bench.player.wrong == 0
    assert bench.player.shown + bench.player.skipped == 60
    assert bench.intervals(1 / 30) == {1: bench.player.shown - 1}
    assert set(bench.digests) <= set(digests)
    assert bench.digests[-1] == digests[-1]


def test_a_loop_does_not_drift(data_of):
    data, digests = data_of(24, loop=True)
    bench = Bench(data, 60)
    bench.run(50)  # twenty rounds of 2.5 s
    assert bench.player.wrong == bench.player.skipped == 0
    assert bench.digests[:180] == digests * 3
    assert bench.times[60::60] == pytest.approx([1 / 60 + 2.5 * n for n in range(1, 20)])


def test_loops_are_as_the_recording_says_or_as_told(data_of):
    data, _ = data_of(30, frame_count=3)
    bench = Bench(data, 60, loop=True)
    bench.run(1)
    assert bench.player.shown > 20
    bench = Bench(data_of(30, frame_count=3, loop=True)[0], 60, loop=False)
    bench.run(1)
    assert bench.player.shown == 3
    assert not bench.player.active
    assert bench.wire.next_event_s() is None


def test_a_host_takes_over(data_of):
    data, _ = data_of(30, loop=True)
    bench = Bench(data, 60)
    bench.run(0.5)
    assert bench.wire.transmit() == b""  # nobody has asked
    shown = bench.player.shown
    hello = bytes((0x30, 0, 0, 1, 7, 7, 0, 0))
    bench.wire.receive(document.on_wire(hello))
    (info,) = document.off_wire(bench.wire.transmit())
    assert info[0] == spec.TYPE_INFO << 4
    ops = b"\x05\x00\x01\x02\x03"
    bench.wire.receive(document.on_wire(bytes((0x15, 0, 0)) + ops))
    bench.run(1.5)
    assert not bench.player.active
    assert bench.player.shown == shown
    assert bench.wire.transmit() != b""
    # What the host has drawn stays.
    assert bench.device.memory.front.digest == bench.digests[-1]
    assert len(bench.digests) == shown + 1


def test_damaged_and_partial_frames_are_left_out(data_of):
    data, digests = data_of(30)
    found = list(segments(data))
    frames = [segment for segment in found if segment.kind == 6]
    damaged = bytearray(data)
    damaged[frames[5].offset + frames[5].size + 4] ^= 1  # a DATA of frame 5
    damaged[frames[9].offset + 3] ^= 1  # the FRAME of frame 9: its DATA belong to frame 8
    bench = Bench(bytes(damaged), 60)
    bench.run(10)
    assert bench.player.wrong == 0
    assert bench.digests == digests[:5] + digests[6:8] + digests[10:]
    assert bench.player.skipped == 2


def test_a_file_that_is_cut_off_is_played_to_the_cut(data_of):
    data, digests = data_of(30)
    frames = [segment for segment in segments(data) if segment.kind == 6]
    bench = Bench(data[: frames[20].offset], 60, loop=True)
    bench.run(0.7)
    assert bench.digests[:20] == digests[:20]
    assert bench.digests[20] == digests[0]


def test_strange_packets_are_passed_over(data_of):
    data, digests = data_of(30)
    frames = [segment for segment in segments(data) if segment.kind == 6]
    strange = encode_segment(13, 0, 0, 0, b"later") + encode_segment(6, 0, 0, 0, b"short")
    strange += encode_segment(7, 1, 0, 0, b"short")
    at = frames[7].offset
    bench = Bench(data[:at] + strange + data[at:], 60)
    bench.run(10)
    assert bench.digests == digests


def changed(data, kind, payload_of):
    """Return a file with the payload of a packet changed."""
    return b"\0" + b"".join(
        encode_segment(s.kind, s.flags, s.seq, s.frame, payload_of(s.payload))
        if s.kind == kind
        else encode_segment(s.kind, s.flags, s.seq, s.frame, s.payload)
        for s in segments(data)
    )


@pytest.mark.parametrize(
    ("kind", "payload", "message"),
    [
        (12, lambda _: b"{", "no JSON"),
        (12, lambda _: b"7", "version None"),
        (12, lambda _: b'{"version": 2}', "version 2"),
        (9, lambda info: b"\x02" + info[1:], "another protocol"),
        (9, lambda info: info[:6] + b"\x09" + info[7:], "unknown pixel format"),
        (9, lambda info: info[:5], "no recording"),
        (9, lambda info: info[:15] + struct.pack("<H", 2000) + info[17:], "payloads of 2000"),
        (9, lambda info: info[:25] + b"\x20\0\0\0" + info[29:], "features arc"),
        (9, lambda info: info[:25] + b"\0\x10\0\0" + info[29:], "HOLD, which recordings"),
        (6, lambda _: b"", "no frames"),
    ],
)
def test_recordings_that_cannot_be_played(data_of, kind, payload, message):
    data, _ = data_of(30)
    with pytest.raises(ValueError, match=message):
        Bench(changed(data, kind, payload), 60, features=frozenset(("line", "box", "dots", "oct")))


@pytest.mark.parametrize("data", [b"", b"\0" * 600, b"GIF89a" * 200])
def test_other_files(data):
    with pytest.raises(ValueError, match="no recording"):
        read_head(Packets(io.BytesIO(data)))


def test_files_that_hold_many_packets_before_meta():
    data = b"\0" + encode_segment(13, 0, 0, 0, b"later") * 20
    with pytest.raises(ValueError, match="no recording"):
        read_head(Packets(io.BytesIO(data)))


def test_another_display(data_of):
    with pytest.raises(ValueError, match="the recording is of 12x10x9 mono1: leave out --size"):
        Bench(data_of(30)[0], 60, format_="index8")
