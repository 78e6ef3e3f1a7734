"""Sessions and violations (protocol.md, 5, 11 and 13), against scripted answers."""

import dataclasses

import document
import pytest
from scripted_link import BOOT, INFO, SESSION, ack, open_link, receive, transmit

from voxdisplay.errors import RemoteProtocolError, TransportTimeout
from voxdisplay.link import FrameShown, Link, PacketRefused, SessionLost, SessionOpened
from voxdisplay.link.info_validation import check_info
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

# -- the session


def test_hello_is_the_documents_with_a_00_before_it():
    """3: "The sender of a session's first packet MUST send one 00 before it"."""
    hello = next(v for v in document.vectors("packet") if v.name == "hello")
    assert Link(SESSION, 0.0).transmit(0.0) == b"\0" + hello.hex("wire")


def test_hello_is_repeated_unchanged_until_it_is_answered():
    link = Link(SESSION, 0.0)
    first = link.transmit(0.0)
    assert link.transmit(0.1) == b""
    assert link.next_timeout(0.1) == pytest.approx(0.15)
    assert link.transmit(0.25) == first
    receive(link, INFO, 0.3)
    assert link.ready
    assert link.transmit(0.5) == b""
    assert link.next_timeout(0.5) is None


def test_hellos_that_may_still_be_in_the_buffer_cost_credit():
    """9.2: "A host that has sent several HELLO [...] counts from the first"."""
    payload = bytes(96)
    enough = 64 + len(packets.encode(packets.Data(ops=payload)))
    for hellos, fits in ((1, True), (2, False)):
        link = Link(SESSION, 0.0)
        for now in range(hellos):
            link.transmit(float(now))
        receive(link, dataclasses.replace(INFO, rx_buffer=enough), 2.0)
        link.present([payload])
        assert isinstance(transmit(link, 2.0)[0], packets.Data) == fits


@pytest.mark.parametrize(
    ("came", "said", "hint"),
    [
        (b"", "nothing came at all", "switched on"),
        (b"login: ", "no packet: b'login: '", "baud rate"),
        (b"login\0\0", "no packet: b'login'", "baud rate"),
        (bytes(3000), "only zeros came, 3000 of them", "held low"),
        (packets.encode(ack()), "1 valid packet came, but no INFO", "another program"),
        (document.on_wire(b"\xf0\0\0\0"), "1 valid packet came", "another program"),
    ],
)
def test_a_hello_that_nobody_answers(came, said, hint):
    link = Link(SESSION, 0.0, timeout_s=1)
    link.receive(came, 0.5)
    link.transmit(0.9)
    with pytest.raises(TransportTimeout, match="answered HELLO within 1 s") as caught:
        link.transmit(1.0)
    assert said in str(caught.value)
    assert hint in caught.value.hint


def timeout_after(came):
    link = Link(SESSION, 0.0, timeout_s=1)
    link.receive(came, 0.5)
    link.transmit(0.9)
    with pytest.raises(TransportTimeout) as caught:
        link.transmit(1.0)
    return str(caught.value), caught.value.hint


WHOLE_INFO = packets.encode(dataclasses.replace(INFO, name="cube", serial="A1"))


@pytest.mark.parametrize("before", [b"", b"boot 1.2\r\n\0", bytes(40)])
@pytest.mark.parametrize("count", [3, 4, 7, 12, len(WHOLE_INFO) - 1])
def test_a_device_that_stops_in_the_middle_of_its_info(before, count):
    message, hint = timeout_after(before + WHOLE_INFO[:count])
    assert f"an incomplete INFO, of which {count} bytes came" in message
    assert "nothing answered" not in message
    assert "stopped in the middle" in hint


@pytest.mark.parametrize("count", [3, 4, 6, 17, len(WHOLE_INFO) - 1])
def test_a_device_that_stops_in_the_middle_of_its_info_after_each_hello(count):
    message, _ = timeout_after(WHOLE_INFO[:count] * 4)
    assert f"an incomplete INFO, of which {count} bytes came" in message
    if count < len(WHOLE_INFO) - 1:  # else the 00 makes it whole
        message, _ = timeout_after((WHOLE_INFO[:count] + b"\0") * 4)
        assert f"an INFO that is incomplete or damaged, of which {count} bytes came" in message


def test_the_info_of_another_session_is_no_incomplete_one_of_ours():
    other = packets.encode(dataclasses.replace(INFO, session=SESSION ^ 0x0101))
    assert "no packet" in timeout_after(other[:20])[0]


def test_a_line_that_echoes():
    """RX and TX connected, or a terminal with echo: what comes are our own packets."""
    message, hint = timeout_after(Link(SESSION, 0.0).transmit(0.0) * 2)
    assert "the HELLO itself" in message
    assert "RX and TX" in hint


def test_before_a_session_all_but_info_is_dropped():
    link = Link(SESSION, 0.0)
    malformed = document.on_wire(bytes.fromhex("80 00 00 01 02"))
    assert link.receive(malformed, 0.0) == []
    assert receive(link, ack(), 0.0) == []
    assert receive(link, packets.Error(code=1, session=0, offset=0), 0.0) == []
    assert receive(link, dataclasses.replace(INFO, session=SESSION + 1), 0.0) == []
    assert not link.ready
    assert link.receive(malformed + packets.encode(INFO), 0.0) == [SessionOpened(INFO)]


def test_an_info_that_is_too_short_breaks_the_protocol():
    with pytest.raises(RemoteProtocolError, match="INFO"):
        Link(SESSION, 0.0).receive(document.on_wire(packets.pack(INFO)[:20]), 0.0)


def test_an_info_of_another_major_opens_a_session_unchecked():
    link = Link(SESSION, 0.0)
    (event,) = link.receive(document.on_wire(bytes.fromhex("90 00 00 02 17 5A 07 B0")), 0.0)
    assert event.info.major == 2


@pytest.mark.parametrize(
    ("field", "value", "named"),
    [
        ("nx", 0, "nx, ny, nz"),
        ("ny", 0, "nx, ny, nz"),
        ("nz", 0, "nx, ny, nz"),
        ("pages", 1, "pages"),
        ("max_payload", 63, "max_payload"),
        ("rx_buffer", 168, "rx_buffer"),
    ],
)
def test_an_info_that_contradicts_the_document(field, value, named):
    check_info(dataclasses.replace(INFO, rx_buffer=169))
    with pytest.raises(RemoteProtocolError, match=named) as caught:
        check_info(dataclasses.replace(INFO, **{field: value}))
    assert caught.value.section == "5"
    with pytest.raises(RemoteProtocolError, match=named):
        receive(Link(SESSION, 0.0), dataclasses.replace(INFO, **{field: value}), 0.0)


def test_a_grid_of_too_many_voxels():
    check_info(dataclasses.replace(INFO, nx=32767, ny=65535, nz=1))
    with pytest.raises(RemoteProtocolError, match="nx, ny, nz"):
        check_info(dataclasses.replace(INFO, nx=32769, ny=65535, nz=1))


def test_the_least_receive_buffer_is_enough():
    """9.2: "large enough for 64 bytes and the longest packet as it is on the wire"."""
    link = open_link(max_payload=247, rx_buffer=254 + 1 + 1 + 64)
    link.present([b"\xc0\x01" + b"\x81" * 245])
    assert [len(packet.ops) for packet in transmit(link, 0.0)] == [247]


# -- what goes wrong


def test_packets_of_another_session_are_dropped():
    link = open_link()
    link.present([b"\xa0"])
    transmit(link, 0.0)
    assert receive(link, ack(1, 0, session=SESSION + 1, flags=1), 0.1) == []
    assert receive(link, ack(1, 0, session=SESSION + 1, boot=1, flags=1), 0.1) == []
    assert receive(link, dataclasses.replace(INFO, session=SESSION + 1, boot=1), 0.1) == []
    assert receive(link, packets.Error(code=7, session=SESSION + 1, offset=3), 0.1) == []
    assert link.ready
    assert link.backlog == 1


def test_the_hosts_own_packets_are_dropped_and_so_is_an_unknown_type():
    link = open_link()
    for packet in (packets.Hello(session=SESSION), packets.Status(), packets.Data()):
        assert receive(link, packet, 0.0) == []
    assert link.receive(document.on_wire(b"\xc0\0\0later"), 0.0) == []
    assert link.stream.counters.unknown == 1


def test_an_answer_to_no_poll_is_ignored():
    link = open_link()
    assert receive(link, ack(0, 99, flags=spec.ACK_FLAG_ASKED), 0.1) == []
    assert transmit(link, 0.2) == []


def test_an_info_that_comes_twice_is_dropped():
    link = open_link()
    assert receive(link, INFO, 0.1) == []
    assert link.counters.sessions == 1


@pytest.mark.parametrize(
    "news",
    [
        ack(boot=BOOT + 1),
        dataclasses.replace(INFO, boot=BOOT + 1),
        packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0),
    ],
    ids=["ack", "info", "error"],
)
def test_a_device_that_has_restarted_gets_the_whole_frame_again(news):
    """12: "begins again with HELLO and a whole frame"."""
    link = open_link()
    link.present([b"\xa0", b"\xa1"])
    link.read(0, 1)
    before = transmit(link, 0.0)
    receive(link, ack(1, 0), 0.1)
    assert receive(link, news, 0.2) == [SessionLost()]
    (hello,) = transmit(link, 0.2)
    assert hello.session == SESSION + 1
    receive(link, dataclasses.replace(INFO, session=SESSION + 1, boot=BOOT + 1), 0.3)
    again = transmit(link, 0.3)
    assert again[:2] == before[:2]
    assert (again[2].start, again[2].count) == (0, 1)


def test_the_last_session_number_is_followed_by_the_first():
    """5: a session is "a number of the host's choice, not 0"."""
    link = Link(0xFFFF, 0.0)
    receive(link, dataclasses.replace(INFO, session=0xFFFF), 0.0)
    receive(link, packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0), 0.0)
    assert [packet.session for packet in transmit(link, 0.0)] == [1]


def test_a_device_that_restarts_all_the_time():
    link = open_link()
    link.present([b"\xa0"])

    def restart():
        for k in range(20):
            transmit(link, float(k))
            receive(link, packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0), float(k))
            receive(link, dataclasses.replace(INFO, session=SESSION + 1 + k), float(k))

    with pytest.raises(TransportTimeout, match="lost the session 9 times"):
        restart()


@pytest.mark.parametrize("code", range(2, 15))
@pytest.mark.parametrize("session", [0, SESSION])
def test_a_refusal_is_an_event_and_a_session_is_opened(code, session):
    link = open_link()
    link.present([b"\xe0"])
    transmit(link, 0.0)
    error = packets.Error(code=code, session=session, offset=3, text="no")
    assert receive(link, error, 0.1) == [PacketRefused(error)]
    assert (link.backlog, link.ready) == (0, False)
    # What was on its way behind it finds no session: that is no news.
    late = packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0)
    assert receive(link, late, 0.1) == []
    assert [packet.session for packet in transmit(link, 0.1)] == [SESSION + 1]


def test_a_malformed_packet_of_a_session_breaks_the_protocol_and_the_next_is_taken():
    link = open_link()
    ticket = link.present([b"\xa0"])
    transmit(link, 0.0)
    malformed = document.on_wire(bytes.fromhex("80 00 00 01 02"))
    with pytest.raises(RemoteProtocolError, match="ACK"):
        link.receive(malformed + packets.encode(ack(1, 0, flags=1)), 0.1)
    assert link.receive(b"", 0.1) == [FrameShown(ticket, 0)]


def test_an_ack_for_what_was_never_sent_breaks_the_protocol():
    link = open_link()
    with pytest.raises(RemoteProtocolError, match="next is 9"):
        receive(link, ack(9, 8), 0.0)
