"""A link against answers made by hand (protocol.md, 5, 9, 12 and 13)."""

import dataclasses

import document
import pytest

from voxdisplay.errors import RemoteProtocolError, TransportTimeout
from voxdisplay.link import Link, PageRead, Ready, Refused, Restarted, Shown, Told
from voxdisplay.link.info import check_info
from voxdisplay.link.sender import PORTION_BYTES
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.stream import PacketStream

SESSION, BOOT = 23063, 45063
INFO = packets.Info(
    major=1, session=SESSION, boot=BOOT, minor=0, format=2, nx=3, ny=5, nz=7, pages=2,
    max_payload=96, rx_buffer=512, refresh=0, features=0b110000000,
)  # fmt: skip


def ack(following=0, last=255, **fields):
    given = {"session": SESSION, "boot": BOOT, "received": 0, "credit": 512, "digest": 0}
    return packets.Ack(seq=following, last=last, **given | {"damaged": 0} | fields)


def sent(link, now):
    """Packets that the link sends at a moment."""
    return list(PacketStream().feed(link.transmit(now)))


def told(link, packet, now):
    return link.receive(packets.encode(packet), now)


def opened(**info):
    link = Link(SESSION, 0.0)
    assert [type(packet) for packet in sent(link, 0.0)] == [packets.Hello]
    given = dataclasses.replace(INFO, **info)
    assert told(link, given, 0.0) == [Ready(given)]
    return link


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
    told(link, INFO, 0.3)
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
        told(link, dataclasses.replace(INFO, rx_buffer=enough), 2.0)
        link.present([payload])
        assert isinstance(sent(link, 2.0)[0], packets.Data) == fits


@pytest.mark.parametrize(
    ("came", "said", "hint"),
    [
        (b"", "nothing came at all", "switched on"),
        (b"login: ", "no packet: b'login: '", "baud rate"),
        (b"login\0\0", "no packet: b'login'", "baud rate"),
        (bytes(3000), "only zeros came, 3000 of them", "held low"),
        (packets.encode(ack()), "packets came, but none that answers", "another program"),
        (document.on_wire(b"\xf0\0\0\0"), "packets came, but none", "another program"),
    ],
)
def test_a_hello_that_nobody_answers(came, said, hint):
    link = Link(SESSION, 0.0, patience_s=1)
    link.receive(came, 0.5)
    link.transmit(0.9)
    with pytest.raises(TransportTimeout, match="answered HELLO within 1 s") as caught:
        link.transmit(1.0)
    assert said in str(caught.value)
    assert hint in caught.value.hint


def test_before_a_session_all_but_info_is_dropped():
    link = Link(SESSION, 0.0)
    malformed = document.on_wire(bytes.fromhex("80 00 00 01 02"))
    assert link.receive(malformed, 0.0) == []
    assert told(link, ack(), 0.0) == []
    assert told(link, packets.Error(code=1, session=0, offset=0), 0.0) == []
    assert told(link, dataclasses.replace(INFO, session=SESSION + 1), 0.0) == []
    assert not link.ready
    assert link.receive(malformed + packets.encode(INFO), 0.0) == [Ready(INFO)]


def test_an_info_that_is_too_short_breaks_the_protocol():
    with pytest.raises(RemoteProtocolError, match="INFO"):
        Link(SESSION, 0.0).receive(document.on_wire(packets.pack(INFO)[:20]), 0.0)


def test_an_info_of_another_major_is_told_as_it_is():
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
        told(Link(SESSION, 0.0), dataclasses.replace(INFO, **{field: value}), 0.0)


def test_a_grid_of_too_many_voxels():
    check_info(dataclasses.replace(INFO, nx=32767, ny=65535, nz=1))
    with pytest.raises(RemoteProtocolError, match="nx, ny, nz"):
        check_info(dataclasses.replace(INFO, nx=32769, ny=65535, nz=1))


def test_the_least_receive_buffer_is_enough():
    """9.2: "large enough for 64 bytes and the longest packet as it is on the wire"."""
    link = opened(max_payload=247, rx_buffer=254 + 1 + 1 + 64)
    link.present([b"\xc0\x01" + b"\x81" * 245])
    assert [len(packet.ops) for packet in sent(link, 0.0)] == [247]


# -- frames


def test_a_frame_is_shown_when_an_ack_says_so():
    link = opened()
    ticket = link.present([b"\xa0", b"\xa1"])
    first, second = sent(link, 0.0)
    assert (first.seq, first.frame, first.flags, first.ops) == (0, 0, 1, b"\xa0")
    assert (second.seq, second.frame, second.flags, second.ops) == (1, 0, 5, b"\xa1")
    assert (link.backlog, link.payloads_left, link.idle) == (1, 2, False)
    assert told(link, ack(1, 0), 0.1) == []
    assert link.payloads_left == 1
    assert told(link, ack(2, 1, flags=spec.ACK_FLAG_PENDING), 0.1) == []
    shown = ack(2, 1, flags=spec.ACK_FLAG_SHOWN, digest=7)
    assert told(link, shown, 0.2) == [Shown(ticket, 7)]
    assert told(link, shown, 0.3) == []
    assert (link.backlog, link.payloads_left, link.idle) == (0, 0, True)


def test_a_frame_that_another_has_followed_is_over_without_word():
    link = opened()
    tickets = [link.present([]) for _ in range(3)]
    assert [packet.frame for packet in sent(link, 0.0)] == [0, 1, 2]
    assert told(link, ack(3, 2, frame=1, flags=1), 0.1) == [Shown(tickets[1], 0)]
    assert told(link, ack(3, 2, frame=2, flags=1), 0.1) == [Shown(tickets[2], 0)]


def test_a_frame_is_sent_while_it_is_coded_and_its_last_packet_commits():
    """6: "COMMIT is on the frame's last packet, and on no other"."""
    link = opened()
    ticket = link.begin()
    behind = link.present([b"\xa7"])
    assert sent(link, 0.0) == []
    for payloads, expected in (([], []), ([b"\xa0"], []), ([b"\xa1", b"\xa2"], [b"\xa0", b"\xa1"])):
        link.supply(ticket, payloads, last=False)
        packets_ = sent(link, 0.0)
        assert [packet.ops for packet in packets_] == expected
        assert not any(packet.flags & spec.DATA_FLAG_COMMIT for packet in packets_)
    assert (link.payloads_in_all, link.payloads_left) == (4, 4)
    told(link, ack(2, 1), 0.0)
    assert link.payloads_left == 2
    link.supply(ticket, [], last=True)
    last, other = sent(link, 0.0)
    assert (last.ops, last.frame) == (b"\xa2", 0)
    assert last.flags == spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT
    assert (other.ops, other.frame) == (b"\xa7", 1)
    assert told(link, ack(4, 3, frame=1, flags=1), 0.1) == [Shown(behind, 0)]


def test_a_frame_of_which_nothing_was_coded_is_an_empty_one():
    link = opened()
    link.supply(link.begin(), [], last=True)
    (packet,) = sent(link, 0.0)
    assert (packet.ops, packet.flags) == (b"", spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT)


def test_what_is_not_queued_any_more_takes_no_payloads():
    link = opened()
    ticket = link.begin()
    link.supply(ticket + 1, [b"\xa0"], last=True)
    assert link.payloads_in_all == 0
    assert sent(link, 0.0) == []


def test_a_frame_that_was_half_coded_when_the_session_ended_goes_on():
    link = opened()
    ticket = link.begin()
    link.supply(ticket, [b"\xa0", b"\xa1"], last=False)
    assert [packet.ops for packet in sent(link, 0.0)] == [b"\xa0"]
    link.receive(packets.encode(packets.Error(code=1, session=SESSION, offset=0)), 0.1)
    (hello,) = sent(link, 0.1)
    told(link, dataclasses.replace(INFO, session=hello.session), 0.1)
    link.supply(ticket, [b"\xa2"], last=True)
    assert [packet.ops for packet in sent(link, 0.2)] == [b"\xa0", b"\xa1", b"\xa2"]


def test_another_frame_is_wanted_before_the_line_runs_dry():
    link = opened(rx_buffer=1 << 20)
    assert link.hungry
    ticket = link.begin()
    link.supply(ticket, [bytes([0xA0])] * 4000, last=False)
    assert link.hungry
    link.supply(ticket, [bytes([0xA0])] * 400, last=False)
    assert not link.hungry
    sent(link, 0.0)
    told(link, ack(1, 0, credit=1 << 20), 1e-5)  # a fast one has no more than it needs
    assert link.hungry


def test_what_is_much_goes_out_in_portions():
    """The device is at work on the first while the next is made."""
    link = opened(max_payload=4096, rx_buffer=1 << 16)
    link.present([bytes(4096)] * 200)
    now, taken, most = 0.0, 0, 0
    while taken < 200:
        portions = [sent(link, now)]
        while link.next_timeout(now) == 0:
            portions.append(sent(link, now))
        most = max(most, len(portions))
        assert max(map(len, portions)) * 4096 <= PORTION_BYTES
        assert portions[0], "nothing is left behind until the device answers"
        taken += sum(map(len, portions))
        now += 1e-3
        told(link, ack(taken % 256, (taken - 1) % 256, credit=1 << 16), now)
    assert most > 1


def test_a_packet_that_is_lost_again_and_again():
    link = opened()
    link.present([b"\xa0"])

    def lose():
        for now in range(100):
            for packet in sent(link, now / 20):
                if isinstance(packet, packets.Status):
                    told(link, ack(0, packet.seq, flags=spec.ACK_FLAG_ASKED), now / 20)

    with pytest.raises(TransportTimeout, match="did not arrive in 30 tries") as caught:
        lose()
    assert "noisy" in caught.value.hint


def test_damage_is_asked_about_at_once():
    """9.4: "SHOULD ask with STATUS at once"."""
    link = opened()
    link.present([b"\xa0"])
    assert len(sent(link, 0.0)) == 1
    told(link, ack(damaged=1), 0.01)
    (status,) = sent(link, 0.01)
    assert isinstance(status, packets.Status)
    told(link, ack(0, status.seq, flags=spec.ACK_FLAG_ASKED, damaged=1), 0.02)
    (again,) = sent(link, 0.02)
    assert again.ops == b"\xa0"
    assert link.counters.retransmitted == 1


def test_when_all_waits_for_one_packet_a_status_follows_it_at_once():
    """Were its answer lost, no other would come: only silence would tell."""
    link = opened(rx_buffer=1 << 14)
    link.present([b"\x00"] * 40)
    assert len(sent(link, 0.0)) > 2
    told(link, ack(0, 1, received=0b1), 0.001)  # 0 was damaged
    again, *_ = sent(link, 0.001)
    assert again.seq == 0
    while (last := link.counters.packets - 1) < 31:
        told(link, ack(0, last, received=(1 << last) - 1), 0.002)
        sent(link, 0.002)
    told(link, ack(0, 31, received=(1 << 31) - 1), 0.003)  # 0 was damaged again
    again, status = sent(link, 0.003)
    assert (again.seq, type(status)) == (0, packets.Status)
    assert sent(link, 0.003) == [], "one question is enough"
    told(link, ack(0, status.seq, received=(1 << 31) - 1, flags=spec.ACK_FLAG_ASKED), 0.004)
    again, status = sent(link, 0.004)
    assert (again.seq, type(status)) == (0, packets.Status)
    told(link, ack(32, 0), 0.005)
    assert all(isinstance(packet, packets.Data) for packet in sent(link, 0.005))


def test_a_link_without_credit_asks_for_some():
    """READ gets no ACK, and so gives no credit back."""
    link = opened(rx_buffer=169)
    for k in range(40):
        link.read(k, 1)
        for packet in sent(link, k * 1e-3):
            answer_of(link, packet, k * 1e-3)
        for packet in sent(link, k * 1e-3):
            answer_of(link, packet, k * 1e-3)
    assert link.idle
    assert 0 < link.counters.statuses < 40
    assert link.next_timeout(1.0) is None


def answer_of(link, packet, now):
    if isinstance(packet, packets.Read):
        page = packets.Page(seq=packet.seq, start=packet.start, count=1, ops=b"\xa0")
        assert told(link, page, now) == [PageRead(page)]
    else:
        told(link, ack(0, packet.seq, credit=169, flags=spec.ACK_FLAG_ASKED), now)


def test_the_lost_come_before_the_new_and_wait_for_credit_too():
    link = opened(rx_buffer=169)
    link.present([bytes(90), b"\xa0"])
    (first,) = sent(link, 0.0)
    told(link, ack(damaged=1), 0.0)
    (status,) = sent(link, 0.0)
    told(link, ack(0, status.seq, credit=100, flags=spec.ACK_FLAG_ASKED, damaged=1), 0.0)
    (asks_again,) = sent(link, 0.0)
    assert isinstance(asks_again, packets.Status)
    told(link, ack(0, asks_again.seq, credit=169, flags=spec.ACK_FLAG_ASKED, damaged=1), 0.0)
    assert sent(link, 0.0)[0] == first


# -- silence


def test_status_is_asked_ever_more_rarely_and_at_most_four_times():
    """9.3: "MUST have no more than 4 of them without answer at one time"."""
    link = Link(SESSION, 0.0, patience_s=100)
    sent(link, 0.0)
    told(link, INFO, 0.0)
    link.present([b"\xa0"])
    now, asked = 0.0, []
    while link.ready:
        asked += [now for packet in sent(link, now) if isinstance(packet, packets.Status)]
        now += link.next_timeout(now)
    assert asked == pytest.approx([0.25, 0.75, 1.75, 3.75])
    assert now >= 7.75, "then it begins again with HELLO"


def test_a_device_that_answers_nothing_but_hello_is_as_good_as_silent():
    link = opened()
    link.present([b"\xa0"])
    now, hellos = 0.0, []

    def answer_hello():
        nonlocal now
        while now < 100:
            for packet in sent(link, now):
                if isinstance(packet, packets.Hello):
                    hellos.append(now)
                    told(link, dataclasses.replace(INFO, session=packet.session), now)
            now += max(link.next_timeout(now) or 0.0, 0.001)

    with pytest.raises(
        TransportTimeout, match=r"answers HELLO, and has said nothing else for 5\.0 s"
    ):
        answer_hello()
    assert hellos


def test_an_answer_counts_for_the_questions_before_it_and_not_for_those_behind():
    link = opened()
    link.present([b"\xa0"])
    sent(link, 0.0)
    tags = []
    for now in (0.25, 0.75, 1.375):
        (status,) = sent(link, now)
        tags.append(status.seq)
    told(link, ack(0, tags[1], flags=spec.ACK_FLAG_ASKED), 1.4)
    count, now = 0, 1.4
    while now < 4:
        count += sum(isinstance(packet, packets.Status) for packet in sent(link, now))
        now += 0.01
        if not link.ready:
            break
    assert count == 3


def test_a_caller_that_was_away_does_not_blame_the_device():
    link = opened()
    link.present([b"\xa0"])
    sent(link, 0.0)
    for now in (1000.0, 2000.0, 2000.01):
        assert all(isinstance(packet, packets.Status) for packet in sent(link, now))
    assert told(link, ack(1, 0, flags=1), 2000.02) == [Shown(1, 0)]
    link.present([b"\xa0"])
    sent(link, 9000.0)
    assert link.next_timeout(9000.0) <= 2.5, "nor has it learnt that the line is slow"


# -- reading


def test_a_page_that_does_not_match():
    for wrong in ({"start": 6}, {"count": 0}, {"count": 11}):
        link = opened()
        link.read(5, 10)
        (read,) = sent(link, 0.0)
        page = {"start": 5, "count": 10} | wrong
        with pytest.raises(RemoteProtocolError, match="PAGE covers") as caught:
            told(link, packets.Page(seq=read.seq, **page), 0.1)
        assert caught.value.section == "10"


def test_a_page_that_nobody_asked_for_is_dropped():
    link = opened()
    assert told(link, packets.Page(seq=1, start=0, count=1), 0.0) == []
    link.read(0, 1)
    (read,) = sent(link, 0.0)
    assert told(link, packets.Page(seq=read.seq + 1, start=0, count=1), 0.0) == []
    link.forget_reads()
    assert told(link, packets.Page(seq=read.seq, start=0, count=1), 0.0) == []
    assert link.idle


def test_a_page_says_nothing_of_data():
    """9.3: a packet is lost when an ACK shows it; the ACK of a DATA may come behind a PAGE."""
    link = opened()
    link.present([b"\xa0"])
    link.read(0, 1)
    data, read = sent(link, 0.0)
    told(link, packets.Page(seq=read.seq, start=0, count=1, ops=b"\xa0"), 0.0)
    assert sent(link, 0.0) == []
    assert told(link, ack(1, data.seq, flags=1), 0.0) == [Shown(1, 0)]


def test_a_read_whose_page_does_not_come_is_sent_again():
    link = opened()
    link.read(3, 4, back=True)
    (read,) = sent(link, 0.0)
    assert (read.flags, read.start, read.count) == (spec.READ_FLAG_BACK, 3, 4)
    (status,) = sent(link, 0.25)
    told(link, ack(0, status.seq, flags=spec.ACK_FLAG_ASKED), 0.3)
    (again,) = sent(link, 0.3)
    assert (again.start, again.count, again.seq != read.seq) == (3, 4, True)


# -- what goes wrong


def test_packets_of_another_session_are_dropped():
    link = opened()
    link.present([b"\xa0"])
    sent(link, 0.0)
    assert told(link, ack(1, 0, session=SESSION + 1, flags=1), 0.1) == []
    assert told(link, ack(1, 0, session=SESSION + 1, boot=1, flags=1), 0.1) == []
    assert told(link, dataclasses.replace(INFO, session=SESSION + 1, boot=1), 0.1) == []
    assert told(link, packets.Error(code=7, session=SESSION + 1, offset=3), 0.1) == []
    assert link.ready
    assert link.backlog == 1


def test_the_hosts_own_packets_are_dropped_and_so_is_an_unknown_type():
    link = opened()
    for packet in (packets.Hello(session=SESSION), packets.Status(), packets.Data()):
        assert told(link, packet, 0.0) == []
    assert link.receive(document.on_wire(b"\xc0\0\0later"), 0.0) == []
    assert link.stream.counters.unknown == 1


def test_an_answer_to_what_was_not_asked():
    link = opened()
    assert told(link, ack(0, 99, flags=spec.ACK_FLAG_ASKED), 0.1) == []
    assert sent(link, 0.2) == []


def test_an_info_that_comes_twice_is_dropped():
    link = opened()
    assert told(link, INFO, 0.1) == []
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
    link = opened()
    link.present([b"\xa0", b"\xa1"])
    link.read(0, 1)
    before = sent(link, 0.0)
    told(link, ack(1, 0), 0.1)
    assert told(link, news, 0.2) == [Restarted()]
    (hello,) = sent(link, 0.2)
    assert hello.session == SESSION + 1
    told(link, dataclasses.replace(INFO, session=SESSION + 1, boot=BOOT + 1), 0.3)
    again = sent(link, 0.3)
    assert again[:2] == before[:2]
    assert (again[2].start, again[2].count) == (0, 1)


def test_the_last_session_number_is_followed_by_the_first():
    """5: a session is "a number of the host's choice, not 0"."""
    link = Link(0xFFFF, 0.0)
    told(link, dataclasses.replace(INFO, session=0xFFFF), 0.0)
    told(link, packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0), 0.0)
    assert [packet.session for packet in sent(link, 0.0)] == [1]


def test_a_device_that_restarts_all_the_time():
    link = opened()
    link.present([b"\xa0"])

    def restart():
        for k in range(20):
            sent(link, float(k))
            told(link, packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0), float(k))
            told(link, dataclasses.replace(INFO, session=SESSION + 1 + k), float(k))

    with pytest.raises(TransportTimeout, match="lost the session 9 times"):
        restart()


@pytest.mark.parametrize("code", range(2, 15))
@pytest.mark.parametrize("session", [0, SESSION])
def test_what_a_device_refuses_is_told_and_a_session_begun(code, session):
    link = opened()
    link.present([b"\xe0"])
    sent(link, 0.0)
    error = packets.Error(code=code, session=session, offset=3, text="no")
    assert told(link, error, 0.1) == [Refused(error)]
    assert (link.backlog, link.ready) == (0, False)
    # What was on its way behind it finds no session: that is no news.
    late = packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0)
    assert told(link, late, 0.1) == []
    assert [packet.session for packet in sent(link, 0.1)] == [SESSION + 1]


def test_a_malformed_packet_of_a_session_breaks_the_protocol_and_the_next_is_taken():
    link = opened()
    ticket = link.present([b"\xa0"])
    sent(link, 0.0)
    malformed = document.on_wire(bytes.fromhex("80 00 00 01 02"))
    with pytest.raises(RemoteProtocolError, match="ACK"):
        link.receive(malformed + packets.encode(ack(1, 0, flags=1)), 0.1)
    assert link.receive(b"", 0.1) == [Shown(ticket, 0)]


def test_an_ack_for_what_was_never_sent_breaks_the_protocol():
    link = opened()
    with pytest.raises(RemoteProtocolError, match="next is 9"):
        told(link, ack(9, 8), 0.0)


# -- asking what is on display


def test_an_idle_link_may_be_asked_what_is_on_display():
    """However long nothing was to be said; and a lost STATUS is asked again."""
    link = opened()
    link.ask()
    (status,) = sent(link, 100.0)
    assert isinstance(status, packets.Status)
    assert sent(link, 100.001) == []
    (again,) = sent(link, 100.0 + link.next_timeout(100.0))
    assert again.seq != status.seq
    answer = ack(last=again.seq, flags=spec.ACK_FLAG_ASKED, digest=77)
    assert told(link, answer, 101.0) == [Told(77)]
    assert told(link, answer, 101.0) == []
    assert link.next_timeout(101.0) is None


def test_a_device_without_digest_is_asked_for_none():
    link = opened(features=0)
    link.ask()
    (status,) = sent(link, 1.0)
    answer = ack(last=status.seq, flags=spec.ACK_FLAG_ASKED, digest=77)
    assert told(link, answer, 1.0) == [Told(None)]


def test_a_question_outlives_the_session():
    link = opened()
    link.ask()
    sent(link, 1.0)
    (restarted,) = told(link, ack(boot=BOOT + 1), 1.0)
    assert restarted == Restarted()
    (hello,) = sent(link, 1.0)
    told(link, dataclasses.replace(INFO, session=hello.session, boot=BOOT + 1), 1.0)
    (status,) = sent(link, 1.0)
    assert isinstance(status, packets.Status)


# -- frames as differences


def on_display(link, number=0, now=0.0):
    """Show a frame of one packet, the first of a session; give what stands for it."""
    ticket = link.present([b"\xa0"])
    sent(link, now)
    assert told(link, ack(1, 0, frame=number, flags=1), now) == [Shown(ticket, 0)]
    return link.on_display


def test_a_difference_is_sent_on_what_is_on_display():
    """6: "without it, as a copy of the front page"."""
    link = opened()
    base = on_display(link)
    ticket = link.present_on(base, [b"\x80\xa0", b"\xa1"], lambda: [b"\xa7"])
    first, last = sent(link, 0.1)
    assert [first.ops, last.ops] == [b"\x80\xa0", b"\xa1"]
    assert [first.flags, last.flags] == [0, spec.DATA_FLAG_COMMIT]
    assert told(link, ack(3, 2, frame=1, flags=1), 0.2) == [Shown(ticket, 0)]
    assert link.on_display not in (base, None)
    link.present_on(link.on_display, [], lambda: [b"\xa7"])
    (nothing,) = sent(link, 0.3)
    assert (nothing.ops, nothing.flags) == (b"", spec.DATA_FLAG_COMMIT)


@pytest.mark.parametrize("why", ["another", "on its way", "behind another", "no session"])
def test_a_difference_from_what_is_not_on_display_goes_whole(why):
    link = opened()
    base = on_display(link)
    if why == "another":
        link.present([b"\xa2"])
        sent(link, 0.1)
        told(link, ack(2, 1, frame=1, flags=1), 0.1)
    elif why == "on its way":
        link.present([b"\xa2"])
        sent(link, 0.1)
    elif why == "behind another":
        link.present([b"\xa2"])
    else:
        link.receive(packets.encode(packets.Error(code=1, session=SESSION, offset=0)), 0.1)
        (hello,) = sent(link, 0.1)
        told(link, dataclasses.replace(INFO, session=hello.session), 0.1)
    link.present_on(base, [b"\x80\xa0"], lambda: [b"\xa7"])
    packet = [packet for packet in sent(link, 0.2) if isinstance(packet, packets.Data)][-1]
    assert (packet.ops, packet.flags) == (b"\xa7", spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT)


def test_a_difference_goes_whole_when_the_session_ends_before_it_is_shown():
    link = opened()
    link.present_on(on_display(link), [b"\x80\xa0"], lambda: [b"\xa7", b"\xa8"])
    (packet,) = sent(link, 0.1)
    assert packet.ops == b"\x80\xa0"
    link.receive(packets.encode(packets.Error(code=1, session=SESSION, offset=0)), 0.2)
    (hello,) = sent(link, 0.2)
    told(link, dataclasses.replace(INFO, session=hello.session), 0.3)
    again = sent(link, 0.3)
    assert [packet.ops for packet in again] == [b"\xa7", b"\xa8"]
    assert {packet.flags & spec.DATA_FLAG_CLEAR for packet in again} == {spec.DATA_FLAG_CLEAR}
