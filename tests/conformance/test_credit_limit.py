"""Limit that a device has granted: withdrawn credit is noticed, and doubt is no blame."""

import struct

import pytest

from voxdisplay.conformance import packets
from voxdisplay.conformance.credit_limit import CreditLimit
from voxdisplay.wire import spec

RING = 500


class Line:
    """What is sent and answered in a session, by hand."""

    def __init__(self):
        self.limit = CreditLimit()
        self.hello(7)
        assert self.info(7) == ""

    def send(self, *bodies):
        self.limit.note_sent(b"".join(map(packets.encode, bodies)))

    def hello(self, session, major=1, more=b"\0\0"):
        self.send(packets.hello(session, major, more))

    def info(self, session):
        fields = struct.pack("<BHHBBHHHBBHIII", 1, session, 9, 1, 2, 3, 5, 7, 2, 0, 96, RING, 0, 0)
        return self.limit.check(packets.Response(packets.body(spec.TYPE_INFO, payload=fields)))

    def ack(self, last, credit, flags=0, session=7):
        fields = struct.pack("<BHHIIIH", last, session, 9, 0, credit, 0, 0)
        return self.limit.check(packets.Response(packets.body(spec.TYPE_ACK, flags, 1, 0, fields)))


SIZE = len(packets.encode(packets.data(0, 0)))


@pytest.fixture
def line():
    return Line()


def test_a_plain_ring_grants_its_size_behind_each_packet(line):
    line.send(*(packets.data(seq, 0) for seq in range(4)))
    assert [line.ack(seq, RING) for seq in (0, 1, 1, 2, 3)] == [""] * 5


def test_credit_of_what_is_free_is_withdrawn(line):
    line.send(packets.data(0, 0), packets.data(1, 0))
    assert line.ack(0, RING) == ""
    assert line.ack(0, RING - 1).startswith(f"credit {RING - 1}, 1 bytes less than granted before")


def test_the_grant_of_info_counts_from_its_hello(line):
    line.send(packets.data(0, 0))
    assert line.ack(0, RING - SIZE) == ""
    assert "1 bytes less" in line.ack(0, RING - SIZE - 1)


def test_credit_may_shrink_as_packets_are_taken(line):
    line.send(packets.data(0, 0), packets.data(1, 0))
    assert line.ack(0, RING) == ""
    assert line.ack(1, RING - SIZE) == ""
    assert "1 bytes less" in line.ack(1, RING - SIZE - 1)


def test_a_status_is_named_by_its_tag(line):
    line.send(packets.data(0, 0), packets.status(0))
    assert line.ack(0, RING) == ""
    size = len(packets.encode(packets.status(0)))
    assert line.ack(0, RING - size, packets.ASKED) == ""
    assert "1 bytes less" in line.ack(0, RING - size - 1, packets.ASKED)


def test_of_a_packet_sent_twice_either_may_be_meant(line):
    line.send(packets.data(0, 0), packets.data(1, 0), packets.data(0, 0))
    assert line.ack(0, RING) == ""  # the second one may have been taken
    assert line.ack(1, RING) == ""  # or not
    assert line.ack(0, RING - SIZE) == ""
    assert "1 bytes less" in line.ack(0, RING - SIZE - 1)


def test_no_packet_is_named_before_the_first(line):
    line.send(packets.data(255, 0))
    assert line.ack(255, 0) == ""
    line.send(packets.data(0, 0))
    assert line.ack(0, RING) == ""
    line.send(packets.data(255, 0))
    assert line.ack(255, RING) == ""
    assert "1 bytes less" in line.ack(255, RING - 1)


def test_zeros_between_packets_and_pieces_of_them_do_not_count(line):
    wire = packets.encode(packets.data(0, 0)) + packets.encode(packets.data(1, 0))
    line.limit.note_sent(bytes(40) + wire[:4])
    line.limit.note_sent(wire[4:SIZE] + bytes(40) + wire[SIZE:])
    assert line.ack(0, RING) == ""
    assert line.ack(1, RING - SIZE) == ""
    assert "1 bytes less" in line.ack(1, RING - SIZE - 1)


def test_damaged_segments_count(line):
    line.send(packets.data(0, 0))
    assert line.ack(0, RING) == ""
    line.limit.note_sent(b"\x08\1\2\3\4\5\6\7\0")
    line.send(packets.data(1, 0))
    assert line.ack(1, RING - SIZE - 9) == ""
    assert "1 bytes less" in line.ack(1, RING - SIZE - 10)


def test_a_new_session_grants_anew(line):
    line.send(packets.data(0, 0))
    assert line.ack(0, 10 * RING) == ""
    line.hello(8)
    assert line.ack(0, 10 * RING) == ""  # of the session before
    assert line.info(8) == ""
    assert line.ack(0, 0) == ""  # of the session before
    line.send(packets.data(0, 0))
    assert line.ack(0, RING - SIZE, session=8) == ""
    assert "1 bytes less" in line.ack(0, RING - SIZE - 1, session=8)


def test_of_several_hellos_the_first_counts(line):
    for _ in range(3):
        line.hello(8)
    assert line.info(8) == ""
    line.send(packets.data(0, 0))
    hello = len(packets.encode(packets.hello(8)))
    assert line.ack(0, RING - SIZE - 2 * hello, session=8) == ""
    assert "1 bytes less" in line.ack(0, RING - SIZE - 2 * hello - 1, session=8)


def test_hellos_that_open_nothing_grant_nothing(line):
    line.hello(7, major=2)
    line.hello(0)
    line.hello(7, more=b"\0")
    assert line.info(7) == ""  # of the other major
    line.send(packets.data(0, 0))
    others = len(packets.encode(packets.hello(7, 2)) + packets.encode(packets.hello(0)))
    others += len(packets.encode(packets.hello(7, more=b"\0")))
    assert line.ack(0, RING - SIZE - others) == ""
    assert "1 bytes less" in line.ack(0, RING - SIZE - others - 1)
