"""Height fields, against the plain rule and floods."""

import math

import numpy as np
import pytest
from surface_checks import centres, crossed, leaks, mask

from voxdisplay.bodies.height_field import HeightField
from voxdisplay.errors import BodyError, CurveError
from voxdisplay.voxelization.body_voxelization import voxelize_body
from voxdisplay.voxelization.voxel_box import VoxelBox

GRID = (13, 11, 12)
ALL = {"x": (0, 13), "y": (0, 11)}


def lit(body: HeightField, grid: tuple[int, int, int] = GRID) -> np.ndarray:
    return mask(voxelize_body(body, VoxelBox.of_grid(grid)).voxels, grid)


@pytest.mark.parametrize(
    "z",
    [
        "6 + 0.3*x - 0.2*y",
        "6 + 3*sin(x/2)*cos(y/3)",
        "2 + (x - 6.3)**2",
        "6.2 + 2*tanh(20*(x - y))",
    ],
)
def test_what_crosses_central_crosses_is_lit(z: str) -> None:
    body = HeightField(z, **ALL)
    function = body.function

    def signed(p: np.ndarray) -> np.ndarray:
        return p[:, 2] - function(p[:, 0].copy(), p[:, 1].copy())

    shown, expected = lit(body), crossed(signed, GRID, samples=201)
    # Beyond the rectangle there is no surface, and arms of crosses end there.
    assert (shown[:, 1:-1, 1:-1] == expected[:, 1:-1, 1:-1]).all()
    below = (signed(centres(GRID)) < 0).reshape(GRID[::-1])
    sides = np.zeros_like(below)
    sides[:, [0, -1]] = sides[:, :, [0, -1]] = True
    sides[[0, -1]] = True  # the flood comes from above alone
    assert leaks(shown | (sides & below), below) == 0


def test_each_column_has_the_voxel_of_its_height() -> None:
    for z in ("4 + 0.1*x", "5", "4.5 + 0.5*sin(x)"):
        body = HeightField(z, **ALL)
        x, y = np.meshgrid(np.arange(13) + 0.5, np.arange(11) + 0.5)
        height = body.function(x, y)
        shown = lit(body)
        assert shown[np.floor(height).astype(int), y.astype(int), x.astype(int)].all()
    assert set(lit(HeightField("12", **ALL)).nonzero()[0]) == {11}


def test_the_rectangle_ends_where_centres_lie_beside_it() -> None:
    shown = lit(HeightField("5.2", x=(2.4, 7.6), y=(3.6, 5.5)))
    assert sorted({tuple(each) for each in np.argwhere(shown)[:, 1:].tolist()}) == [
        (j, i) for j in (4, 5) for i in (2, 3, 4, 5, 6, 7)
    ]
    # A steep wall in the last column is there although the centre is beyond it.
    steep = lit(HeightField("10*(x - 2)", x=(2, 3.2), y=(0, 11)))
    assert steep[:, 5, 2].nonzero()[0].tolist() == list(range(10))
    assert steep[:, 5, 3].nonzero()[0].tolist() == [10, 11]


def test_nothing_is_drawn_across_jumps_and_poles() -> None:
    found = voxelize_body(
        HeightField("3 + 6*floor(x/6)", x=(0, 12), y=(0, 11)), VoxelBox.of_grid(GRID)
    )
    assert set(found.voxels[:, 2]) == {3, 9}
    assert "jumps" in found.notes[0]
    # Smooth, however steep: it is drawn.
    assert (lit(HeightField("6 + 5*tanh(1e4*(x - 6.2))", **ALL)).any(axis=(1, 2))[1:11]).all()
    pole = lit(HeightField("6 + 1/(x - 6.2)", **ALL))
    assert pole[7:, 5, 6].all()
    assert not pole[6:, 5, 5].any()
    assert pole[:5, 5, 5:7].any(axis=1).all()


def test_columns_without_a_value_are_left_out_and_counted() -> None:
    found = voxelize_body(HeightField("5 + sqrt(x - 4)", **ALL), VoxelBox.of_grid(GRID))
    assert found.voxels[:, 0].min() == 4
    assert found.notes == ("the height has no value at 44 of 143 columns",)
    with pytest.raises(BodyError, match="has no value at any of 143 columns"):
        voxelize_body(HeightField("sqrt(-1 - x)", **ALL), VoxelBox.of_grid(GRID))


def test_callables_and_expressions_have_the_same_voxels() -> None:
    expected = lit(HeightField("6 + 3*sin(x)*y/11", **ALL))
    assert (lit(HeightField(lambda x, y: 6 + 3 * np.sin(x) * y / 11, **ALL)) == expected).all()
    assert (lit(HeightField(lambda x, y: 6 + 3 * math.sin(x) * y / 11, **ALL)) == expected).all()
    with pytest.raises(BodyError, match="z returned shape"):
        lit(HeightField(lambda x, y: np.ones((2, x.size + y.size)), **ALL))


def test_scaled_and_moved_along_the_axes_it_stays_a_height_field() -> None:
    body = HeightField("3 + sin(x)", x=(0, 5), y=(1, 4))
    moved = body.transformed(np.diag((2.0, -1.0, 1.0)), (1, 8, 2))
    same = HeightField("5 + sin((x - 1)/2)", x=(1, 11), y=(4, 7))
    assert (lit(moved) == lit(same)).all()


def test_turned_it_is_a_surface() -> None:
    body = HeightField("5 + sin(x)*y/9", x=(1, 8), y=(2, 9))
    turn = np.eye(3)[[2, 0, 1]]
    for certified in (False, True):
        found = voxelize_body(
            body.transformed(turn), VoxelBox.of_grid((13, 13, 13)), certified=certified
        )
        assert found.notes == ()
        x, y, z = (found.voxels + 0.5).T
        on = (y > 1) & (y < 8) & (z > 2) & (z < 9)
        assert on.sum() > 40
        assert np.abs(x - 5 - np.sin(y) * z / 9)[on].max() <= 0.9  # along x, of a slanted one
    with_z = mask(found.voxels, (13, 13, 13)).transpose(1, 0, 2)
    upright = lit(body, (13, 13, 13))
    assert with_z.sum() == pytest.approx(upright.sum(), rel=0.05)


def test_reversed_and_empty_ranges_are_errors() -> None:
    for x, words in (((3, 1), "x runs backwards"), ((2, 2), "x is empty")):
        with pytest.raises(CurveError, match=words):
            HeightField("1", x=x, y=(0, 1))
    with pytest.raises(CurveError, match="z: 't' at column 1"):
        HeightField("t", **ALL)


def test_hostile_heights_end() -> None:
    for z in ("sin(1e9*x)*1e9", "exp(1000*x)", "1/sin(1e6*x)", "9**9**x"):
        voxelize_body(HeightField(z, **ALL), VoxelBox.of_grid(GRID))
