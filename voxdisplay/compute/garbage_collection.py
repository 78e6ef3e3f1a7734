"""Pause of the garbage collector while many objects are made. Must not know what they are."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


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
