"""Displays that show something else than was sent, or refuse it."""

import dataclasses

import pytest
from memory_pipe import assert_shows, changed, open_display, random_frame

import voxdisplay as vd
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec


def test_a_page_that_differs_once_is_repaired():
    display, pipe = open_display()
    frame = random_frame(display)

    def disturb():
        pipe.device.on_swap = lambda: None
        pipe.device.memory.front.put(7, b"\x01\x02\x03")

    pipe.device.on_swap = disturb
    receipt = display.present(frame)
    assert receipt.digest == frame.digest()
    assert "1 voxels differ" in receipt.repaired
    assert_shows(pipe, frame)
    assert pipe.device.swaps == 2
    assert display.present(frame).repaired is None


@pytest.mark.parametrize("newer", [False, True])
def test_a_page_that_differs_once_is_repaired_without_waiting_too(newer):
    display, pipe = open_display()
    shown = []

    def disturb():
        shown.append(pipe.bench.snapshot().digest)
        if len(shown) == 1:
            pipe.device.memory.front.put(7, b"\x01\x02\x03")
            if newer:
                display.present(last, wait=False)

    first, last = random_frame(display, 1), random_frame(display, 2)
    pipe.device.on_swap = disturb
    display.present(first, wait=False)
    display.flush()
    frame = last if newer else first
    assert_shows(pipe, frame)
    assert shown == [first.digest(), frame.digest()]
    assert display.present(first).frame == len(set(shown)) + 1


def test_a_page_that_differs_again_and_again():
    display, pipe = open_display()
    pipe.device.on_swap = lambda: pipe.device.memory.front.put(17, b"\x01\x02\x03")
    with pytest.raises(vd.DesyncError, match=r"1 voxels differ, the first at \(0, 1, 0\)"):
        display.present(random_frame(display))
    pipe.device.on_swap = lambda: None
    display.present(random_frame(display))


def test_where_a_page_of_numbers_differs():
    display, pipe = open_display(pixel_format="index8")
    pipe.device.on_swap = lambda: pipe.device.memory.front.put(3 + 17 * 2, b"\x07")
    with pytest.raises(vd.DesyncError, match=r"first at \(3, 2, 0\): 7 instead of 0"):
        display.present(display.frame())


@pytest.mark.parametrize("features", [frozenset({"digest"}), frozenset({"digest", "read"})])
def test_a_digest_that_lies(features):
    display, pipe = open_display(features=features)

    def lie(packet):
        if isinstance(packet, packets.Ack):
            return dataclasses.replace(packet, digest=packet.digest ^ 1)
        return packet

    pipe.answers = changed(lie)
    with pytest.raises(vd.DesyncError, match="digest") as caught:
        display.present(random_frame(display))
    assert ("reads back as it was meant" in str(caught.value)) == ("read" in features)
    display.present(random_frame(display), wait=False)
    with pytest.raises(vd.DesyncError, match="digest"):
        display.flush()


def test_a_refused_packet_and_then_another():
    display, pipe = open_display()
    for _ in range(6):
        frame = random_frame(display)
        frame.iter_payloads = lambda *_device: iter([[b"\xe0\x00"]])
        with pytest.raises(vd.DeviceError, match=r"OP \(7\) at byte 3: op E0") as caught:
            display.present(frame)
        assert caught.value.code == spec.CODE_OP
    frame = random_frame(display)
    display.present(frame)
    assert_shows(pipe, frame)
    assert pipe.device.errors_by_code == {spec.CODE_OP: 6}


def test_a_code_that_nobody_knows():
    display, pipe = open_display()
    error = packets.encode(packets.Error(code=99, session=0, offset=0))
    pipe.answers = lambda data: error + data
    with pytest.raises(vd.DeviceError, match=r"an unknown code \(99\) at byte 0$"):
        display.clear()
