"""Transmission of frames (protocol.md, 6, 9 and 12), against scripted answers."""

import dataclasses

import pytest
from scripted_link import INFO, SESSION, ack, open_link, receive, show_frame, transmit

from voxdisplay.errors import TransportTimeout
from voxdisplay.link import FrameShown, PageReceived
from voxdisplay.link.sender import BURST_BYTES
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

# -- frames


def test_a_frame_is_shown_when_an_ack_says_so():
    link = open_link()
    ticket = link.present([b"\xa0", b"\xa1"])
    first, second = transmit(link, 0.0)
    assert (first.seq, first.frame, first.flags, first.ops) == (0, 0, 1, b"\xa0")
    assert (second.seq, second.frame, second.flags, second.ops) == (1, 0, 5, b"\xa1")
    assert (link.backlog, link.unacknowledged_payloads, link.idle) == (1, 2, False)
    assert receive(link, ack(1, 0), 0.1) == []
    assert link.unacknowledged_payloads == 1
    assert receive(link, ack(2, 1, flags=spec.ACK_FLAG_PENDING), 0.1) == []
    shown = ack(2, 1, flags=spec.ACK_FLAG_SHOWN, digest=7)
    assert receive(link, shown, 0.2) == [FrameShown(ticket, 7)]
    assert receive(link, shown, 0.3) == []
    assert (link.backlog, link.unacknowledged_payloads, link.idle) == (0, 0, True)


def test_a_frame_that_another_has_followed_is_over_without_word():
    link = open_link()
    tickets = [link.present([]) for _ in range(3)]
    assert [packet.frame for packet in transmit(link, 0.0)] == [0, 1, 2]
    assert receive(link, ack(3, 2, frame=1, flags=1), 0.1) == [FrameShown(tickets[1], 0)]
    assert receive(link, ack(3, 2, frame=2, flags=1), 0.1) == [FrameShown(tickets[2], 0)]


def test_a_frame_is_sent_while_it_is_coded_and_its_last_packet_commits():
    """6: "COMMIT is on the frame's last packet, and on no other"."""
    link = open_link()
    ticket = link.open_frame()
    behind = link.present([b"\xa7"])
    assert transmit(link, 0.0) == []
    for payloads, expected in (([], []), ([b"\xa0"], []), ([b"\xa1", b"\xa2"], [b"\xa0", b"\xa1"])):
        link.append_payloads(ticket, payloads, last=False)
        packets_ = transmit(link, 0.0)
        assert [packet.ops for packet in packets_] == expected
        assert not any(packet.flags & spec.DATA_FLAG_COMMIT for packet in packets_)
    assert (link.payload_count, link.unacknowledged_payloads) == (4, 4)
    receive(link, ack(2, 1), 0.0)
    assert link.unacknowledged_payloads == 2
    link.append_payloads(ticket, [], last=True)
    last, other = transmit(link, 0.0)
    assert (last.ops, last.frame) == (b"\xa2", 0)
    assert last.flags == spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT
    assert (other.ops, other.frame) == (b"\xa7", 1)
    assert receive(link, ack(4, 3, frame=1, flags=1), 0.1) == [FrameShown(behind, 0)]


def test_a_frame_of_which_nothing_was_coded_is_an_empty_one():
    link = open_link()
    link.append_payloads(link.open_frame(), [], last=True)
    (packet,) = transmit(link, 0.0)
    assert (packet.ops, packet.flags) == (b"", spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT)


def test_what_is_not_queued_any_more_takes_no_payloads():
    link = open_link()
    ticket = link.open_frame()
    link.append_payloads(ticket + 1, [b"\xa0"], last=True)
    assert link.payload_count == 0
    assert transmit(link, 0.0) == []


def test_a_frame_that_was_half_coded_when_the_session_ended_goes_on():
    link = open_link()
    ticket = link.open_frame()
    link.append_payloads(ticket, [b"\xa0", b"\xa1"], last=False)
    assert [packet.ops for packet in transmit(link, 0.0)] == [b"\xa0"]
    link.receive(packets.encode(packets.Error(code=1, session=SESSION, offset=0)), 0.1)
    (hello,) = transmit(link, 0.1)
    receive(link, dataclasses.replace(INFO, session=hello.session), 0.1)
    link.append_payloads(ticket, [b"\xa2"], last=True)
    assert [packet.ops for packet in transmit(link, 0.2)] == [b"\xa0", b"\xa1", b"\xa2"]


def test_another_frame_is_wanted_before_the_line_runs_dry():
    link = open_link(rx_buffer=1 << 20)
    assert link.needs_frame
    ticket = link.open_frame()
    link.append_payloads(ticket, [bytes([0xA0])] * 4000, last=False)
    assert link.needs_frame
    link.append_payloads(ticket, [bytes([0xA0])] * 400, last=False)
    assert not link.needs_frame
    transmit(link, 0.0)
    receive(link, ack(1, 0, credit=1 << 20), 1e-5)  # a fast one has no more than it needs
    assert link.needs_frame


def test_what_is_much_goes_out_in_portions():
    """The device is at work on the first while the next is made."""
    link = open_link(max_payload=4096, rx_buffer=1 << 16)
    link.present([bytes(4096)] * 200)
    now, taken, most = 0.0, 0, 0
    while taken < 200:
        portions = [transmit(link, now)]
        while link.next_timeout(now) == 0:
            portions.append(transmit(link, now))
        most = max(most, len(portions))
        assert max(map(len, portions)) * 4096 <= BURST_BYTES
        assert portions[0], "nothing is left behind until the device answers"
        taken += sum(map(len, portions))
        now += 1e-3
        receive(link, ack(taken % 256, (taken - 1) % 256, credit=1 << 16), now)
    assert most > 1


def test_a_packet_that_is_lost_again_and_again():
    link = open_link()
    link.present([b"\xa0"])

    def lose():
        for now in range(100):
            for packet in transmit(link, now / 20):
                if isinstance(packet, packets.Status):
                    receive(link, ack(0, packet.seq, flags=spec.ACK_FLAG_ASKED), now / 20)

    with pytest.raises(TransportTimeout, match="did not arrive in 30 tries") as caught:
        lose()
    assert "noisy" in caught.value.hint


def test_damage_is_followed_by_a_poll_at_once():
    """9.4: "SHOULD ask with STATUS at once"."""
    link = open_link()
    link.present([b"\xa0"])
    assert len(transmit(link, 0.0)) == 1
    receive(link, ack(damaged=1), 0.01)
    (status,) = transmit(link, 0.01)
    assert isinstance(status, packets.Status)
    receive(link, ack(0, status.seq, flags=spec.ACK_FLAG_ASKED, damaged=1), 0.02)
    (again,) = transmit(link, 0.02)
    assert again.ops == b"\xa0"
    assert link.counters.retransmitted == 1


def test_when_all_waits_for_one_packet_a_status_follows_it_at_once():
    """Were its answer lost, no other would come: only silence would tell."""
    link = open_link(rx_buffer=1 << 14)
    link.present([b"\x00"] * 40)
    assert len(transmit(link, 0.0)) > 2
    receive(link, ack(0, 1, received=0b1), 0.001)  # 0 was damaged
    again, *_ = transmit(link, 0.001)
    assert again.seq == 0
    while (last := link.counters.packets - 1) < 31:
        receive(link, ack(0, last, received=(1 << last) - 1), 0.002)
        transmit(link, 0.002)
    receive(link, ack(0, 31, received=(1 << 31) - 1), 0.003)  # 0 was damaged again
    again, status = transmit(link, 0.003)
    assert (again.seq, type(status)) == (0, packets.Status)
    assert transmit(link, 0.003) == [], "one question is enough"
    receive(link, ack(0, status.seq, received=(1 << 31) - 1, flags=spec.ACK_FLAG_ASKED), 0.004)
    again, status = transmit(link, 0.004)
    assert (again.seq, type(status)) == (0, packets.Status)
    receive(link, ack(32, 0), 0.005)
    assert all(isinstance(packet, packets.Data) for packet in transmit(link, 0.005))


def test_the_status_of_a_full_window_is_behind_all_portions():
    """9.3: "right behind them"."""
    link = open_link(max_payload=20_000, rx_buffer=1 << 21)
    link.present([bytes(BURST_BYTES)] * 80)
    for now in range(1, 9):  # of the first 8 none is damaged: now the line is known
        out_of(link, now / 1000)
        receive(link, ack(min(link.counters.packets, 8), 7, credit=1 << 21), now / 1000)
    while link.counters.packets < 40:  # 8 and 9 are, again and again
        out_of(link, 0.01)
        count = link.counters.packets
        received = sum(1 << seq - 9 for seq in range(10, count))
        receive(link, ack(8, count - 1, received=received, credit=1 << 21), 0.01)
    *again, status = out_of(link, 0.02)
    assert [packet.seq for packet in again] == [8, 9]
    assert isinstance(status, packets.Status)


def out_of(link, now):
    out = transmit(link, now)
    while link.next_timeout(now) == 0:
        out += transmit(link, now)
    return out


def test_a_link_without_credit_asks_for_some():
    """READ gets no ACK, and so gives no credit back."""
    link = open_link(rx_buffer=169)
    for k in range(40):
        link.read(k, 1)
        for packet in transmit(link, k * 1e-3):
            answer_of(link, packet, k * 1e-3)
        for packet in transmit(link, k * 1e-3):
            answer_of(link, packet, k * 1e-3)
    assert link.idle
    assert 0 < link.counters.statuses < 40
    assert link.next_timeout(1.0) is None


def answer_of(link, packet, now):
    if isinstance(packet, packets.Read):
        page = packets.Page(seq=packet.seq, start=packet.start, count=1, ops=b"\xa0")
        assert receive(link, page, now) == [PageReceived(page)]
    else:
        receive(link, ack(0, packet.seq, credit=169, flags=spec.ACK_FLAG_ASKED), now)


def test_the_lost_come_before_the_new_and_wait_for_credit_too():
    link = open_link(rx_buffer=169)
    link.present([bytes(90), b"\xa0"])
    (first,) = transmit(link, 0.0)
    receive(link, ack(damaged=1), 0.0)
    (status,) = transmit(link, 0.0)
    receive(link, ack(0, status.seq, credit=100, flags=spec.ACK_FLAG_ASKED, damaged=1), 0.0)
    (asks_again,) = transmit(link, 0.0)
    assert isinstance(asks_again, packets.Status)
    receive(link, ack(0, asks_again.seq, credit=169, flags=spec.ACK_FLAG_ASKED, damaged=1), 0.0)
    assert transmit(link, 0.0)[0] == first


def test_a_held_frame_has_all_but_its_last_payload_acknowledged():
    link = open_link()
    ticket = link.open_frame()
    link.append_payloads(ticket, [b"\xa0", b""], last=False)
    assert not link.is_held(ticket)
    (first,) = transmit(link, 0.0)
    assert first.ops == b"\xa0"
    assert not link.is_held(ticket)
    assert not link.is_held(ticket + 1)
    receive(link, ack(1, 0), 0.1)
    assert link.is_held(ticket)
    assert link.next_timeout(0.1) is None  # it may wait as long as it likes
    link.append_payloads(ticket, [], last=True)
    assert not link.is_held(ticket)
    (commit,) = transmit(link, 0.2)
    assert (commit.ops, commit.flags) == (b"", spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT)


def test_a_held_frame_is_sent_again_in_a_new_session_and_held_there():
    link = open_link()
    base = show_frame(link)
    ticket = link.present_difference(base, [b"\x80\xa0", b""], lambda: [b"\xa7", b""], held=True)
    (packet,) = transmit(link, 0.1)
    assert (packet.ops, packet.flags) == (b"\x80\xa0", 0)
    link.receive(packets.encode(packets.Error(code=1, session=SESSION, offset=0)), 0.2)
    (hello,) = transmit(link, 0.2)
    receive(link, dataclasses.replace(INFO, session=hello.session), 0.3)
    assert not link.is_held(ticket)
    (again,) = transmit(link, 0.3)
    assert (again.ops, again.flags) == (b"\xa7", spec.DATA_FLAG_CLEAR)


# -- frames as differences


def test_a_difference_is_sent_on_what_is_on_display():
    """6: "without it, as a copy of the front page"."""
    link = open_link()
    base = show_frame(link)
    ticket = link.present_difference(base, [b"\x80\xa0", b"\xa1"], lambda: [b"\xa7"])
    first, last = transmit(link, 0.1)
    assert [first.ops, last.ops] == [b"\x80\xa0", b"\xa1"]
    assert [first.flags, last.flags] == [0, spec.DATA_FLAG_COMMIT]
    assert receive(link, ack(3, 2, frame=1, flags=1), 0.2) == [FrameShown(ticket, 0)]
    assert link.displayed not in (base, None)
    link.present_difference(link.displayed, [], lambda: [b"\xa7"])
    (nothing,) = transmit(link, 0.3)
    assert (nothing.ops, nothing.flags) == (b"", spec.DATA_FLAG_COMMIT)


@pytest.mark.parametrize("why", ["another", "on its way", "behind another", "no session"])
def test_a_difference_from_what_is_not_on_display_goes_whole(why):
    link = open_link()
    base = show_frame(link)
    if why == "another":
        link.present([b"\xa2"])
        transmit(link, 0.1)
        receive(link, ack(2, 1, frame=1, flags=1), 0.1)
    elif why == "on its way":
        link.present([b"\xa2"])
        transmit(link, 0.1)
    elif why == "behind another":
        link.present([b"\xa2"])
    else:
        link.receive(packets.encode(packets.Error(code=1, session=SESSION, offset=0)), 0.1)
        (hello,) = transmit(link, 0.1)
        receive(link, dataclasses.replace(INFO, session=hello.session), 0.1)
    link.present_difference(base, [b"\x80\xa0"], lambda: [b"\xa7"])
    packet = [packet for packet in transmit(link, 0.2) if isinstance(packet, packets.Data)][-1]
    assert (packet.ops, packet.flags) == (b"\xa7", spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT)


def test_a_difference_goes_whole_when_the_session_ends_before_it_is_shown():
    link = open_link()
    link.present_difference(show_frame(link), [b"\x80\xa0"], lambda: [b"\xa7", b"\xa8"])
    (packet,) = transmit(link, 0.1)
    assert packet.ops == b"\x80\xa0"
    link.receive(packets.encode(packets.Error(code=1, session=SESSION, offset=0)), 0.2)
    (hello,) = transmit(link, 0.2)
    receive(link, dataclasses.replace(INFO, session=hello.session), 0.3)
    again = transmit(link, 0.3)
    assert [packet.ops for packet in again] == [b"\xa7", b"\xa8"]
    assert {packet.flags & spec.DATA_FLAG_CLEAR for packet in again} == {spec.DATA_FLAG_CLEAR}


def chained_link():
    """Link that has sent a frame, and behind it two that repeat it."""
    link = open_link()
    sessions, _ = link.displayed
    ticket = link.present([b"\xa2"])
    again = link.present_difference((sessions, ticket), [], lambda: [b"\xa2"])
    link.present_difference((sessions, again), [b"\xa3"], lambda: [b"\xa2", b"\xa3"])
    return link


def test_a_difference_from_the_frame_right_before_it_is_sent_behind_it():
    """6, point 6: a device begins a frame when the one before is on display."""
    sent = transmit(chained_link(), 0.1)
    assert [(packet.frame, packet.ops) for packet in sent] == [(0, b"\xa2"), (1, b""), (2, b"\xa3")]
    clear, commit = spec.DATA_FLAG_CLEAR, spec.DATA_FLAG_COMMIT
    assert [packet.flags for packet in sent] == [clear | commit, commit, commit]


@pytest.mark.parametrize("shown", [0, 1, 2])
def test_such_differences_in_a_new_session_begin_with_a_whole_frame(shown):
    link = chained_link()
    transmit(link, 0.1)
    if shown:
        receive(link, ack(3, 2, frame=shown - 1, flags=1), 0.1)
    link.receive(packets.encode(packets.Error(code=1, session=SESSION, offset=0)), 0.2)
    (hello,) = transmit(link, 0.2)
    receive(link, dataclasses.replace(INFO, session=hello.session), 0.3)
    again = transmit(link, 0.3)
    whole = spec.DATA_FLAG_CLEAR
    expected = [
        [(0, b"\xa2", whole), (1, b"", 0), (2, b"\xa3", 0)],
        [(0, b"\xa2", whole), (1, b"\xa3", 0)],
        [(0, b"\xa2", whole), (0, b"\xa3", whole)],
    ][shown]
    assert [(p.frame, p.ops, p.flags & spec.DATA_FLAG_CLEAR) for p in again] == expected


def test_a_burst_that_ended_at_its_size_is_followed_by_more():
    link = open_link(rx_buffer=1 << 20, max_payload=4096)
    link.present([bytes(4000)])
    assert len(transmit(link, 0.0)) == 1
    assert not link.has_more
    receive(link, ack(1, 0, frame=0, flags=1, credit=1 << 20), 0.001)
    link.present([bytes(4000)] * 12)
    bursts = [len(transmit(link, 0.001))]
    while link.has_more:
        bursts.append(len(transmit(link, 0.001)))
    assert bursts == [5, 5, 2]
