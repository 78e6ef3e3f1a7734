"""The barrier at which parts wait until all hold a frame."""

import threading

import pytest

from voxdisplay.display.swap_barrier import SwapBarrier
from voxdisplay.errors import LocalProtocolError


class Part:
    is_present, is_cancelled = True, False


def started(barrier, member):
    """A thread that waits, and whether it has passed."""
    passed = threading.Event()

    def wait():
        barrier.wait(member)
        passed.set()

    threading.Thread(target=wait, daemon=True).start()
    return passed


def test_it_opens_when_the_last_arrives():
    parts = [Part(), Part(), Part()]
    barrier = SwapBarrier(parts)
    first, second = started(barrier, parts[0]), started(barrier, parts[1])
    assert not first.wait(0.1)
    assert not second.is_set()
    barrier.wait(parts[2])
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
    barrier.wait(parts[2])  # comes late, and passes


def test_one_that_was_no_member_passes_with_the_others():
    member, late = Part(), Part()
    barrier = SwapBarrier([member])
    passed = started(barrier, late)
    assert not passed.wait(0.1)
    barrier.wait(member)
    assert passed.wait(10)


def test_one_that_is_cancelled_waits_no_longer():
    member, other = Part(), Part()
    member.is_cancelled = True
    with pytest.raises(LocalProtocolError, match="closed"):
        SwapBarrier([member, other]).wait(member)
