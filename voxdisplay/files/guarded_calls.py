"""Calls into libraries that read files: what they raise becomes an error that names the file."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from voxdisplay.errors import BodyError, MissingExtra


def guarded(name: str, what: str, call: Callable[[], Any]) -> Any:
    """Return what a call into a library returns; whatever it raises becomes a `BodyError`.

    Warnings of the library are not shown: what matters is checked here.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    what : str
        What the library reads, for errors: ``"the header"``.
    call : callable
        Takes no arguments.

    """
    try:
        # Users may have told numpy to raise.
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            return call()
    except (BodyError, MissingExtra):
        raise
    except Exception as error:  # noqa: BLE001 - libraries raise anything for damaged files
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise BodyError(f"{name}: {what} cannot be read: {reason}") from None
