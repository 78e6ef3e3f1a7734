"""Notes on what of a body is outside the display, against the voxels of the whole body."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import voxdisplay as vd
from voxdisplay.bodies.body import Body

GRID = (13, 15, 17)
TURN = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
BODIES = {
    "sphere": vd.Sphere((0, 0, 0), 5),
    "turned ellipsoid": vd.Ellipsoid((0, 0, 0), (5, 2, 3)).transformed(TURN),
    "cone": vd.Cone((0, 0, 0), (2, 3, 5), 3),
    "torus": vd.Torus((0, 0, 0), 4, 1.5),
    "turned torus": vd.Torus((0, 0, 0), 4, 1.5).transformed(TURN),
    "tube": vd.Tube(vd.Circle((0, 0, 0), 4), 1.5),
    "box": vd.Box((-3, -4, -5), (3, 4, 5)),
    "height field": vd.HeightField("3 * sin(x)", x=(-4, 4), y=(-5, 5)),
    "surface": vd.Surface("u", "v", "3 * sin(u)", u=(-4, 4), v=(-5, 5)),
}
OUTSIDE = "it is outside the display"
PARTLY = "part of it is outside the display"
AT = st.tuples(*(st.integers(-4, side + 4) for side in GRID))


@pytest.mark.parametrize("name", BODIES)
@settings(max_examples=25)
@given(at=AT)
def test_it_is_said_when_there_are_voxels_outside(name: str, at: vd.Grid) -> None:
    body = BODIES[name].transformed(np.eye(3), np.array(at) + 0.25)
    whole = vd.voxelize(body).voxels
    clipped = vd.voxelize(body, clip=GRID)
    if not len(clipped):
        assert clipped.notes == (OUTSIDE,)
    elif not near_a_side(whole):
        is_cut = len(clipped) < len(whole)
        assert clipped.notes == ((PARTLY,) if is_cut else ())


def near_a_side(voxels: np.ndarray) -> bool:
    """Whether a body ends at a side of the grid, give or take a voxel."""
    low, high = voxels.min(axis=0), voxels.max(axis=0)
    return bool((abs(low) <= 1).any() or (abs(high - np.array(GRID) + 1) <= 1).any())


def test_single_points_are_missed() -> None:
    points = vd.Scatter([(1, 1, 1), (50, 1, 1)])
    assert vd.voxelize(points, clip=GRID).notes == (PARTLY,)


@pytest.mark.parametrize(
    "body",
    [
        vd.Plane((6, 7, 8), (1, 1, 1)),
        vd.Implicit("x - 5"),
        vd.Sphere((6.5, 7.5, 8.5), 6.5),
        # Its bounds are wider than it is.
        vd.Sphere((0, 0, 0), 6.4).transformed(TURN, (6.5, 7.5, 8.5)),
    ],
)
def test_what_has_no_end_or_just_fits_is_not_missed(body: Body) -> None:
    assert vd.voxelize(body, clip=GRID).notes == ()
