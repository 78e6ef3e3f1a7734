"""Point of view from which a scene is best seen.

Must not know what is seen from there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from voxdisplay.errors import SceneError

if TYPE_CHECKING:
    from voxdisplay.scene.evaluation_context import EvaluationContext
    from voxdisplay.scene.objects import View

MAX_YAW_DEG, MAX_PITCH_DEG = 360.0, 90.0
MIN_ZOOM, MAX_ZOOM = 0.3, 2.5


class BestView(NamedTuple):
    """A point of view.

    Attributes
    ----------
    yaw_deg, pitch_deg : float
        As of `voxdisplay preview --view-angle`: 0, 0 is from the front; a greater pitch looks from
        above.
    zoom : float
        Above 1 is nearer.

    """

    yaw_deg: float
    pitch_deg: float
    zoom: float


def best_view(view: View, context: EvaluationContext) -> BestView:
    """Return the point of view that a scene file names; raise SceneError if it is none."""
    yaw, pitch = context.numbers("angle", view.angle).tolist()
    found = BestView(yaw, pitch, context.number("zoom", view.zoom))
    limits = (
        ("angle[0]", yaw, -MAX_YAW_DEG, MAX_YAW_DEG),
        ("angle[1]", pitch, -MAX_PITCH_DEG, MAX_PITCH_DEG),
        ("zoom", found.zoom, MIN_ZOOM, MAX_ZOOM),
    )
    for key, value, low, high in limits:
        if not low <= value <= high:
            problem = f"must be {low:g} to {high:g}, not {value:g}"
            raise SceneError(problem, path=f"{context.path}.{key}")
    return found
