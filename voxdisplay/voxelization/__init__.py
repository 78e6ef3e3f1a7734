"""Voxelisation: curves to ordered, 26-connected sequences, bodies to sets of voxels.

``voxelize(curve)`` returns a `Sequence`, ``voxelize(body)`` a `VoxelSet`; `measure` judges any list
of voxels. This package knows curves only by their positions, bodies by their geometries, and
neither displays nor colours of displays nor the wire. It needs numpy; with
the extra `fast`, much work is done compiled, with the same voxels
(`voxdisplay.compute.kernel_backend`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any, overload

from voxdisplay.argument_checks import choice, flag, instance, whole_number, wrong_kind
from voxdisplay.bodies.body import Body
from voxdisplay.compute.garbage_collection import collecting_between
from voxdisplay.curves.curve import Curve
from voxdisplay.voxelization.body_voxelization import MAX_SPAN, box_of, voxelize_body
from voxdisplay.voxelization.digitise import digitise
from voxdisplay.voxelization.point_indices import point_indices
from voxdisplay.voxelization.sequence import Report, Sequence, clip
from voxdisplay.voxelization.voxel_box import VoxelBox
from voxdisplay.voxelization.voxel_set import VoxelSet

__all__ = [
    "Report",
    "Sequence",
    "VoxelBox",
    "VoxelSet",
    "clip",
    "march",
    "point_indices",
    "voxelize",
    "voxelize_batches",
    "voxelize_body",
    "voxelize_many",
]


@overload
def voxelize(
    curve: Curve,
    *,
    method: str = "grid-plane",
    variant: int = 3,
    tangent: str | None = None,
    pitch: float | None = None,
    reach: float | None = None,
    certified: bool = False,
) -> Sequence: ...


@overload
def voxelize(
    curve: Body, *, certified: bool = False, clip: tuple[int, int, int] | None = None
) -> VoxelSet: ...


def voxelize(
    curve: Curve | Body,
    *,
    method: str = "grid-plane",
    variant: int = 3,
    tangent: str | None = None,
    pitch: float | None = None,
    reach: float | None = None,
    certified: bool = False,
    clip: tuple[int, int, int] | None = None,
) -> Sequence | VoxelSet:
    """Return the voxels along a curve, or those of a body.

    Parameters
    ----------
    curve : Curve or Body
        Any continuous curve; where it jumps, the sequence is split. For a body, the options of
        methods are left out.
    method : {"grid-plane", "march"}
        Grid-plane intersection digitisation (`grid_plane`), for which the guarantees below hold, or
        the tangent march of the paper (`tangent_march`), for comparison.
    variant : {1, 2, 3}
    tangent : {"analytic", "difference"}, optional
        How the march measures distances and tangents: see `tangent_march.follow`.
    pitch, reach : float, optional
        Step sizes of the march's search for the nearest point: in degrees where the parameter is
        an angle around z, as for the paper's curves, else in voxels. By default those of the
        paper's tables: see `tangent_march.follow`.
    certified : bool
        Prove the guarantees, and that no feature is missed, however narrow, by interval bounds of
        the curve's formula (`certify`); it takes about twice the time. Without it, features much
        narrower than 1/64 of the range of t may be missed. The report's ``certified`` is True if
        there is a proof; the sequence's ``proof`` is the certificate, or the reason why there is
        none: a callable has no bounds, and a curve that jumps is not connected.
    clip : (int, int, int), optional
        For a body: size (nx, ny, nz) of a display, outside of which no voxel is wanted. Bodies
        that have no end, such as planes, need it.

    Returns
    -------
    VoxelSet
        For a body.
    Sequence
        For a curve:
        26-connected; the first voxel holds the first point, the last of an open curve its last;
        others are within 0.7072 of the curve, if a step from one float t to the next moves it by
        less than 0.002. Each has exactly two neighbours but for the contacts that
        ``.contact_pairs`` lists. A closed curve is one whose ends are within 0.001 voxels of each
        other, unless it says otherwise itself; its last voxel is a neighbour of the first.

        A closed curve could begin at any of its corners, which are found at its ``breaks``: all of
        their voxels are in the sequence, as ends are within 0.8661 of the curve, and are contacts
        where no way without a chord leads through them, as at right angles between axes. So a
        polygon has the same voxels from each of its corners, but for a few with corners less than
        two voxels apart. A smooth closed curve that begins elsewhere has other voxels near both
        beginnings where one passes by the first point of the other, and single ones where it is
        sampled at other points.

        A curve and its reverse have the same voxels, in reverse, and so have shifts by whole voxels
        and mirror images, unless an end or a corner lies on a face of voxels: a voxel holds its
        lower faces only. A closed curve that begins on a face, but at no corner, begins with the
        voxel on the inner side.

    Raises
    ------
    CurveError, BodyError
        If the curve or body cannot be evaluated, runs off, or has no end.
    ValueError
        If there is no such method or option, or the method has none such.

    """
    if isinstance(curve, Body):
        certified = flag("certified", certified)
        grid = None if clip is None else VoxelBox.of_grid(_sides(clip))
        return voxelize_body(curve, grid or box_of(curve, certified=certified), certified=certified)
    if clip is not None:
        raise ValueError(
            "clip: a sequence is whole; `Sequence.clip` finds what is inside a display"
        )
    return voxelize_many(
        [curve],
        method=method,
        variant=variant,
        tangent=tangent,
        pitch=pitch,
        reach=reach,
        certified=certified,
    )[0]


def voxelize_many(
    curves: Iterable[Curve],
    *,
    method: str = "grid-plane",
    variant: int = 3,
    tangent: str | None = None,
    pitch: float | None = None,
    reach: float | None = None,
    certified: bool = False,
) -> list[Sequence]:
    """Return the voxels along many curves: as `voxelize`, but much faster than one by one."""
    curves = _as_curves(curves)
    choice("method", method, ("grid-plane", "march"))
    certified = flag("certified", certified)
    if method == "grid-plane":
        if pitch is not None or reach is not None:
            raise ValueError("pitch and reach are the march's: they go with method='march'")
        return list(chain.from_iterable(collecting_between(digitise(curves, certified=certified))))
    if certified:
        raise ValueError("nothing is proven of the march: certified goes with 'grid-plane'")
    # Curves that are drawn take the other method, and start sooner without this one.
    from voxdisplay.voxelization.tangent_march import march  # noqa: PLC0415

    many = len(curves) > 1
    return [
        march(
            curve,
            variant,
            tangent=tangent,
            pitch=pitch,
            reach=reach,
            number=index if many else None,
        )
        for index, curve in enumerate(curves)
    ]


def voxelize_batches(curves: Iterable[Curve]) -> Iterator[list[Sequence]]:
    """Yield the voxels along many curves, as of `voxelize_many`, some curves at a time.

    What is not held on to needs no memory when the next ones come.
    """
    return digitise(_as_curves(curves))


def _sides(clip: Any) -> tuple[int, int, int]:
    """Return three whole numbers, or raise an error that names the argument."""
    if not isinstance(clip, tuple | list) or len(clip) != 3:
        raise wrong_kind("clip", "three whole numbers (nx, ny, nz)", clip)
    nx, ny, nz = (whole_number("clip", side, 1, MAX_SPAN) for side in clip)
    return nx, ny, nz


def _as_curves(curves: Any) -> list[Curve]:
    if not isinstance(curves, Iterable) or getattr(curves, "ndim", 1) == 0:
        raise wrong_kind("curves", "an iterable of curves", curves)
    listed = list(curves)
    if not all(issubclass(kind, Curve) for kind in set(map(type, listed))):
        for curve in listed:
            instance("curve", curve, Curve, "a Curve")
    return listed
