"""Reading of many objects of one type in columns, as far as they are of plain numbers.

Must not know object types.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Protocol, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.curves import Curve


class MayBeThick(Protocol):
    """An object that is shown as a thin curve, or as a tube about it."""

    @property
    def thickness(self) -> str | float | None:
        """Diameter of the tube; None: thin."""


Kind = TypeVar("Kind", bound=MayBeThick)


def curves_in_columns(
    objects: Sequence[Kind],
    numbers_of: Callable[[Kind], tuple[str | float, ...]],
    build: Callable[[Floats, Sequence[Kind]], Sequence[Curve | None]],
) -> list[Curve | None]:
    """Return the curves of thin objects of plain numbers; None for others.

    Parameters
    ----------
    objects : sequence
        Of one type.
    numbers_of : callable
        An object -> all its numbers.
    build : callable
        The numbers, (n, k), of n objects that have k numbers each, and these objects -> their
        curves, None where a number is wrong.

    """
    rows = [numbers_of(each) if each.thickness is None else () for each in objects]
    plain = defaultdict(list)  # indices of objects, by their k
    for i, row in enumerate(rows):
        if set(map(type, row)) == {float}:
            plain[len(row)].append(i)
    found: list[Curve | None] = [None] * len(objects)
    for members in plain.values():
        table = np.array([rows[i] for i in members])
        shapes = build(table, [objects[i] for i in members])
        for i, shape in zip(members, shapes, strict=True):
            found[i] = shape
    return found
