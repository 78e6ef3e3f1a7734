"""Tori and tubes: against distances, floods and the centres inside."""

import numpy as np
import pytest
from surface_checks import centres, crossed, leaks, mask

import voxdisplay as vd
from voxdisplay.bodies.body import Body
from voxdisplay.bodies.tube import Torus, Tube
from voxdisplay.curves.arguments import ArgumentError
from voxdisplay.errors import BodyError
from voxdisplay.voxelization.body_voxelization import voxelize_body
from voxdisplay.voxelization.voxel_box import VoxelBox

GRID = (23, 21, 19)


def lit(body: Body, grid: tuple[int, int, int] = GRID) -> np.ndarray:
    return mask(voxelize_body(body, VoxelBox.of_grid(grid)).voxels, grid)


def torus_distance(c, major, minor, n):
    def signed(p):
        h = (p - c) @ n
        rho = np.linalg.norm(p - c - h[:, None] * n, axis=1)
        return np.hypot(rho - major, h) - minor

    return signed


@pytest.mark.parametrize("seed", range(5))
def test_tori(seed: int) -> None:
    rng = np.random.default_rng(seed)
    c, n = rng.uniform(9, 11, size=3), rng.normal(size=3)
    n /= np.linalg.norm(n)
    signed = torus_distance(c, 5.3, 2.2, n)
    shown = lit(Torus(c, 5.3, 2.2, n))
    expected = crossed(signed, GRID)
    assert not (shown & ~expected).any()
    assert (expected & ~shown).sum() <= 12  # two crossings between neighbouring centres
    inside = (signed(centres(GRID)) < 0).reshape(GRID[::-1])
    assert leaks(shown, inside) == 0
    assert (lit(Torus(c, 5.3, 2.2, n, fill="solid")) == inside).all()


def test_a_thin_torus_is_covered() -> None:
    voxels = voxelize_body(Torus((11, 10, 9), 7, 0.05, (1, 2, 3)), VoxelBox.of_grid(GRID)).voxels
    signed = torus_distance(np.array((11, 10, 9)), 7, 0, np.array((1, 2, 3)) / 14**0.5)
    assert signed(voxels + 0.5).max() <= 0.7072
    points = vd.Circle((11, 10, 9), 7, (1, 2, 3)).position(np.linspace(0, 6.28, 99)).T
    gaps = np.abs(points[:, None] - (voxels + 0.5)).max(axis=2).min(axis=1)
    assert gaps.max() <= 1 + 1e-9


CURVES = {
    "knot": vd.TorusKnot(2, 3, (11, 10, 9), 5, 2),
    "corner": vd.Polyline([(5, 5, 5), (16, 6, 7), (8, 15, 13)]),
    "line": vd.Segment((5.2, 6.1, 5.3), (16, 13, 14)),
}


def distance_to(curve: vd.Curve, radius) -> object:
    t = np.unique(np.concatenate((np.linspace(*curve.t_range, 4000), curve.breaks)))
    points, radii = curve.position(t).T, radius(t)

    def signed(p):
        parts = np.array_split(p, max(len(p) // 200, 1))
        return np.concatenate(
            [(np.linalg.norm(part[:, None] - points, axis=2) - radii).min(axis=1) for part in parts]
        )

    return signed


@pytest.mark.parametrize("name", CURVES)
def test_tubes(name: str) -> None:
    curve = CURVES[name]
    signed = distance_to(curve, lambda t: 1.7 + 0 * t)
    value = signed(centres(GRID)).reshape(GRID[::-1])
    shown, solid = lit(Tube(curve, 1.7)), lit(Tube(curve, 1.7, fill="solid"))
    assert np.abs(value[shown]).max() <= 0.52
    sure = np.abs(value) > 0.02
    assert (solid == (value <= 0))[sure].all()
    assert leaks(shown, value < 0) == 0


def test_radii_may_vary() -> None:
    line = CURVES["line"]
    value = distance_to(line, lambda t: 1 + 2 * t)(centres(GRID)).reshape(GRID[::-1])
    solid = lit(Tube(line, "1 + k*t", params={"k": 2}, fill="solid"))
    assert (solid == (value <= 0))[np.abs(value) > 0.02].all()
    by_function = lit(Tube(line, lambda t: 1 + 2 * t, fill="solid"))
    assert (by_function == solid).all()
    with pytest.raises(BodyError, match="the radius is -1 at t = 0"):
        lit(Tube(line, "t - 1"))
    with pytest.raises(ArgumentError, match="radius must be positive"):
        Tube(line, 0)


def test_a_thin_tube_has_voxels_along_the_curve() -> None:
    for fill in ("shell", "solid"):
        voxels = voxelize_body(Tube(CURVES["line"], 0.1, fill=fill), VoxelBox.of_grid(GRID)).voxels
        for at in CURVES["line"].position(np.linspace(0, 1, 50)).T:
            assert np.abs(voxels + 0.5 - at).max(axis=1).min() <= 1 + 1e-9


def test_a_tube_about_a_curve_that_jumps_has_two_parts() -> None:
    curve = vd.Parametric("5 + 10*floor(t)", "10 + 3*t", "9", t=(0, 1.9))
    solid = lit(Tube(curve, 1.5, fill="solid"))
    assert solid[9, :, 5].any()
    assert solid[9, :, 15].any()
    assert not solid[:, :, 8:13].any()


def test_curves_without_end_and_without_points_are_errors() -> None:
    with pytest.raises(BodyError, match="z is not finite at t = 0"):
        lit(Tube(vd.Parametric("t", "t", "log(t - 1)", t=(0, 1)), 1))
    with pytest.raises(BodyError, match="too long or too rough"):
        lit(Tube(vd.Parametric("9 + 9*sin(1e9*t)", "t", "t", t=(0, 1)), 1))


def test_parts_outside_cost_nothing_and_light_nothing() -> None:
    far = vd.Segment((1e7, 0, 0), (1e7, 9, 9))
    assert not lit(Tube(far, 2)).any()
    assert lit(Tube(vd.Segment((-1e7, 9, 9), (1e7, 9, 9)), 2)).any()
