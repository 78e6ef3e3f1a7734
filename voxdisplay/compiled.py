"""The choice between array code in numpy and the same code compiled, which takes the extra `fast`.

A function marked as a `twin` has another of its name, with the same parameters and results to the
last bit, in the module ``kernels`` beside it. Those need numba, which takes longer to import than
most scenes to draw, and some seconds to compile them the first time after an installation: they
are taken only if numba is installed, and from when the work is worth it on. What the functions do
is not known here.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import import_module
from importlib.util import find_spec
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Result = TypeVar("Result")

# How many samples of curves make it worth to load the kernels: those that numpy needs as long for.
WORTH = 1_500_000


class _Choice:
    """Whether kernels are in use, and how much was done without."""

    use: bool | None = None if find_spec("numba") else False  # None: not yet
    done = 0


def prepare(samples: int, ahead: float = 1) -> None:
    """Load the kernels if they are worth it, before work on so many samples of curves.

    They are if this, times ``ahead``, what is to come, together with what was done without them
    would have paid for loading them.
    """
    if _Choice.use is None:
        if _Choice.done + samples * ahead > WORTH:
            _Choice.use = True
        _Choice.done += samples


def use(choice: bool | None) -> bool | None:
    """Say whether to use the kernels, None to wait for work; give what was said before."""
    before, _Choice.use = _Choice.use, choice
    return before


def twin(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """Mark a function that has a compiled twin."""
    package = function.__module__.rpartition(".")[0]
    other: Callable[Given, Result] | None = None

    @wraps(function)
    def either(*args: Given.args, **named: Given.kwargs) -> Result:
        nonlocal other
        if not _Choice.use:
            return function(*args, **named)
        other = other or getattr(import_module(f"{package}.kernels"), function.__name__)
        return other(*args, **named)

    return either
