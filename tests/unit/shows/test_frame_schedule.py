"""Timelines: which frame is due when, and positions of a player."""

import itertools
import math

import pytest

import voxdisplay as vd
from voxdisplay.shows.frame_schedule import FrameSchedule, Segment
from voxdisplay.shows.play_clock import PlayClock
from voxdisplay.shows.show import EncodedShow, Show, ShowSource


class Numbers:
    """A show of which only the numbers matter."""

    loop = False

    def __init__(self, fps=30.0, frame_count=90):
        self.fps, self.frame_count = fps, frame_count
        self.duration = frame_count / fps

    def frame(self, number):
        frame = vd.Frame((3, 5, 7))
        frame.draw([(number % 3, 0, 0)])
        return frame


def line(*segments, turns=1, **options):
    return FrameSchedule([Segment(*each) for each in segments], turns, **options)


def test_a_plain_class_is_a_show():
    assert isinstance(Numbers(), Show)
    assert not isinstance(Numbers(), EncodedShow | ShowSource)
    assert not isinstance(vd.Frame((3, 5, 7)), Show)


@pytest.mark.parametrize("fps", [24, 25, 29.97, 30, 60, 0.3, 1000])
def test_each_frame_is_found_by_its_time_and_by_its_number(fps):
    schedule = line((Numbers(fps, 100),))
    assert schedule.frames == 100
    assert schedule.duration_s == pytest.approx(100 / fps)
    for number in range(100):
        slot = schedule.slot(number)
        assert (slot.ordinal, slot.number) == (number, number)
        assert slot.begins_s == pytest.approx(number / fps)
        assert slot.ends_s == pytest.approx((number + 1) / fps)
        for time_s in (number / fps, (number + 0.5) / fps, (number + 0.999) / fps):
            assert schedule.slot_at(time_s) == slot
    assert schedule.slot(100) is schedule.slot(-1) is None
    assert schedule.slot_at(100 / fps) is schedule.slot_at(-0.1) is None


@pytest.mark.parametrize(
    ("fps", "refresh", "cadence"), [(24, 60, [3, 2]), (30, 60, [2]), (25, 50, [2]), (60, 60, [1])]
)
def test_the_frames_of_ticks_have_a_regular_cadence(fps, refresh, cadence):
    schedule = line((Numbers(fps, fps * 7),), turns=0)
    numbers = [schedule.slot_at(tick / refresh).ordinal for tick in range(refresh * 60)]
    assert numbers == [tick * fps // refresh for tick in range(refresh * 60)]
    changes = [k for k in range(1, len(numbers)) if numbers[k] != numbers[k - 1]]
    gaps = [after - before for before, after in itertools.pairwise(changes)]
    first = cadence.index(gaps[0])
    assert gaps == [cadence[(first + k) % len(cadence)] for k in range(len(gaps))]


def test_an_hour_of_turns_does_not_drift():
    schedule = line((Numbers(29.97, 90),), turns=0)
    last = None
    for turn in (0, 1, 1000, 1_000_000):
        slot = schedule.slot(turn * 90 + 7)
        assert slot.number == 7
        assert slot.begins_s == pytest.approx((turn * 90 + 7) / 29.97, rel=1e-14)
        assert schedule.slot_at(slot.begins_s + 1e-6) == slot
        assert slot != last
        last = slot
    assert schedule.duration_s == math.inf
    assert schedule.frames is None


def test_parts_speeds_and_turns():
    show = Numbers(10, 50)
    schedule = line((show, 1.0, 2.5), (show, 0.05, 0.35, 0.5), turns=2)
    assert schedule.turn_s == pytest.approx(1.5 + 0.6)
    assert schedule.frames == 2 * (15 + 4)
    numbers = [schedule.slot(ordinal).number for ordinal in range(19)]
    assert numbers == [*range(10, 25), 0, 1, 2, 3]
    for before, after in zip(range(37), range(1, 38), strict=True):
        assert schedule.slot(before).ends_s == pytest.approx(schedule.slot(after).begins_s)
        middle_s = (schedule.slot(before).begins_s + schedule.slot(before).ends_s) / 2
        assert schedule.slot_at(middle_s) == schedule.slot(before)
    assert schedule.slot(37).ends_s == pytest.approx(schedule.duration_s)
    assert schedule.repeated(0).duration_s == math.inf


def test_a_shuffled_turn_is_always_the_same_and_holds_every_show():
    shows = [(Numbers(10, count),) for count in range(1, 9)]
    schedule = line(*shows, turns=0, shuffle=True)
    turns = [
        [schedule.slot(36 * turn + at).segment for at in range(36)] for turn in (0, 1, 2, 1, 0)
    ]
    assert turns[0] == turns[4]
    assert turns[1] == turns[3]
    assert turns[0] != turns[1] != turns[2]
    for turn in turns:
        assert sorted(turn) == sorted(turns[0])


def test_a_still_picture_stays_as_long_as_it_should():
    still = Numbers(30, 1)
    assert line((still,)).turn_s == pytest.approx(1 / 30)
    schedule = line((still, 0.0, 5.0), (Numbers(),))
    assert schedule.slot(0).ends_s == 5.0
    assert schedule.slot_at(4.99).segment == 0
    assert schedule.slot_at(5.01).segment == 1


def test_nothing_to_play_is_an_error():
    with pytest.raises(ValueError, match="nothing to play"):
        line((Numbers(), 5.0, 4.0))


def test_positions():
    clock = PlayClock(100.0, 2.0, 0.5)
    assert clock.position(104.0) == 4.0
    assert clock.moment(4.0) == 104.0
    clock.pause(104.0)
    clock.pause(110.0)
    assert clock.position(1000.0) == 4.0
    clock.resume(1000.0)
    clock.resume(1002.0)
    assert clock.position(1004.0) == 6.0
    clock.seek(1.0, 1004.0)
    assert clock.position(1006.0) == 2.0
