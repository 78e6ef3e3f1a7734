"""Playing shows: pacing by ticks and by the host, controls, ends; all in virtual time."""

import itertools
import math

import numpy as np
import pytest
from memory_pipe import Pipe
from virtual_time_device import VirtualTimeDevice

import voxdisplay as vd
from voxdisplay.display import player as player_module
from voxdisplay.shows import preparing
from voxdisplay.shows.show import EncodedFrame

SIZE = (16, 16, 16)


class Moving:
    """A show whose frames tell their numbers."""

    loop = False

    def __init__(self, fps, frame_count, voxels=40):
        self.fps, self.frame_count, self._voxels = fps, frame_count, voxels
        self.duration = frame_count / fps

    def frame(self, number):
        frame = vd.Frame(SIZE)
        steps = np.arange(self._voxels)
        frame.draw(np.stack((steps % 16, (steps + number) % 16, steps // 16 % 8), axis=1))
        frame.draw([(number % 16, number // 16 % 16, 15)], "red")
        return frame


@pytest.fixture(autouse=True)
def one_process(monkeypatch):
    """Prepare all frames in this process: time is virtual here, and that of another is not."""
    monkeypatch.setattr(preparing, "_WORKER_SHARE", math.inf)


@pytest.fixture(autouse=True)
def closed_displays():
    """Close the displays of a test, some of which have a frame under way."""
    yield
    while Watched.opened:
        Watched.opened.pop().close(flush=False)


class Watched:
    """A display of virtual time, and the ticks on which its picture changed."""

    opened = []  # noqa: RUF012 - of all of them

    def __init__(self, refresh=60_000, baud=0, **config):
        self.device = VirtualTimeDevice(baud=baud, grid=SIZE, refresh=refresh, **config)
        self.display = vd.open(self.device, clock=self.device.clock)
        self.opened.append(self.display)
        self.changes, self.swaps = [], 0
        self._digest = None
        self._line = self.device._wire._wire if baud else self.device._wire
        self.device.bench._device.on_swap = self._note

    def _note(self):
        self.swaps += 1
        digest = self.device.bench.snapshot().digest
        if digest != self._digest:
            self._digest = digest
            tick = self._line._swap_tick
            self.changes.append((digest, self.device.clock() if tick is None else tick))

    def intervals(self):
        return [after - before for (_, before), (_, after) in itertools.pairwise(self.changes)]


HOLDS = frozenset(("line", "read", "digest", "hold"))


@pytest.mark.parametrize("features", [HOLDS, HOLDS - {"hold"}], ids=["holds", "repeats"])
@pytest.mark.parametrize("baud", [0, 115_200, 12_000_000])
@pytest.mark.parametrize(
    ("fps", "refresh", "allowed"),
    [(30, 60, {2}), (24, 60, {2, 3}), (25, 50, {2}), (60, 60, {1}), (5, 60, {12})],
)
def test_by_the_ticks_of_the_device_every_interval_is_right(fps, refresh, allowed, baud, features):
    watched = Watched(refresh * 1000, baud, features=features)
    show = Moving(fps, 2 * fps)
    report = watched.display.play(show)
    assert [digest for digest, _ in watched.changes] == [
        show.frame(number).digest() for number in range(2 * fps)
    ]
    gaps = watched.intervals()
    assert set(gaps) == allowed
    assert all(a != b for a, b in itertools.pairwise(gaps)) or len(allowed) == 1
    assert (report.frames, report.shown, report.dropped) == (2 * fps, 2 * fps, 0)
    assert report.ticks == {str(n): gaps.count(n) for n in sorted(allowed)}
    if "hold" in features:
        assert watched.swaps == 2 * fps, "a swap for each frame"
    else:
        assert watched.swaps >= 2 * refresh - 3, "a swap on every tick"


@pytest.mark.parametrize("refresh", [0, 60_000])
@pytest.mark.parametrize("baud", [0, 115_200])
def test_by_the_clock_of_the_host_each_frame_has_its_time(refresh, baud):
    watched = Watched(refresh, baud)
    report = watched.display.play(Moving(30, 60), clock="host")
    assert (report.frames, report.shown, report.dropped) == (60, 60, 0)
    assert watched.swaps == 60, "no frames but those of the show"
    assert report.fps == pytest.approx(30, rel=0.02)
    assert report.seconds == pytest.approx(2, abs=0.1)
    assert report.late_ms["max"] <= (17.0 if refresh else 9.0)
    assert report.wire_bytes > 60 * 30
    assert (report.wrong, report.repaired) == (0, 0)


@pytest.mark.parametrize("clock", ["device", "host"])
def test_a_slow_line_drops_frames_and_shows_the_last_one(clock):
    watched = Watched(baud=9600)
    show = Moving(30, 90, voxels=1500)
    report = watched.display.play(show, clock=clock)
    assert report.frames == 90 == report.shown + report.dropped
    assert 3 < report.shown < 45
    assert report.late_ms["max"] < 600
    assert watched.changes[-1][0] == show.frame(89).digest()
    digests = [show.frame(number).digest() for number in range(90)]
    numbers = [digests.index(digest) for digest, _ in watched.changes]
    assert numbers == sorted(numbers)


def test_frames_may_be_delayed_in_place_of_dropped():
    watched = Watched(baud=9600)
    show = Moving(30, 12, voxels=1500)
    report = watched.display.play(show, late="delay")
    assert (report.frames, report.shown, report.dropped) == (12, 12, 0)
    assert len(watched.changes) == 12
    assert report.seconds > 1


@pytest.mark.parametrize("late", ["drop", "delay"])
def test_speed_start_and_until(late):
    watched = Watched()
    show = Moving(10, 40)
    report = watched.display.play(show, speed=2, start=1.0, until=3.0, clock="host", late=late)
    assert [digest for digest, _ in watched.changes] == [
        show.frame(number).digest() for number in range(10, 30)
    ]
    assert report.seconds == pytest.approx(1.0, abs=0.1)
    assert report.fps == pytest.approx(20, rel=0.03)


@pytest.mark.parametrize("clock", ["device", "host"])
def test_an_hour_of_turns_drifts_by_nothing_and_keeps_nothing(clock, monkeypatch):
    monkeypatch.setattr(player_module, "_MAX_WAIT_S", 1.0)
    watched = Watched(refresh=1000)
    sizes = []

    def observe(player):
        queue = watched.display._operations.queue
        if watched.device.clock() - began_s >= 900 * (len(sizes) + 1):
            kept = (player._swaps, queue._unwaited, queue._shown, queue._repeats,
                    player._source._ready, player._meter._ticks._swaps)  # fmt: skip
            sizes.append(sum(map(len, kept)))
            expected = int((watched.device.clock() - began_s) / 2)
            assert abs(player._last.ordinal - expected) <= 2
        if len(sizes) == 4:
            player.stop()

    began_s = watched.device.clock()
    report = watched.display.play(
        Moving(0.5, 3, voxels=2), loop=True, clock=clock, observer=observe
    )
    assert report.seconds == pytest.approx(3600, abs=5)
    assert report.frames == pytest.approx(1800, abs=3)
    assert report.dropped <= 2
    assert report.fps == pytest.approx(0.5, rel=1e-3)
    assert max(sizes) < 80
    watched.display.close()


def test_a_loop_does_not_show_its_first_frame_twice():
    watched = Watched()
    show = Moving(30, 4)
    show.loop = True
    stop_at = 20

    def observe(player):
        if player.shown >= stop_at:
            player.stop()

    watched.display.play(show, observer=observe)
    wanted = [show.frame(number % 4).digest() for number in range(stop_at)]
    assert [digest for digest, _ in watched.changes][:stop_at] == wanted
    assert set(watched.intervals()[: stop_at - 1]) == {2}
    watched.display.close()


@pytest.mark.parametrize("clock", ["device", "host"])
def test_pause_seek_and_stop(clock):
    watched = Watched()
    show = Moving(30, 300)
    digests = [show.frame(number).digest() for number in range(300)]
    done = []

    def observe(player):
        now = watched.device.clock() - began_s
        steps = [
            (1.0, player.pause), (2.0, player.pause), (3.0, lambda: player.seek(5.0)),
            (4.0, player.pause), (4.5, lambda: player.seek(-100.0)), (5.0, player.stop),
        ]  # fmt: skip
        if now >= steps[len(done)][0]:
            steps[len(done)][1]()
            done.append(player.paused)

    began_s = watched.device.clock()
    report = watched.display.play(show, clock=clock, observer=observe)
    assert done == [True, False, False, True, True, True]
    numbers = [digests.index(digest) for digest, _ in watched.changes]
    jumps = [(a, b) for a, b in itertools.pairwise(numbers) if not 0 <= b - a <= 2]
    assert len(jumps) == 2
    assert jumps[0][1] - jumps[0][0] == pytest.approx(150, abs=6)
    assert jumps[1][1] == 0, "a seek shows the frame there, although it is paused"
    assert report.shown == pytest.approx(91, abs=8)
    assert report.gap_ms["max"] < 60, "a pause is no gap"
    watched.display.close()


def test_a_seek_beyond_the_end_shows_the_last_frame():
    watched = Watched()
    show = Moving(30, 60)
    report = watched.display.play(
        show, observer=lambda player: player.seek(100.0) if player.shown == 3 else None
    )
    assert watched.changes[-1][0] == show.frame(59).digest()
    assert report.seconds < 1


def test_a_still_picture_a_frame_and_a_scene_are_shown():
    watched = Watched()
    frame = watched.display.frame()
    frame.draw([(1, 2, 3)])
    report = watched.display.play(frame)
    assert (report.frames, report.shown) == (1, 1)
    assert watched.changes[-1][0] == frame.digest()
    scene = vd.read_scene('{"type": "segment", "from": [1, 1, 1], "to": [9, 9, 9]}')
    watched.display.play(scene)
    again = watched.display.frame()
    again.draw(scene)
    assert watched.changes[-1][0] == again.digest()


class Recorded(Moving):
    """A show that is encoded already."""

    def encoded_frame(self, number, max_payload, features):
        frame = self.frame(number)
        return EncodedFrame(tuple(frame.payloads(max_payload, features)), frame.digest())


@pytest.mark.parametrize("clock", ["device", "host"])
def test_encoded_frames_are_sent_as_they_are(clock):
    watched = Watched()
    show = Recorded(30, 30)
    report = watched.display.play(show, clock=clock)
    assert report.shown == 30
    assert watched.changes[-1][0] == show.frame(29).digest()
    assert watched.display._operations.queue.displayed is None
    kept = watched.display.frame(keep=True)
    assert kept.digest() == show.frame(29).digest()


@pytest.mark.parametrize("clock", ["device", "host"])
def test_a_frame_that_is_displayed_wrongly_is_counted_and_repaired(clock):
    watched = Watched()
    note, spoiled = watched.device.bench._device.on_swap, []

    def spoil():
        note()
        if len(watched.changes) == 10 and not spoiled:
            spoiled.append(1)
            watched.device.bench._device.memory.front.put(7, b"\x01\x02\x03")

    watched.device.bench._device.on_swap = spoil
    show = Moving(30, 30)
    report = watched.display.play(show, clock=clock)
    assert (report.wrong, report.repaired) == (1, 1)
    assert report.shown == 30
    assert watched.device.bench.snapshot().digest == show.frame(29).digest()


def test_a_display_that_is_always_wrong_is_an_error():
    watched = Watched()
    memory = watched.device.bench._device.memory
    watched.device.bench._device.on_swap = lambda: memory.front.put(7, b"\x01\x02\x03")
    with pytest.raises(vd.DesyncError):
        watched.display.play(Moving(30, 30))
    watched.display.close(flush=False)


@pytest.mark.parametrize("clock", ["device", "host"])
def test_a_device_that_restarts_goes_on_at_the_right_frame(clock):
    watched = Watched()
    show = Moving(30, 90)
    restarted = []

    def observe(player):
        if player.shown == 30 and not restarted:
            restarted.append(1)
            watched.device.bench.power_cycle()

    report = watched.display.play(show, clock=clock, observer=observe)
    assert report.wrong == 0
    assert report.shown >= 80
    assert watched.device.bench.snapshot().digest == show.frame(89).digest()
    assert report.seconds == pytest.approx(3, abs=0.3)


def test_an_error_of_the_show_or_the_port_reaches_the_caller():
    class Failing(Moving):
        def frame(self, number):
            if number == 7:
                raise vd.CurveError("frame 7 fails")
            return super().frame(number)

    watched = Watched()
    with pytest.raises(vd.CurveError, match="frame 7"):
        watched.display.play(Failing(30, 30))

    def interrupt(player):
        if player.shown == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        watched.display.play(Moving(30, 30), observer=interrupt)
    watched.display.present(Moving(30, 30).frame(5))
    watched.display.close()


def test_a_frame_of_another_grid_is_refused():
    class Other(Moving):
        def frame(self, number):
            return vd.Frame((3, 5, 7 + number))

    watched = Watched()
    with pytest.raises(vd.LocalProtocolError, match="the frame is 3x5x7"):
        watched.display.play(Other(30, 30))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speed": 0}, "speed"),
        ({"speed": "fast"}, "speed"),
        ({"start": -1}, "start"),
        ({"start": 9}, "the show ends at 1 s"),
        ({"until": 0}, "until"),
        ({"clock": "sun"}, "clock"),
        ({"late": "never"}, "late"),
        ({"fit": "best"}, "fit"),
        ({"observer": 3}, "observer"),
        ({"loop": np.zeros(2)}, "loop"),
    ],
)
def test_arguments_are_checked_before_anything_is_sent(options, message):
    pipe = Pipe()
    display = vd.open(pipe, clock=lambda: pipe.now)
    before = display.counters.wire_bytes
    with pytest.raises((TypeError, ValueError), match=message):
        display.play(Moving(30, 30), **options)
    assert display.counters.wire_bytes == before


def test_what_is_no_show_is_refused():
    watched = Watched()
    with pytest.raises(TypeError, match="expected a show, a scene, a playlist or a frame"):
        watched.display.play("spin.json")
