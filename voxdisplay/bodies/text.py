"""Text as a body: letters in a plane, flat or extruded."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from voxdisplay.argument_checks import choice, number, wrong_kind
from voxdisplay.bodies.body import Fill, check_fill
from voxdisplay.bodies.geometry import TriangleMesh
from voxdisplay.bodies.glyphs import MAX_CHARACTERS, Glyphs, choose_font, lacking_error
from voxdisplay.bodies.mesh import TriangulatedBody
from voxdisplay.bodies.outline_triangulation import Region, triangulate
from voxdisplay.curves import arguments
from voxdisplay.curves.arguments import ArgumentError
from voxdisplay.curves.polyline import Polyline
from voxdisplay.errors import BodyError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from voxdisplay.compute.array_types import Floats, Ints

_MAX_LINES = 1000
_CLOSE = 0.02  # voxels by which outlines may be off
_FINE = 2000  # and parts of a capital's height
_MAX_SIZE = 1e9
# Shares of a line's ends in the place that is at `at`; the left end is where the pen begins.
_SHARES = {"left": (0.0, 0.0), "center": (0.5, 0.5), "right": (0.0, 1.0)}

Align = Literal["left", "center", "right"]


class Text(TriangulatedBody):
    """Letters of a font.

    Parameters
    ----------
    text : str
        One or more lines. Any script that the font has; lines of mixed direction are ordered.
    at : (3,) array
        Left end of the first line's baseline, in voxels; its middle or right end by ``align``.
    height : float
        Height of a capital letter, in voxels.
    direction : (3,) array
        Where a line runs to.
    up : (3,) array
        Where the letters' upper ends point to; only its part across `direction` counts.
    font : bytes or path, optional
        A TrueType or OpenType font. Default: that of the extra, or one of the system.
    depth : float, optional
        Thickness of the letters, away from the reader. Default: flat.
    align : {"left", "center", "right"}
        Which place of each line is at ``at``; the last two by what of it can be seen.
    fill : {"shell", "solid"}
        With a depth: whether the letters are hollow. Flat ones are filled always.

    Raises
    ------
    BodyError
        If there is no font, it is none, or it lacks characters.
    MissingExtra
        Without HarfBuzz.

    """

    def __init__(
        self,
        text: str,
        at: ArrayLike,
        height: float,
        *,
        direction: ArrayLike = (1, 0, 0),
        up: ArrayLike = (0, 0, 1),
        font: bytes | str | os.PathLike[str] | None = None,
        depth: float | None = None,
        align: Align = "left",
        fill: Fill = "shell",
    ) -> None:
        if not isinstance(text, str):
            raise wrong_kind("text", "a text", text)
        lines = text.expandtabs(4).splitlines()
        if not text.strip():
            raise ArgumentError("text", "has no letters")
        if len(text) > MAX_CHARACTERS or len(lines) > _MAX_LINES:
            raise ArgumentError("text", f"has more than {MAX_CHARACTERS} letters or too many lines")
        start = arguments.vector("at", at)
        size = _positive("height", height)
        thickness = None if depth is None else _positive("depth", depth)
        choice("align", align, tuple(_SHARES))
        shares = _SHARES[align]
        frame = _frame(arguments.vector("direction", direction), arguments.vector("up", up))
        letters = "".join(lines)
        glyphs = choose_font(letters) if font is None else _font(font)
        if glyphs.lacking(letters):
            raise lacking_error(glyphs, letters)
        scale = size / glyphs.cap_height
        tolerance = min(_CLOSE / scale, glyphs.cap_height / _FINE)
        self._outlines = []
        regions: dict[int, Region] = {}
        parts = []
        for row, line in enumerate(lines):
            placed = glyphs.set_line(line, tolerance)
            left = float(np.dot(shares, _ends(placed)))
            drop = row * glyphs.line_height
            for outlines, x, y in placed:
                place = np.array([x - left, y - drop])
                self._outlines += [outline + place for outline in outlines]
                if id(outlines) not in regions:
                    regions[id(outlines)] = triangulate(outlines)
                parts.append((regions[id(outlines)], place))
        meshes = [_prism(region, place, thickness, scale) for region, place in parts]
        if not sum(len(faces) for _, faces in meshes):
            raise BodyError(f"the text {text[:20]!r} shows nothing in {glyphs.name}")
        starts = np.cumsum([0, *(len(points) for points, _ in meshes)])
        points = np.concatenate([points for points, _ in meshes])
        faces = np.concatenate(
            [faces + first for (_, faces), first in zip(meshes, starts, strict=False)]
        )
        self._frame = frame, start, scale
        # Flat letters enclose nothing.
        inside = check_fill(fill) if thickness is not None else "shell"
        sheet = thickness is None
        super().__init__(TriangleMesh(points @ frame + start, faces, is_sheet=sheet), inside)
        self._arguments = {
            "text": text,
            "at": start,
            "height": size,
            "direction": frame[0],
            "up": frame[1],
            "font": glyphs.name,
            "depth": thickness,
            "align": align,
            "fill": self.fill,
        }

    def outlines(self) -> tuple[Polyline, ...]:
        """Return the outlines of the letters' fronts, as closed curves."""
        frame, start, scale = self._frame
        return tuple(
            Polyline(np.concatenate((outline, outline[:1])) * scale @ frame[:2] + start)
            for outline in self._outlines
        )


def _ends(placed: list[tuple[list[Floats], float, float]]) -> tuple[float, float]:
    """Return the left and the right end of what can be seen of a line, in units of the font."""
    across = [outline[:, 0] + x for outlines, x, _ in placed for outline in outlines]
    if not across:
        return 0.0, 0.0
    return min(float(each.min()) for each in across), max(float(each.max()) for each in across)


def _positive(name: str, value: float) -> float:
    found = number(name, value)
    if not 0 < found < _MAX_SIZE:
        raise ArgumentError(name, f"is above 0 voxels, and below {_MAX_SIZE:g}; not {found:g}")
    return found


def _frame(direction: Floats, up: Floats) -> Floats:
    """Return the directions of the line, of the letters' upper ends, and to the reader: rows."""
    length = float(np.linalg.norm(direction))
    if not 0 < length < np.inf:
        raise ArgumentError("direction", "has no length")
    along = direction / length
    across = up - (up @ along) * along
    width = float(np.linalg.norm(across))
    if not width > 1e-9 * float(np.linalg.norm(up)):
        raise ArgumentError("up", "points along `direction`")
    return np.stack((along, across / width, np.cross(along, across / width)))


def _font(font: bytes | str | os.PathLike[str]) -> Glyphs:
    if isinstance(font, bytes):
        return Glyphs("the font", font)
    if not isinstance(font, str | os.PathLike):
        raise wrong_kind("font", "bytes or a path", font)
    path = Path(font)
    try:
        return Glyphs(path.name, path.read_bytes())
    except (OSError, ValueError) as error:
        if isinstance(error, BodyError):
            raise
        what = (error.strerror if isinstance(error, OSError) else None) or error
        raise BodyError(f"the font {str(font)[:200]!r} cannot be read: {what}") from None


def _prism(region: Region, place: Floats, depth: float | None, scale: float) -> tuple[Floats, Ints]:
    """Return vertices and faces of a region, flat or extruded away from the reader."""
    count = len(region.points)
    front = np.column_stack(((region.points + place) * scale, np.zeros(count)))
    if depth is None:
        return front, region.triangles
    back = front - np.array([0, 0, depth])
    start, end = region.boundary.T
    walls = np.concatenate(
        [np.column_stack(each) for each in ((end, start, start + count),
                                            (end, start + count, end + count))]
    )  # fmt: skip
    faces = np.concatenate((region.triangles, region.triangles[:, ::-1] + count, walls))
    return np.concatenate((front, back)), faces
