"""All vectors of protocol.md, on the driver and on the emulator."""

from itertools import chain

import document
import numpy as np
import pytest
from drawing import decode_plainly
from vector_device import (
    VectorDevice,
    features_of,
    flags_of,
    hold_dialogue,
    hold_ops,
    hold_refused,
)

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import DEFAULT
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.chains import encode_chains
from voxdisplay.wire.digest import digest, palette_digest
from voxdisplay.wire.encoding_selection import encode_update
from voxdisplay.wire.op_decoder import decode_ops
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.packet_stream import PacketStream
from voxdisplay.wire.page_update import PageUpdate
from voxdisplay.wire.palette_ops import color_blocks
from voxdisplay.wire.payload_splitting import PayloadLayout
from voxdisplay.wire.range_coded_chains import encode_range_coded
from voxdisplay.wire.slab_values import ValueMode
from voxdisplay.wire.slabs import encode_slabs, encode_values
from voxdisplay.wire.spans import decode_spans, encode_spans


def each(kind):
    return pytest.mark.parametrize("vector", document.vectors(kind), ids=str)


@each("cobs")
def test_delimiting(vector):
    decoded, encoded = vector.hex("decoded"), vector.hex("encoded")
    assert document.cobs_encode(decoded) == encoded
    assert document.cobs_decode(encoded) == decoded
    assert packets.cobs.encode(decoded) == encoded
    assert packets.cobs.decode(encoded) == decoded
    assert VectorDevice.cobs_encode(decoded) == encoded
    assert VectorDevice.cobs_decode(encoded) == decoded


@each("crc")
def test_check_value(vector):
    data, crc = vector.hex("bytes"), vector.hex("crc")
    assert packets.zlib.crc32(data).to_bytes(4, "little") == crc
    assert VectorDevice.crc(data).to_bytes(4, "little") == crc


PACKET_CLASSES = {cls.__name__.upper(): cls for cls in packets.TYPES.values()}


def fields_of(vector):
    """The fields of a ``packet`` vector, as the driver's dataclass takes them."""
    group = {"READ": "READ_FLAG", "PAGE": "READ_FLAG"}.get(vector["type"], f"{vector['type']}_FLAG")
    values = {}
    for key, text in vector.lines:
        if key in {"type", "packet", "wire"}:
            continue
        if vector["type"] == "HELLO" and key in {"major", "minor"}:
            continue  # what the driver says unasked
        if key == "flags":
            values[key] = flags_of(text, group)
        elif key == "features":
            values[key] = sum(1 << getattr(spec, f"FEATURE_{name}") for name in text.split("|"))
        elif key == "format":
            values[key] = getattr(spec, f"FORMAT_{text}")
        elif key == "code":
            values[key] = getattr(spec, f"CODE_{text}")
        elif key == "ops":
            values[key] = document.hex_bytes(text)
        elif text.startswith('"'):
            values[key] = text.strip('"')
        else:
            values[key] = int(text)
    return values


@each("packet")
def test_packets_of_the_driver(vector):
    packet = PACKET_CLASSES[vector["type"]](**fields_of(vector))
    assert packets.pack(packet) == vector.hex("packet")
    assert packets.encode(packet) == vector.hex("wire")
    assert packets.decode(vector.hex("packet")) == packet


@each("packet")
@pytest.mark.parametrize("size", [1, 7, 1000])
def test_packets_in_the_drivers_stream(vector, size):
    data = b"boot text\0" + vector.hex("wire") + b"tail"
    stream = PacketStream()
    found = []
    for at in range(0, len(data), size):
        found += stream.feed(data[at : at + size])
    assert found == [packets.decode(vector.hex("packet"))]


@each("packet")
def test_packets_of_the_device(vector):
    assert document.on_wire(vector.hex("packet")[:-4]) == vector.hex("wire")
    assert VectorDevice.segments(vector.hex("wire")) == [vector.hex("packet")[:-4]]
    assert VectorDevice.wire(vector.hex("packet")[:-4]) == vector.hex("wire")


@each("ops")
def test_ops_on_the_device(vector):
    hold_ops(vector)


@each("ops")
def test_digest_of_the_driver(vector):
    nx, ny, _ = vector.grid
    voxels = vector.voxels()
    index = [x + nx * (y + ny * z) for x, y, z in voxels]
    values = [int.from_bytes(pixel, "little") for pixel in voxels.values()]
    found = digest(np.array(index, dtype=int), np.array(values, dtype=int))
    colors = {}
    if "COLORS" in vector.name.upper():
        colors = decode_plainly(
            [vector.hex("ops")], vector.grid, PixelFormat[vector["format"]]
        ).palette
    own = [entry for entry, color in colors.items() if color != tuple(DEFAULT[entry].tolist())]
    count = vector.grid[0] * vector.grid[1] * vector.grid[2]
    found += palette_digest(count, np.array(own, dtype=int), np.array([colors[i] for i in own]))
    assert found & 0xFFFFFFFF == vector.integer("digest")


# What a plain reading knows, and what the driver codes: all that is not range-coded.
not_range_coded = pytest.mark.parametrize(
    "vector",
    [
        v
        for v in document.vectors("ops")
        if not v.name.startswith(("arc-", "arc2-", "slabs-", "values-"))
    ],
    ids=str,
)


@each("ops")
def test_ops_as_the_driver_reads_them(vector):
    grid, format_ = Grid(*vector.grid), PixelFormat[vector["format"]]
    drawn = decode_ops([vector.hex("ops")], grid, format_)
    lit = drawn.values != 0
    places = map(tuple, grid.voxels_at(drawn.index[lit]).tolist())
    pixels = (int(value).to_bytes(format_.bytes, "little") for value in drawn.values[lit])
    assert dict(zip(places, pixels, strict=True)) == vector.voxels()


@not_range_coded
def test_ops_by_a_plain_reading(vector):
    format_ = PixelFormat[vector["format"]]
    page = decode_plainly([vector.hex("ops")], vector.grid, format_).page
    nx, ny, _ = vector.grid
    lit = {
        (index % nx, index // nx % ny, index // nx // ny): value.to_bytes(format_.bytes, "little")
        for index, value in enumerate(page)
        if value
    }
    assert lit == vector.voxels()


@each("refused")
def test_refused_ops(vector):
    hold_refused(vector)


@each("dialogue")
def test_dialogues_with_the_device(vector):
    hold_dialogue(vector)


@each("ops")
def test_coders_of_the_driver(vector):
    """What is on display after the vector, the driver's own ops draw, and its reader reads."""
    nx, ny, nz = vector.grid
    pixel_format = PixelFormat(vector["format"].lower())
    voxels = vector.voxels()
    places = np.array(list(voxels), dtype=int).reshape(-1, 3)
    index = places @ [1, nx, nx * ny]
    values = np.zeros(nx * ny * nz, dtype=np.uint32)
    values[index] = [int.from_bytes(pixel, "little") for pixel in voxels.values()]
    config = EncoderConfig(Grid(*vector.grid), pixel_format, 1024)
    for payloads in (encode_spans(values, config), encode_chains(places, values[index], config)):
        device = VectorDevice(vector.grid, vector["format"])
        device.open_session()
        device.send(bytes((0x15, 0, 0)) + b"".join(payloads))
        assert device.lit_voxels() == voxels
        (page,) = device.send(
            bytes.fromhex("50 05 00 00 00 00 00 00") + len(values).to_bytes(4, "little")
        )
        count = int.from_bytes(page[8:12], "little")
        assert decode_spans(page[12:], count, pixel_format).tolist() == values[:count].tolist()


@not_range_coded
def test_coders_of_the_driver_by_a_plain_reading(vector):
    """The same with all features of the format."""
    format_ = PixelFormat[vector["format"]]
    meant = decode_plainly([vector.hex("ops")], vector.grid, format_)
    pixels = np.array(meant.page)
    content = PageUpdate(None, np.flatnonzero(pixels), lambda index: pixels[index])
    features = features_of(vector) - {"palette", "read", "digest", "arc", "arc2", "slabs", "values"}
    bits = sum(1 << getattr(spec, f"FEATURE_{name.upper()}") for name in features)
    config = EncoderConfig(Grid(*vector.grid), format_, 64, bits)
    drawn = decode_plainly(
        chain.from_iterable(encode_update(content, config)), vector.grid, format_
    )
    assert drawn.page == meant.page
    assert not drawn.two_pixels
    assert {name.lower() for name in drawn.ops} & ALL_FEATURES <= features
    palette = DEFAULT.copy()
    for entry, color in meant.palette.items():
        palette[entry] = color
    entries = np.array(sorted(meant.palette), dtype=int)
    payloads = PayloadLayout(color_blocks(entries, palette, config), config).payloads
    again = decode_plainly(payloads, vector.grid, format_)
    assert again.palette.items() >= meant.palette.items()


ALL_FEATURES = {"line", "box", "dots", "oct", "diff", "colors"}


@each("dialogue")
def test_dialogues_as_the_driver_reads_them(vector):
    facts = dict(vector.lines)
    for key, text in vector.lines:
        if key == "device" and not text.endswith("*"):
            body = document.hex_bytes(text)
            packet = packets.decode(body + bytes(4))
            assert packets.pack(packet)[:-4] == body
            if isinstance(packet, packets.Info):
                assert (packet.nx, packet.ny, packet.nz) == vector.grid
                assert PixelFormat.from_wire(packet.format) is PixelFormat[facts["format"]]
                for name in ("boot", "max_payload", "rx_buffer", "refresh"):
                    assert getattr(packet, name) == int(facts[name])


@pytest.mark.parametrize(
    "vector",
    [v for v in document.vectors("ops") if v.name.startswith("arc-") and v.voxels()],
    ids=str,
)
def test_arcs_of_the_driver(vector):
    """These vectors give the voxels in the order of the curve: there is one way to code them."""
    voxels = np.array(list(vector.voxels()))
    pens = np.array([int.from_bytes(pixel, "little") for pixel in vector.voxels().values()])
    pixel_format = PixelFormat(vector["format"].lower())
    config = EncoderConfig(Grid(*vector.grid), pixel_format, 1024, 1 << spec.FEATURE_ARC)
    assert encode_range_coded(voxels, pens, config) == [vector.hex("ops")]


@pytest.mark.parametrize("name", ["slabs-one-box", "slabs-wide-grid", "slabs-shell"])
def test_slabs_of_the_driver(name):
    """These vectors have the boxes that the document recommends."""
    (vector,) = [v for v in document.vectors("ops") if v.name == name]
    pixel_format = PixelFormat[vector["format"]]
    config = EncoderConfig(Grid(*vector.grid), pixel_format, 1024, 1 << spec.FEATURE_SLABS)
    voxels = np.array(list(vector.voxels()))
    (pen,) = set(vector.voxels().values())
    index = np.sort(config.grid.index_of(voxels))
    assert encode_slabs(index, int.from_bytes(pen, "little"), config) == [vector.hex("ops")]


VALUE_MODES = {
    "values-noise": ValueMode(),
    "values-noise-rgb888": ValueMode(copies=True),
    "values-copies": ValueMode(copies=True),
    "values-weighted": ValueMode(weights=(58, 58, 58, -53, -52, -53, 47)),
    "values-both": ValueMode(copies=True, weights=(-64, 63, 1, 2, 30, 4, -5)),
}


@pytest.mark.parametrize("name", VALUE_MODES)
def test_values_of_the_driver(name):
    """These vectors have the boxes that the document recommends for surfaces."""
    (vector,) = [v for v in document.vectors("ops") if v.name == name]
    config = EncoderConfig(Grid(*vector.grid), PixelFormat[vector["format"]], 1024)
    index = config.grid.index_of(np.array(list(vector.voxels())))
    values = np.array([int.from_bytes(pixel, "little") for pixel in vector.voxels().values()])
    order = np.argsort(index)
    payloads = encode_values(index[order], values[order], VALUE_MODES[name], 8, config)
    assert payloads == [vector.hex("ops")]


@pytest.mark.parametrize(
    "vector",
    [v for v in document.vectors("refused") if v.name.startswith(("slabs-", "values-"))],
    ids=str,
)
def test_refused_slabs_as_the_driver_reads_them(vector):
    if vector["code"] != "OP":  # the driver reads what it is given
        with pytest.raises(RemoteProtocolError):
            decode_ops([vector.hex("ops")], Grid(*vector.grid), PixelFormat[vector["format"]])
