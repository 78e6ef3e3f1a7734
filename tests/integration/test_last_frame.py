"""Last frame of a program that waits for none, and how a display ends, on real ptys."""

import json
import signal
import subprocess
import sys
import warnings

import numpy as np
import pytest
from carriers import eventually
from conftest import DEADLINE_S, ROOT
from memory_pipe import assert_shows, open_display, random_frame
from pluggable_pty import noise_frame
from virtual_time_device import VirtualTimeDevice

import voxdisplay as vd


@pytest.mark.parametrize("count", [1, 2, 20])
def test_the_last_of_some_frames_is_shown_when_the_block_ends(emulator, tmp_path, count):
    dump = tmp_path / "front.npy"
    port = emulator("--pty", "--size", "17x9x5", "--format", "index8", "--dump", dump).port
    with vd.open(port) as display:
        for seed in range(count):
            frame = noise_frame(display, seed)
            display.present(frame, wait=False)
    eventually(dump.exists, "a frame")
    eventually(lambda: np.array_equal(np.load(dump), frame.array()), "the last frame")


def test_a_frame_that_changed_after_it_was_handed_over_is_shown_as_it_was():
    display, pipe = open_display()
    frame = random_frame(display)
    before = frame.copy()
    with display:
        display.present(frame, wait=False)
        frame.draw([(0, 0, 0)], "red")
    assert_shows(pipe, before)


@pytest.mark.parametrize("how", ["exception", "flush=False"])
def test_a_frame_may_be_dropped(how):
    display, pipe = open_display(refresh=1000)
    first, last = random_frame(display, 1), random_frame(display, 2)
    display.present(first)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        display.present(last, wait=False)
        if how == "exception":
            display.__exit__(ZeroDivisionError, ZeroDivisionError(), None)
        else:
            display.close(flush=False)
    assert pipe.closed == 1
    assert_shows(pipe, first)


@pytest.mark.parametrize("error", [GeneratorExit(), SystemExit(0), SystemExit("done")])
def test_the_end_of_a_generator_or_program_shows_the_last_frame(error):
    display, pipe = open_display()
    display.present(random_frame(display, 1))
    last = random_frame(display, 2)
    display.present(last, wait=False)
    display.__exit__(type(error), error, None)
    assert pipe.closed == 1
    assert_shows(pipe, last)


def test_a_frame_that_nobody_waited_for_is_verified_when_it_is_displayed():
    display, _ = open_display()
    display.present(random_frame(display, 1))
    frame = random_frame(display, 2)
    display.present(frame, wait=False)
    assert np.array_equal(display.verify(frame), frame.array())


def test_closing_without_frames_sends_nothing():
    display, pipe = open_display()
    display.present(random_frame(display))
    before = display.counters.wire_bytes
    display.close()
    assert display.counters.wire_bytes == before
    assert pipe.closed == 1


def test_a_frame_that_is_not_shown_in_time_is_a_warning():
    display, pipe = open_display()
    display.present(random_frame(display), wait=False)
    pipe.device.tick = lambda: None  # its refresh never comes
    with pytest.warns(RuntimeWarning, match="last frame was not shown .* longer than 0.5 s"):
        display.close(flush_timeout_s=0.5)
    assert pipe.closed == 1


def test_a_frame_that_cannot_be_shown_is_a_note_and_the_port_is_free(plug):
    notes = []
    display = vd.open(str(plug.plug().path), note=notes.append)
    plug.hold()
    display.present(noise_frame(display, 1), wait=False)
    plug.unplug()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        display.close()
    assert len(notes) == 1
    assert "the last frame was not shown before" in notes[0]
    assert "is gone" in notes[0]


def test_the_last_frame_of_a_device_that_comes_back(plug):
    with vd.open(str(plug.plug().path), reconnect_s=20) as display:
        display.present(noise_frame(display, 1))
        plug.unplug()
        frame = noise_frame(display, 2)
        plug.device.power_cycle()
        plug.plug()
        display.present(frame, wait=False)
    assert plug.snapshot().pixels == frame.array().tobytes()


def test_a_refused_frame_is_not_waited_for():
    display, pipe = open_display()
    display._connection.link.present([b"\x07"])
    with pytest.raises(vd.DeviceError):
        display.flush()
    display.close()
    assert pipe.closed == 1


# -- dark at the end, on a slow line


@pytest.fixture
def large_scene(tmp_path):
    """A scene of some 20 seconds at 9600 Bd."""
    corners = np.random.default_rng(1).integers(0, 64, (400, 3)).tolist()
    path = tmp_path / "large.json"
    path.write_text(json.dumps({"type": "polyline", "points": corners}), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "portions", "rate"),
    [("SIGINT", 1, 9600), ("SIGTERM", 4, 9600), ("SIGTERM", 2, 2400)],
)
def test_dark_after_a_signal_in_mid_push_on_a_slow_line(
    emulator, tmp_path, large_scene, name, portions, rate
):
    """HELLO waits behind all that is on the line: that takes longer than a device may be silent."""
    dump, capture = tmp_path / "front.npy", tmp_path / "capture"
    port = emulator("--pty", "--baud", rate, "--size", "64x64x64", "--dump", dump).port
    with vd.open(port) as display:  # something is lit before
        frame = display.frame()
        frame.draw([(1, 2, 3)], "red")
        display.present(frame)
    eventually(lambda: dump.exists() and np.load(dump).any(), "a lit voxel")
    command = [sys.executable, "-m", "voxdisplay", "push", str(large_scene), "--port", port]
    command += ["--on-exit", "blank", "--capture", str(capture)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT) as push:
        eventually(capture.exists, "a capture")
        eventually(
            lambda: capture.read_text(encoding="utf-8").count('"device"') > portions, "packets"
        )
        push.send_signal(getattr(signal, name))
        _, text = push.communicate(timeout=DEADLINE_S)
    assert "the display is dark" in text
    assert push.returncode in (130, 143)
    eventually(lambda: not np.load(dump).any(), "darkness")


@pytest.mark.parametrize("rate", [600, 1200, 2400])
def test_dark_behind_a_pipe_of_unknown_rate_before_any_answer_to_a_frame(rate):
    """How slow the line is, the handshake has shown."""
    device = VirtualTimeDevice(baud=rate, grid=(64, 64, 64))
    display = vd.open(device, clock=device.clock)
    corners = np.random.default_rng(1).integers(0, 64, (400, 3))
    frame = display.frame()
    frame.draw(vd.Polyline(corners), "red")
    display.present(frame, wait=False)
    assert display.counters.packets > 0
    assert device.bench.counters().swaps == 0
    display.close(blank=True)
    assert device.bench.counters().swaps == 1
    assert not any(device.bench.snapshot().pixels)
