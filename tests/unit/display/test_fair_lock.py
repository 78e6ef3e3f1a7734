"""Fair re-entrant lock: order of the threads that wait for it."""

import signal
import threading

import pytest
from carriers import WAIT_S, eventually

from voxdisplay.display.fair_lock import FairLock


def start(target):
    thread = threading.Thread(target=target, daemon=True)
    thread.start()
    return thread


def is_waited_for(lock):
    """Return whether another thread waits for its turn."""
    free = lock._next.acquire(blocking=False)
    if free:
        lock._next.release()
    return not free


def test_who_releases_it_does_not_overtake_who_waits():
    lock, order = FairLock(), []

    def wait():
        with lock:
            order.append("waited")

    for _ in range(50):
        order.clear()
        lock.acquire()
        waiter = start(wait)
        eventually(lambda: is_waited_for(lock), "a thread that waits")
        lock.release()
        with lock:
            order.append("again")
        waiter.join(WAIT_S)
        assert order == ["waited", "again"]


def test_a_thread_that_has_it_gets_it_again_while_another_waits():
    lock = FairLock()
    with lock:
        waiter = start(lambda: lock.acquire() and lock.release())
        eventually(lambda: is_waited_for(lock), "a thread that waits")
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


def test_a_signal_handler_takes_it_while_its_own_thread_waits():
    lock, in_handler, released = FairLock(), [], threading.Event()
    has_it = threading.Event()

    def hold():
        with lock:
            has_it.set()
            released.wait(WAIT_S)

    def handle(*_):
        in_handler.append(lock.acquire(0.0))
        released.set()
        with lock:
            in_handler.append("had it")

    holder = start(hold)
    has_it.wait(WAIT_S)
    before = signal.signal(signal.SIGUSR1, handle)
    main = threading.main_thread().ident
    try:
        killer = start(
            lambda: (
                eventually(lambda: is_waited_for(lock), "a thread that waits"),
                signal.pthread_kill(main, signal.SIGUSR1),
            )
        )
        assert lock.acquire(WAIT_S)
        lock.release()
    finally:
        signal.signal(signal.SIGUSR1, before)
    killer.join(WAIT_S)
    holder.join(WAIT_S)
    assert in_handler == [False, "had it"]
    assert lock.acquire(0.0), "it is free again"
