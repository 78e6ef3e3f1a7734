"""Fair re-entrant lock: order of the threads that wait for it."""

import threading

import pytest
from carriers import WAIT_S, eventually

from voxdisplay.display.fair_lock import FairLock


def start(target):
    thread = threading.Thread(target=target, daemon=True)
    thread.start()
    return thread


def test_who_releases_it_does_not_overtake_who_waits():
    lock, order = FairLock(), []

    def wait():
        with lock:
            order.append("waited")

    for _ in range(50):
        order.clear()
        lock.acquire()
        waiter = start(wait)
        eventually(lock._next.locked, "a thread that waits")
        lock.release()
        with lock:
            order.append("again")
        waiter.join(WAIT_S)
        assert order == ["waited", "again"]


def test_a_thread_that_has_it_gets_it_again_while_another_waits():
    lock = FairLock()
    with lock:
        waiter = start(lambda: lock.acquire() and lock.release())
        eventually(lock._next.locked, "a thread that waits")
        with lock:
            assert lock.acquire(0.0)
            lock.release()
        assert waiter.is_alive(), "it is released as often as it was acquired"
    waiter.join(WAIT_S)
    assert not waiter.is_alive()


@pytest.mark.parametrize("timeout_s", [0.0, 0.05])
def test_who_waits_too_long_does_not_get_it(timeout_s):
    lock, results = FairLock(), []
    with lock:
        for _ in range(2):
            waiter = start(lambda: results.append(lock.acquire(timeout_s)))
            waiter.join(WAIT_S)
    assert results == [False, False]
    assert lock.acquire(0.0)


def test_an_error_inside_releases_it():
    lock = FairLock()
    with pytest.raises(ZeroDivisionError), lock:
        raise ZeroDivisionError
    results = []
    start(lambda: results.append(lock.acquire(0.0))).join(WAIT_S)
    assert results == [True]
