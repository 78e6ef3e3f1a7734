"""What a curve is, to everything that draws one.

A curve is a continuous map from a parameter range into voxel space. It knows no voxels, no
colours and no display: only where it is.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Curve(ABC):
    """A parametric space curve P(t), a <= t <= b.

    Coordinates are voxel space: voxel (i, j, k) is the cube [i, i+1) x [j, j+1) x [k, k+1), its
    centre at +1/2 (paper, equation 3).

    Attributes
    ----------
    t_range : (float, float)
        The range (a, b), finite, a < b.
    closed : bool or None
        Whether P(a) and P(b) are joined. None: found from the end points.
    breaks : (k,) float64 array
        Parameters inside the range, ascending, where the direction may turn sharply (the vertices
        of a polyline). A hint for sampling; never needed for correctness.

    """

    t_range: tuple[float, float]
    closed: bool | None = None
    breaks: Floats = np.empty(0)

    @abstractmethod
    def position(self, t: Floats) -> Floats:
        """Give the points at t.

        Parameters
        ----------
        t : (n,) float64 array
            Parameters inside ``t_range``; n may be 0 or 1.

        Returns
        -------
        (3, n) float64 array
            Rows x, y, z, in voxels. Not finite where the curve has no point.

        """

    def derivative(self, t: Floats) -> Floats | None:  # noqa: ARG002 - for those that have one
        """Give dP/dt at t as a (3, n) float64 array, or None when it is not known."""
        return None
