"""Polls, timeouts and reads (protocol.md, 9.3 and 10), against scripted answers."""

import dataclasses

import pytest
from scripted_link import BOOT, INFO, SESSION, ack, open_link, receive, transmit

from voxdisplay.errors import RemoteProtocolError, TransportTimeout
from voxdisplay.link import FrameShown, Link, PageReceived, SessionLost, StatusReceived
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

# -- silence


def test_polls_back_off_and_at_most_four_are_outstanding():
    """9.3: "MUST have no more than 4 of them without answer at one time"."""
    link = Link(SESSION, 0.0, timeout_s=100)
    transmit(link, 0.0)
    receive(link, INFO, 0.0)
    link.present([b"\xa0"])
    now, asked = 0.0, []
    while link.ready:
        asked += [now for packet in transmit(link, now) if isinstance(packet, packets.Status)]
        now += link.next_timeout(now)
    assert asked == pytest.approx([0.25, 0.75, 1.75, 3.75])
    assert now >= 7.75, "then it begins again with HELLO"


def test_a_device_may_be_given_more_time():
    for extra_s in (0.0, 30.0):
        link = Link(SESSION, 0.0, timeout_s=5)
        link.extend_timeout(extra_s)
        transmit(link, 4.9 + extra_s)
        with pytest.raises(TransportTimeout):
            transmit(link, 5.1 + extra_s)


def test_a_device_that_answers_nothing_but_hello_is_as_good_as_silent():
    link = open_link()
    link.present([b"\xa0"])
    now, hellos = 0.0, []

    def answer_hello():
        nonlocal now
        while now < 100:
            for packet in transmit(link, now):
                if isinstance(packet, packets.Hello):
                    hellos.append(now)
                    receive(link, dataclasses.replace(INFO, session=packet.session), now)
            now += max(link.next_timeout(now) or 0.0, 0.001)

    with pytest.raises(
        TransportTimeout, match=r"answers HELLO, and has sent nothing else for 5\.0 s"
    ):
        answer_hello()
    assert hellos


def test_an_answer_counts_for_the_questions_before_it_and_not_for_those_behind():
    link = open_link()
    link.present([b"\xa0"])
    transmit(link, 0.0)
    tags = []
    for now in (0.25, 0.75, 1.375):
        (status,) = transmit(link, now)
        tags.append(status.seq)
    receive(link, ack(0, tags[1], flags=spec.ACK_FLAG_ASKED), 1.4)
    count, now = 0, 1.4
    while now < 4:
        count += sum(isinstance(packet, packets.Status) for packet in transmit(link, now))
        now += 0.01
        if not link.ready:
            break
    assert count == 3


def test_a_caller_that_was_away_does_not_blame_the_device():
    link = open_link()
    link.present([b"\xa0"])
    transmit(link, 0.0)
    for now in (1000.0, 2000.0, 2000.01):
        assert all(isinstance(packet, packets.Status) for packet in transmit(link, now))
    assert receive(link, ack(1, 0, flags=1), 2000.02) == [FrameShown(1, 0)]
    link.present([b"\xa0"])
    transmit(link, 9000.0)
    assert link.next_timeout(9000.0) <= 2.5, "nor has it learnt that the line is slow"


# -- asking what is on display


def test_an_idle_link_can_request_the_digest():
    """However long it was idle; and a lost STATUS is sent again."""
    link = open_link()
    link.request_status()
    (status,) = transmit(link, 100.0)
    assert isinstance(status, packets.Status)
    assert transmit(link, 100.001) == []
    (again,) = transmit(link, 100.0 + link.next_timeout(100.0))
    assert again.seq != status.seq
    answer = ack(last=again.seq, flags=spec.ACK_FLAG_ASKED, digest=77)
    assert receive(link, answer, 101.0) == [StatusReceived(77)]
    assert receive(link, answer, 101.0) == []
    assert link.next_timeout(101.0) is None


def test_a_device_without_digest_reports_none():
    link = open_link(features=0)
    link.request_status()
    (status,) = transmit(link, 1.0)
    answer = ack(last=status.seq, flags=spec.ACK_FLAG_ASKED, digest=77)
    assert receive(link, answer, 1.0) == [StatusReceived(None)]


def test_a_question_outlives_the_session():
    link = open_link()
    link.request_status()
    transmit(link, 1.0)
    (restarted,) = receive(link, ack(boot=BOOT + 1), 1.0)
    assert restarted == SessionLost()
    (hello,) = transmit(link, 1.0)
    receive(link, dataclasses.replace(INFO, session=hello.session, boot=BOOT + 1), 1.0)
    (status,) = transmit(link, 1.0)
    assert isinstance(status, packets.Status)


# -- reading


def test_a_page_that_does_not_match():
    for wrong in ({"start": 6}, {"count": 0}, {"count": 11}):
        link = open_link()
        link.read(5, 10)
        (read,) = transmit(link, 0.0)
        page = {"start": 5, "count": 10} | wrong
        with pytest.raises(RemoteProtocolError, match="PAGE covers") as caught:
            receive(link, packets.Page(seq=read.seq, **page), 0.1)
        assert caught.value.section == "10"


def test_a_page_without_a_request_is_dropped():
    link = open_link()
    assert receive(link, packets.Page(seq=1, start=0, count=1), 0.0) == []
    link.read(0, 1)
    (read,) = transmit(link, 0.0)
    assert receive(link, packets.Page(seq=read.seq + 1, start=0, count=1), 0.0) == []
    link.cancel_reads()
    assert receive(link, packets.Page(seq=read.seq, start=0, count=1), 0.0) == []
    assert link.idle


def test_a_page_says_nothing_of_data():
    """9.3: a packet is lost when an ACK shows it; the ACK of a DATA may come behind a PAGE."""
    link = open_link()
    link.present([b"\xa0"])
    link.read(0, 1)
    data, read = transmit(link, 0.0)
    receive(link, packets.Page(seq=read.seq, start=0, count=1, ops=b"\xa0"), 0.0)
    assert transmit(link, 0.0) == []
    assert receive(link, ack(1, data.seq, flags=1), 0.0) == [FrameShown(1, 0)]


def test_a_read_whose_page_does_not_come_is_sent_again():
    link = open_link()
    link.read(3, 4, back=True)
    (read,) = transmit(link, 0.0)
    assert (read.flags, read.start, read.count) == (spec.READ_FLAG_BACK, 3, 4)
    (status,) = transmit(link, 0.25)
    receive(link, ack(0, status.seq, flags=spec.ACK_FLAG_ASKED), 0.3)
    (again,) = transmit(link, 0.3)
    assert (again.start, again.count, again.seq != read.seq) == (3, 4, True)


def test_many_reads_take_no_tag_whose_answer_is_still_to_come():
    """Else the answer to a STATUS would be taken for one to a READ that was sent much later."""
    link = open_link(rx_buffer=1 << 16)
    link.request_status()
    (status,) = transmit(link, 0.0)
    for start in range(100):
        for count in (1, 2, 3):
            link.read(start, count)
    reads = transmit(link, 0.0)
    answer = ack(last=status.seq, flags=spec.ACK_FLAG_ASKED, credit=1 << 16)
    assert receive(link, answer, 0.1) == [StatusReceived(0)]
    asked = []
    while reads:
        asked += [(read.start, read.count) for read in reads]
        for read in reads:
            page = packets.Page(seq=read.seq, start=read.start, count=read.count, ops=b"\xa0")
            assert receive(link, page, 0.1) == [PageReceived(page)]
        reads = transmit(link, 0.1)
    assert len(set(asked)) == len(asked) == 300
    assert link.idle


def test_a_page_shows_that_earlier_requests_are_lost():
    """9: "answered in the order in which they are taken"."""
    link = open_link(rx_buffer=1 << 16)
    for k in range(3):
        link.read(k, 1)
    first, second, third = transmit(link, 0.0)
    assert receive(link, packets.Page(seq=second.seq, start=1, count=1, ops=b"\xa0"), 0.1)
    (again,) = transmit(link, 0.1)
    assert (again.start, again.seq) == (0, third.seq + 1)
    assert again.seq != first.seq
