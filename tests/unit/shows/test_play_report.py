"""Figures of played shows: quantiles, ticks from reports that came late, bounded memory."""

import random

import pytest

from voxdisplay.shows.play_report import Distribution, PlayMeter, TickEstimator


def test_quantiles():
    values = Distribution()
    assert values.quantile(0.5) == 0.0
    for value in range(1, 101):
        values.add(value)
    assert [values.quantile(share) for share in (0.05, 0.5, 0.95, 1)] == [5, 50, 95, 100]


def test_memory_does_not_grow_with_the_number_of_values():
    values = Distribution()
    chance = random.Random(1)
    for _ in range(100_000):
        values.add(chance.uniform(-20, 400))
    assert len(values._counts) < 3000


def ticks_of(reports, refresh_hz=60.0):
    estimator = TickEstimator(refresh_hz)
    for now, fresh in reports:
        estimator.add(now, fresh=fresh)
    return estimator.counts()


def reports_of(ticks, late_s, refresh_hz=60.0, every=True):
    """Reports of swaps with new frames on some ticks; repeats on the others."""
    out, before = [], 0.0
    for tick in range(max(ticks) + 1):
        if tick in ticks or every:
            before = max(before, 7.0 + tick / refresh_hz + late_s(tick))  # the pipe keeps order
            out.append((before, tick in ticks))
    return out


def test_ticks_of_reports_that_come_in_time():
    ticks = [0, 2, 5, 7, 10, 12]
    for every in (True, False):
        assert ticks_of(reports_of(ticks, lambda _: 0.003, every=every)) == {"2": 3, "3": 2}


def test_a_late_report_is_found_out_by_those_that_follow():
    ticks = list(range(0, 400, 2))
    chance = random.Random(2)

    def late_s(tick):
        return chance.uniform(0, 0.004) + (0.05 if tick % 37 == 5 else 0.0)

    assert ticks_of(reports_of(ticks, late_s)) == {"2": 199}


def test_the_first_report_may_be_late():
    ticks = list(range(0, 400, 2))
    assert ticks_of(reports_of(ticks, lambda tick: 0.012 if tick < 3 else 0.001)) == {"2": 199}


@pytest.mark.parametrize("drift", [-3e-4, 3e-4])
def test_a_refresh_that_is_not_quite_what_was_announced(drift):
    ticks = list(range(0, 20_000, 2))
    found = ticks_of(reports_of(ticks, lambda _: 0.0, refresh_hz=60 * (1 + drift)))
    assert found == {"2": 9999}


def test_a_missed_tick_is_counted():
    ticks = [0, 2, 4, 6, 9, 11, 13]
    assert ticks_of(reports_of(ticks, lambda _: 0.002, every=False)) == {"2": 5, "3": 1}


def test_breaks_make_no_intervals():
    meter = PlayMeter(60.0)
    for number in range(10):
        meter.note_swap(1 + number / 30, 1 + number / 30)
    meter.note_break()
    for number in range(10):
        meter.note_swap(100 + number / 30, 100 + number / 30)
        meter.note_swap(100 + (number + 0.5) / 30, None)
    meter.frames = 25
    report = meter.report(seconds=110.0, wrong=0, repaired=0, wire_bytes=1234)
    assert (report.frames, report.shown, report.dropped) == (25, 20, 5)
    assert report.fps == pytest.approx(30)
    assert report.gap_ms["max"] == 33.3
    assert report.ticks == {"2": 18}
    assert report.late_ms == {"p50": 0.0, "p95": 0.0, "max": 0.0}
    json = report.as_json()
    assert list(json) == [
        "frames", "shown", "dropped", "fps", "late_ms", "gap_ms", "ticks", "wrong", "repaired",
        "wire_bytes", "seconds",
    ]  # fmt: skip
    assert PlayMeter(0.0).report(seconds=1, wrong=0, repaired=0, wire_bytes=0).ticks == {}
