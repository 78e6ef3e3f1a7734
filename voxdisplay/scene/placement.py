"""Affine maps of scenes: transforms of objects and fitting to a grid.

Must not know scene files but the steps of a transform.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.bodies import Body
from voxdisplay.curves import Transformed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.curves import Curve
    from voxdisplay.scene.evaluation_context import EvaluationContext
    from voxdisplay.scene.values import TransformStep

_FLAT = 1e-12  # ratio of the least to the greatest stretch at which a body has no inside left


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """The affine map of points p to ``matrix @ p + offset``.

    Attributes
    ----------
    matrix : (3, 3) float64 array
    offset : (3,) float64 array
        In voxels.

    """

    matrix: Floats
    offset: Floats

    @classmethod
    def scaling(cls, factor: float, offset: Floats) -> Placement:
        """Return the map that scales by the same factor along all axes, then moves."""
        return cls(np.diag((factor,) * 3), offset)

    def after(self, inner: Placement | None) -> Placement:
        """Return the map that applies another one first."""
        if inner is None:
            return self
        return Placement(self.matrix @ inner.matrix, self.matrix @ inner.offset + self.offset)

    def inverse(self) -> Placement | None:
        """Return the inverse map; None if there is none."""
        if self.flattens:
            return None
        matrix: Floats = np.linalg.inv(self.matrix).astype(np.float64)
        return Placement(matrix, -matrix @ self.offset)

    @property
    def flattens(self) -> bool:
        """True if it makes a body flat."""
        stretch = np.linalg.svd(self.matrix, compute_uv=False)
        return bool(stretch[2] <= _FLAT * stretch[0])

    def points(self, points: Floats) -> Floats:
        """Return the images of points, (n, 3): (n, 3)."""
        return np.asarray(points @ self.matrix.T + self.offset)

    def of_curve(self, curve: Curve) -> Curve:
        """Return the image of a curve."""
        whole: Placement = self
        if isinstance(curve, Transformed):
            whole = self.after(Placement(curve.matrix, curve.offset))
            curve = curve.curve
        factor = whole.matrix[0, 0]
        if factor > 0 and (whole.matrix == np.diag((factor,) * 3)).all():
            return Transformed(curve, float(factor), whole.offset)
        return Transformed(curve, whole.matrix, whole.offset)

    def of_body(self, body: Body) -> Body | None:
        """Return the image of a body; None if nothing is left of it."""
        return None if self.flattens else body.transformed(self.matrix, self.offset)


def placed(shape: Curve | Body, placement: Placement | None) -> Curve | Body | None:
    """Return the image of a curve or body; None if nothing is left of it."""
    if placement is None:
        return shape
    return placement.of_body(shape) if isinstance(shape, Body) else placement.of_curve(shape)


def transform_placement(
    steps: Sequence[TransformStep], context: EvaluationContext
) -> Placement | None:
    """Return the map of a transform's steps, in order; None without a step.

    Raises
    ------
    SceneError, CurveError
        If a number is wrong, or a step is not one of rotate, scale and translate.

    """
    whole: Placement | None = None
    for i, step in enumerate(steps):
        whole = _step_placement(step, f"transform[{i}]", context).after(whole)
    return whole


def _step_placement(step: TransformStep, key: str, context: EvaluationContext) -> Placement:
    given = [name for name in ("rotate", "scale", "translate") if getattr(step, name) is not None]
    if len(given) != 1:
        found = f"both {' and '.join(map(repr, given))}" if given else "none of them"
        problem = f"a step has one of 'rotate', 'scale' and 'translate', not {found}"
        raise context.error(key, problem, hint="write several steps: [{...}, {...}]")
    if step.translate is not None:
        for name in ("angle", "about"):
            if getattr(step, name) is not None:
                raise context.error(f"{key}.{name}", f"{name!r} has no meaning beside 'translate'")
        return Placement(np.eye(3), context.numbers(f"{key}.translate", step.translate))
    about = np.zeros(3) if step.about is None else context.numbers(f"{key}.about", step.about)
    if step.rotate is not None:
        if step.angle is None:
            hint = 'in radians, such as "90*deg"'
            raise context.error(key, "the key 'angle' is missing beside 'rotate'", hint=hint)
        axis = context.numbers(f"{key}.rotate", step.rotate)
        matrix = _rotation(axis, context.number(f"{key}.angle", step.angle), key, context)
    else:
        if step.angle is not None:
            raise context.error(f"{key}.angle", "'angle' belongs to 'rotate'")
        assert step.scale is not None  # noqa: S101 - see above
        if isinstance(step.scale, list):
            matrix = np.diag(context.numbers(f"{key}.scale", step.scale))
        else:
            matrix = np.diag((context.number(f"{key}.scale", step.scale),) * 3)
    return Placement(matrix, about - matrix @ about)


def _rotation(axis: Floats, angle: float, key: str, context: EvaluationContext) -> Floats:
    """Return the matrix that turns by an angle about an axis (Rodrigues' formula)."""
    length = np.abs(axis).max()
    if not length:
        raise context.error(f"{key}.rotate", "the axis has no direction: [0, 0, 0]")
    x, y, z = axis / length / np.linalg.norm(axis / length)
    # Quarter turns are exact: sin(pi) in float64 is not 0.
    quarters = angle / (np.pi / 2)
    if abs(quarters - round(quarters)) < 1e-12 and abs(quarters) < 1e6:
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    else:
        cos, sin = float(np.cos(angle)), float(np.sin(angle))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    direction = np.array([x, y, z])
    matrix = cos * np.eye(3) + sin * cross + (1 - cos) * np.outer(direction, direction)
    return np.asarray(matrix + 0.0, dtype=np.float64)
