"""Independent parts of large work, done on all processors at once.

numpy, and what is compiled, let go of Python's lock while they work on large arrays: that is what
threads gain. What the parts are is not known here.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from typing import TypeVar

import numpy as np

Part = TypeVar("Part")
Result = TypeVar("Result")

_thread = threading.local()


def cpu_count() -> int:
    """Tell how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on all systems
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def ordered_map(function: Callable[[Part], Result], parts: Sequence[Part]) -> Iterator[Result]:
    """Give what a function gives for parts, in their order; the first error in it is raised.

    Within a part nothing is divided any further. A part must be worth some hundred microseconds,
    and the function must bear being called from several threads at once; and twice for a part.
    """
    workers = min(cpu_count(), len(parts))
    if workers < 2 or getattr(_thread, "works", False):
        yield from map(function, parts)
        return
    with ExitStack() as stack:
        try:
            from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415 - most work is small

            pool = stack.enter_context(ThreadPoolExecutor(workers, initializer=_init_worker))
            results = pool.map(function, parts)
        except RuntimeError:  # no thread may begin: there are too many, or the program is ending
            results = map(function, parts)
        yield from results


def _init_worker() -> None:
    _thread.works = True
    np.seterr(all="ignore")  # what a caller has set does not reach its threads
