"""Driver's encoders against the emulator's decoder; the packet reader on arbitrary bytes."""

import contextlib

import document
import numpy as np
import pytest
from drawing import fewest_segments, page_after, segments_in, values_of
from hypothesis import given, settings
from hypothesis import strategies as st

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import packet as packets
from voxdisplay.wire.chains import encode_chains
from voxdisplay.wire.digest import digest
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.packet_stream import PacketStream
from voxdisplay.wire.spans import decode_spans, encode_spans

GRIDS = [Grid(3, 5, 7), Grid(17, 64, 40), Grid(300, 4, 3), Grid(1, 1, 1)]
codings = st.builds(
    EncoderConfig, st.sampled_from(GRIDS), st.sampled_from(PixelFormat), st.integers(64, 400)
)
seeds = st.integers(0, 2**32 - 1)


def walk(rng, grid, count):
    """Chains, lone voxels and repeats: steps of any length, most of them short and persistent."""
    at = rng.integers(0, grid)
    step = rng.integers(-1, 2, 3)
    voxels = []
    while len(voxels) < count:
        voxels.append(at)
        chance = rng.random()
        if chance < 0.05:
            at = rng.integers(0, grid)
            continue
        if chance < 0.4:
            step = rng.integers(-1, 2, 3)
        at = np.clip(at + step, 0, np.asarray(grid) - 1)
    return np.array(voxels).reshape(-1, 3)


def pens_for(rng, voxels, grid, format_):
    """Pixels that change now and then; a voxel has the same wherever it is drawn."""
    colors = rng.integers(1, format_.full, grid.voxels, endpoint=True)
    stretch = grid.index_of(voxels) // max(1, grid.voxels // rng.integers(1, 12))
    return colors[stretch]


@settings(max_examples=250, deadline=None, derandomize=True)
@given(codings, seeds, st.integers(0, 600))
def test_chains_draw_what_was_meant(config, seed, count):
    rng = np.random.default_rng(seed)
    grid, format_ = config.grid, config.format
    voxels = walk(rng, grid, count)
    pens = pens_for(rng, voxels, grid, format_)
    payloads = encode_chains(voxels, pens, config)
    assert all(0 < len(payload) <= config.max_payload for payload in payloads)
    meant = np.zeros(grid.voxels, dtype=np.uint32)
    meant[grid.index_of(voxels)] = pens
    shuffled = [payloads[k] for k in rng.permutation(len(payloads))]
    page = page_after(shuffled, grid, format_)
    assert (values_of(page, format_) == meant).all()
    assert page.digest == digest(np.arange(grid.voxels), meant)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.sampled_from(GRIDS), st.sampled_from(PixelFormat), seeds, st.integers(1, 24))
def test_chains_are_cut_into_the_fewest_segments(grid, format_, seed, count):
    rng = np.random.default_rng(seed)
    voxels = walk(rng, grid, count)
    pens = pens_for(rng, voxels, grid, format_)
    payloads = encode_chains(voxels, pens, EncoderConfig(grid, format_, 65535))
    assert len(segments_in(payloads, grid, format_)) == fewest_segments(voxels, pens)


def random_values(rng, format_, count):
    """Stretches of dark, of one pixel, and of any pixels, of very different lengths."""
    parts, left = [], count
    while left > 0:
        n = min(left, int(rng.choice([1, 2, 3, 5, 17, 31, 32, 33, 159, 160, 161, 300])))
        kind = rng.integers(3)
        any_ = rng.integers(0, format_.full, n, endpoint=True)
        parts.append(any_ if kind == 0 else np.full(n, any_[0] if kind == 1 else 0))
        left -= n
    return np.concatenate(parts).astype(np.uint32)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(codings, seeds)
def test_spans_draw_what_was_meant(config, seed):
    rng = np.random.default_rng(seed)
    count = config.grid.voxels
    kept = rng.integers(1, count, endpoint=True)
    values = np.zeros(count, dtype=np.uint32)
    at = rng.integers(0, count - kept, endpoint=True)
    values[at : at + kept] = random_values(rng, config.format, kept)
    payloads = encode_spans(values, config)
    assert all(0 < len(payload) <= config.max_payload for payload in payloads)
    shuffled = [payloads[k] for k in rng.permutation(len(payloads))]
    assert (
        values_of(page_after(shuffled, config.grid, config.format), config.format) == values
    ).all()


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.binary(max_size=40), st.integers(0, 80), st.sampled_from(PixelFormat))
def test_a_page_of_any_bytes_is_read_or_refused(ops, count, format_):
    with contextlib.suppress(RemoteProtocolError):
        values = decode_spans(ops, count, format_)
        assert len(values) == count
        assert (values <= format_.full).all()


some_packets = st.lists(
    st.one_of(
        st.builds(packets.Status, seq=st.integers(0, 255)),
        st.builds(packets.Data, seq=st.integers(0, 255), ops=st.binary(max_size=600)),
        st.builds(
            packets.Ack,
            **{name: st.integers(0, 255) for name in ("seq", "frame", "last", "session", "boot")},
            **{name: st.integers(0, 2**32 - 1) for name in ("received", "credit", "digest")},
            damaged=st.integers(0, 65535),
        ),
    ),
    max_size=8,
)


def read_all(stream, data):
    """All packets, also those behind one that breaks the protocol."""
    found = []
    while True:
        try:
            found += stream.feed(data)
        except RemoteProtocolError:
            data = b""
        else:
            return found


@settings(max_examples=150, deadline=None, derandomize=True)
@given(some_packets, st.randoms(use_true_random=False))
def test_any_portions_give_the_same_packets(sent, random):
    data = b"".join(map(packets.encode, sent))
    stream, found, at = PacketStream(), [], 0
    while at < len(data):
        size = random.choice([1, 2, 7, 100, 1000])
        found += stream.feed(data[at : at + size])
        at += size
    assert found == sent


@settings(max_examples=200, deadline=None, derandomize=True)
@given(some_packets.filter(bool), st.randoms(use_true_random=False))
def test_a_flipped_bit_loses_only_what_it_touches(sent, random):
    wires = [packets.encode(packet) for packet in sent]
    data = bytearray(b"".join(wires))
    bit = random.randrange(8 * len(data))
    data[bit // 8] ^= 1 << bit % 8
    ends = np.cumsum([len(wire) for wire in wires])
    hit = int(np.searchsorted(ends, bit // 8, side="right"))
    # A 00 that is no 00 any more joins two packets.
    touched = {hit, hit + 1} if bit // 8 == ends[hit] - 1 else {hit}
    left = [packet for k, packet in enumerate(sent) if k not in touched]
    assert read_all(PacketStream(), bytes(data)) == left


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.lists(st.binary(max_size=200), max_size=20))
def test_any_bytes_go_through_and_the_next_packet_is_read(pieces):
    stream = PacketStream()
    for piece in pieces:
        read_all(stream, piece)
    assert read_all(stream, b"\0" + packets.encode(packets.Status(seq=5)))[-1] == packets.Status(
        seq=5
    )
    assert len(stream.noise) <= 64


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.binary(min_size=3, max_size=60))
def test_any_packet_is_a_value_or_breaks_the_protocol(body):
    """What the driver has read it can write, but for reserved bytes and text that is no UTF-8."""
    for packet in read_all(PacketStream(), document.on_wire(body)):
        again = packets.decode(packets.pack(packet))
        assert again == packet
        assert packets.pack(packet)[:3] == body[:3]


@pytest.mark.slow
@settings(max_examples=5000, deadline=None, derandomize=True)
@given(codings, seeds, st.integers(0, 2000))
def test_many_more_chains(config, seed, count):
    test_chains_draw_what_was_meant.hypothesis.inner_test(config, seed, count)


@pytest.mark.slow
@settings(max_examples=5000, deadline=None, derandomize=True)
@given(codings, seeds)
def test_many_more_spans(config, seed):
    test_spans_draw_what_was_meant.hypothesis.inner_test(config, seed)
