"""Evaluation context of a scene object: resolves expressions, attaches JSON paths to errors.

Knows params and expressions; it must not know what the numbers are for.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from voxdisplay.curves import arguments
from voxdisplay.errors import CurveError, SceneError
from voxdisplay.expressions.parse import constant, parse

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.expressions.program import Expression
    from voxdisplay.scene.point_table import FilePoints


@contextmanager
def as_scene_error(path: str) -> Iterator[None]:
    """Raise a CurveError of the block as a SceneError at a JSON path."""
    try:
        yield
    except CurveError as error:
        raise _scene_error(error, path) from error


def _scene_error(error: CurveError, path: str) -> SceneError:
    if isinstance(error, arguments.ArgumentError):
        path = f"{path}.{error.argument}"
    return SceneError(str(error), path=path, hint=error.hint)


class EvaluationContext:
    """Evaluation context of one scene object.

    Attributes
    ----------
    path : str
        JSON path of the object.
    names : mapping of str to float
        The scene's params.
    folder : Path or None
        Folder of the files that the object may name; None: it may name none.
    notes : list of str
        Choices made while the object was read, one line each, for people.

    """

    def __init__(self, path: str, names: Mapping[str, float], folder: Path | None) -> None:
        self.path = path
        self.names = names
        self.folder = folder
        self.notes: list[str] = []

    def formula(self, key: str, source: str | float) -> Expression:
        """Return the expression of t that a key has."""
        with as_scene_error(f"{self.path}.{key}"):
            return parse(source, self.names)

    def number(self, key: str, source: str | float) -> float:
        """Return the number that a key has."""
        with as_scene_error(f"{self.path}.{key}"):
            return constant(source, self.names)

    def numbers(self, key: str, sources: Sequence[str | float]) -> Floats:
        """Return a list of n numbers: (n,) float64."""
        # Long lists are of plain numbers: those need neither parser nor path.
        row = [
            source if isinstance(source, float) else self.number(f"{key}[{i}]", source)
            for i, source in enumerate(sources)
        ]
        try:
            return arguments.array(key, row, (None,))
        except CurveError as error:
            raise _scene_error(error, self.path) from error

    def points(self, key: str, rows: Sequence[Sequence[str | float]]) -> Floats:
        """Return n rows of three numbers: (n, 3) float64."""
        table = [
            [
                source if isinstance(source, float) else self.number(f"{key}[{i}][{j}]", source)
                for j, source in enumerate(row)
            ]
            for i, row in enumerate(rows)
        ]
        try:
            return arguments.points(key, table, least=0)
        except CurveError as error:
            raise _scene_error(error, self.path) from error

    def points_from_file(self, key: str, name: str, *, split: bool) -> FilePoints:
        """Read a file of points beside the scene.

        Parameters
        ----------
        key : str
        name : str
            Relative to the scene's folder.
        split : bool
            Whether rows that are not finite separate strands.

        """
        with as_scene_error(f"{self.path}.{key}"):
            if self.folder is None:
                raise CurveError("this scene has no folder, and may name no file")
            # Most scenes name no file, and are drawn sooner without its readers.
            from voxdisplay.scene.points_file import read_points  # noqa: PLC0415

            found = read_points(self.folder, name, split=split)
        if found.note:
            self.notes.append(found.note)
        return found
