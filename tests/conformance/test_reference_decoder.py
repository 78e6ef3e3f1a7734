"""Reference decoder of the kit: the vectors of protocol.md, read a third time."""

import document
import pytest

from voxdisplay.conformance import packets
from voxdisplay.conformance.announced_device import FEATURES, AnnouncedDevice
from voxdisplay.conformance.reference_decoder import ReferenceDecoder, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec


def device_of(vector):
    pixel_format = getattr(spec, f"FORMAT_{vector['format']}")
    allowed = dict(vector.lines).get("features")
    names = allowed.split("|") if allowed else [name for name in FEATURES if name != "HOLD"]
    if pixel_format != spec.FORMAT_INDEX8:
        names = [name for name in names if name not in {"DIFF", "PALETTE"}]
    if pixel_format == spec.FORMAT_MONO1:
        names = [name for name in names if name != "FADE"]
    bits = sum(1 << FEATURES[name] for name in names)
    return AnnouncedDevice(pixel_format, *vector.grid, features=bits)


@pytest.mark.parametrize("vector", document.vectors("ops"), ids=str)
def test_what_ops_draw(vector):
    device, page = device_of(vector), Page()
    ReferenceDecoder(device, page).draw(vector.hex("ops"))
    lit = {place: int.from_bytes(pixel, "little") for place, pixel in vector.voxels().items()}
    assert {device.voxel_at(index): value for index, value in page.pixels.items()} == lit
    assert page.digest(device) == vector.integer("digest")


@pytest.mark.parametrize("vector", document.vectors("refused"), ids=str)
def test_what_is_refused(vector):
    decoder = ReferenceDecoder(device_of(vector), Page())
    if vector["code"].startswith("FINE"):
        decoder.draw(vector.hex("ops"))
        return
    with pytest.raises(Refused) as refused:
        decoder.draw(vector.hex("ops"))
    assert refused.value.code == getattr(spec, f"CODE_{vector['code']}")
    assert refused.value.at + packets.HEADER_BYTES == vector.integer("offset")


@pytest.mark.parametrize("vector", document.vectors("cobs"), ids=str)
def test_cobs(vector):
    assert packets.cobs_encode(vector.hex("decoded")) == vector.hex("encoded")
    assert packets.cobs_decode(vector.hex("encoded")) == vector.hex("decoded")


@pytest.mark.parametrize("vector", document.vectors("packet"), ids=str)
def test_packets(vector):
    whole = vector.hex("packet")
    assert packets.encode(whole[:-4]) == vector.hex("wire")
    assert packets.decode_segment(vector.hex("wire")[:-1]) == whole[:-4]
