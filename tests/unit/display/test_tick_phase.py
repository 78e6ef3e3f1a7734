"""When COMMITs go out to devices that tick by clocks of their own."""

import random

import pytest

from voxdisplay.display.tick_phase import TickPhase, commit_delay

PERIOD_S = 1 / 60


class Device:
    """A device in virtual time: when it ticks, and how long packets to and from it take."""

    def __init__(self, chance):
        self.origin_s = chance.uniform(0, PERIOD_S)
        self.phase = TickPhase(60)

    def swap(self, commit_s, chance):
        """Return when it swaps, and report that, now and then late."""
        self.phase.note_commit(commit_s)
        arrives_s = commit_s + chance.uniform(0.1e-3, 0.3e-3)
        tick_s = arrives_s + (self.origin_s - arrives_s) % PERIOD_S
        late_s = chance.choice([0.2e-3, 0.4e-3, 0.6e-3, 9e-3, 30e-3])
        self.phase.note_swap(tick_s + late_s)
        return tick_s


def skews(count, frames, delay, seed):
    """Return how far swaps are apart, for each frame."""
    chance = random.Random(seed)
    devices = [Device(chance) for _ in range(count)]
    now, found = 100.0, []
    for _ in range(frames):
        now += chance.uniform(0.05, 0.2)
        while wait_s := delay([device.phase for device in devices], now):
            now += wait_s
        swaps = []
        for device in devices:
            now += chance.uniform(0, 0.4e-3)
            swaps.append(device.swap(now, chance))
        found.append(max(swaps) - min(swaps))
    return found


@pytest.mark.parametrize("count", [2, 3, 4])
def test_swaps_are_within_one_tick(count):
    aligned, at_once = (
        [skew for seed in range(8) for skew in skews(count, 100, delay, seed)[20:]]
        for delay in (commit_delay, lambda *_: 0.0)
    )
    assert max(aligned) <= PERIOD_S - 0.5e-3
    assert max(at_once) > PERIOD_S - 0.5e-3


def told(*ticks_s, refresh_hz=10):
    """Return phases of devices that ticked at these times."""
    phases = []
    for tick_s in ticks_s:
        phase = TickPhase(refresh_hz)
        phase.note_commit(tick_s - 0.01)
        phase.note_swap(tick_s)
        phases.append(phase)
    return phases


def test_it_waits_for_a_tick_that_is_about_to_come():
    phases = told(1.0, 1.03)
    assert commit_delay(phases, 1.05) == 0
    assert commit_delay(phases, 1.0995) == pytest.approx(0.0005)
    assert commit_delay(phases, 1.1299) == pytest.approx(0.0001)
    # Two that come shortly one after the other are waited for together.
    phases = told(1.0, 1.002)
    assert commit_delay(phases, 1.0995) == pytest.approx(0.0025)


def test_ticks_that_are_not_known_are_not_waited_for():
    assert commit_delay([*told(1.0), TickPhase(10)], 1.0999) == 0
    assert commit_delay([*told(1.0), *told(1.01, refresh_hz=10.1)], 1.0999) == 0
    assert commit_delay(told(1.0, 1.01), 10.0999) == 0  # clocks have drifted apart since


def test_a_report_that_is_later_than_a_tick_tells_nothing():
    phase = TickPhase(10)
    phase.note_swap(0.5)  # of a swap that nobody asked for
    phase.note_commit(1.0)
    phase.note_swap(1.2)
    assert phase.next_tick(1.3) is None
    phase.note_commit(2.0)
    phase.note_swap(2.08)
    phase.note_commit(3.0)
    phase.note_swap(3.05)
    assert phase.next_tick(3.1) == pytest.approx(3.15)
