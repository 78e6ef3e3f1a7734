"""Parallel map over threads, in order, on all processors.

numpy and compiled kernels release the global interpreter lock while they work on large arrays,
which is what threads gain by. Must not know what the parts are.
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
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on all systems
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def ordered_map(function: Callable[[Part], Result], parts: Sequence[Part]) -> Iterator[Result]:
    """Yield the results of a function for parts, in their order; raise the first error in it.

    Parameters
    ----------
    function : callable
        Called from several threads at once, and possibly twice for a part. Calls of this function
        within a part run in its own thread.
    parts : sequence
        Each worth some hundred microseconds.

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
        except RuntimeError:  # no thread can start: too many, or the interpreter is ending
            results = map(function, parts)
        yield from results


def _init_worker() -> None:
    _thread.works = True
    np.seterr(all="ignore")  # a caller's np.errstate does not reach worker threads
