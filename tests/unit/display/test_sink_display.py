"""Displays that take pictures and answer nothing: what is sent and when, and what is refused."""

import json

import numpy as np
import pytest
from stand_ins import missing_attributes

import voxdisplay as vd
from voxdisplay.display.sink_connection import SinkConnection
from voxdisplay.display.sink_display import SinkDisplay
from voxdisplay.display.sink_operations import SinkOperations, SinkQueue
from voxdisplay.frame.output_transform import OutputTransform
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.orientation import Orientation
from voxdisplay.shows.show import EncodedFrame

GRID = Grid(3, 5, 7)


class Time:
    """A clock that sleeping moves."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        assert seconds > 0
        self.now += seconds


class RecordingSink:
    """A sink that keeps what it is sent, and when."""

    port, protocol, grid, max_fps = "test:", "Test", GRID, 20.0

    def __init__(self, clock):
        self._clock = clock
        self.pictures, self.times, self.closed = [], [], 0
        self.failure = None

    def send(self, rgb):
        if self.failure:
            raise self.failure
        self.pictures.append(rgb.copy())
        self.times.append(round(self._clock() - 100, 6))
        return 2, 330

    def close(self):
        self.closed += 1


@pytest.fixture
def clock():
    return Time()


@pytest.fixture
def sink(clock):
    return RecordingSink(clock)


@pytest.fixture
def shown(sink, clock):
    with SinkDisplay(sink, clock=clock, sleep=clock.sleep) as shown:
        yield shown


def lit(frame, *voxel, color="red"):
    frame.draw(np.array([voxel]), color)
    return frame


def test_a_frame_is_sent_and_its_receipt_proves_nothing(shown, sink):
    frame = lit(shown.frame(), 2, 4, 6, color=(10, 20, 30))
    receipt = shown.present(frame)
    assert sink.pictures[0][6, 4, 2].tolist() == [10, 20, 30]
    assert np.count_nonzero(sink.pictures[0]) == 3
    assert (receipt.frame, receipt.voxels, receipt.packets) == (1, 1, 2)
    assert (receipt.wire_bytes, receipt.retransmitted, receipt.digest) == (330, 0, None)
    assert not shown.answers
    assert shown.digest() is None
    assert shown.counters.wire_bytes == 330


def test_what_it_says_of_itself(shown):
    assert shown.info.grid == GRID
    assert shown.info.format is vd.PixelFormat.RGB888
    assert (shown.info.protocol, shown.info.features) == ("Test", ())
    assert repr(shown) == "<Display test: 'LED cube' 3x5x7 rgb888, 0 frames shown>"


def test_reading_back_is_refused(shown):
    frame = shown.frame()
    for question in (shown.read, lambda: shown.verify(frame), lambda: shown.read(back=True)):
        with pytest.raises(vd.IncompatibleDevice, match="nothing answers on this port"):
            question()


def test_a_frame_that_keeps_begins_as_what_was_sent(shown):
    with pytest.raises(vd.IncompatibleDevice, match="nothing answers"):
        shown.frame(keep=True)
    frame = lit(shown.frame(), 0, 1, 2)
    shown.present(frame)
    assert shown.frame(keep=True) == frame


def test_frames_of_another_kind_are_refused(shown, sink):
    with pytest.raises(vd.LocalProtocolError):
        shown.present(vd.Frame((5, 3, 7)))
    assert not sink.pictures


def test_no_more_frames_are_sent_than_the_rate_allows(shown, sink):
    for _ in range(4):
        shown.present(shown.frame())
    assert sink.times == [0, 0.05, 0.1, 0.15]


def test_of_unwaited_frames_the_newest_is_sent_in_time(shown, sink, clock):
    for number in range(5):
        shown.present(lit(shown.frame(), number % 3, number, 0), wait=False)
    assert sink.times == [0], "the others wait for their turn"
    clock.sleep(0.02)
    shown.poll()
    assert sink.times == [0]
    shown.flush()
    assert sink.times == [0, 0.05]
    assert sink.pictures[1][0, 4, 1].any()
    counts = shown.playback
    assert (counts.presented, counts.shown, counts.dropped) == (5, 2, 3)


def test_a_loop_of_ones_own(shown, sink):
    for _ in shown.clock(fps=10, seconds=0.5):
        shown.present(shown.frame(), wait=False)
    assert sink.times == [0, 0.1, 0.2, 0.3, 0.4]
    assert shown.playback.fps == pytest.approx(10)


def test_late_wake_ups_do_not_add_up(shown, sink, clock):
    for _ in range(3):
        shown.present(shown.frame())
        clock.sleep(0.055)
    assert sink.times == [0, 0.055, 0.11]
    shown.present(shown.frame())
    shown.present(shown.frame())
    assert sink.times[3:] == [0.165, 0.2], "the rate is kept in the mean"


def test_the_last_frame_is_sent_before_it_closes(sink, clock):
    with SinkDisplay(sink, clock=clock, sleep=clock.sleep) as shown:
        shown.present(shown.frame(), wait=False)
        shown.present(lit(shown.frame(), 1, 1, 1), wait=False)
        assert len(sink.pictures) == 1
    assert sink.pictures[-1][1, 1, 1].any()
    assert sink.closed == 1
    with pytest.raises(vd.LocalProtocolError, match="closed"):
        shown.present(vd.Frame(GRID))


def test_closing_dark_drops_what_waits(sink, clock):
    shown = SinkDisplay(sink, clock=clock, sleep=clock.sleep)
    shown.present(lit(shown.frame(), 0, 0, 0), wait=False)
    shown.present(lit(shown.frame(), 1, 1, 1), wait=False)
    shown.close(blank=True)
    assert [picture.any() for picture in sink.pictures] == [True, False]


def test_clear_sends_darkness(shown, sink):
    shown.present(lit(shown.frame(), 0, 0, 0))
    assert shown.clear().digest is None
    assert not sink.pictures[-1].any()


def test_a_lost_receiver_is_an_error(shown, sink):
    sink.failure = vd.TransportClosed("test: is gone")
    for wait in (True, False):
        with pytest.raises(vd.TransportClosed, match="is gone"):
            shown.present(shown.frame(), wait=wait)


def test_closing_notes_a_frame_that_could_not_be_sent(sink, clock):
    notes = []
    with SinkDisplay(sink, note=notes.append, clock=clock, sleep=clock.sleep) as shown:
        shown.present(shown.frame())
        shown.present(shown.frame(), wait=False)
        sink.failure = vd.TransportClosed("test: is gone")
    assert sink.closed == 1
    assert "test: is gone" in notes[0]


def moving(fps=10):
    voxel = {"type": "points", "points": [[1.5, 0.5, "0.5 + 6*time"]], "color": "red"}
    scene = {"size": [3, 5, 7], "duration": 1, "fps": fps, "objects": [voxel]}
    return vd.read_scene(json.dumps(scene))


def test_a_show_is_played(shown, sink):
    report = shown.play(moving())
    assert (report.frames, report.shown, report.dropped) == (10, 10, 0)
    assert (report.wrong, report.repaired, report.ticks) == (0, 0, {})
    assert report.wire_bytes == 3300
    assert sink.times == [round(number / 10, 6) for number in range(10)]
    heights = [np.argwhere(picture)[0][0] for picture in sink.pictures]
    assert heights == [int(0.5 + 6 * number / 10) for number in range(10)]


def test_a_show_faster_than_the_rate_drops_frames(shown, sink):
    report = shown.play(moving(fps=60))
    assert report.frames == 60
    assert report.shown == len(sink.pictures) <= 22
    assert min(np.diff(sink.times)) >= 0.049
    assert report.dropped == 60 - report.shown
    assert report.late_ms["p95"] < 50, "no frame waits for a whole period"
    assert report.fps == pytest.approx(20)


def test_the_observer_may_pause_seek_and_stop(shown, sink):
    positions = []

    def observe(player):
        positions.append(player.position_s)
        if len(positions) == 3:
            player.seek(0.5)
        if player.position_s > 0.8:
            player.stop()

    report = shown.play(moving(), observer=observe)
    assert 2 <= report.shown < 8
    assert len(sink.pictures) == report.shown


def test_frames_that_another_process_has_encoded_are_decoded(shown, sink):
    frame = lit(lit(shown.frame(), 1, 2, 3, color=(1, 2, 3)), 2, 4, 6, color=(7, 8, 9))
    queue = shown._operations.queue
    most, features, _ = queue.encoding_for
    queue.start_unwaited(EncodedFrame(tuple(frame.payloads(most, features)), frame.digest()))
    shown.flush()
    assert np.array_equal(sink.pictures[0], frame.rgb())


# Behind `_check_readable`, which refuses.
ONLY_TO_READ = {"read_page", "read_and_compare"}


def test_the_stand_ins_have_all_that_displays_and_players_use(clock, sink):
    connection = SinkConnection(sink)
    operations = SinkOperations(connection, clock, clock.sleep)
    stand_ins = {
        ("operations", "_operations"): operations,
        ("queue",): operations.queue,
        ("connection", "_connection"): connection,
    }
    assert missing_attributes(stand_ins) <= ONLY_TO_READ


def test_to_a_player_there_are_no_ticks(clock, sink):
    queue = SinkQueue(SinkConnection(sink), clock)
    assert queue.backlog == 0
    assert queue.line_is_free
    assert queue.repeat(3, vd.Frame(GRID)) == 3


def test_a_cube_that_stands_otherwise_is_sent_its_memory(shown, sink):
    shown.set_output(OutputTransform(Orientation.of("z,-x,y"), brightness=0.5))
    assert shown.info.grid == (7, 3, 5)
    frame = lit(shown.frame(), 6, 0, 1, color="white")
    shown.present(frame)
    (picture,) = sink.pictures
    assert picture.shape == (7, 5, 3, 3)
    # The user's x is the memory's z, y its x backwards, z its y.
    assert np.argwhere(picture.any(axis=-1)).tolist() == [[6, 1, 2]]
    assert picture[6, 1, 2].tolist() == [188] * 3
    assert shown.frame(keep=True) == frame


def test_a_cube_has_no_serial_number(shown):
    with pytest.raises(vd.IncompatibleDevice, match="no serial number"):
        shown.set_output(None, serial="A1")
