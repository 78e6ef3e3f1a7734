"""Range-coded slabs: drawn by the emulator, read by the driver, and selected."""

import numpy as np
import pytest
from drawing import page_after, values_of
from hypothesis import given, settings
from hypothesis import strategies as st

import voxdisplay as vd
from voxdisplay.compute import kernel_backend
from voxdisplay.errors import RemoteProtocolError
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import encoding_selection, kernels, slab_coder, slab_decoder, slabs, spec
from voxdisplay.wire.features import select_features
from voxdisplay.wire.op_decoder import decode_ops
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.slab_contexts import MODEL_BASES, slab_decisions

GRIDS = [Grid(17, 12, 20), Grid(3, 5, 7), Grid(300, 4, 3), Grid(1, 1, 1), Grid(70, 66, 9)]
SLABS = 1 << spec.FEATURE_SLABS
SETS = ("box", "oct", "dots")


@pytest.fixture(autouse=True)
def _without_kernels():
    """Use none but where a test asks for them, whatever has been drawn before."""
    before = kernel_backend.set_enabled(False)
    yield
    kernel_backend.set_enabled(before)


def shell(side, radius, thick=0.5):
    """Voxels of a sphere in a cube, as an array of 0 and 1: [z, y, x]."""
    place = np.stack(np.mgrid[:side, :side, :side]) + 0.5 - side / 2
    return (np.abs(np.linalg.norm(place, axis=0) - radius) < thick).astype(np.uint8)


def random_set(rng, grid, kind):
    """Return the indices of some voxels: noise, a ball, or its shell, ascending."""
    place = grid.voxels_at(np.arange(grid.voxels))
    if kind == "noise":
        return np.flatnonzero(rng.random(grid.voxels) < rng.choice([0.01, 0.3, 0.9, 1.0]))
    far = np.linalg.norm((place - rng.uniform(0, grid)) / np.maximum(1, np.array(grid) / 4), axis=1)
    return np.flatnonzero(far < 2 if kind == "ball" else np.abs(far - 2) < 0.3)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(GRIDS),
    st.sampled_from(PixelFormat),
    st.sampled_from([64, 65, 200, 1024]),
    st.sampled_from(["noise", "ball", "shell"]),
)
def test_the_emulator_draws_and_the_driver_reads_what_was_meant(seed, grid, format_, most, kind):
    rng = np.random.default_rng(seed)
    index = random_set(rng, grid, kind)
    pen = int(rng.integers(1, format_.full + 1))
    payloads = slabs.encode_slabs(index, pen, EncoderConfig(grid, format_, most, SLABS))
    assert all(0 < len(payload) <= most for payload in payloads)
    meant = np.zeros(grid.voxels, dtype=np.uint32)
    meant[index] = pen
    assert np.array_equal(values_of(page_after(payloads, grid, format_), format_), meant)
    read = decode_ops(payloads, grid, format_)
    assert np.array_equal(read.index, index)
    assert (read.values == pen).all()


def test_no_voxel_makes_no_payload():
    assert slabs.encode_slabs(np.arange(0), 1, EncoderConfig(GRIDS[0], PixelFormat.MONO1, 64)) == []


class Decoder:
    """Decoder of the slabs of a box above a slab that is known."""

    def __init__(self, decode, stream, before):
        self.decode, self.stream = decode, stream
        self.state = slab_coder.initial_state()
        self.state[-3:] = int.from_bytes(stream[:3].tobytes(), "big"), 1 << 24, 3
        _, tall, wide = before.shape
        count = before.reshape(4, tall // 4, 4, wide // 4, 4).sum(axis=(0, 2, 4))
        self.cells = np.pad(np.where(count == 64, 2, np.minimum(count, 1)), 1).astype(np.int64)
        self.below = np.pad(before[3], 1).astype(np.int64)
        self.lit = np.empty(before.shape, dtype=np.bool_)

    def next_slab(self):
        known = (self.cells, self.below, self.lit)
        return self.decode(self.state, self.stream, *known, slab_coder.state_table(), MODEL_BASES)


@pytest.mark.parametrize("kind", ["noise", "ball", "shell"])
def test_kernels_do_what_numpy_does(kind):
    """Also uncompiled, so that each of their lines is seen to run."""
    rng = np.random.default_rng(3)
    grid = Grid(17, 23, 40)
    voxels = np.zeros((grid.voxels,), dtype=np.bool_)
    voxels[random_set(rng, grid, kind)] = True
    box = np.zeros((44, 24, 20), dtype=np.bool_)
    box[4:44, :23, :17] = voxels.reshape(40, 23, 17)
    box[:4, 2:9, 3:14] = True
    models, bits, ends = slab_decisions(box, MODEL_BASES)
    table = slab_coder.state_table()
    outcomes = []
    for functions in (slab_decoder, kernels):
        for compiled in (True, False):
            decisions = slab_decisions if functions is slab_decoder else kernels.slab_decisions
            code = slab_coder.code_bits if functions is slab_decoder else kernels.code_bits
            decode = functions.decode_slab
            if functions is kernels and not compiled:
                decisions, code, decode = (f.py_func for f in (decisions, code, decode))
            for mine, theirs in zip((models, bits, ends), decisions(box, MODEL_BASES), strict=True):
                assert np.array_equal(mine, theirs)
            state, out = slab_coder.initial_state(), np.zeros(1 << 14, dtype=np.int64)
            assert code(state, models, bits, out, table, len(out) - 8)
            data = slab_coder.finish(state, out)
            assert not code(slab_coder.initial_state(), models, bits, out, table, len(data) // 2)
            stream = np.frombuffer(data + bytes(3), dtype=np.uint8)
            decoder = Decoder(decode, stream, box[:4])
            for slab in range(10):
                assert decoder.next_slab()
                assert np.array_equal(decoder.lit, box[4 * slab + 4 : 4 * slab + 8])
            for count in (3, 5, len(data) // 2):
                decoder = Decoder(decode, stream[:count], box[:4])
                assert not all(decoder.next_slab() for _ in range(10))
            outcomes.append(data)
    assert len(set(outcomes)) == 1


def test_kernels_are_used_where_they_are_enabled():
    grid = Grid(64, 64, 64)
    index = np.flatnonzero(shell(64, 28))
    found = []
    for use in (False, True):
        kernel_backend.set_enabled(use)
        payloads = slabs.encode_slabs(index, 1, EncoderConfig(grid, PixelFormat.MONO1, 1024))
        assert np.array_equal(decode_ops(payloads, grid, PixelFormat.MONO1).index, index)
        found.append(payloads)
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("ops", "why"),
    [
        ("59", "ends inside"),
        ("59 91 11 18 00 01", "ends inside"),
        ("59 BF 91 0A 00 00 FB 65 61 56 A0 00", "behind the last bit"),
        ("59 BF 91 06 00 0E 00 00", "leaves the grid"),
    ],
)
def test_what_is_no_slabs_is_refused(ops, why):
    with pytest.raises(RemoteProtocolError, match=why):
        decode_ops([bytes.fromhex(ops)], Grid(17, 64, 40), PixelFormat.MONO1)


def test_more_cells_than_the_grid_has_are_refused():
    with pytest.raises(RemoteProtocolError, match="more cells"):
        decode_ops([bytes.fromhex("59 80 02 19 80")], Grid(3, 5, 7), PixelFormat.INDEX8)


def test_a_slab_that_fits_no_payload_is_divided():
    """Noise of 64 x 64 voxels takes more than 64 bytes a slab."""
    rng = np.random.default_rng(1)
    grid = Grid(64, 64, 4)
    index = np.flatnonzero(rng.random(grid.voxels) < 0.5)
    payloads = slabs.encode_slabs(index, 1, EncoderConfig(grid, PixelFormat.MONO1, 64))
    assert len(payloads) > 30
    assert np.array_equal(decode_ops(payloads, grid, PixelFormat.MONO1).index, index)


# -- selection


def drawn(frame, features, rate=0.0, most=1024):
    """Return the payloads of a frame, after the emulator has drawn them right."""
    payloads = [p for some in frame.iter_payloads(most, features, rate) for p in some]
    page = page_after(payloads, frame.grid, frame.format)
    meant = frame.format.values(frame.array()).reshape(-1)
    assert np.array_equal(values_of(page, frame.format), meant)
    return payloads


def size(payloads):
    return sum(map(len, payloads))


def test_a_shell_takes_about_a_bit_a_voxel():
    frame = Frame((64, 64, 64), "mono1")
    frame.set(shell(64, 28))
    short, long = drawn(frame, (*SETS, "slabs")), drawn(frame, SETS)
    assert all(payload[0] == spec.OP_SLABS for payload in short)
    assert 8 * size(short) < 1.1 * len(frame.lit()[0]) < 8 * size(long) / 3


def test_a_body_and_a_curve_are_coded_each_its_own_way():
    frame = Frame((64, 64, 64), "rgb565")
    frame.draw(vd.Sphere((32, 32, 32), 20), "red")
    frame.draw(vd.Segment((1, 1, 1), (60, 3, 2)), "lime")
    payloads = drawn(frame, (*SETS, "slabs", "arc"))
    assert any(spec.OP_SLABS in payload[:4] for payload in payloads)
    assert size(payloads) < size(drawn(frame, (*SETS, "arc")))


def test_each_colour_has_slabs_of_its_own_if_that_is_shorter():
    frame = Frame((48, 48, 48), "index8")
    page = shell(48, 20)
    page[24:] *= 77
    page[3, 4, 5], page[40, 41, 42] = 5, 6
    frame.set(page)
    for features in (("slabs",), (*SETS, "slabs")):
        payloads = drawn(frame, features)
        assert sum(spec.OP_SLABS in payload[:3] for payload in payloads) == 2, "not of lone voxels"
        assert size(payloads) < size(drawn(frame, features[:-1]))


def test_what_is_shorter_otherwise_has_no_slabs():
    rng = np.random.default_rng(2)
    noise = Frame((32, 32, 32), "rgb888")
    noise.set(rng.integers(1, 256, (32, 32, 32, 3), dtype=np.uint8))
    box = Frame((32, 32, 32), "mono1")
    page = np.zeros((32, 32, 32), dtype=np.uint8)
    page[3:9, 3:30, 5:20] = 1
    box.set(page)
    blank = Frame((32, 32, 32), "mono1")
    for frame in (noise, box, blank):
        assert drawn(frame, (*SETS, "slabs")) == drawn(frame, SETS)


def test_a_fast_line_has_no_range_coding():
    names = ("line", "arc", "slabs")
    assert select_features(names, 11_520) == names
    assert select_features(names, 100_000) == ("line",)


def test_too_many_colours_are_not_tried(monkeypatch):
    frame = Frame((32, 32, 32), "index8")
    frame.set(shell(32, 14, 2.0) * (1 + np.arange(32, dtype=np.uint8)[:, None, None] // 4))
    tried = []
    monkeypatch.setattr(encoding_selection, "_MANY_PENS", 3)
    encode = slabs.encode_slabs
    monkeypatch.setattr(
        slabs,
        "encode_slabs",
        lambda index, pen, config: tried.append(pen) or encode(index, pen, config),
    )
    drawn(frame, (*SETS, "slabs"))
    assert len(tried) == 3


def test_what_is_nearly_dark_is_not_tried(monkeypatch):
    def encode(*_given):
        raise AssertionError

    monkeypatch.setattr(slabs, "encode_slabs", encode)
    frame = Frame((256, 256, 256), "mono1")
    frame.draw(np.random.default_rng(3).integers(0, 256, (2000, 3)), "white")
    assert drawn(frame, (*SETS, "slabs")) == drawn(frame, SETS)


@pytest.mark.parametrize(("side", "sparse"), [(16, False), (64, False), (170, True)])
def test_dark_cells_are_counted_around_what_is_lit(side, sparse):
    config = EncoderConfig(Grid(512, 256, 512), PixelFormat.MONO1, 1024, 0)
    voxels = 300 + np.random.default_rng(4).integers(0, side, (400, 3)) - [0, 200, 0]
    index = np.unique(config.grid.index_of(voxels))
    assert slabs.are_too_sparse(index, config) == sparse
