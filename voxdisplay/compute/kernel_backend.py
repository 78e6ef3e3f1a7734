"""Kernel backend: dispatch of array functions to numpy or to compiled kernels (extra `fast`).

A function decorated by `with_kernel` has a compiled kernel of its name, with the same parameters
and results to the last bit, in the module ``kernels`` of its package. Kernels need numba, which
takes longer to import than most scenes to draw, and some seconds to compile on first use after an
installation: they are used only if numba is installed, and once the work outweighs loading them.
Must not know what the functions do.
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

# Number of curve samples from which on kernels are loaded: each saves 0.25 to 0.45 microseconds,
# and loading takes about a second.
BREAK_EVEN_SAMPLES = 3_000_000


class _State:
    """State of the process: whether kernels are used, and the samples computed without them."""

    use: bool | None = None  # None: not decided yet
    done = 0.0


def enable_if_worthwhile(samples: int, ahead: float = 1) -> None:
    """Enable the kernels if the work outweighs loading them.

    Parameters
    ----------
    samples : int
        Samples of curves in the work to come. They are added to those already computed without
        kernels.
    ahead : float
        Factor from these samples to all that are expected.

    """
    if _State.use is None:
        if _State.done + samples * ahead > BREAK_EVEN_SAMPLES:
            _State.use = _numba_works()
        _State.done += samples


def set_enabled(choice: bool | None) -> bool | None:
    """Set whether kernels are used, None to decide by the work; return the previous setting."""
    before, _State.use = _State.use, choice
    return before


def enabled() -> bool:
    """Return whether kernels are in use."""
    return bool(_State.use)


def _numba_works() -> bool:
    try:
        import_module("numba")
    except ImportError:  # not installed, or at odds with this numpy
        return False
    return True


def with_kernel(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """Decorate a function that has a compiled kernel of its name."""
    package = function.__module__.rpartition(".")[0]
    compiled: Callable[Given, Result] | None = None

    @wraps(function)
    def dispatch(*args: Given.args, **named: Given.kwargs) -> Result:
        nonlocal compiled
        if not _State.use:
            return function(*args, **named)
        if compiled is None:  # compiled now, or loaded from the cache
            with deferred_interrupts():
                compiled = getattr(import_module(f"{package}.kernels"), function.__name__)
                return compiled(*args, **named)
        return compiled(*args, **named)

    return dispatch


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Defer SIGINT to the end of the block: the compiler loses one that comes half-way.

    Other threads than the main one are never interrupted by Python and need nothing.
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

    The cache is invalidated by changes of the kernel's own file alone: constants of other modules
    would be compiled in, and have to be arguments.
    """
    from numba import njit  # noqa: PLC0415 - an extra, and slow

    # As numpy: no fastmath, and division by 0 is infinite. Without the global interpreter lock, for
    # `voxdisplay.compute.parallel`.
    try:
        kernel: Kernel = njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no writable cache directory
        kernel = njit(nogil=True, error_model="numpy")(function)
    return kernel
