"""Right-handed orthonormal bases along a direction: where angles of circular curves begin.

Curves that turn about a direction n (a circle's normal, a helix's axis) measure their angle in
the plane across n, from the unit vector u nearest to +x, towards n x u: counter-clockwise when
seen against n. When n is along x, u is +y. So with n = [0, 0, 1] angle 0 is +x and 90 degrees is
+y; with n = [1, 0, 0] they are +y and +z.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.curves import arguments

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

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
    # Plain numbers: thousands of circles are made one by one, and numpy takes longer to begin.
    parts = arguments.vector(name, direction).tolist()
    most = max(map(abs, parts)) or 1.0  # so that its square neither overflows nor vanishes
    parts = [part / most for part in parts]
    length = _norm(parts)
    if length == 0:
        raise arguments.ArgumentError(name, "has no direction: it is 0")
    x, y, z = n = [part / length for part in parts]
    across = math.hypot(y, z) >= 1e-9
    u = [1.0 - x * x, -x * y, -x * z] if across else [-y * x, 1.0 - y * y, -y * z]
    length = _norm(u)
    a, b, c = u = [part / length for part in u]
    v = [y * c - z * b, z * a - x * c, x * b - y * a]
    return np.array(u), np.array(v), np.array(n)


def _norm(parts: list[float]) -> float:
    row = np.array(parts)
    return math.sqrt(row.dot(row))


def orthonormal_bases(directions: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return u and v, (n, 3) each, of many directions, (n, 3): to the bit `orthonormal_basis`.

    Also where there are any, (n,): a direction of length 0 has none.
    """
    most = np.abs(directions).max(axis=1)
    parts = directions / np.where(most > 0, most, 1.0)[:, None]
    length = _norms(parts)
    there = length > 0
    parts = parts / np.where(there, length, 1.0)[:, None]
    x, y, z = parts.T
    across = np.array([math.hypot(*pair) >= 1e-9 for pair in parts[:, 1:].tolist()], dtype=bool)
    u = np.stack(
        (
            np.where(across, 1.0 - x * x, -y * x),
            np.where(across, -x * y, 1.0 - y * y),
            np.where(across, -x * z, -y * z),
        ),
        axis=1,
    )
    u /= _norms(u)[:, None]
    a, b, c = u.T
    return u, np.stack((y * c - z * b, z * a - x * c, x * b - y * a), axis=1), there


def _norms(rows: Floats) -> Floats:
    # By the same function as `_norm`, which may round otherwise than a sum of products.
    return np.sqrt([row.dot(row) for row in rows])
