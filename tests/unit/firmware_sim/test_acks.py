"""ACK, sequence numbers, window and credit of the emulator: section 9."""

import pytest
from device_packets import (
    ACK,
    ASKED,
    BOOT,
    CLEAR,
    COMMIT,
    DOT,
    ERROR,
    INFO,
    OVERRUN,
    SEQUENCE,
    SESSION,
    SHOWN,
    DeviceUnderTest,
    block_with_pending_frame,
    data,
    data_of_wire_size,
    hello,
    parse_responses,
    status,
)

from firmware_sim.bench import Bench
from firmware_sim.device import TX_BUFFER

# ACK and the window: section 9


def test_an_ack_says_everything() -> None:
    rig = DeviceUnderTest(rx_buffer=4096)
    rig.show_frame(0, 0, DOT)
    rig.request(data(3, 1, DOT))
    ack = rig.request(data(5, 1, DOT))
    assert (ack.kind, ack.flags, ack.seq, ack.frame, ack.last) == (ACK, SHOWN, 1, 0, 5)
    assert (ack.session, ack.boot, ack.received, ack.credit) == (SESSION, BOOT, 0b1010, 4096)
    assert ack.digest == rig.device.memory.front.digest
    assert len(ack.payload) == 19


def test_a_status_asks_for_an_ack_and_its_tag_is_not_kept() -> None:
    """ASKED answers a STATUS, whose tag is in `last`; else the last DATA, 255 before the first."""
    rig = DeviceUnderTest()
    ack = rig.request(status(99))
    assert (ack.flags, ack.last) == (ASKED, 99)
    assert rig.request(b"\x02" * 8 + b"\0").last == 255
    rig.request(data(0, 0))
    rig.request(status(98))
    assert rig.request(b"\x02" * 8 + b"\0").last == 0


def test_packets_may_come_in_any_order() -> None:
    rig = DeviceUnderTest()
    order = [4, 1, 0, 31, 2, 3]
    nexts = [0, 0, 2, 2, 3, 5]
    for seq, following in zip(order, nexts, strict=True):
        place = bytes((0x80 | seq - 1,)) if seq else b""
        ack = rig.request(data(seq, 0, place + DOT))
        assert (ack.seq, ack.last) == (following, seq)
    assert ack.received == 1 << 31 - 5 - 1
    assert [i for i, value in enumerate(rig.back[::3]) if value] == [0, 1, 2, 3, 4, 31]


def test_a_duplicate_is_answered_and_not_applied() -> None:
    """The device MUST NOT apply it again, and answers with ACK."""
    rig = DeviceUnderTest()
    for seq in (0, 2):
        rig.request(data(seq, 0))
    for seq in (0, 2, 255, 225):
        ack = rig.request(data(seq, 77, b"\xff", CLEAR))
        assert (ack.kind, ack.seq, ack.last, ack.received) == (ACK, 1, seq, 1)


@pytest.mark.parametrize("seq", [32, 100, 223])
def test_what_is_outside_the_window_is_refused(seq: int) -> None:
    assert DeviceUnderTest().request(data(seq, 0)).error == (SEQUENCE, 1)


@pytest.mark.parametrize("seq", [224, 255])
def test_what_is_behind_the_window_is_a_duplicate(seq: int) -> None:
    assert DeviceUnderTest().request(data(seq, 0)).last == seq


def test_numbers_go_round() -> None:
    rig = DeviceUnderTest()
    for number in range(600):
        ack = rig.request(data(number % 256, 0))
        assert ack.seq == (number + 1) % 256
    ack = rig.request(data((600 + 31) % 256, 0))
    assert ack.received == 1 << 30


def test_acks_may_be_left_out_while_more_can_be_taken() -> None:
    """MAY leave out this ACK, but not for more than 8 packets in a row."""
    rig = DeviceUnderTest(max_silent_acks=8)
    acks = rig.send(*(data(seq, 0) for seq in range(20)))
    assert [ack.last for ack in acks] == [8, 17, 19]
    assert rig.request(data(20, 0)).last == 20
    asked, done = rig.send(data(21, 0), status(7), data(22, 0))
    assert (asked.flags, asked.last, asked.seq) == (ASKED, 7, 22)
    assert done.last == 22
    assert rig.request(data(23, 0) + hello(5)).kind == INFO


# Credit and the receive ring: section 9.2


def test_the_credit_can_be_used_to_the_last_byte() -> None:
    """`credit`: bytes that the device has room for behind the packet named by `last`."""
    rig = DeviceUnderTest(rx_buffer=1200)
    used = block_with_pending_frame(rig)
    last = data_of_wire_size(3, 1200 - used - 600)
    wire = (
        b"\0\0" + data_of_wire_size(2, 600) + b"\0\0\0" + last + b"\0"
    )  # 00 is outside the credit
    for k in range(0, len(wire), 7):
        assert rig.send(wire[k : k + 7]) == []
    assert rig.send(b"\0\0\0", b"\0") == []
    assert [ack.last for ack in rig.tick()] == [0, 1, 2, 3]


def test_one_byte_more_is_an_overrun() -> None:
    """OVERRUN is sent once for each time that bytes were lost, with seq and frame 0."""
    rig = DeviceUnderTest(rx_buffer=1200)
    used = block_with_pending_frame(rig)
    assert rig.send(data_of_wire_size(2, 600), data_of_wire_size(3, 1200 - used - 600)) == []
    error, ack = rig.send(status(1))
    assert error.error == (OVERRUN, 0)
    assert (error.seq, error.frame, error.session) == (0, 0, SESSION)
    assert (ack.damaged, ack.seq) == (1, 1)
    assert rig.send(status(2)) == rig.send(b"") == rig.send(status(3)[:4]) == []
    assert [ack.last for ack in rig.tick()] == [0, 1, 2, 3]
    # What was cut goes on to the next 00.
    assert rig.send(status(3)[4:-1]) == []
    assert [a.last for a in rig.send(b"\0", status(4))] == [4]
    assert Bench(rig.device).counters().overruns == 1


def test_a_packet_that_is_cut_by_an_overrun_is_damaged() -> None:
    rig = DeviceUnderTest(rx_buffer=1200)
    block_with_pending_frame(rig)
    error, ack = rig.send(
        data_of_wire_size(2, 600), data_of_wire_size(3, 600), data_of_wire_size(4, 600)
    )
    assert error.error == (OVERRUN, 0)
    assert ack.damaged == 1
    assert [ack.last for ack in rig.tick()] == [0, 1, 2]
    (ack,) = rig.send(data_of_wire_size(3, 600))  # the loss ended with a 00
    assert (ack.last, ack.seq, ack.damaged) == (3, 4, 1)


def test_bytes_may_be_lost_again_and_again() -> None:
    rig = DeviceUnderTest(rx_buffer=1200)
    block_with_pending_frame(rig)
    assert rig.send(data_of_wire_size(2, 600), data_of_wire_size(3, 600))[0].error == (OVERRUN, 0)
    rig.tick()
    rig.request(data(3, 1, DOT, CLEAR | COMMIT))
    assert rig.send(data(4, 2), data_of_wire_size(5, 1100)) == []
    assert rig.send(data_of_wire_size(6, 600))[0].error == (OVERRUN, 0)
    assert Bench(rig.device).counters().overruns == 2


def test_a_stream_without_end_is_bounded() -> None:
    rig = DeviceUnderTest(rx_buffer=1200)
    block_with_pending_frame(rig)
    sent = [answer.kind for _ in range(50) for answer in rig.send(b"\x33" * 1000)]
    assert sent == [ERROR, ACK]
    assert len(rig.device._ring) <= 1200


def test_a_host_that_does_not_read_is_not_read_either() -> None:
    rig = DeviceUnderTest(rx_buffer=1200)
    longest = 0
    for tag in range(4000):
        rig.device.receive(status(tag % 256))
        longest = max(longest, len(rig.device._out))
    assert longest < TX_BUFFER + 100
    first = parse_responses(rig.device.transmit())
    assert rig.device.pending is False
    assert first[-2].error == (OVERRUN, 0)
    rest = parse_responses(rig.device.transmit())
    assert [ack.flags for ack in rest] == [ASKED] * (1200 // 9)
    assert rig.request(status(5)).last == 5


def test_a_clogged_device_that_lost_everything_goes_on() -> None:
    rig = DeviceUnderTest(rx_buffer=1200)
    while len(rig.device._out) < TX_BUFFER:
        rig.device.receive(status(1))
    rig.device.receive(b"\x33" * 2000)
    rig.device.transmit()
    assert [a.last for a in rig.send(b"\0", status(5))] == [5]
