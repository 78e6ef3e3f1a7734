"""Right-handed orthonormal bases along a direction: where angles of circular curves begin.

Curves that turn about a direction n (a circle's normal, a helix's axis) measure their angle in
the plane across n, from the unit vector u nearest to +x, towards n x u: counter-clockwise when
seen against n. When n is along x, u is +y. So with n = [0, 0, 1] angle 0 is +x and 90 degrees is
+y; with n = [1, 0, 0] they are +y and +z.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.curves import arguments

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from voxdisplay.compute.array_types import Floats


def orthonormal_basis(name: str, direction: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Return unit vectors u, v, n, right-handed, with n along a direction, u at angle 0.

    Parameters
    ----------
    name : str
        Name of the argument, for errors.
    direction : (3,) array
        Of any length but 0.

    """
    n = arguments.vector(name, direction)
    n = n / (np.abs(n).max() or 1.0)  # so that its square neither overflows nor vanishes
    with np.errstate(under="ignore"):
        length = np.linalg.norm(n)
        if length == 0:
            raise arguments.ArgumentError(name, "has no direction: it is 0")
        n = n / length
        towards = np.array([1.0, 0.0, 0.0])
        if np.hypot(n[1], n[2]) < 1e-9:
            towards = np.array([0.0, 1.0, 0.0])
        u = towards - (towards @ n) * n
        u /= np.linalg.norm(u)
        return u, np.cross(n, u), n
