"""Where an object stands in a scene file: makes numbers of what it says, and errors of what fails.

Knows params and expressions; does not know what the numbers are for.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from voxdisplay.curves import arguments
from voxdisplay.errors import CurveError, SceneError
from voxdisplay.expressions.parse import constant, parse
from voxdisplay.scene.points_file import read_points

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.expressions.program import Expression


@contextmanager
def as_scene_error(path: str) -> Iterator[None]:
    """Turn a CurveError into a SceneError that says where."""
    try:
        yield
    except CurveError as error:
        if isinstance(error, arguments.ArgumentError):
            path = f"{path}.{error.argument}"
        raise SceneError(str(error), path=path, hint=error.hint) from error


class EvaluationContext:
    """The place of one object.

    Parameters
    ----------
    path : str
        Its JSON path.
    names : mapping of str to float
        The scene's params.
    folder : Path or None
        Where the files are that it may name; None when it may not.

    """

    def __init__(self, path: str, names: Mapping[str, float], folder: Path | None) -> None:
        self.path = path
        self.names = names
        self.folder = folder

    def formula(self, key: str, source: str | float) -> Expression:
        """Parse an expression of t."""
        with as_scene_error(f"{self.path}.{key}"):
            return parse(source, self.names)

    def number(self, key: str, source: str | float) -> float:
        """Compute a number."""
        with as_scene_error(f"{self.path}.{key}"):
            return constant(source, self.names)

    def numbers(self, key: str, sources: Sequence[str | float]) -> Floats:
        """Compute a list of n numbers: (n,) float64."""
        # Long lists are of plain numbers, which need no parser and no path each.
        row = [
            source if isinstance(source, float) else self.number(f"{key}[{i}]", source)
            for i, source in enumerate(sources)
        ]
        with as_scene_error(self.path):
            return arguments.array(key, row, (None,))

    def points(self, key: str, rows: Sequence[Sequence[str | float]]) -> Floats:
        """Compute n rows of three numbers: (n, 3) float64."""
        table = [
            [
                source if isinstance(source, float) else self.number(f"{key}[{i}][{j}]", source)
                for j, source in enumerate(row)
            ]
            for i, row in enumerate(rows)
        ]
        with as_scene_error(self.path):
            return arguments.points(key, table, least=0)

    def points_from_file(self, key: str, name: str) -> Floats:
        """Read a file of points beside the scene: (n, 3) float64."""
        with as_scene_error(f"{self.path}.{key}"):
            if self.folder is None:
                raise CurveError("this scene has no folder, and may name no file")
            return read_points(self.folder, name)
