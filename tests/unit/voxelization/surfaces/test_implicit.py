"""Implicit surfaces and solids, against the plain rule at all centres, floods and closed forms."""

import math

import numpy as np
import pytest
from surface_checks import centres, leaks, mask

from voxdisplay.bodies.implicit import Implicit
from voxdisplay.bodies.primitives import Sphere
from voxdisplay.errors import BodyError, CurveError
from voxdisplay.voxelization import voxelize
from voxdisplay.voxelization.body_voxelization import voxelize_body
from voxdisplay.voxelization.surfaces import implicit
from voxdisplay.voxelization.voxel_box import VoxelBox
from voxdisplay.voxelization.voxel_set import VoxelSet

GRID = (21, 17, 19)
FORMULAS = {
    "sphere": "(x - 9.7)**2 + (y - 8.2)**2 + (z - 9.1)**2 - 49",
    "torus": "hypot(hypot(x - 10.1, y - 8.3) - 5.2, z - 9.4) - 2.1",
    "gyroid": "sin(x/2)*cos(y/2) + sin(y/2)*cos(z/2) + sin(z/2)*cos(x/2)",
    "blobs": "0.5 - exp(-hypot(x-7,y-8,z-9)**2/9) - exp(-hypot(x-13,y-8,z-9)**2/9)",
    "plane on centres": "z - 5.5",
    "plane on faces": "z - 5",
    "kinks": "max(abs(x - 10), abs(y - 8), abs(z - 9)) - 5.25",
    "steps": "floor(x/3) + y/4 - z/3",
}


def voxelized(body: Implicit, *, certified: bool = False) -> VoxelSet:
    return voxelize_body(body, VoxelBox.of_grid(GRID), certified=certified)


def lit(body: Implicit) -> np.ndarray:
    return mask(voxelized(body).voxels, GRID)


def plain_rule(f, grid: tuple[int, int, int]) -> np.ndarray:
    """Return the voxels of f = 0 by the signs at all centres: [z, y, x]."""
    wide = tuple(side + 2 for side in grid)
    at = centres(wide) - 1
    value = f(*at.T).reshape(wide[::-1])
    shown = value == 0
    for axis in range(3):
        step = np.eye(3)[axis] / 2
        middle = f(*(at + step).T).reshape(wide[::-1])
        for z, y, x in np.ndindex(value.shape):
            ahead = [z, y, x]
            ahead[2 - axis] += 1
            if ahead[2 - axis] == value.shape[2 - axis]:
                continue
            ends = (z, y, x), tuple(ahead)
            inside = [value[end] <= 0 for end in ends]
            if inside[0] != inside[1]:
                outer, inner = (ends[0], ends[1]) if inside[1] else (ends[1], ends[0])
                shown[outer if middle[z, y, x] < 0 else inner] = True
    return shown[1:-1, 1:-1, 1:-1]


@pytest.mark.parametrize("name", FORMULAS)
def test_signs_at_centres_decide(name: str) -> None:
    body = Implicit(FORMULAS[name])
    f = body.function
    expected = plain_rule(lambda x, y, z: f(x.copy(), y.copy(), z.copy()), GRID)
    shown = lit(body)
    assert (shown == expected).all()
    inside = (f(*centres(GRID).T) <= 0).reshape(GRID[::-1])
    assert (lit(Implicit(FORMULAS[name], fill="solid")) == inside).all()


@pytest.mark.parametrize("name", FORMULAS)
def test_bricks_and_planes_have_the_same_voxels(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for fill in ("shell", "solid"):
        body = Implicit(FORMULAS[name], fill=fill)
        found = []
        for cost in (1e9, 0):
            monkeypatch.setattr(implicit, "_DENSE_COST", cost)
            found.append(voxelized(body).voxels.tolist())
        assert found[0] == found[1]
        by_function = Implicit(body.function, fill=fill)  # no bounds
        assert voxelized(by_function).voxels.tolist() == found[0]


def test_nothing_leaks() -> None:
    for name in ("sphere", "torus", "blobs", "kinks"):
        body = Implicit(FORMULAS[name])
        inside = (body.function(*centres(GRID).T) < 0).reshape(GRID[::-1])
        assert inside.any()
        assert leaks(lit(body), inside) == 0


def test_spheres_equal_those_in_closed_form() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        c, r = rng.uniform(6, 12, size=3), rng.uniform(3, 6)
        f = f"(x - {c[0]})**2 + (y - {c[1]})**2 + (z - {c[2]})**2 - {r}**2"
        closed = mask(voxelize_body(Sphere(c, r), VoxelBox.of_grid(GRID)).voxels, GRID)
        own = lit(Implicit(f))
        assert not (own & ~closed).any()
        assert (closed & ~own).sum() <= 24  # where the sphere crosses a line twice between centres


def test_poles_are_no_surface_and_jumps_are() -> None:
    found = voxelized(Implicit("1/(x - 7.3) + (y - 8)/1000"))
    assert len(found) == 0
    assert "poles" in found.notes[0]
    assert set(voxelized(Implicit("if(x < 7.3, -1, 1)")).voxels[:, 0]) == {7}
    both = voxelized(Implicit("(x - 3.2)/(x - 7.3)"))
    assert set(both.voxels[:, 0]) == {3}


def test_boxes_cut() -> None:
    found = voxelized(Implicit("z - 5.2", box=[(2, 3, 0), (9.5, 8, 20)]))
    assert found.voxels.min(axis=0).tolist() == [2, 3, 5]
    assert found.voxels.max(axis=0).tolist() == [9, 7, 5]
    solid = voxelized(Implicit("z - 5.2", box=[(2, 3, 1), (9, 8, 20)], fill="solid"))
    assert len(solid) == 7 * 5 * 4
    assert len(voxelized(Implicit("z - 5.2", box=[(50, 3, 0), (90, 8, 20)]))) == 0
    for box in ([(2, 3, 0), (2, 8, 20)], [(2, 3, 0), (1, 8, 20)]):
        with pytest.raises(BodyError, match="box is empty along x"):
            Implicit("x", box=box)


def test_transformed_functions_move_voxels() -> None:
    body = Implicit(FORMULAS["torus"], box=[(0, 0, 0), (20, 17, 19)])
    own = lit(body)
    moved = lit(body.transformed(np.eye(3), (1, -2, 3)))
    assert (moved[3:, :-2, 1:] == own[:-3, 2:, :-1])[:, :, :18].all()


def test_values_that_are_missing_are_counted() -> None:
    found = voxelized(Implicit("sqrt(x - 5) - 2"))
    assert set(found.voxels[:, 0]) == {8}
    assert "no value" in found.notes[0]
    with pytest.raises(BodyError, match="has no value at any of"):
        voxelized(Implicit("log(-1 - x**2)"))


def test_certificates_tell_what_they_do_not_cover() -> None:
    for name in ("sphere", "torus", "gyroid", "blobs", "kinks"):
        assert voxelized(Implicit(FORMULAS[name]), certified=True).notes == (), name
    needle = "hypot(x - 10, y - 8) - 0.1"  # passes between the centres
    assert "not proven: 1" in voxelized(Implicit(needle), certified=True).notes[0]
    assert "callable" in voxelized(Implicit(lambda x, y, z: x + y - z), certified=True).notes[0]


def test_functions_of_numbers_and_of_wrong_shapes() -> None:
    plain = voxelize_body(
        Implicit(lambda x, y, z: math.sin(x) + y - 4 + 0 * z), VoxelBox.of_grid((3, 5, 7))
    )
    same = voxelize_body(Implicit("sin(x) + y - 4"), VoxelBox.of_grid((3, 5, 7)))
    assert plain.voxels.tolist() == same.voxels.tolist()
    with pytest.raises(BodyError, match="f returned shape"):
        voxelized(Implicit(lambda x, y, z: np.ones((2, x.size + y.size + z.size))))
    with pytest.raises(CurveError, match="f: unknown name 'q'"):
        Implicit("x + q")


def test_hostile_functions_end() -> None:
    for f in ("sin(1e9*x)*sin(1e9*y)*sin(1e9*z)", "9**9**x", "x**1000 - 1", "1/sin(1e6*x)"):
        voxelized(Implicit(f), certified=True)


@pytest.mark.parametrize("times", [1, 2])
def test_a_box_that_is_turned_is_no_gap(times):
    """Outside its box a function is not taken, which is not to have no value."""
    body = Implicit("sqrt(x + 6) - 2", box=((-5, -5, -5), (5, 5, 5)))
    for _ in range(times):
        body = body.transformed([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    voxels = voxelize(body.transformed(np.eye(3), (10, 10, 10)))
    assert len(voxels)
    assert voxels.notes == ()


def test_gaps_are_counted_inside_a_turned_box_alone():
    body = Implicit("sqrt(x) - 2", box=((-5, -5, -5), (5, 5, 5)))
    (note,) = voxelize(body.transformed([[0, -1, 0], [1, 0, 0], [0, 0, 1]], (10, 10, 10))).notes
    assert note.startswith("f has no value at 50 %")
