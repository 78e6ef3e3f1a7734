"""Construction of many curves of one class from columns of arguments.

It costs less than to check and convert the arguments of one curve after the other. Must not know a
particular curve.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from voxdisplay.curves import arguments

if TYPE_CHECKING:
    from voxdisplay.compute.array_types import Bools, Floats

Made = TypeVar("Made")


def are_moderate(numbers: Floats) -> Bools:
    """Return where all numbers of a row, of (n, ...), are finite and not too large: (n,)."""
    rows = numbers.reshape(len(numbers), -1)
    return np.asarray((np.abs(rows) <= arguments.MAX_MAGNITUDE).all(axis=1))


def from_columns(kind: type[Made], good: Bools, **columns: Iterable[Any]) -> list[Made | None]:
    """Return n objects of a class with these attributes; its constructor is not called.

    Parameters
    ----------
    kind : type
    good : (n,) bool array
        Where an argument is wrong, there is None in place of the object.
    **columns
        The n values of each attribute.

    """
    names = tuple(columns)
    found: list[Made | None] = []
    for is_good, values in zip(good.tolist(), zip(*columns.values(), strict=True), strict=True):
        if not is_good:
            found.append(None)
            continue
        made = kind.__new__(kind)
        for name, value in zip(names, values, strict=True):
            setattr(made, name, value)
        found.append(made)
    return found
