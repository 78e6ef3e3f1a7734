"""Pause of the garbage collector while many objects are made. Must not know what they are."""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Part = TypeVar("Part")


@contextmanager
def garbage_collection_paused() -> Iterator[None]:
    """Pause the garbage collector while many objects are made that all stay.

    It would go through all of them again and again. If it is off, it stays off.
    """
    if not gc.isenabled():
        yield
        return
    try:
        gc.disable()  # in here: an interrupt may come as soon as that is done
        yield
    finally:
        gc.enable()


def collecting_between(parts: Iterable[Part]) -> Iterator[Part]:
    """Yield parts; the garbage collector is paused while each is made and used, not in between.

    Then it looks at the objects of one part, and not again and again at all there are.
    """
    ahead = iter(parts)
    while True:
        with garbage_collection_paused():
            try:
                part = next(ahead)
            except StopIteration:
                return
            yield part
            del part
