"""Evaluation context of a scene object: resolves expressions, attaches JSON paths to errors.

Knows params and expressions; it must not know what the numbers are for.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay.curves import arguments
from voxdisplay.errors import BodyError, CurveError, SceneError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from voxdisplay.bodies import Body
    from voxdisplay.compute.array_types import Floats
    from voxdisplay.expressions.program import Expression
    from voxdisplay.scene.environment import Environment
    from voxdisplay.scene.scene_files import SceneFiles
    from voxdisplay.scene.strands import Strands


@contextmanager
def as_scene_error(path: str) -> Iterator[None]:
    """Raise a CurveError or BodyError of the block as a SceneError at a JSON path."""
    try:
        yield
    except (CurveError, BodyError) as error:
        raise scene_error(error, path) from error


def scene_error(error: CurveError | BodyError, path: str) -> SceneError:
    """Return an error as one at a JSON path."""
    if isinstance(error, arguments.ArgumentError):
        path = f"{path}.{error.argument}"
    return SceneError(str(error), path=path, hint=error.hint)


class EvaluationContext:
    """Evaluation context of one scene object.

    Attributes
    ----------
    path : str
        JSON path of the object.
    environment : Environment
        The values of names.
    files : SceneFiles
        The files that the object may name.
    notes : list of str
        Choices made while the object was read, one line each, for people.
    wanted_columns : tuple of str
        Names that may be columns of its file, by which it is coloured.
    columns : list of mappings of str to (n,) float64 array
        Those that were found, for each of the things it is made of.

    """

    def __init__(self, path: str, environment: Environment, files: SceneFiles) -> None:
        self.path = path
        self.environment = environment
        self.files = files
        self.notes: list[str] = []
        self.wanted_columns: tuple[str, ...] = ()
        self.columns: list[Mapping[str, Floats]] = []

    def error(self, key: str, message: str, *, hint: str | None = None) -> SceneError:
        """Return an error at a key."""
        return SceneError(message, path=f"{self.path}.{key}", hint=hint)

    def object_error(self, message: str, *, hint: str | None = None) -> SceneError:
        """Return an error of the object as a whole."""
        return SceneError(message, path=self.path, hint=hint)

    def formula(
        self, key: str, source: str | float, variables: tuple[str, ...] = ("t",)
    ) -> Expression:
        """Return the expression of some variables that a key has."""
        with as_scene_error(f"{self.path}.{key}"):
            return self.environment.formula(source, variables)

    def number(self, key: str, source: str | float) -> float:
        """Return the number that a key has."""
        try:
            return self.environment.number(source)
        except CurveError as error:
            raise scene_error(error, f"{self.path}.{key}") from error

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
            raise scene_error(error, self.path) from error

    def points(self, key: str, rows: Sequence[Sequence[str | float]]) -> Floats:
        """Return n rows of three numbers: (n, 3) float64."""
        quick = self.environment.table_of(rows)
        if quick is not None:
            return quick
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
            raise scene_error(error, self.path) from error

    def pair(self, key: str, sources: Sequence[str | float]) -> tuple[float, float]:
        """Return two numbers."""
        first, second = self.numbers(key, sources).tolist()
        return first, second

    def file_bytes(self, key: str, name: str) -> bytes:
        """Return what is in a file beside the scene."""
        from voxdisplay.files.contained_files import read_inside  # noqa: PLC0415 - as below

        with as_scene_error(f"{self.path}.{key}"):
            return self.files.once((name,), lambda: read_inside(self._folder(), name))

    def body_from_file(
        self,
        key: str,
        name: str,
        into: Sequence[Sequence[str | float]] | None,
        **options: Any,
    ) -> Body:
        """Read a mesh, volume or voxel model beside the scene, and fit it into a box.

        Parameters
        ----------
        key : str
        name : str
            Relative to the scene's folder.
        into : two corners, optional
            As of `fitted`.
        **options
            Of `voxdisplay.files.loading.load_body`.

        """
        from voxdisplay.files.loading import load_body  # noqa: PLC0415 - as below

        with as_scene_error(f"{self.path}.{key}"):
            made = (name, *map(repr, options.items()))
            found = self.files.once(made, lambda: load_body(name, folder=self._folder(), **options))
        self.notes += [f"{self.path}: {each}" for each in found.notes]
        return self.fitted(found.body, into)

    def fitted(self, body: Body, into: Sequence[Sequence[str | float]] | None) -> Body:
        """Return a body, scaled uniformly and centred in a box.

        Parameters
        ----------
        body : Body
        into : two corners, optional
            None: the scene's volume less a margin of one voxel.

        """
        from voxdisplay.files.loading import fitted  # noqa: PLC0415 - as below

        if into is None:
            corners = np.array([np.ones(3), np.array(self.files.volume(), dtype=np.float64) - 1])
            corners[1] = np.maximum(corners[1], 2.0)
        else:
            corners = np.sort(self.points("into", into), axis=0)
        with as_scene_error(self.path if into is None else f"{self.path}.into"):
            return fitted(body, corners[0].tolist(), corners[1].tolist())[0]

    def _folder(self) -> Path:
        if self.files.folder is None:
            raise CurveError("this scene has no folder, and may name no file")
        return self.files.folder

    def points_from_file(self, key: str, name: str, *, split: bool) -> Strands:
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
            # Most scenes name no file, and are drawn sooner without its readers.
            from voxdisplay.scene.points_file import read_points  # noqa: PLC0415

            folder, wanted = self._folder(), self.wanted_columns
            found = self.files.once(
                (name, split, wanted), lambda: read_points(folder, name, split=split, wanted=wanted)
            )
        if found.note:
            self.notes.append(found.note)
        return found
