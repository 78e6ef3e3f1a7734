"""Voxelisation of bodies: dispatch by geometry to its voxeliser."""

from __future__ import annotations

import time
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Protocol

import numpy as np

from voxdisplay.argument_checks import choice
from voxdisplay.errors import BodyError
from voxdisplay.voxelization.clipping_note import clipping_note
from voxdisplay.voxelization.voxel_box import VoxelBox

if TYPE_CHECKING:
    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.geometry import Geometry
    from voxdisplay.voxelization.voxel_set import VoxelSet

MAX_SPAN = 1 << 14
"""Largest side, in voxels, of the box of a body that is not clipped."""


class Voxeliser(Protocol):
    """A function that voxelises geometries of one class."""

    def __call__(
        self, geometry: Geometry, box: VoxelBox, body: Body, *, certified: bool
    ) -> VoxelSet:
        """Return the voxels inside a box; ``body.kind`` says whether the inside is wanted."""


# Module and function of the voxeliser of each geometry, which are imported on first use, as the
# geometries are: what draws curves alone needs none of them.
_VOXELISERS: dict[str, tuple[str, str]] = {
    "TriangleMesh": ("mesh", "voxelize_mesh"),
    "LitVoxels": ("lit_voxels", "voxelize_lit"),
    "QuadricPatches": ("quadrics", "voxelize_quadrics"),
    "ImplicitFunction": ("implicit", "voxelize_implicit"),
    "BallChain": ("ball_chains", "voxelize_chain"),
    "HeightFunction": ("height_field", "voxelize_heights"),
}


def voxelize_body(body: Body, box: VoxelBox, *, certified: bool = False) -> VoxelSet:
    """Return the voxels of a body inside a box.

    Parameters
    ----------
    body : Body
    box : VoxelBox
    certified : bool
        Prove that nothing of a body given by formulas is missed.

    Raises
    ------
    BodyError
        If the body cannot be evaluated or drawn.

    """
    began_s = time.perf_counter()
    choice("fill", body.fill, ("shell", "solid"))
    choice("kind", body.kind, ("surface", "solid", "volume", "points"))
    geometry = body.geometry(box.corners, certified=certified)
    kind = type(geometry).__name__
    if kind not in _VOXELISERS:
        raise BodyError(
            f"{body} is of a geometry that cannot be voxelised: {kind}",
            hint=f"it must be one of {', '.join(_VOXELISERS)}",
        )
    module, name = _VOXELISERS[kind]
    package = __name__.rpartition(".")[0]
    voxelize: Voxeliser = getattr(import_module(f"{package}.surfaces.{module}"), name)
    voxels = voxelize(geometry, box, body, certified=certified)
    notes = (*getattr(geometry, "notes", ()), *voxels.notes)
    cut = clipping_note(
        geometry,
        body,
        voxels,
        lambda wider: voxelize(geometry, wider, body, certified=False).voxels,
    )
    if cut:
        notes = (*notes, cut)
    return replace(voxels, body=body, notes=notes, seconds=time.perf_counter() - began_s)


def box_of(body: Body, *, certified: bool = False) -> VoxelBox:
    """Return a box that holds all voxels of a body; if certified, it is proven to.

    Raises
    ------
    BodyError
        If the body has no end, or is larger than any display.

    """
    low, high = body.proven_bounds() if certified else body.bounds()
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise BodyError(f"{body} has no end", hint="clip it to a display: clip=(nx, ny, nz)")
    if (high - low).max() > MAX_SPAN or max(np.abs(low).max(), np.abs(high).max()) > 1 << 30:
        raise BodyError(
            f"{body} is more than {MAX_SPAN} voxels long or far away",
            hint="scale it, or clip it to a display: clip=(nx, ny, nz)",
        )
    return VoxelBox.around(low, high)
