"""Voxel sets: the voxels of a body, without an order, and what is known of each.

A voxel set is a value. It must not know displays or how it was made.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.bodies.body import Body, Kind
from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.voxelization.voxel_box import VoxelBox

if TYPE_CHECKING:
    from voxdisplay.voxelization.body_report import BodyReport


@dataclass(eq=False, repr=False)
class VoxelSet:
    """The voxels of a body inside a box.

    Attributes
    ----------
    box : VoxelBox
        What the body was clipped to.
    index : (N,) int64 array
        Scan-order indices in the box, ascending, each once; read-only.
    kind : {"surface", "solid", "volume", "points"}
    colors : (N, 3) uint8 array or None
        The body's own colours.
    parameters : mapping of str to (N,) float64 array
        Numbers at voxels, by which they can be coloured: u, v, value, ...
    notes : tuple of str
        What was wrong with the body or left out, one line each, for people.
    body : Body, optional
        What the voxels show.
    seconds : float
        Time spent on them.
    certified : bool
        Whether it was asked for, and proven, that no part of the body is missed: each point of it
        inside the box is within 1, in max norm, of a lit centre, but for the tolerance of formulas.

    """

    box: VoxelBox
    index: Ints
    kind: Kind
    colors: NDArray[np.uint8] | None = None
    parameters: Mapping[str, Floats] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    body: Body | None = None
    seconds: float = 0.0
    certified: bool = False

    def __post_init__(self) -> None:
        self._freeze()

    def _freeze(self) -> None:
        self.index.flags.writeable = False
        for array in (self.colors, *self.parameters.values(), vars(self).get("voxels")):
            if array is not None:
                array.flags.writeable = False

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Pickling forgets that arrays are read-only.
        self.__dict__.update(state)
        self._freeze()

    def __len__(self) -> int:
        return len(self.index)

    def __repr__(self) -> str:
        count = len(self)
        extent = ""
        if count:
            low, high = (
                tuple(bound(axis=0).tolist()) for bound in (self.voxels.min, self.voxels.max)
            )
            extent = f", from {low} to {high}"
        return f"<VoxelSet: {self.kind}, {count} voxel{'s' * (count != 1)}{extent}>"

    @cached_property
    def voxels(self) -> NDArray[np.int32]:
        """Voxels, (N, 3) int32, columns x, y, z, distinct, in scan order; read-only."""
        voxels = self.box.voxels_at(self.index)
        voxels.flags.writeable = False
        return voxels

    def value(self, name: str) -> Floats | None:
        """Return numbers at the voxels by name, (N,); None if there are none of that name.

        Those of ``parameters``, or the body's own parameters at the centres: `Body.values_at`.
        """
        if name in self.parameters:
            return np.asarray(self.parameters[name])
        if self.body is None:
            return None
        return self.body.values_at(np.add(self.voxels, 0.5, dtype=np.float64)).get(name)

    @cached_property
    def report(self) -> BodyReport:
        """Quality figures, computed when first asked for: that takes longer than drawing."""
        from voxdisplay.voxelization.body_report import report_on  # noqa: PLC0415 - rarely needed

        voxels = self.voxels.astype(np.int64)
        found = report_on(voxels, self.box, self.kind, self.body, self.seconds)
        return replace(found, certified=self.certified)

    def _repr_png_(self) -> bytes | None:
        """Return a picture for notebooks, in its bounding box; None without Pillow."""
        from voxdisplay.view.rich_display import voxels_png  # noqa: PLC0415 - needs an extra

        return voxels_png(self.voxels)
