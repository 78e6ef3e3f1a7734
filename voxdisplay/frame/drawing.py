"""Result of drawing one object on a frame. Must not know frames."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from voxdisplay.curves.singular_points import SingularPoint


@dataclass(frozen=True, slots=True)
class Drawing:
    """Result of drawing one object.

    Attributes
    ----------
    voxels : int
        Number of its voxels, inside the grid or not.
    clipped : int
        Number of those outside, which are not shown.
    exact_color : bool
        True if the display can show its colours as they are.
    undefined : tuple of SingularPoint
        Parameters at which a curve has no value and is drawn with the limits of both sides.
    jumps : tuple of float
        Parameters at which a curve jumps: nothing is drawn across.
    notes : tuple of str
        What was wrong with a body or left out, for people.

    """

    voxels: int
    clipped: int
    exact_color: bool
    undefined: tuple[SingularPoint, ...] = ()
    jumps: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def sum(cls, drawings: Iterable[Drawing]) -> Drawing:
        """Return the result of drawing several objects."""
        drawings = list(drawings)
        return cls(
            voxels=sum(drawing.voxels for drawing in drawings),
            clipped=sum(drawing.clipped for drawing in drawings),
            exact_color=all(drawing.exact_color for drawing in drawings),
            undefined=tuple(point for drawing in drawings for point in drawing.undefined),
            jumps=tuple(t for drawing in drawings for t in drawing.jumps),
            notes=tuple(note for drawing in drawings for note in drawing.notes),
        )
