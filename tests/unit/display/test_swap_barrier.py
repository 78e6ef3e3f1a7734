"""The barrier at which parts wait until all hold a frame."""

import threading

import pytest

from voxdisplay.display.swap_barrier import SwapBarrier
from voxdisplay.display.tick_phase import TickPhase
from voxdisplay.errors import LocalProtocolError


class Part:
    is_present, is_cancelled, tick_phase = True, False, None


def nothing():
    pass


def started(barrier, member, commit=nothing):
    """A thread that waits, and whether it has passed."""
    passed = threading.Event()

    def wait():
        barrier.wait(member, commit)
        passed.set()

    threading.Thread(target=wait, daemon=True).start()
    return passed


def test_it_opens_when_the_last_arrives():
    parts = [Part(), Part(), Part()]
    barrier = SwapBarrier(parts)
    first, second = started(barrier, parts[0]), started(barrier, parts[1])
    assert not first.wait(0.1)
    assert not second.is_set()
    barrier.wait(parts[2], nothing)
    assert first.wait(10)
    assert second.wait(10)


def test_one_that_leaves_or_goes_away_is_not_waited_for():
    parts = [Part(), Part(), Part()]
    barrier = SwapBarrier(parts)
    first = started(barrier, parts[0])
    barrier.leave(parts[1])
    assert not first.wait(0.1)
    parts[2].is_present = False
    assert first.wait(10)
    barrier.wait(parts[2], nothing)  # comes late, and passes


def test_one_that_was_no_member_passes_with_the_others():
    member, late = Part(), Part()
    barrier = SwapBarrier([member])
    passed = started(barrier, late)
    assert not passed.wait(0.1)
    barrier.wait(member, nothing)
    assert passed.wait(10)


def test_one_that_is_cancelled_waits_no_longer():
    member, other = Part(), Part()
    member.is_cancelled = True
    with pytest.raises(LocalProtocolError, match="closed"):
        SwapBarrier([member, other]).wait(member, nothing)


def test_the_last_one_sends_all_commits_and_none_is_sent_twice():
    sent = []
    parts = [Part(), Part(), Part()]
    barrier = SwapBarrier(parts)

    def commit(number):
        return lambda: sent.append((number, threading.current_thread()))

    others = [started(barrier, parts[number], commit(number)) for number in (0, 1)]
    while len(barrier._arrived) < 2:
        assert not any(other.is_set() for other in others)
    barrier.wait(parts[2], commit(2))
    assert all(other.wait(10) for other in others)
    barrier.wait(Part(), commit(3))  # comes late
    assert {number for number, _ in sent} == {0, 1, 2, 3}
    assert len(sent) == 4
    assert len({thread for _, thread in sent}) == 1


def test_one_that_is_cancelled_has_no_commit_sent():
    sent = []
    member, other = Part(), Part()
    barrier = SwapBarrier([member, other])
    member.is_cancelled = True
    with pytest.raises(LocalProtocolError, match="closed"):
        barrier.wait(member, lambda: sent.append("member"))
    barrier.wait(other, lambda: sent.append("other"))
    assert sent == ["other"]


def test_commits_wait_for_a_tick_that_would_come_between_them():
    now = [0.0]

    def sleep(seconds):
        now[0] += seconds

    parts = [Part(), Part()]
    for part, tick_s in zip(parts, (1.0, 1.03), strict=True):
        part.tick_phase = TickPhase(10)
        part.tick_phase.note_commit(tick_s - 0.01)
        part.tick_phase.note_swap(tick_s)
    now[0] = 1.0995
    sent = []
    barrier = SwapBarrier(parts, lambda: now[0], sleep)
    first = started(barrier, parts[0], lambda: sent.append(now[0]))
    barrier.wait(parts[1], lambda: sent.append(now[0]))
    assert first.wait(10)
    assert sent == [pytest.approx(1.1), pytest.approx(1.1)]
    # They count: the next reports are held against them.
    parts[0].tick_phase.note_swap(1.1001)
    assert parts[0].tick_phase.next_tick(1.15) == pytest.approx(1.2001)
