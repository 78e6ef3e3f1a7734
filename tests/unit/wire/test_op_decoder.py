"""The driver's decoder of ops, against the document's vectors and a voxelwise decoder."""

from __future__ import annotations

import random

import document
import numpy as np
import pytest
from random_ops import VoxelwiseDecoder, random_ops

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire.op_decoder import decode_ops

GRIDS = [(3, 5, 7), (16, 16, 16), (21, 9, 13), (300, 4, 3)]


def lit(decoded):
    kept = decoded.values != 0
    return dict(zip(decoded.index[kept].tolist(), decoded.values[kept].tolist(), strict=True))


@pytest.mark.parametrize("name", ["mono1", "index8", "rgb565", "rgb888"])
@pytest.mark.parametrize("sides", GRIDS)
def test_random_ops_draw_what_a_voxelwise_decoder_draws(name, sides):
    rng = random.Random(f"{name} {sides}")
    for _ in range(30):
        plain = VoxelwiseDecoder(sides, name)
        ops = random_ops(rng, plain, name)
        decoded = decode_ops([ops], Grid(*sides), PixelFormat(name))
        assert lit(decoded) == {index: value for index, value in plain.voxels.items() if value}
        for entry, color in decoded.colors.items():
            assert tuple(plain.palette[3 * entry : 3 * entry + 3]) == color


@pytest.mark.parametrize("vector", document.vectors("ops"), ids=str)
def test_vectors(vector):
    format_ = PixelFormat(vector["format"].lower())
    nx, ny, _ = vector.grid
    decoded = decode_ops([vector.hex("ops")], Grid(*vector.grid), format_)
    assert lit(decoded) == {
        x + nx * (y + ny * z): int.from_bytes(pixel, "little")
        for (x, y, z), pixel in vector.voxels().items()
        if any(pixel)
    }


@pytest.mark.parametrize(
    "vector",
    # What a format or a device lacks is checked where features are.
    [v for v in document.vectors("refused") if v["code"] != "OP" or v.name == "reserved-op"],
    ids=str,
)
def test_refused_vectors(vector):
    format_ = PixelFormat(vector["format"].lower())
    with pytest.raises(RemoteProtocolError, match="ops:"):
        decode_ops([vector.hex("ops")], Grid(*vector.grid), format_)


def test_later_packets_and_ops_count():
    grid, format_ = Grid(3, 5, 7), PixelFormat.RGB888
    red, blue = b"\x01\xff\x00\x00", b"\x01\x00\x00\xff"
    dot = b"\x05\x00\x01\x02\x03"
    index = 1 + 3 * (2 + 5 * 3)
    assert lit(decode_ops([red + dot + blue + dot], grid, format_)) == {index: 0xFF0000}
    assert lit(decode_ops([blue + dot, red + dot], grid, format_)) == {index: 0xFF}


def test_what_a_frame_is_encoded_to_is_decoded():
    rng = np.random.default_rng(5)
    for name in ("mono1", "index8", "rgb565", "rgb888"):
        frame = Frame((40, 33, 37), name)
        frame.draw(rng.integers(0, (40, 33, 37), (300, 3)), color=rng.integers(0, 256, (300, 3)))
        for features in ((), ("line", "box", "dots", "oct"), ("arc",)):
            decoded = decode_ops(frame.payloads(200, features), frame.grid, frame.format)
            index, values = frame.lit()
            assert lit(decoded) == dict(zip(index.tolist(), values.tolist(), strict=True))


def test_ops_that_write_again_and_again_are_refused():
    full_page = b"\x02" + bytes(3) + b"\xbf\xe0\xff\x0f"  # MOVE 0, RUN of 262 144 voxels
    grid = Grid(64, 64, 64)
    assert len(decode_ops([full_page * 4], grid, PixelFormat.MONO1).index) == grid.voxels
    with pytest.raises(RemoteProtocolError, match="again and again"):
        decode_ops([full_page * 5], grid, PixelFormat.MONO1)


def test_hostile_bytes_are_refused_or_drawn_on_the_grid():
    rng = random.Random(3)
    grid = Grid(3, 5, 7)
    for _ in range(3000):
        payload = rng.randbytes(rng.randrange(1, 40))
        try:
            decoded = decode_ops([payload], grid, PixelFormat.INDEX8)
        except RemoteProtocolError:
            continue
        assert ((decoded.index >= 0) & (decoded.index < grid.voxels)).all()


def test_differences_are_of_index8_alone():
    with pytest.raises(RemoteProtocolError, match="DIFF is an op of index8"):
        decode_ops([b"\xe0\x01"], Grid(3, 5, 7), PixelFormat.RGB565)
