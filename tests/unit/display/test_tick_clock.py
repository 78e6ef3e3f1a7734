"""Refresh ticks as a clock: ticks taken, missed, drifting; a device that is overloaded."""

import itertools

import pytest

from voxdisplay.display.tick_clock import TickClock

REFRESH = 60.0


def run(clock, seconds, *, refresh=REFRESH, late_s=0.002, start=0, tolerance=1.0):
    """Start swaps ahead of a device that shows one on each tick; return the ticks taken."""
    taken, waiting = [], []
    for real in range(start, start + int(seconds * refresh)):
        now = 5.0 + real / refresh
        while len(waiting) < 2:
            waiting.append(clock.take(now, waiting[0] if waiting else None))
            taken.append(waiting[-1])
        clock.note_swap(waiting.pop(0), now + late_s, tolerance)
    return taken


def test_each_swap_takes_a_tick():
    clock = TickClock(REFRESH)
    taken = run(clock, 20)
    assert taken == list(range(len(taken)))
    assert not clock.is_overloaded


@pytest.mark.parametrize("drift", [-0.002, 0.002])
def test_a_refresh_that_drifts_is_followed_within_a_tick(drift):
    clock = TickClock(REFRESH)
    taken = run(clock, 60, refresh=REFRESH * (1 + drift))
    steps = {after - before for before, after in itertools.pairwise(taken)}
    assert steps == ({1, 0} if drift > 0 else {1, 2})
    assert taken[-1] == pytest.approx(60 * REFRESH, abs=3)
    assert not clock.is_overloaded


def test_a_device_without_a_frame_has_missed_ticks():
    clock = TickClock(REFRESH)
    run(clock, 1)
    now = 5.0 + 1.0 + 10 / REFRESH
    assert clock.take(now, None) == pytest.approx(71, abs=1)


def test_a_swap_that_is_long_overdue_means_missed_ticks():
    clock = TickClock(REFRESH)
    run(clock, 1)
    before = clock.next
    assert clock.take(5.0 + 1.0, clock.next - 1) == before
    assert clock.take(5.0 + 1.5, before) > before + 25


def test_a_tick_that_was_taken_may_be_put_back():
    clock = TickClock(REFRESH)
    assert clock.take(1.0, None) == 0
    clock.put_back()
    assert clock.take(1.0, None) == 0


def test_a_line_that_misses_every_tick_is_overloaded():
    clock = TickClock(REFRESH)
    run(clock, 1)
    for number in range(20):
        clock.take(10.0 + number / 6, None)
    assert clock.is_overloaded


@pytest.mark.parametrize(("refresh", "ahead"), [(1, 2), (24, 2), (60, 6), (50, 5), (240, 8)])
def test_a_tenth_of_a_second_is_started_ahead(refresh, ahead):
    assert TickClock(refresh).ahead == ahead
