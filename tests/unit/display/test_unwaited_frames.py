"""Loops that present without waiting: pacing, counts, deadlines; all in virtual time."""

import gc
import itertools
import signal

import numpy as np
import pytest
from memory_pipe import assert_shows, open_display, random_frame
from virtual_time_device import VirtualTimeDevice

import voxdisplay as vd
from voxdisplay.display.playback_counts import PlaybackMeter

SIZE = (16, 16, 16)


def paced_display(baud=115_200, refresh=60_000, **config):
    device = VirtualTimeDevice(baud=baud, grid=SIZE, refresh=refresh, **config)
    return vd.open(device, clock=device.clock), device


def moving_frame(display, number, voxels=40):
    frame = display.frame()
    steps = np.arange(voxels)
    frame.draw(np.stack((steps % 16, (steps + number) % 16, steps // 16 + number % 8), axis=1))
    return frame


def sleep(device, seconds):
    """Let time pass in which nobody looks at the port."""
    until_s = device.clock() + seconds
    while device.clock() < until_s:
        device._now = min(device._now + 0.001, until_s)
        device._wire.next_event_s()  # takes what has come by now


@pytest.mark.parametrize("baud", [115_200, 1_000_000, 12_000_000, 0])
@pytest.mark.parametrize("refresh", [60_000, 0])
def test_a_plain_loop_that_sleeps_shows_every_frame_that_the_line_carries(baud, refresh):
    display, device = paced_display(baud, refresh)
    swaps = device.bench.counters().swaps
    with display:
        for number in range(60):
            display.present(moving_frame(display, number), wait=False)
            sleep(device, 1 / 30)
        display.flush()
        assert device.bench.counters().swaps - swaps == 60
        counts = display.playback
        assert (counts.presented, counts.shown, counts.dropped) == (60, 60, 0)
        assert counts.wrong == 0


def test_the_clock_yields_times_by_number_and_turns_the_link():
    display, device = paced_display()
    with display:
        times = []
        for frame_time in display.clock(fps=30, seconds=3):
            times.append((frame_time, device.clock()))
            display.present(moving_frame(display, len(times)), wait=False)
        assert [time for time, _ in times] == [number / 30 for number in range(90)]
        began_s = times[0][1]
        assert [real - began_s for _, real in times] == pytest.approx(
            [t for t, _ in times], abs=1e-3
        )
        assert device.clock() - began_s == pytest.approx(3.0, abs=1e-3)
        counts = display.playback
        assert (counts.presented, counts.shown, counts.dropped) == (90, 90, 0)
        assert counts.fps == pytest.approx(30, rel=0.02)
        assert len(counts.intervals_s) == 89
        assert sum(counts.intervals_s) == pytest.approx(89 / 30, rel=0.02)


def test_a_slow_line_drops_frames_and_is_never_behind():
    display, device = paced_display(baud=9600)
    with display:
        for _ in display.clock(fps=30, seconds=3):
            last = random_frame(display, int(device.clock() * 1000), density=0.1)
            display.present(last, wait=False)
            assert display._connection.link.backlog <= 2
        display.flush()
        counts = display.playback
        assert counts.presented == 90 == counts.shown + counts.dropped
        assert 2 < counts.shown < 30
        assert device.bench.snapshot().pixels == last.array().tobytes()


def test_a_late_caller_gets_the_newest_time_that_is_due():
    display, device = paced_display()
    with display:
        clock = display.clock(fps=10, seconds=2)
        assert next(clock) == 0.0
        sleep(device, 0.15)
        assert next(clock) == 0.1
        sleep(device, 0.5)
        assert next(clock) == 0.6
        assert list(clock) == [number / 10 for number in range(7, 20)]


def test_the_clock_does_not_drift_in_an_hour():
    display, device = paced_display(baud=0)
    with display:
        began_s = device.clock()
        *_, last = display.clock(fps=2.997, seconds=3600)
        assert last == 10_789 / 2.997
        assert device.clock() - began_s == pytest.approx(3600, abs=1e-3)


def test_each_clock_counts_anew():
    display, _ = paced_display(refresh=1000)
    with display:
        display.present(moving_frame(display, 0), wait=False)
        display.flush()
        display.present(moving_frame(display, 1), wait=False)
        display.present(moving_frame(display, 2), wait=False)
        assert display.playback.presented == 3
        assert display.playback.shown == 1
        next(display.clock(fps=30))
        assert display.playback.presented == 2, "those on their way"
        display.flush()
        assert display.playback.shown + display.playback.dropped == 2


def test_waiting_for_a_moment_in_the_past_serves_the_link_once():
    display, device = paced_display()
    with display:
        display.present(moving_frame(display, 0), wait=False)
        sleep(device, 0.1)
        display.wait_until(device.clock() - 1)
        assert display.playback.shown == 1


@pytest.mark.parametrize("fps", [0, -1, float("nan"), float("inf"), "30"])
def test_a_clock_refuses_a_rate_that_is_none_at_once(fps):
    display, _ = paced_display()
    with display, pytest.raises((TypeError, ValueError), match="fps"):
        display.clock(fps=fps)


@pytest.mark.parametrize("when", [float("nan"), float("inf"), None])
def test_a_moment_is_a_finite_number(when):
    display, _ = paced_display()
    with display, pytest.raises((TypeError, ValueError), match="when"):
        display.wait_until(when)


def test_flushing_has_a_deadline():
    display, pipe = open_display()
    display.present(random_frame(display), wait=False)
    tick, pipe.device.tick = pipe.device.tick, lambda: None  # its refresh does not come
    with pytest.raises(vd.TransportTimeout, match=r"not shown within 0\.5 s"):
        display.flush(0.5)
    pipe.device.tick = tick
    display.flush(0.5)
    display.close()


def test_an_error_in_the_middle_of_a_loop_reaches_the_caller():
    display, pipe = open_display()

    def unplug():
        raise vd.TransportClosed("unplugged")

    def loop():
        for number, _ in enumerate(display.clock(fps=30)):
            display.present(random_frame(display, number), wait=False)
            if number == 3:
                pipe.before_read = unplug

    with pytest.raises(vd.TransportClosed):
        loop()
    display.close(flush=False)


def test_an_interrupt_while_waiting_reaches_the_caller_and_the_display_goes_on():
    display, pipe = open_display()

    def interrupt():
        pipe.before_read = lambda: None
        raise KeyboardInterrupt

    frame = random_frame(display)
    clock = display.clock(fps=30)
    next(clock)
    display.present(frame, wait=False)
    pipe.before_read = interrupt
    with pytest.raises(KeyboardInterrupt):
        next(clock)
    display.flush()
    assert_shows(pipe, frame)


# -- counts


def test_a_report_names_the_last_of_several_frames():
    meter = PlaybackMeter()
    for _ in range(4):
        meter.note_presented()
    meter.note_shown(1, 10.0)
    meter.note_shown(0, 10.5)
    meter.note_shown(2, 11.0)
    meter.note_dropped()
    reading = meter.reading()
    assert (reading.presented, reading.shown, reading.dropped) == (4, 3, 1)
    assert reading.intervals_s == (0.5, 0.5)
    assert reading.fps == 2.0


def test_intervals_are_bounded_in_memory():
    meter = PlaybackMeter()
    for number in range(5000):
        meter.note_shown(1, number / 10)
    assert len(meter.reading().intervals_s) == 1000
    assert meter.reading().fps == pytest.approx(10)
    assert PlaybackMeter().reading().fps == 0.0


def test_frames_of_lost_reports_count_and_refused_ones_are_dropped():
    display, pipe = open_display(refresh=0)
    frames = [random_frame(display, seed, 0.01) for seed in range(3)]
    pipe.answers = lambda _data: b""
    for frame in frames[:2]:
        display.present(frame, wait=False)
    pipe.answers = lambda data: data
    display.flush()
    assert (display.playback.shown, display.playback.dropped) == (2, 0)
    frames[2].copy = lambda: frames[2]
    frames[2].iter_payloads = lambda *_device: iter([[b"\xe0\x00"]])
    display.present(frames[2], wait=False)
    with pytest.raises(vd.DeviceError):
        display.flush()
    assert display.playback.dropped == 1
    display.close()


# -- the end, in the middle of a call


def close_when(pipe, display, moment, **how):
    """Close the display from a signal handler, at the n-th read from now on."""
    counter = itertools.count()

    def handler(_number, _frame):
        display.close(**how)

    def before_read():
        if next(counter) == moment:
            signal.raise_signal(signal.SIGUSR1)

    before = signal.signal(signal.SIGUSR1, handler)
    pipe.before_read = before_read
    return before


class ClosablePipe:
    """Raises after it was closed, as all real ones do."""

    def __init__(self, pipe):
        self._pipe, self.port, self.closed = pipe, pipe.port, False

    def _check(self):
        if self.closed:
            raise vd.TransportClosed(f"{self.port} is gone: the port is closed")

    def read(self, timeout_s):
        self._pipe.before_read()
        self._check()
        before, self._pipe.before_read = self._pipe.before_read, lambda: None
        try:
            return self._pipe.read(timeout_s)
        finally:
            self._pipe.before_read = before

    def write(self, data, timeout_s):
        self._check()
        self._pipe.write(data, timeout_s)

    def close(self):
        self.closed = True


@pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="signals of POSIX")
@pytest.mark.parametrize("moment", [0, 1, 2])
@pytest.mark.parametrize("how", [{}, {"flush": False}])
@pytest.mark.parametrize("unwaited", [False, True])
def test_a_signal_handler_that_closes_the_display_is_named_by_the_interrupted_call(
    moment, how, unwaited
):
    first, pipe = open_display(refresh=1000)
    first.close()
    notes = []
    display = vd.open(ClosablePipe(pipe), clock=lambda: pipe.now, note=notes.append)
    frame = random_frame(display)

    def present():
        display.present(frame, wait=not unwaited)
        display.flush()

    before = close_when(pipe, display, moment, **how)
    try:
        with pytest.raises(vd.LocalProtocolError, match=r"closed by .* a signal handler"):
            present()
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert [("middle of another call" in note) for note in notes] == [True] * (unwaited and not how)


def test_a_display_that_is_lost_with_a_frame_is_a_resource_warning():
    display, pipe = open_display()
    display.present(random_frame(display), wait=False)
    pipe.device.tick = lambda: None
    with pytest.warns(ResourceWarning, match="last frame was not shown: pipe: was never closed"):
        del display


def test_a_display_that_is_lost_without_a_frame_is_none():
    display, _ = open_display()
    display.present(random_frame(display))
    del display
    gc.collect()
    with pytest.raises(AttributeError):
        vd.Display(object())
    gc.collect()
