"""Frames that are held for refresh ticks (protocol.md, 7.12), against scripted answers."""

import dataclasses

import pytest
from scripted_link import INFO, SESSION, ack, open_link, receive, transmit

from voxdisplay.errors import TransportTimeout
from voxdisplay.link import FrameShown
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

FEATURES = INFO.features | 1 << spec.FEATURE_HOLD


def open_holding(refresh=20_000, features=FEATURES):
    """Open a link to a device of 20 ticks a second."""
    return open_link(refresh=refresh, features=features, minor=1)


def held(link, payloads, ticks):
    ticket = link.present(payloads)
    link.hold(ticks)
    return ticket


@pytest.mark.parametrize(("ticks", "sent"), [(0, []), (1, []), (2, [7, 2]), (20, [7, 20])])
def test_hold_comes_before_the_ops_of_the_last_packet(ticks, sent):
    link = open_holding()
    held(link, [b"\xa0", b"\xa1"], ticks)
    first, last = transmit(link, 0.0)
    assert (first.ops, last.ops) == (b"\xa0", bytes(sent) + b"\xa1")
    assert last.flags & spec.DATA_FLAG_COMMIT


def test_hold_has_a_packet_of_its_own_behind_a_full_payload():
    link = open_holding()
    full = b"\xa0" * (INFO.max_payload - 1)
    held(link, [full], 3)
    first, last = transmit(link, 0.0)
    assert (first.ops, last.ops) == (full, b"\x07\x03")
    assert not first.flags & spec.DATA_FLAG_COMMIT
    assert last.flags & spec.DATA_FLAG_COMMIT


def test_a_frame_that_is_being_encoded_is_held_by_its_last_packet():
    link = open_holding()
    ticket = link.open_frame()
    link.hold(4)
    link.append_payloads(ticket, [b"\xa0", b"\xa1"], last=False)
    assert [packet.ops for packet in transmit(link, 0.0)] == [b"\xa0"]
    link.append_payloads(ticket, [], last=True)
    assert [packet.ops for packet in transmit(link, 0.0)] == [b"\x07\x04\xa1"]


@pytest.mark.parametrize("refresh", [0, 20_000])
def test_a_device_without_the_feature_is_never_sent_one(refresh):
    link = open_holding(refresh, features=FEATURES if not refresh else INFO.features)
    held(link, [b"\xa0"], 3)
    assert [packet.ops for packet in transmit(link, 0.0)] == [b"\xa0"]


def test_all_frames_on_their_way_are_held_for_a_second_at_most():
    link = open_holding()
    tickets = [held(link, [b"\xa0"], ticks) for ticks in (12, 8, 2, 255)]
    assert [packet.ops for packet in transmit(link, 0.0)] == [b"\x07\x0c\xa0", b"\x07\x08\xa0"]
    assert receive(link, ack(2, 1, flags=1), 0.6) == [FrameShown(tickets[0], 0)]
    assert [packet.ops for packet in transmit(link, 0.6)] == [b"\x07\x02\xa0"]
    receive(link, ack(3, 2, frame=2, flags=1), 1.1)
    assert [packet.ops for packet in transmit(link, 1.1)] == [b"\x07\x14\xa0"], "20 ticks a second"


def test_in_a_new_session_a_frame_is_held_as_the_device_there_can():
    link = open_holding()
    full = b"\xa0" * INFO.max_payload
    held(link, [full], 3)
    held(link, [], 4)
    assert [packet.ops for packet in transmit(link, 0.0)] == [full, b"\x07\x03", b"\x07\x04"]
    receive(link, packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0), 0.1)
    (hello,) = transmit(link, 0.1)
    assert hello.session == SESSION + 1
    receive(link, dataclasses.replace(INFO, session=SESSION + 1), 0.1)
    assert [packet.ops for packet in transmit(link, 0.1)] == [full, b""]


def statuses(link, now):
    return [packet for packet in transmit(link, now) if isinstance(packet, packets.Status)]


def test_a_device_that_holds_frames_may_be_silent_for_so_long():
    link = open_holding()
    held(link, [b"\xa0"], 20)
    transmit(link, 0.0)
    waits_s = link.next_timeout(0.0)
    other = open_holding()
    other.present([b"\xa0"])
    transmit(other, 0.0)
    assert waits_s == pytest.approx(other.next_timeout(0.0) + 1.0)
    assert not statuses(link, waits_s - 0.01)
    assert len(statuses(link, waits_s)) == 1
    assert link.next_timeout(waits_s) > 1.0, "the second waits as long"
    receive(link, ack(1, 0, flags=1), 2.0)
    assert link.next_timeout(2.0) is None


def given_up_s(link):
    """Return when a link gives up a device that answers nothing."""
    for step in range(1000):
        try:
            link.transmit(step / 20)
        except TransportTimeout:
            return step / 20
    raise AssertionError("it never gives up")


def test_hello_waits_behind_frames_that_are_held():
    silent = {}
    for ticks in (0, 20):
        link = open_holding()
        held(link, [b"\xa0"], ticks)
        transmit(link, 0.0)
        receive(link, packets.Error(code=spec.CODE_NO_SESSION, session=0, offset=0), 0.0)
        silent[ticks] = given_up_s(link)
    assert silent[20] - silent[0] == pytest.approx(1.0, abs=0.06)
