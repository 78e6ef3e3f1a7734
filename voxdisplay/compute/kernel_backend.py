"""The choice between array code in numpy and the same code compiled, which takes the extra `fast`.

A function marked as a `twin` has another of its name, with the same parameters and results to the
last bit, in ``kernels`` beside its module. Those need numba, which takes longer to import than
most scenes to draw, and some seconds to compile them the first time after an installation: they
are taken only if numba is installed, and from when the work is worth it on. What the functions do
is not known here.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from importlib import import_module
from typing import Any, ParamSpec, TypeVar

Given = ParamSpec("Given")
Result = TypeVar("Result")
Kernel = TypeVar("Kernel", bound=Callable[..., Any])

# How many samples of curves make it worth to load the kernels: they save 0.25 to 0.45 microseconds
# for each, and loading them takes about a second.
BREAK_EVEN_SAMPLES = 3_000_000


class _State:
    """Whether kernels are in use, and how much was done without."""

    use: bool | None = None  # not asked yet
    done = 0.0


def enable_if_worthwhile(samples: int, ahead: float = 1) -> None:
    """Load the kernels if they are worth it, before work on so many samples of curves.

    They are if this, times ``ahead``, what is to come, together with what was done without them
    would have paid for loading them.
    """
    if _State.use is None:
        if _State.done + samples * ahead > BREAK_EVEN_SAMPLES:
            _State.use = _numba_works()
        _State.done += samples


def set_enabled(choice: bool | None) -> bool | None:
    """Say whether to use the kernels, None to wait for work; give what was said before."""
    before, _State.use = _State.use, choice
    return before


def enabled() -> bool:
    """Tell whether kernels are in use."""
    return bool(_State.use)


def _numba_works() -> bool:
    try:
        import_module("numba")
    except ImportError:  # not installed, or at odds with this numpy
        return False
    return True


def with_kernel(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """Mark a function that has a compiled twin."""
    package = function.__module__.rpartition(".")[0]
    other: Callable[Given, Result] | None = None

    @wraps(function)
    def either(*args: Given.args, **named: Given.kwargs) -> Result:
        nonlocal other
        if not _State.use:
            return function(*args, **named)
        if other is None:  # it is compiled now, or what is kept of it loaded
            with deferred_interrupts():
                other = getattr(import_module(f"{package}.kernels"), function.__name__)
                return other(*args, **named)
        return other(*args, **named)

    return either


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Keep an interrupt until the end of what is done: the compiler loses it half-way.

    Where none can come there is nothing to do: Python gives them to its main thread only.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came = []
    before = signal.signal(signal.SIGINT, lambda number, _frame: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
    if came:
        signal.raise_signal(signal.SIGINT)


def jit(function: Kernel) -> Kernel:
    """Compile a kernel, once for an installation.

    What is compiled is kept until its own file changes: constants of other modules, which would
    be compiled into it, have to be arguments.
    """
    from numba import njit  # noqa: PLC0415 - an extra, and slow

    # No fastmath, and a division by 0 is infinite: all as in numpy. And without Python's lock, for
    # `voxdisplay.compute.parallel`.
    try:
        kernel: Kernel = njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # there is no place to keep it
        kernel = njit(nogil=True, error_model="numpy")(function)
    return kernel
