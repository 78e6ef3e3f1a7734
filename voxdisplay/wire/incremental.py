"""Work that is done in steps, for who must not be away from a line for long.

Such work is a generator: at each yield there is time for something else, and in the end it returns
what was wanted. Nothing here knows what is worked at.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeAlias, TypeVar

Result = TypeVar("Result")
Incremental: TypeAlias = Generator[None, None, Result]


def run_to_end(steps: Incremental[Result]) -> Result:
    """Do all steps; give the result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: Result = end.value
            return result
