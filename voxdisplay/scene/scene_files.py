"""Files that a scene names, and the volume that it was composed for. Must not know objects."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from voxdisplay.raster.grid import Grid

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")

DEFAULT_SIZE = Grid(128, 128, 128)
"""Volume of a scene that names none."""


class SceneFiles:
    """Files that a scene names: each is read once.

    Parameters
    ----------
    folder : Path or None
        Where they are; None: it may name none.
    size : Grid or None
        The grid that the scene was composed for.

    Attributes
    ----------
    folder : Path or None
    size : Grid or None
        That grid; the default one as soon as the volume was asked for.

    """

    def __init__(self, folder: Path | None, size: Grid | None) -> None:
        self.folder = folder
        self.size = size
        self._read: dict[tuple[Any, ...], Any] = {}

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_read": {}}

    def volume(self) -> Grid:
        """Return the grid that the scene was composed for, by default 128x128x128."""
        if self.size is None:
            self.size = DEFAULT_SIZE
        return self.size

    def once(self, key: tuple[Any, ...], read: Callable[[], T]) -> T:
        """Return what is read from a file, by the key of how it is read."""
        if key not in self._read:
            self._read[key] = read()
        found: T = self._read[key]
        return found
