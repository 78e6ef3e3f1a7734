"""Groups of objects of one type whose numbers are read in columns, one row for each object.

Must not know object types.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.curves import Curve
    from voxdisplay.scene.scene_object import SceneObject

MIN_COLUMN = 8
"""Fewer objects of a type are built alone."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Objects of one type that have equally many numbers.

    Attributes
    ----------
    indices : list of int
        The objects' places in the scene.
    objects : list of SceneObject
    rows : list of tuple of str or float
        The numbers of each.
    is_plain : bool
        True if no number is an expression.

    """

    indices: list[int]
    objects: list[SceneObject]
    rows: list[tuple[str | float, ...]]
    is_plain: bool

    def build(self, table: Floats) -> dict[int, Curve]:
        """Return the curves of the numbers, (n, k), by the objects' places.

        Those of which a number is wrong are left out.
        """
        shapes = type(self.objects[0]).build_columns(table, self.objects)
        pairs = zip(self.indices, shapes, strict=True)
        return {index: shape for index, shape in pairs if shape is not None}


def columns_of(objects: Sequence[tuple[int, SceneObject]]) -> list[Columns]:
    """Return the objects that can be read in columns, with their places in the scene."""
    groups: dict[tuple[type, int, bool], Columns] = {}
    for index, scene_object in objects:
        row = scene_object.column_numbers if scene_object.is_simple else None
        if row is not None:
            key = type(scene_object), len(row), set(map(type, row)) == {float}
            if key not in groups:
                groups[key] = Columns([], [], [], is_plain=key[2])
            group = groups[key]
            group.indices.append(index)
            group.objects.append(scene_object)
            group.rows.append(row)
    return [group for group in groups.values() if len(group.rows) >= MIN_COLUMN]
