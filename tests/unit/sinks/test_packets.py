"""Packets against vectors worked out by hand from the specification of each protocol."""

import numpy as np
import pytest

from voxdisplay.raster.grid import Grid
from voxdisplay.sinks.adalight import AdalightEncoder
from voxdisplay.sinks.artnet import ArtNetEncoder
from voxdisplay.sinks.ddp import DdpEncoder
from voxdisplay.sinks.opc import OpcEncoder
from voxdisplay.sinks.sacn import SacnEncoder, multicast_group
from voxdisplay.sinks.settings import SinkSettings
from voxdisplay.sinks.wled import WledEncoder

ONE_LED = np.array([10, 20, 30], dtype=np.uint8)
ONE = Grid(1, 1, 1)
CID = bytes(range(16))


def packets(encoder, data=ONE_LED):
    return [bytes(packet) for packet in encoder.encode(np.asarray(data, dtype=np.uint8))]


def row(count):
    """A row of LEDs of 0, 1, 2, ... modulo 251."""
    return Grid(count, 1, 1), np.arange(3 * count, dtype=np.int64) % 251


# -- Art-Net


def test_an_artdmx():
    encoder = ArtNetEncoder(SinkSettings(ONE, universe=(0x0102,)))
    # OpCode low byte first, version 14, sequence 1, physical 0, SubUni, Net, an even length.
    assert packets(encoder) == [
        b"Art-Net\0" + bytes.fromhex("0050 000e 01 00 02 01 0004 0a141e 00")
    ]


def test_artdmx_sequence_numbers_are_never_0():
    encoder = ArtNetEncoder(SinkSettings(ONE), sequence=253)
    assert [packets(encoder)[0][12] for _ in range(4)] == [254, 255, 1, 2]


def test_several_universes_of_artnet_end_by_an_artsync():
    size, data = row(171)
    first, second, sync = packets(ArtNetEncoder(SinkSettings(size, universe=(3,))), data)
    assert first[14:18] == bytes.fromhex("03 00 01fe")
    assert second[14:18] == bytes.fromhex("04 00 0004"), "padded to an even length"
    assert first[18:] + second[18:21] == bytes(data.tolist())
    assert sync == b"Art-Net\0" + bytes.fromhex("0052 000e 00 00")


def test_there_is_no_artsync_where_it_is_off():
    size, data = row(171)
    assert len(packets(ArtNetEncoder(SinkSettings(size, sync=False)), data)) == 2


def test_an_address_moves_the_first_universe_alone():
    size, data = row(4)
    settings = SinkSettings(size, universe=(9, 2), address=507)
    first, second, _ = packets(ArtNetEncoder(settings), data)
    assert first[14:18] == bytes.fromhex("09 00 0200")
    assert first[18:] == bytes(506) + bytes(range(6)), "two LEDs have room"
    assert second[14:18] == bytes.fromhex("02 00 0006")
    assert second[18:] == bytes(range(6, 12))


def test_universes_behind_the_last_one_named_follow():
    size, data = row(5)
    settings = SinkSettings(size, universe=(7, 1), pixels=1)
    sent = packets(ArtNetEncoder(settings), data)
    assert [packet[14] for packet in sent[:-1]] == [7, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"universe": (0x8000,)}, "32768 is not from 0 to 32767"),
        ({"universe": (0x7FFF,), "pixels": 1}, "not from 0 to 32767"),
        ({"universe": (3, 2), "pixels": 1}, "in use"),
        ({"pixels": 171}, "room for 170"),
        ({"pixels": 129, "order": "rgbw"}, "room for 128 LEDs of 4 bytes"),
        ({"address": 511}, "no room"),
    ],
)
def test_universes_that_do_not_suit(settings, complaint):
    with pytest.raises(ValueError, match=complaint):
        ArtNetEncoder(SinkSettings(Grid(3, 1, 1), **settings))


# -- sACN


def test_an_sacn_data_packet():
    encoder = SacnEncoder(SinkSettings(ONE, universe=(7,), priority=90), CID, sequence=259)
    root = bytes.fromhex("0010 0000") + b"ASC-E1.17\0\0\0" + bytes.fromhex("7071 00000004") + CID
    framing = bytes.fromhex("705b 00000002") + b"voxdisplay" + bytes(54)
    framing += bytes.fromhex("5a 0000 03 00 0007")
    dmp = bytes.fromhex("700e 02 a1 0000 0001 0004 00 0a141e")
    assert packets(encoder) == [root + framing + dmp]


def test_a_full_sacn_packet_has_638_bytes():
    data = np.zeros(512, dtype=np.uint8)
    settings = SinkSettings(Grid(128, 1, 1), order="rgbw")
    (packet,) = packets(SacnEncoder(settings, CID), data)
    assert len(packet) == 638
    assert packet[16:18] == bytes.fromhex("726e")
    assert packet[38:40] == bytes.fromhex("7258")
    assert packet[115:117] == bytes.fromhex("720b")
    assert packet[123:125] == bytes.fromhex("0201")


def test_several_universes_of_sacn_end_by_a_synchronization_packet():
    size, data = row(171)
    encoder = SacnEncoder(SinkSettings(size, universe=(258,)), CID, sequence=6)
    first, second, sync = packets(encoder, data)
    for universe, packet in ((258, first), (259, second)):
        assert packet[109:111] == bytes.fromhex("0102"), "synchronization address"
        assert packet[111] == 6
        assert int.from_bytes(packet[113:115], "big") == universe
    root = bytes.fromhex("0010 0000") + b"ASC-E1.17\0\0\0" + bytes.fromhex("7021 00000008") + CID
    assert sync == root + bytes.fromhex("700b 00000001 06 0102 0000")
    assert encoder.universes == [258, 259, 258]
    assert packets(encoder, data)[2][44] == 7


def test_sacn_begins_at_universe_1():
    assert packets(SacnEncoder(SinkSettings(ONE), CID))[0][113:115] == bytes([0, 1])
    with pytest.raises(ValueError, match="0 is not from 1 to 63999"):
        SacnEncoder(SinkSettings(ONE, universe=(0,)), CID)


def test_without_synchronization_the_address_is_0():
    size, data = row(171)
    sent = packets(SacnEncoder(SinkSettings(size, sync=False), CID), data)
    assert [packet[109:111] for packet in sent] == [bytes(2), bytes(2)]


def test_the_group_of_a_universe():
    assert multicast_group(0x1234) == "239.255.18.52"


# -- DDP


def test_a_ddp_packet():
    # Version 1 with PUSH, no sequence, RGB of 8 bits, output 1, offset 0, 3 bytes.
    assert packets(DdpEncoder(SinkSettings(ONE))) == [
        bytes.fromhex("41 00 0b 01 00000000 0003 0a141e")
    ]


def test_ddp_offsets_are_bytes_and_the_last_packet_pushes():
    size, data = row(481)
    first, last = packets(DdpEncoder(SinkSettings(size, offset=2)), data)
    assert first[:10] == bytes.fromhex("40 00 0b 01 00000006 05a0")
    assert last[:10] == bytes.fromhex("41 00 0b 01 000005a6 0003")
    assert first[10:] + last[10:] == bytes(data.tolist())


def test_ddp_with_white():
    (packet,) = packets(DdpEncoder(SinkSettings(ONE, order="rgbw")), [1, 2, 3, 4])
    assert packet == bytes.fromhex("41 00 1b 01 00000000 0004 01020304")


# -- OPC


def test_an_opc_message():
    assert packets(OpcEncoder(SinkSettings(ONE))) == [bytes.fromhex("01 00 0003 0a141e")]


def test_opc_goes_on_in_the_next_channel():
    size, data = row(21_846)
    first, second = packets(OpcEncoder(SinkSettings(size, channel=4)), data)
    assert first[:4] == bytes.fromhex("04 00 ffff")
    assert second[:4] == bytes.fromhex("05 00 0003")
    assert first[4:] + second[4:] == bytes(data.tolist())


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"channel": 0, "pixels": 1}, "0 is all channels"),
        ({"channel": 255, "pixels": 1}, "the last would be 256"),
        ({"order": "rgbw"}, "has no white"),
    ],
)
def test_channels_that_do_not_suit(settings, complaint):
    with pytest.raises(ValueError, match=complaint):
        OpcEncoder(SinkSettings(Grid(2, 1, 1), **settings))


# -- WLED


def test_a_dnrgb_packet():
    assert packets(WledEncoder(SinkSettings(ONE, hold=2, offset=259))) == [
        bytes.fromhex("04 02 0103 0a141e")
    ]


def test_dnrgb_has_489_leds_a_packet():
    size, data = row(490)
    first, second = packets(WledEncoder(SinkSettings(size)), data)
    assert (first[:4], len(first)) == (bytes.fromhex("04 ff 0000"), 4 + 3 * 489)
    assert second[:4] == bytes.fromhex("04 ff 01e9")
    assert first[4:] + second[4:] == bytes(data.tolist())


@pytest.mark.parametrize(
    ("settings", "complaint"), [({"offset": 65_535}, "65536"), ({"order": "grbw"}, "no white")]
)
def test_leds_that_dnrgb_lacks(settings, complaint):
    with pytest.raises(ValueError, match=complaint):
        WledEncoder(SinkSettings(Grid(2, 1, 1), **settings))


# -- Adalight


def test_an_adalight_frame():
    assert packets(AdalightEncoder(SinkSettings(ONE))) == [b"Ada" + bytes.fromhex("0000 55 0a141e")]


def test_the_count_of_adalight_is_one_less():
    size, data = row(300)
    (frame,) = packets(AdalightEncoder(SinkSettings(size)), data)
    assert frame == b"Ada" + bytes.fromhex("012b 7f") + bytes(data.tolist())


@pytest.mark.parametrize(
    ("size", "order", "complaint"),
    [(Grid(41, 40, 40), "rgb", "at most 65536"), (ONE, "wrgb", "no white")],
)
def test_leds_that_adalight_lacks(size, order, complaint):
    with pytest.raises(ValueError, match=complaint):
        AdalightEncoder(SinkSettings(size, order=order))


def test_each_frame_replaces_the_one_before():
    size, data = row(700)
    for encoder in (
        ArtNetEncoder(SinkSettings(size)),
        SacnEncoder(SinkSettings(size), CID),
        DdpEncoder(SinkSettings(size)),
        WledEncoder(SinkSettings(size)),
        OpcEncoder(SinkSettings(size, pixels=170)),
    ):
        assert any(b"\xaa" * 8 in each for each in packets(encoder, np.full(2100, 0xAA)))
        assert not any(b"\xaa" * 8 in each for each in packets(encoder, data))
