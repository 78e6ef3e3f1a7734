"""Frames that keep what is displayed and are sent as a difference; palettes."""

import document
import pytest
from memory_pipe import GRID, assert_shows, open_display, random_frame

import voxdisplay as vd
from voxdisplay.wire import spec


def flags_sent(pipe):
    """A list that grows by the flags of each DATA packet."""
    flags, write = [], pipe.write

    def noting(data, timeout_s):
        for body in document.off_wire(data.replace(b"\0\0", b"\0").lstrip(b"\0")):
            flags.extend([body[0] & 15] if body[0] >> 4 == spec.TYPE_DATA else [])
        write(data, timeout_s)

    pipe.write = noting
    return flags


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
def test_a_frame_that_keeps_what_is_on_display(format_):
    display, pipe = open_display(pixel_format=format_)
    before = random_frame(display)
    whole = display.present(before)
    flags = flags_sent(pipe)
    frame = display.frame(keep=True)
    assert (frame.array() == before.array()).all()
    frame.draw([(x, 1, 2) for x in range(17)], "red")
    frame.draw([(3, 3, 3)], "black")
    receipt = display.present(frame)
    assert_shows(pipe, frame)
    assert receipt.digest == frame.digest()
    assert receipt.wire_bytes < whole.wire_bytes / 3
    assert flags == [spec.DATA_FLAG_COMMIT]


def test_any_frame_that_differs_little_goes_as_its_difference():
    display, pipe = open_display()
    frame = random_frame(display)
    display.present(frame)
    flags = flags_sent(pipe)
    array = frame.array()
    array[2, 3, 4] ^= 255
    again = display.frame()
    again.set(array)
    display.present(again)
    assert_shows(pipe, again)
    display.present(again)
    assert flags == [spec.DATA_FLAG_COMMIT] * 2
    for wait in (True, False):
        display.present(random_frame(display, 1 + wait), wait=wait)
        assert flags.pop() & spec.DATA_FLAG_CLEAR
    display.flush()


def test_without_waiting_too():
    display, pipe = open_display()
    frame = random_frame(display)
    display.present(frame, wait=False)
    kept = display.frame(keep=True)
    assert (kept.array() == frame.array()).all()
    flags = flags_sent(pipe)
    kept.draw([(3, 3, 3)], "lime")
    display.present(kept, wait=False)
    kept.draw([(4, 4, 4)], "lime")  # what was handed over stays as it was
    display.flush()
    kept.draw([(4, 4, 4)], "black")
    assert flags == [spec.DATA_FLAG_COMMIT]
    assert pipe.bench.snapshot().digest != frame.digest()


def test_after_a_restart_no_difference_is_sent():
    display, pipe = open_display()
    display.present(random_frame(display))
    frame = display.frame(keep=True)
    frame.draw([(3, 3, 3)], "lime")
    pipe.bench.power_cycle()
    display.present(frame)
    assert_shows(pipe, frame)
    pipe.bench.power_cycle()
    display.present(frame, wait=False)
    display.flush()
    assert_shows(pipe, frame)


def test_what_another_has_shown_is_read_back():
    first, pipe = open_display()
    shown = random_frame(first)
    first.present(shown)
    display, _ = open_display(pipe)
    frame = display.frame(keep=True)
    assert (frame.array() == shown.array()).all()
    frame.draw([(3, 3, 3)], "lime")
    flags = flags_sent(pipe)
    display.present(frame)
    assert_shows(pipe, frame)
    assert flags == [spec.DATA_FLAG_COMMIT]


@pytest.mark.parametrize("features", [frozenset(), frozenset({"digest"}), frozenset({"read"})])
def test_what_is_not_known_is_not_made_up(features):
    display, pipe = open_display(features=features)
    if "read" not in features:
        with pytest.raises(vd.IncompatibleDevice, match="not known what is on display") as caught:
            display.frame(keep=True)
        assert "whole frame first" in caught.value.hint
    frame = random_frame(display)
    display.present(frame)
    if features:
        assert (display.frame(keep=True).array() == frame.array()).all()
    else:
        with pytest.raises(vd.IncompatibleDevice, match="not known"):
            display.frame(keep=True)
    display.present(frame)
    assert_shows(pipe, frame)


def test_a_difference_that_fails_is_followed_by_the_full_frame():
    display, pipe = open_display()
    display.present(random_frame(display))
    pipe.device.memory.front.put(7, b"\x01\x02\x03")  # and nobody has noticed
    frame = display.frame(keep=True)
    frame.draw([(3, 3, 3)], "lime")
    display.present(frame)
    assert_shows(pipe, frame)
    assert display.present(frame).digest == frame.digest()


def test_a_palette_needs_a_device_that_takes_one():
    display, _ = open_display(pixel_format="index8", features=frozenset({"diff", "digest"}))
    palette = display.frame().palette
    with pytest.raises(vd.IncompatibleDevice, match="no palette"):
        display.frame(palette=palette)
    display.present(display.frame())
    palette[1] = 77
    with pytest.raises(vd.LocalProtocolError, match="palette of its own"):
        display.present(vd.Frame(GRID, "index8", palette=palette))
    with pytest.raises(ValueError, match="keeps its palette"):
        display.frame(keep=True, palette=palette)


def test_a_palette_of_its_own():
    features = frozenset({"palette", "read", "digest"})
    display, pipe = open_display(pixel_format="index8", features=features)
    frame = display.frame()
    assert frame.draw([(x, 1, 2) for x in range(17)], ["#123456", "#abcdef"]).exact_color
    display.present(frame)
    assert_shows(pipe, frame)
    flags = flags_sent(pipe)
    kept = display.frame(keep=True)
    assert (kept.rgb() == frame.rgb()).all()
    assert kept.draw([(3, 4, 1)], "#777777").exact_color
    assert display.present(kept).digest == kept.digest()
    assert flags == [spec.DATA_FLAG_COMMIT]
    given = display.frame(palette=kept.palette)
    given.set(kept.array())
    display.present(given)
    other, _ = open_display(pipe)
    assert other.frame(keep=True).draw([(0, 0, 0)], "#010203").exact_color
    assert other.clear().digest == 0
