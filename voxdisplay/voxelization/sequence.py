"""Voxel sequences, and reports of their quality.

A sequence is a value. It must not know colours or displays; ``clip`` takes the shape of one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.curves.curve import Curve
from voxdisplay.curves.singular_points import SingularPoint, singular_points
from voxdisplay.voxelization.certify import END_ERROR, Certificate


@dataclass(frozen=True)
class Report:
    """Quality figures of a sequence.

    Attributes
    ----------
    voxels : int
        Number of voxels.
    closed : bool
        Whether the last is followed by the first.
    pieces : int
        Into how many connected pieces jumps of the curve split them.
    e_max, e_av : float
        Greatest and mean true distance of voxel centres from the curve, in voxels (paper,
        equations 7 and 8, but to the nearest point).
    gaps : int
        Consecutive voxels of a piece that are not neighbours.
    contacts : int
        Pairs i < j, j - i > 1 (cyclically if closed), of equal or 26-adjacent voxels.
    seconds : float
        Time spent on the voxels (a share by voxels, where many curves were done at once).
    certified : bool
        Whether it is proven that voxels are within 0.7072 of the curve (the first and the last
        within 0.8661), and all of the curve, however narrow a feature, within 2.5 in max norm of
        a voxel's centre; and that they are connected, without a jump.
    undefined : tuple of SingularPoint
        Parameters at which a coordinate has no value and the limits of both sides are drawn, by
        ``.axis``, ``.t`` and ``.jump``.
    jumps : tuple of float
        Parameters at which the curve jumps: nothing is drawn across.

    """

    voxels: int
    closed: bool
    pieces: int
    e_max: float
    e_av: float
    gaps: int
    contacts: int
    seconds: float
    certified: bool
    undefined: tuple[SingularPoint, ...] = ()
    jumps: tuple[float, ...] = ()

    def __repr__(self) -> str:
        rarely = [f"{name}={getattr(self, name)}" for name in ("undefined", "jumps")]
        return "Report({})".format(
            ", ".join(
                [
                    f"voxels={self.voxels}, closed={self.closed}, pieces={self.pieces}",
                    f"e_max={self.e_max:.4g}, e_av={self.e_av:.4g}",
                    f"gaps={self.gaps}, contacts={self.contacts}",
                    f"seconds={self.seconds:.2g}, certified={self.certified}",
                    *[each for each in rarely if not each.endswith("=()")],
                ]
            )
        )


@dataclass(eq=False, init=False, repr=False)
class Sequence:
    """An ordered, 26-connected list of voxels along a curve.

    Attributes
    ----------
    voxels : (N, 3) int32 array
        Columns x, y, z; read-only. Voxel i of an axis covers [i, i + 1).
    closed : bool
        Whether the last voxel is followed by the first.
    starts : (pieces,) int64 array
        Index of the first voxel of every piece; the first is 0. The curve jumps before each other.
        Read-only.
    t : (N,) float64 array
        A parameter at which the curve is near each voxel, ascending; read-only.
    curve : Curve
        What the voxels show.
    seconds : float
        Time spent on them.
    proof : Certificate, str or None
        The proven bounds, or the reason why there is no proof, if one was asked for.

    """

    voxels: NDArray[np.int32]
    closed: bool
    starts: NDArray[np.int64]
    t: NDArray[np.float64]
    curve: Curve
    seconds: float = 0.0
    proof: Certificate | str | None = None

    def __init__(
        self,
        voxels: NDArray[np.int32],
        closed: bool,
        starts: NDArray[np.int64],
        t: NDArray[np.float64],
        curve: Curve,
        seconds: float = 0.0,
        proof: Certificate | str | None = None,
    ) -> None:
        self.voxels = voxels
        self.closed = closed
        self.starts = starts
        self.t = t
        self.curve = curve
        self.seconds = seconds
        self.proof = proof
        self._freeze()

    def _freeze(self) -> None:
        cached = (vars(self).get("distances"), vars(self).get("contact_pairs"))
        for array in (self.voxels, self.starts, self.t, *cached):
            if array is not None and array.flags.writeable:  # to look costs less than to set
                array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.voxels)

    def __repr__(self) -> str:
        count, pieces = len(self), len(self.starts)
        low, high = (
            tuple(bound(axis=0).tolist()) if count else ()
            for bound in (self.voxels.min, self.voxels.max)
        )
        return (
            f"<Sequence: {count} voxel{'s' * (count != 1)}, "
            f"{'closed' if self.closed else 'open'}, {pieces} piece{'s' * (pieces != 1)}, "
            f"from {low} to {high}>"
        )

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Pickling forgets that arrays are read-only.
        self.__dict__.update(state)
        self._freeze()

    def _repr_png_(self) -> bytes | None:
        """Return a picture for notebooks, in its bounding box; None without Pillow."""
        from voxdisplay.view.rich_display import voxels_png  # noqa: PLC0415 - needs an extra

        return voxels_png(self.voxels)

    @cached_property
    def distances(self) -> NDArray[np.float64]:
        """Distance of every voxel's centre from the curve, in voxels: (N,); read-only."""
        from voxdisplay.voxelization import measure  # noqa: PLC0415 - drawing needs no measures

        apart = measure.distances(self.voxels, self.curve)
        lost = apart > END_ERROR
        if lost.any():  # at features that are too narrow to be found without a hint
            hints = self.t[lost]
            apart[lost] = measure.distances(self.voxels[lost], self.curve, hints=hints)
        apart.flags.writeable = False  # `report` is made from them
        return apart

    @property
    def undefined(self) -> tuple[SingularPoint, ...]:
        """Parameters at which a coordinate has no value and the limits of both sides are drawn."""
        return singular_points(self.curve)

    @property
    def jumps(self) -> tuple[float, ...]:
        """Parameters at which the curve jumps: those of the voxels that begin further pieces."""
        return tuple(self.t[self.starts[1:]].tolist()) if len(self.starts) > 1 else ()

    @cached_property
    def contact_pairs(self) -> NDArray[np.int64]:
        """Index pairs at which the sequence touches itself: see `measure.contacts`."""
        from voxdisplay.voxelization import measure  # noqa: PLC0415 - drawing needs no measures

        pairs = measure.contacts(self.voxels, closed=self.closed)
        pairs.flags.writeable = False
        return pairs

    @cached_property
    def report(self) -> Report:
        """Quality figures, computed when first asked for: that can take longer than drawing."""
        from voxdisplay.voxelization import measure  # noqa: PLC0415 - drawing needs no measures

        return Report(
            voxels=len(self),
            closed=self.closed,
            pieces=len(self.starts),
            e_max=float(self.distances.max()),
            e_av=float(self.distances.mean()),
            gaps=len(measure.gaps(self.voxels, closed=self.closed, starts=self.starts)),
            contacts=measure.count_contacts(self.voxels, closed=self.closed),
            seconds=self.seconds,
            certified=isinstance(self.proof, Certificate),
            undefined=self.undefined,
            jumps=self.jumps,
        )


def clip(sequence: Sequence, grid: tuple[int, int, int]) -> NDArray[np.int64]:
    """Return the stretches of a sequence inside a grid.

    Parameters
    ----------
    sequence : Sequence
        The voxels.
    grid : (nx, ny, nz)
        A display's shape; voxels 0 <= x < nx and so on are inside.

    Returns
    -------
    (k, 2) int64 array
        Bounds [start, stop) of maximal stretches of consecutive voxels that are all inside and
        of one piece, ascending. A closed sequence is taken as open: a stretch may end with the
        last voxel and go on at the first.

    """
    voxels = sequence.voxels
    inside = np.asarray(((voxels >= 0) & (voxels < np.asarray(grid))).all(axis=1))
    runs_on = inside[1:] & inside[:-1]
    runs_on[sequence.starts[1:] - 1] = False
    start = np.flatnonzero(inside & ~np.append(False, runs_on))
    stop = np.flatnonzero(inside & ~np.append(runs_on, False)) + 1
    return np.stack((start, stop), axis=1)
