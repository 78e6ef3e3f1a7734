"""Scenes as shows: frames by number, each a function of the scene and the number alone.

Must not know displays or players.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from voxdisplay.scene.voxelized_items import Kept, draw_items, voxelize_items

if TYPE_CHECKING:
    from voxdisplay.frame import Frame
    from voxdisplay.scene.item import PartSpan, SceneItem


class Moment(Protocol):
    """Items that a scene shows at one time."""

    @property
    def items(self) -> tuple[SceneItem, ...]:
        """Items in drawing order."""

    @property
    def spans(self) -> tuple[PartSpan, ...]:
        """Which of them are shown in part."""


class FrameSource(Protocol):
    """A scene, still or moving."""

    @property
    def duration(self) -> float: ...  # noqa: D102 - see `SceneShow`
    @property
    def fps(self) -> float: ...  # noqa: D102
    @property
    def loop(self) -> bool: ...  # noqa: D102
    @property
    def frame_count(self) -> int: ...  # noqa: D102

    def at_frame(self, number: int) -> Moment:
        """Return what it shows in a frame."""


class SceneShow:
    """A scene as frames of one grid and pixel format.

    Items that are the same in successive frames are voxelised once.

    Parameters
    ----------
    scene : FrameSource
        Fitted to the grid.
    blank : Frame
        A blank frame: copies of it are drawn on.

    """

    def __init__(self, scene: FrameSource, blank: Frame) -> None:
        self.scene = scene
        self._blank = blank
        self._kept: Kept = {}

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_kept": {}}

    def __repr__(self) -> str:
        return f"<SceneShow of {self.scene!r}>"

    @property
    def duration(self) -> float:
        """Seconds that it lasts; 0 for a still scene."""
        return self.scene.duration

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.scene.fps

    @property
    def loop(self) -> bool:
        """True if it is meant to start again at its end."""
        return self.scene.loop

    @property
    def frame_count(self) -> int:
        """Number of frames; 1 for a still scene."""
        return self.scene.frame_count

    def frame(self, number: int) -> Frame:
        """Return a frame.

        Parameters
        ----------
        number : int
            From 0 to ``frame_count - 1``.

        Raises
        ------
        SceneError
            If a value is wrong at that time, or an object cannot be drawn.

        """
        scene = self.scene.at_frame(number)
        frame = self._blank.copy()
        whole = voxelize_items(scene.items, frame.grid, kept=self._kept)
        _, self._kept = draw_items(frame, scene.items, whole, scene.spans, self._kept)
        return frame
