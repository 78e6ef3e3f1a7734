"""Waiting for several descriptors at once, whatever their numbers.

``select.select`` waits to the microsecond, which a paced line needs, and refuses descriptors above
1023, which a process with many open files has. For those, ``select.poll`` is used: its timeouts
are whole milliseconds, rounded up.
"""

import select
import socket
from collections.abc import Iterable
from typing import Final, TypeAlias, TypeVar

Waitable: TypeAlias = int | socket.socket
R = TypeVar("R", bound=Waitable)
W = TypeVar("W", bound=Waitable)

_SELECT_LIMIT: Final = 1024  # FD_SETSIZE, the same on all systems that have poll


def wait_ready(
    readers: Iterable[R], writers: Iterable[W] = (), timeout_s: float | None = None
) -> tuple[list[R], list[W]]:
    """Wait until a descriptor can be read or written.

    A descriptor whose other end is closed counts as ready: the call that follows fails.

    Parameters
    ----------
    readers, writers
        Descriptors or sockets to be read, and to be written.
    timeout_s
        Longest wait in seconds; None: for ever.

    Returns
    -------
    readable, writable
        Those of `readers` and `writers` that are ready; none after the timeout.
    """
    readers, writers = list(readers), list(writers)
    numbers = [*map(_number, readers), *map(_number, writers)]
    if max(numbers, default=0) < _SELECT_LIMIT or not hasattr(select, "poll"):
        readable, writable, _ = select.select(readers, writers, [], timeout_s)
        return readable, writable
    poll = select.poll()
    for number in set(numbers):
        events = (number in map(_number, readers)) * select.POLLIN
        poll.register(number, events | (number in map(_number, writers)) * select.POLLOUT)
    ready = dict(poll.poll(None if timeout_s is None else max(timeout_s, 0.0) * 1000))
    return (
        [each for each in readers if ready.get(_number(each), 0) & ~select.POLLOUT],
        [each for each in writers if ready.get(_number(each), 0) & ~select.POLLIN],
    )


def _number(waitable: Waitable) -> int:
    return waitable if isinstance(waitable, int) else waitable.fileno()
