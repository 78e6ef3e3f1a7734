"""Incremental work: long computations as generators that pause, so that a link can be served.

At each yield the caller may do something else; the generator's return value is the result. Must not
know what is computed.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeAlias, TypeVar

Result = TypeVar("Result")
Incremental: TypeAlias = Generator[None, None, Result]


def run_to_end(steps: Incremental[Result]) -> Result:
    """Run incremental work to its end and return its result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: Result = end.value
            return result
