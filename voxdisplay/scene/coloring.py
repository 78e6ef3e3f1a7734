"""Colours of voxels: one for all, several spread over them, or a colour map by a value.

Knows voxels and what is known of each; it must not know files or displays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from voxdisplay import voxelization
from voxdisplay.errors import CurveError
from voxdisplay.raster.color import colors_at
from voxdisplay.raster.display_list import Spread

if TYPE_CHECKING:
    from collections.abc import Mapping

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.expressions.program import Expression
    from voxdisplay.scene.placement import Placement
    from voxdisplay.voxelization import Sequence, VoxelSet

Colors = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class ColorsByValue:
    """A colour map by a value.

    Attributes
    ----------
    colors : (k, 3) uint8 array
        From the lowest value to the highest.
    by : Expression
        Its variables are x, y and z, in voxels of the scene, and names of values at voxels.
    range : (float, float) or None
        The values of the first and the last colour; None: the lowest and highest of all voxels.

    """

    colors: Colors
    by: Expression
    range: tuple[float, float] | None = None


Coloring = Colors | ColorsByValue | None
"""Colours of an object: (k, 3), by value, or None: its own, or white."""

WHITE: Colors = np.full((1, 3), 255, dtype=np.uint8)


def voxel_colors(
    coloring: Coloring,
    voxels: Sequence | VoxelSet,
    columns: Mapping[str, Floats],
    fit: Placement | None,
) -> Colors | Spread:
    """Return the colours of voxels.

    Parameters
    ----------
    coloring : (k, 3) array, ColorsByValue or None
    voxels : Sequence or VoxelSet
        N of them, all that the object has.
    columns : mapping of str to (n,) float64 array
        Values of the points that a curve is made of, by name.
    fit : Placement, optional
        How the scene was fitted to the voxels.

    Returns
    -------
    (N, 3) or (1, 3) uint8 array, or Spread

    Raises
    ------
    CurveError
        If a value by which it is coloured is not known.

    """
    if coloring is None:
        own = voxels.colors if isinstance(voxels, voxelization.VoxelSet) else None
        return WHITE if own is None else own
    if isinstance(coloring, ColorsByValue):
        return _by_value(coloring, voxels, columns, fit)
    if len(coloring) == 1:
        return coloring
    if isinstance(voxels, voxelization.VoxelSet):
        return _spread_over_body(coloring, voxels)
    if len(coloring) == voxels.curve.point_count:
        return colors_at(coloring, voxelization.point_indices(voxels))
    return Spread(coloring, len(voxels))


def _spread_over_body(colors: Colors, voxels: VoxelSet) -> Colors:
    """Return colours along the line of a tube, or from the lowest voxel to the highest.

    As many colours as a body has points are those of its points.
    """
    of = voxels.parameters.get("point")
    if of is not None and len(colors) == getattr(voxels.body, "point_count", None):
        return np.asarray(colors[of.astype(np.int64)])
    if not len(voxels):
        return WHITE
    share = voxels.value("s")
    if share is None:
        z = voxels.voxels[:, 2].astype(np.float64)
        share = (z - z.min()) / (np.ptp(z) or 1.0)
    return colors_at(colors, share * (len(colors) - 1))


def _by_value(
    coloring: ColorsByValue,
    voxels: Sequence | VoxelSet,
    columns: Mapping[str, Floats],
    fit: Placement | None,
) -> Colors:
    if not len(voxels):
        return WHITE
    shape = (len(voxels),)
    known = _Values(voxels, columns, fit)
    used = {step for step in coloring.by.program if isinstance(step, str)}
    operands = [known.of(name) if name in used else np.zeros(1) for name in coloring.by.variables]
    values = np.broadcast_to(coloring.by.value(*operands), shape)
    finite = values[np.isfinite(values)]
    if coloring.range is None:
        low, high = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)
    else:
        low, high = coloring.range
    with np.errstate(all="ignore"):
        share = (values - low) / (high - low if high != low else 1.0)
    share = np.clip(np.nan_to_num(share, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    index = np.floor(share * (len(coloring.colors) - 1) + 0.5).astype(np.int64)
    return np.asarray(coloring.colors[index])


class _Values:
    """Values at voxels by name."""

    def __init__(
        self, voxels: Sequence | VoxelSet, columns: Mapping[str, Floats], fit: Placement | None
    ) -> None:
        self.voxels = voxels
        self.columns = columns
        self._fit = fit
        self._centers: Floats | None = None

    def of(self, name: str) -> Floats:
        """Return the values of a name, (N,)."""
        voxels = self.voxels
        if isinstance(voxels, voxelization.VoxelSet):
            found = voxels.value(name)
            if found is not None:
                return found
            index = voxels.value("t") if name in self.columns else None
            if index is not None:  # a tube about points, whose t counts them
                return _along_points(self.columns[name], index)
        elif name == "t":
            return voxels.t
        elif name == "s":
            return np.linspace(0.0, 1.0, len(voxels))
        elif name in self.columns:
            return _along_points(self.columns[name], voxelization.point_indices(voxels))
        if name not in {"x", "y", "z"}:
            raise CurveError(f"the voxels have no value {name!r} to be coloured by")
        if self._centers is None:
            centers: Floats = voxels.voxels + np.float64(0.5)
            inverse = self._fit.inverse() if self._fit else None
            self._centers = inverse.points(centers) if inverse else centers
        return np.asarray(self._centers[:, "xyz".index(name)])


def _along_points(column: Floats, index: Floats) -> Floats:
    """Return the values of points at fractional indices, (N,)."""
    ring = np.append(column, column[0])  # behind the last point, the first one follows
    return np.asarray(np.interp(index, np.arange(len(ring)), ring), dtype=np.float64)
