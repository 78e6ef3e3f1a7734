"""Range-coded pixel values: drawn by the emulator, read by the driver, and selected."""

import document
import numpy as np
import pytest
from drawing import page_after, values_of

from voxdisplay.compute import kernel_backend
from voxdisplay.errors import RemoteProtocolError
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import (
    kernels,
    slab_coder,
    slab_value_decoder,
    slab_values,
    slabs,
    spec,
    value_kernels,
)
from voxdisplay.wire.encoding_selection import encode_update
from voxdisplay.wire.features import select_features
from voxdisplay.wire.op_decoder import decode_ops
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.page_update import PageUpdate
from voxdisplay.wire.slab_values import LITERALS, ValueMode
from voxdisplay.wire.slabs import encode_values, encode_values_best
from voxdisplay.wire.value_weights import fitted_weights

GRIDS = [Grid(3, 5, 7), Grid(9, 6, 6), Grid(37, 4, 5)]
MODES = [
    ValueMode(),
    ValueMode(copies=True),
    ValueMode(weights=(58, 58, 58, -53, -52, -53, 47)),
    ValueMode(copies=True, weights=(-64, 63, 1, 2, 3, 4, 5)),
]
COLORED = [each for each in PixelFormat if each is not PixelFormat.MONO1]
SETS = ("box", "oct", "dots")


@pytest.fixture(autouse=True)
def _without_kernels():
    """Use none but where a test asks for them, whatever has been drawn before."""
    before = kernel_backend.set_enabled(False)
    yield
    kernel_backend.set_enabled(before)


def picture(rng, grid, format_, kind):
    """Return indices and pixel values of some voxels."""
    share = {"noise": 0.9, "gradient": 0.4, "steps": 0.2}[kind]
    index = np.flatnonzero(rng.random(grid.voxels) < share)
    top = slab_values.levels(format_)
    if kind == "noise":
        channels = rng.integers(0, top + 1, (len(index), len(top)))
    else:
        place = grid.voxels_at(index).sum(axis=1)[:, None]
        slope = 2.3 if kind == "gradient" else 0.2
        channels = (place * slope).astype(int) * np.arange(1, len(top) + 1) % (top + 1)
        channels += rng.integers(-1, 2, channels.shape) * (kind == "gradient")
    channels = np.clip(channels, 0, top)
    channels[:, 0] += ~channels.any(axis=1)
    return index, slab_values.join_channels(channels, format_)


@pytest.mark.parametrize("format_", COLORED)
@pytest.mark.parametrize("mode", MODES, ids=["plain", "copies", "weighted", "both"])
@pytest.mark.parametrize("kind", ["noise", "gradient", "steps"])
def test_the_emulator_draws_and_the_driver_reads_what_was_meant(format_, mode, kind):
    rng = np.random.default_rng(5)
    for grid, most in zip(GRIDS, (64, 1024, 400), strict=True):
        index, values = picture(rng, grid, format_, kind)
        payloads = encode_values(index, values, mode, 8, EncoderConfig(grid, format_, most))
        assert all(0 < len(payload) <= most for payload in payloads)
        meant = np.zeros(grid.voxels, dtype=np.uint32)
        meant[index] = values
        assert np.array_equal(values_of(page_after(payloads, grid, format_), format_), meant)
        read = decode_ops(payloads, grid, format_)
        assert np.array_equal(read.index, index)
        assert np.array_equal(read.values, values)


def coded(format_, mode, kind, kernel):
    """Return decisions, stream and levels of a box of three slabs above one that is known."""
    rng = np.random.default_rng(3)
    grid = Grid(12, 8, 16)
    index, values = picture(rng, grid, format_, kind)
    shape = grid.nz, grid.ny, grid.nx
    lit = np.zeros(grid.voxels, dtype=np.bool_)
    lit[index] = True
    pixels = np.zeros((grid.voxels, len(slab_values.levels(format_))), dtype=np.int16)
    pixels[index] = slab_values.split_channels(values, format_)
    box = pixels.reshape(*shape, -1), lit.reshape(shape)
    begin = slab_values.initial_carry(format_)
    settings = mode.switches, slab_values.levels(format_), LITERALS
    models, bits, ends, carry = kernel(*box, begin, *settings)
    state, out = slab_coder.initial_state(), np.zeros(1 << 15, dtype=np.int64)
    assert slab_coder.code_bits(state, models, bits, out, slab_coder.state_table(), 1 << 14)
    return (models, bits, ends, carry), slab_coder.finish(state, out), box, settings


def decoded(data, box, settings, format_, kernel):
    """Yield the outcome and the levels of the slabs of `coded`."""
    pixels, lit = box
    state = slab_coder.initial_state()
    state[-3:] = int.from_bytes(data[:3], "big"), 1 << 24, 3
    stream = np.frombuffer(data, dtype=np.uint8)
    carry = slab_values.initial_carry(format_)
    known = np.zeros((5, *pixels.shape[1:]), dtype=np.int16)
    known[4] = pixels[3]
    switches, top, literals = settings
    for slab in range(1, 4):
        known[0], known[1:] = known[4], 0
        part = lit[4 * slab - 1 : 4 * slab + 4]
        table = slab_coder.state_table()
        yield kernel(state, stream, known, part, carry, switches, top, table, literals), known[1:]


@pytest.mark.parametrize("kind", ["noise", "gradient", "steps"])
@pytest.mark.parametrize("mode", MODES, ids=["plain", "copies", "weighted", "both"])
def test_kernels_do_what_numpy_does(mode, kind, monkeypatch):
    """Also uncompiled, so that each of their lines is seen to run."""
    for helper in ("predicted", "copy_context", "value_class", "next_bit", "decode_residual"):
        monkeypatch.setattr(value_kernels, helper, getattr(value_kernels, helper).py_func)
    for format_ in (PixelFormat.INDEX8, PixelFormat.RGB565):
        found, data, box, settings = coded(format_, mode, kind, slab_values.value_decisions)
        again, same, *_ = coded(format_, mode, kind, kernels.value_decisions.py_func)
        for mine, theirs in zip(found, again, strict=True):
            assert np.array_equal(mine, theirs)
        assert data == same
        for decode in (slab_value_decoder.decode_values, kernels.decode_values.py_func):
            parts = decoded(data + bytes(3), box, settings, format_, decode)
            for slab, (outcome, levels) in enumerate(parts, 1):
                assert outcome == 0
                assert np.array_equal(levels, box[0][4 * slab : 4 * slab + 4])
            cut = decoded(data[: len(data) // 2], box, settings, format_, decode)
            assert 1 in [outcome for outcome, _ in cut]


def test_compiled_kernels_are_used_where_they_are_enabled():
    rng = np.random.default_rng(1)
    grid = Grid(40, 20, 12)
    index, values = picture(rng, grid, PixelFormat.RGB888, "gradient")
    config = EncoderConfig(grid, PixelFormat.RGB888, 500)
    found = []
    for use in (False, True):
        kernel_backend.set_enabled(use)
        payloads = encode_values(index, values, MODES[3], 8, config)
        read = decode_ops(payloads, grid, PixelFormat.RGB888)
        assert np.array_equal(read.values, values)
        found.append(payloads)
    assert found[0] == found[1]


REFUSED = [
    ("5B", "index8", "ends inside"),
    ("5B 00 00", "index8", "behind the last bit"),
    ("5B 00", "mono1", "no op of mono1"),
]


@pytest.mark.parametrize("use", [False, True])
@pytest.mark.parametrize(("ops", "format_", "why"), REFUSED)
def test_what_is_no_values_is_refused(ops, format_, why, use):
    kernel_backend.set_enabled(use)
    with pytest.raises(RemoteProtocolError, match=why):
        decode_ops([bytes.fromhex(ops)], Grid(3, 5, 7), PixelFormat(format_))


def test_kernels_refuse_a_dark_pixel(monkeypatch):
    for helper in ("predicted", "copy_context", "value_class", "next_bit", "decode_residual"):
        monkeypatch.setattr(value_kernels, helper, getattr(value_kernels, helper).py_func)
    monkeypatch.setattr(slab_value_decoder, "decode_values", kernels.decode_values.py_func)
    (vector,) = (v for v in document.vectors("refused") if v.name == "values-black-pixel")
    with pytest.raises(RemoteProtocolError, match="no lit pixel"):
        decode_ops([vector.hex("ops")], Grid(*vector.grid), PixelFormat.RGB888)


def test_a_box_goes_through_what_is_dark():
    """More slabs in a row than are coded at once have no voxel."""
    grid = Grid(3, 3, 200)
    index = np.concatenate((np.arange(20), np.arange(grid.voxels - 20, grid.voxels)))
    values = 1 + index % 7
    config = EncoderConfig(grid, PixelFormat.INDEX8, 1024)
    (payload,) = encode_values(index, values, ValueMode(), 8, config)
    read = decode_ops([payload], grid, PixelFormat.INDEX8)
    assert np.array_equal(read.index, index)
    assert np.array_equal(read.values, values)


@pytest.mark.parametrize("use", [False, True])
@pytest.mark.parametrize("format_", COLORED)
def test_streams_that_are_changed_are_read_or_refused(format_, use):
    """Cut, or with a byte changed: never anything but RemoteProtocolError."""
    kernel_backend.set_enabled(use)
    rng = np.random.default_rng(9)
    grid = Grid(17, 12, 6)
    outcomes = set()
    for mode in MODES:
        index, values = picture(rng, grid, format_, "gradient")
        (data, *_) = encode_values(index, values, mode, 8, EncoderConfig(grid, format_, 300))
        for at in rng.integers(1, len(data), 12).tolist():
            changed = bytearray(data)
            changed[at] ^= int(rng.integers(1, 256))
            for hostile in (changed, data[:at]):
                try:
                    assert decode_ops([bytes(hostile)], grid, format_).values.all()
                    outcomes.add("drawn")
                except RemoteProtocolError as error:
                    outcomes.add(str(error).split(": ")[1].split(",")[0])
    assert "a value is no lit pixel" in " ".join(outcomes)
    assert "the payload ends inside" in " ".join(outcomes)


def test_one_cell_that_fits_no_payload_is_divided():
    rng = np.random.default_rng(2)
    grid = Grid(4, 4, 4)
    index, values = picture(rng, grid, PixelFormat.RGB888, "noise")
    config = EncoderConfig(grid, PixelFormat.RGB888, 64)
    payloads = encode_values(index, values, ValueMode(), 8, config)
    assert len(payloads) > 2
    read = decode_ops(payloads, grid, PixelFormat.RGB888)
    assert np.array_equal(read.values, values)


# -- the choice of modes, and of the op


def chosen(values, monkeypatch, most=np.inf):
    """Return the mode that is chosen for a volume, [z, y, x] of index8."""
    config = EncoderConfig(Grid(*values.shape[::-1]), PixelFormat.INDEX8, 1024)
    index = np.flatnonzero(values)
    tried = []
    encode = slabs.encode_values
    monkeypatch.setattr(
        slabs, "encode_values", lambda *args: tried.append(args[2]) or encode(*args)
    )
    payloads = encode_values_best(index, values.reshape(-1)[index], most, config)
    assert bool(payloads) == (most == np.inf)
    return tried[-1] if payloads else None


def test_each_kind_of_volume_has_its_mode(monkeypatch):
    rng = np.random.default_rng(4)
    z, y, x = np.mgrid[:16, :16, :16]
    smooth = 120 + 50 * np.sin(x / 4) * np.cos(y / 5) + 30 * np.sin(z / 3 + x / 7)
    noisy = 100 + rng.normal(0, 2, smooth.shape)
    steps = 1 + (x + y + z) // 6
    modes = [chosen(each.astype(np.uint8), monkeypatch) for each in (steps, noisy, smooth)]
    assert modes[0] == ValueMode(copies=True)
    assert modes[1] == ValueMode()
    assert modes[2].weights is not None
    assert chosen(noisy.astype(np.uint8), monkeypatch, most=100) is None


def test_large_volumes_are_sampled():
    config = EncoderConfig(Grid(64, 64, 64), PixelFormat.INDEX8, 1024)
    rows = slabs._sample(np.arange(64**3), config)
    assert len(rows) == 5 * 16**3
    assert set(rows // 64**2 // 16) == {0, 1, 2, 3}


def test_weights_follow_a_linear_field():
    grid = Grid(9, 8, 7)
    index = np.arange(grid.voxels)
    x, y, z = grid.voxels_at(index).T.astype(int)
    config = EncoderConfig(grid, PixelFormat.INDEX8, 1024)
    weights = fitted_weights(index, 10 + 3 * x + 5 * y + 7 * z, config)
    assert abs(sum(weights) - 64) <= 3
    assert fitted_weights(index[:9], index[:9] + 1, config) is None


def drawn(frame, features):
    """Return the payloads of a frame, after the emulator has drawn them right."""
    payloads = [p for some in frame.iter_payloads(1024, features, 0.0) for p in some]
    page = page_after(payloads, frame.grid, frame.format)
    meant = frame.format.values(frame.array()).reshape(-1)
    assert np.array_equal(values_of(page, frame.format), meant)
    return payloads


def colored_shell(format_, *, plain=False):
    """Return a frame with a shell coloured by height, and another of one colour."""
    side = 40
    frame = Frame((side, side, side), format_)
    z, y, x = np.mgrid[:side, :side, :side] + 0.5 - side / 2
    shell = np.abs(np.sqrt(x * x + y * y + z * z) - 16) < 0.5
    shade = np.clip(128 + 5 * z, 1, 255).astype(np.uint8) * shell
    if plain:
        shade[np.abs(np.sqrt(x * x + y * y + z * z) - 8) < 0.5] = 7
    wide = np.stack((shade, shade // 2, shade), axis=-1)
    pixels = {"index8": shade, "rgb565": shade.astype(np.uint16) * 257, "rgb888": wide}
    frame.set(pixels[format_])
    return frame


@pytest.mark.parametrize("format_", ["index8", "rgb565", "rgb888"])
def test_a_coloured_shell_is_coded_by_values(format_):
    frame = colored_shell(format_)
    payloads = drawn(frame, (*SETS, "slabs", "values"))
    assert all(payload[0] == spec.OP_VALUES for payload in payloads)
    assert 8 * sum(map(len, payloads)) < 3 * len(frame.lit()[0])
    assert all(spec.OP_VALUES not in payload[:1] for payload in drawn(frame, (*SETS, "slabs")))


def test_slabs_and_values_share_a_picture():
    frame = colored_shell("index8", plain=True)
    payloads = drawn(frame, (*SETS, "slabs", "values"))
    for fewer in (("slabs",), ("values",)):
        assert sum(map(len, payloads)) <= sum(map(len, drawn(frame, (*SETS, *fewer))))


def test_noise_and_one_colour_have_no_values():
    noise = Frame((16, 16, 16), "index8")
    noise.set(np.random.default_rng(1).integers(1, 256, (16, 16, 16), dtype=np.uint8))
    box = Frame((16, 16, 16), "index8")
    page = np.zeros((16, 16, 16), dtype=np.uint8)
    page[2:9, 3:8, 4:15] = 9
    box.set(page)
    for frame in (noise, box):
        assert drawn(frame, (*SETS, "slabs", "values")) == drawn(frame, (*SETS, "slabs"))


def test_voxels_that_become_dark_are_coded_otherwise():
    config = EncoderConfig(Grid(40, 40, 40), PixelFormat.INDEX8, 1024, 1 << spec.FEATURE_VALUES)
    pixels = colored_shell("index8").array().reshape(-1).copy()
    index = np.flatnonzero(pixels)
    pixels[index[::50]] = 0
    update = PageUpdate(None, index, lambda where: pixels[where].astype(np.uint32))
    payloads = [p for some in encode_update(update, config) for p in some]
    assert sum(payload[0] == spec.OP_VALUES for payload in payloads) > 0
    read = decode_ops(payloads, config.grid, PixelFormat.INDEX8)
    assert np.array_equal(read.index, index)
    assert np.array_equal(read.values, pixels[index])


def test_what_is_nearly_dark_has_no_values(monkeypatch):
    def encode(*_given):
        raise AssertionError

    monkeypatch.setattr(slabs, "encode_values_best", encode)
    rng = np.random.default_rng(3)
    frame = Frame((256, 256, 256), "index8")
    frame.draw(rng.integers(0, 256, (2000, 3)), rng.integers(0, 256, (2000, 3)).astype(np.uint8))
    assert drawn(frame, (*SETS, "values")) == drawn(frame, SETS)


def test_a_fast_line_has_no_values():
    assert select_features(("line", "values"), 100_000) == ("line",)
