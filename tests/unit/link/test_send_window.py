"""Send window, credit and loss (protocol.md, 9.1 to 9.3), one ACK at a time."""

import pytest

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.link.send_window import SendWindow
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

SIZE = 100


def ack(following, last, *, received=0, credit=1000, flags=0):
    return packets.Ack(
        seq=following, flags=flags, last=last, session=1, boot=1, received=received, credit=credit,
        digest=0, damaged=0,
    )  # fmt: skip


def sent(window, count):
    return [window.send(window.add(bytes(SIZE)), float(k)) for k in range(count)]


def lost(window):
    return [seq for seq, flight in sorted(window.outstanding.items()) if flight.lost]


def test_no_number_is_sent_32_ahead_of_next():
    window = SendWindow(10**6)
    sent(window, 31)
    assert window.has_room
    sent(window, 1)
    assert not window.has_room
    window.acknowledge(ack(1, 0))
    assert window.has_room
    sent(window, 1)
    assert not window.has_room


def test_data_leaves_the_reserve():
    """9.2: "The host MUST leave 64 bytes of the credit to HELLO and STATUS"."""
    window = SendWindow(SIZE + spec.LIMIT_RESERVE)
    assert window.has_credit(SIZE)
    assert not window.has_credit(SIZE + 1)
    sent(window, 1)
    assert not window.has_credit(1)


def test_what_was_promised_stays_promised():
    """9.2: "A host goes by the farthest place that it has been told"."""
    window = SendWindow(10 * SIZE + spec.LIMIT_RESERVE)
    sent(window, 2)
    window.acknowledge(ack(1, 0, credit=9 * SIZE + spec.LIMIT_RESERVE))
    assert window.has_credit(8 * SIZE)
    window.acknowledge(ack(2, 1, credit=5 * SIZE))
    assert window.has_credit(8 * SIZE)
    assert not window.has_credit(8 * SIZE + 1)


def test_credit_counts_from_the_end_of_the_packet_that_last_names():
    window = SendWindow(10 * SIZE)
    sent(window, 3)
    for seq, room in ((0, 1000 - 2 * SIZE), (1, 1000 - SIZE), (2, 1000)):
        window.acknowledge(ack(seq + 1, seq, credit=1000))
        assert window.has_credit(room - 64)
        assert not window.has_credit(room - 63)


def test_what_is_received_is_reported_once():
    window = SendWindow(10**6)
    sent(window, 5)
    done = window.acknowledge(ack(1, 3, received=0b101))  # 0, and 2 and 4
    assert [flight.sent_s for flight in done] == [0.0, 2.0, 4.0]
    assert sorted(window.outstanding) == [1, 3]
    assert window.acknowledge(ack(1, 3, received=0b101)) == []


def test_lost_is_what_was_sent_before_something_that_was_taken():
    """9.3: "it, or something that was sent after it, has been taken"."""
    window = SendWindow(10**6)
    sent(window, 5)
    window.acknowledge(ack(1, 2, received=0b10))  # 2 was taken and dropped; 3 has been received
    assert lost(window) == [1, 2]
    assert window.first_lost() == 1


def test_a_status_that_is_answered_tells_of_all_before_it():
    window = SendWindow(10**6)
    sent(window, 2)
    window.send_tagged(77, 9)
    sent(window, 1)
    window.acknowledge(ack(0, 77, flags=spec.ACK_FLAG_ASKED))
    assert lost(window) == [0, 1]


def test_last_of_a_status_and_last_of_a_data_are_different_numbers():
    window = SendWindow(10**6)
    sent(window, 2)
    window.send_tagged(5, 9)
    window.acknowledge(ack(0, 5))
    window.acknowledge(ack(0, 0, flags=spec.ACK_FLAG_ASKED))
    assert lost(window) == []


def test_before_the_first_data_last_names_nothing():
    """9: "Without ASKED, last is 255 in a session before its first DATA"."""
    window = SendWindow(1000)
    sent(window, 2)
    assert window.acknowledge(ack(0, 255, credit=10**6)) == []
    assert lost(window) == []
    assert not window.has_credit(1000)


def test_what_is_sent_again_is_lost_only_when_that_is_known():
    """An ACK for damage repeats the ``last`` before: that is no word of a second transmission."""
    window = SendWindow(1000)
    sent(window, 3)
    dropped = ack(0, 2, credit=1000)  # 0 and 1 were damaged; 2 is of the next frame
    window.acknowledge(dropped)
    assert lost(window) == [0, 1, 2]
    for seq in (0, 1, 2):
        window.send(seq, 9.0)
    window.acknowledge(dropped)
    assert lost(window) == []
    assert not window.has_credit(3 * SIZE + 1000 - 6 * SIZE - 63), (
        "credit behind the first, not the second"
    )
    window.send_tagged(7, 9)
    window.acknowledge(ack(0, 7, flags=spec.ACK_FLAG_ASKED))
    assert lost(window) == [0, 1, 2]


def test_what_is_dropped_again_is_lost_again():
    """``last`` goes back to a number only when that has been taken once more."""
    window = SendWindow(1000)
    sent(window, 3)
    window.acknowledge(ack(0, 2))  # 0 was damaged; 1 and 2 are of the next frame
    for seq in (0, 1, 2):
        window.send(seq, 9.0)
    window.acknowledge(ack(0, 1, credit=1000))  # 0 was damaged once more
    assert lost(window) == [0, 1]
    assert window.has_credit(1000 - SIZE - 64)
    assert not window.has_credit(1000 - SIZE - 63), "credit behind the second transmission of 1"
    window.acknowledge(ack(0, 2))
    assert lost(window) == [0, 1, 2]


def test_a_number_that_comes_round_again_names_its_new_packet():
    window = SendWindow(10**6)
    for k in range(256):
        sent(window, 1)
        window.send_tagged(7, 9)
        window.acknowledge(ack((k + 1) % 256, 7, flags=spec.ACK_FLAG_ASKED))
    sent(window, 2)  # 0 and 1 again
    window.acknowledge(ack(0, 0))
    assert lost(window) == [0]


def test_what_is_sent_again_and_received_gives_its_credit():
    window = SendWindow(1000)
    sent(window, 1)
    window.send_tagged(7, 9)
    window.acknowledge(ack(0, 7, flags=spec.ACK_FLAG_ASKED))
    window.send(0, 1.0)
    window.acknowledge(ack(1, 0, credit=1000))
    assert window.has_credit(1000 - 64)


@pytest.mark.parametrize("following", [255, 4, 100, 200])
def test_a_device_that_received_what_was_not_sent_breaks_the_protocol(following):
    window = SendWindow(1000)
    sent(window, 3)
    with pytest.raises(RemoteProtocolError, match="next") as caught:
        window.acknowledge(ack(following, 0))
    assert caught.value.section == "9"


def test_sequence_numbers_wrap_around():
    window = SendWindow(10**9)
    for k in range(600):
        sent(window, 1)
        if k % 20 == 19:
            assert len(window.acknowledge(ack((k + 1) % 256, k % 256))) == 20
    assert window.next_seq == 600 % 256
    assert not window.outstanding
