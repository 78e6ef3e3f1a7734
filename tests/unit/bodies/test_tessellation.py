"""Triangulations of surfaces: watertight, near the surface, and what is left out of them."""

from collections import Counter
from contextlib import suppress

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.bodies.geometry import TriangleMesh
from voxdisplay.bodies.surface import Surface
from voxdisplay.errors import BodyError, CurveError
from voxdisplay.voxelization.body_voxelization import voxelize_body
from voxdisplay.voxelization.voxel_box import VoxelBox

BOX = np.zeros(3), np.full(3, 40.0)
TURN, HALF = (0, "tau"), ("-pi/2", "pi/2")
SPHERE = ("20+15*cos(u)*cos(v)", "20+15*sin(u)*cos(v)", "20+15*sin(v)")
TORUS = ("20+(12+5*cos(v))*cos(u)", "20+(12+5*cos(v))*sin(u)", "20+5*sin(v)")
MOEBIUS = ("20+(12+v*cos(u/2))*cos(u)", "20+(12+v*cos(u/2))*sin(u)", "20+v*sin(u/2)")
_R = "(10+5*(cos(u/2)*sin(v)-sin(u/2)*sin(2*v)))"
KLEIN = (f"20+{_R}*cos(u)", f"20+{_R}*sin(u)", "20+5*(sin(u/2)*sin(v)+cos(u/2)*sin(2*v))")


def triangles_of(surface: Surface, *, certified: bool = False) -> TriangleMesh:
    return surface.geometry(BOX, certified=certified)


def edge_counts(mesh: TriangleMesh) -> Counter:
    """Return how many triangles lie at each edge, by the snapped positions of its ends."""
    corners = np.rint(mesh.vertices * 2.0**16).astype(np.int64)
    counts: Counter = Counter()
    for face in mesh.faces.tolist():
        points = [tuple(corners[each].tolist()) for each in face]
        if len(set(points)) == 3:
            counts.update(frozenset((points[k], points[k - 1])) for k in range(3))
    return counts


@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize(
    ("formulas", "u", "v", "boundary"),
    [
        (SPHERE, TURN, HALF, False),
        (TORUS, TURN, TURN, False),
        (MOEBIUS, TURN, (-4, 4), True),
        (KLEIN, TURN, TURN, False),
        (("20 + u", "20 + v", "20 + 3*sin(u/4)*cos(v/5)"), (-15, 15), (-15, 15), True),
    ],
)
def test_sewn_without_gaps(formulas, u, v, boundary: bool, certified: bool) -> None:
    mesh = triangles_of(Surface(*formulas, u=u, v=v), certified=certified)
    assert mesh.notes == ()
    counts = edge_counts(mesh)
    ones = [edge for edge, count in counts.items() if count % 2]
    assert bool(ones) == boundary
    # The boundary is one closed line, or two: each of its points has two edges.
    ends = Counter(point for edge in ones for point in edge)
    assert all(count == 2 for count in ends.values())


@pytest.mark.parametrize("certified", [False, True])
def test_triangles_are_near_their_surface(certified: bool) -> None:
    rng = np.random.default_rng(1)
    mesh = triangles_of(Surface(*TORUS, u=TURN, v=TURN), certified=certified)
    weights = rng.dirichlet((1, 1, 1), size=len(mesh.faces))
    points = np.einsum("fk,fkc->fc", weights, mesh.vertices[mesh.faces])
    ring = np.hypot(points[:, 0] - 20, points[:, 1] - 20) - 12
    assert np.abs(np.hypot(ring, points[:, 2] - 20) - 5).max() <= 0.02
    u, v = mesh.parameters["u"], mesh.parameters["v"]
    x = 20 + (12 + 5 * np.cos(v)) * np.cos(u)
    assert np.abs(x - mesh.vertices[:, 0]).max() < 1e-9


def test_waves_that_the_first_grid_cannot_see_are_found() -> None:
    flat = Surface("u", "v", "20 + 8*sin(32*pi*u/40)", u=(0, 40), v=(0, 40))
    heights = triangles_of(flat).vertices[:, 2]
    assert heights.min() < 12.1
    assert heights.max() > 27.9


def test_certified_finds_what_samples_miss() -> None:
    spike = Surface("u", "v", "20 + 15*exp(-((u - 17.77)**2 + (v - 13.33)**2)*900)",
                    u=(0, 40), v=(0, 40))  # fmt: skip
    assert triangles_of(spike).vertices[:, 2].max() < 22
    found = triangles_of(spike, certified=True)
    assert found.notes == ()
    assert found.vertices[:, 2].max() > 34.9
    by_callable = Surface(lambda u, v: (u, v, u * v / 40), u=(0, 40), v=(0, 40))
    assert "nothing is proven" in triangles_of(by_callable, certified=True).notes[0]


def test_what_is_outside_of_the_box_is_not_refined() -> None:
    wide = Surface("u", "v", "20 + sin(u)", u=(-1e5, 1e5), v=(0, 40))
    mesh = triangles_of(wide)
    assert np.abs(mesh.vertices[:, 0] - 20).max() < 30
    assert len(mesh.faces) < 300_000


def test_jumps_and_poles_are_not_crossed() -> None:
    step = triangles_of(Surface("u", "v", "10 + 20*floor(u/20)", u=(0, 39), v=(0, 39)))
    assert "jumps" in step.notes[0]
    sides = step.vertices[step.faces][:, :, 2]
    assert np.ptp(sides, axis=1).max() == 0
    assert np.abs(step.vertices[:, 0] - 20).min() < 0.01
    pole = triangles_of(Surface("u", "v", "20 + 1/(u - 19.3)", u=(0, 39), v=(0, 39)))
    assert pole.vertices[:, 2].min() < 0
    assert pole.vertices[:, 2].max() > 40
    middle = pole.vertices[pole.faces][:, :, 0]
    assert not ((middle.min(axis=1) < 19.3) & (middle.max(axis=1) > 19.3)).any()


def test_where_there_is_no_point_there_is_no_triangle() -> None:
    cap = Surface("20 + u", "20 + v", "20 + sqrt(150 - u**2 - v**2)", u=(-15, 15), v=(-15, 15))
    mesh = triangles_of(cap)
    assert "no point" in mesh.notes[0]
    rim = np.hypot(mesh.vertices[:, 0] - 20, mesh.vertices[:, 1] - 20).max()
    assert 12.2 < rim <= 150**0.5
    with pytest.raises(BodyError, match="y is not finite at u = 0, v = 1"):
        triangles_of(Surface("u", "log(-1 - u**2)", "v", u=(0, 1), v=(1, 2)))


def test_hostile_formulas_end() -> None:
    for z in ("20 + 10*sin(1e9*u)*cos(1e9*v)", "9**9**u", "tan(1e7*u*v)", "exp(1000*u)"):
        for certified in (False, True):
            surface = Surface("40*u", "40*v", z, u=(0, 1), v=(0, 1))
            with suppress(BodyError):
                triangles_of(surface, certified=certified)


def test_a_surface_may_be_a_point_or_a_line() -> None:
    for formulas in (("20", "20", "20"), ("u", "u", "u")):
        assert len(triangles_of(Surface(*formulas, u=(1, 9), v=(1, 9))).faces)


def test_wrong_arguments_are_named() -> None:
    with pytest.raises(CurveError, match="u runs backwards: 3 to 1"):
        Surface("u", "v", "1", u=(3, 1), v=(0, 1))
    with pytest.raises(CurveError, match="z: unknown name 'w'"):
        Surface("u", "v", "w", u=(0, 1), v=(0, 1))
    with pytest.raises(TypeError, match="needs x, y and z"):
        Surface("u", "v", u=(0, 1), v=(0, 1))
    with pytest.raises(BodyError, match="the surface returned shape"):
        triangles_of(Surface(lambda u, v: np.stack((u, v)), u=(0, 1), v=(0, 1)))


def test_solids_are_filled_where_the_box_cuts_them_and_sheets_have_no_notes() -> None:
    ball = Surface(*SPHERE, u=TURN, v=HALF, fill="solid")
    whole = voxelize_body(ball, VoxelBox.of_grid((40, 40, 40)))
    cut = voxelize_body(ball, VoxelBox((0, 0, 12), (40, 40, 22)))
    inside = whole.voxels[(whole.voxels[:, 2] >= 12) & (whole.voxels[:, 2] < 22)]
    assert cut.voxels.tolist() == inside.tolist()
    x, y, z = np.indices((40, 40, 40)).reshape(3, -1) + 0.5
    apart = np.sqrt((x - 20) ** 2 + (y - 20) ** 2 + (z - 20) ** 2)
    assert (apart < 14.97).sum() <= len(whole) <= (apart <= 15).sum()
    sheet = voxelize_body(Surface(*MOEBIUS, u=TURN, v=(-4, 4)), VoxelBox.of_grid((40, 40, 40)))
    assert sheet.notes == ()
    assert sheet.parameters["v"].min() < -3.5
    assert len(sheet.parameters["u"]) == len(sheet)


def test_a_pole_between_two_lines_of_the_first_grid_is_found():
    found = vd.voxelize(vd.Surface("u", "v", "1/(u - 20)", u=(0, 99), v=(0, 99)), clip=(99, 99, 60))
    assert "poles" in " ".join(found.notes)
    x, _, z = found.voxels.T
    assert z.max() == 59
    heights = {int(a): int(b) for a, b in zip(x, z, strict=True) if a > 21}
    assert all(z == int(1 / (x + 0.5 - 20)) for x, z in heights.items())


def test_a_surface_far_larger_than_its_box_is_drawn():
    wide = vd.Surface("u", "v", "u*v/9 + 30", u=(-1e9, 1e9), v=(-1e9, 1e9))
    voxels = vd.voxelize(wide, clip=(40, 40, 60)).voxels + 0.5
    assert len(voxels) > 800
    x, y, z = voxels.T
    assert (np.abs(x * y / 9 + 30 - z) / np.sqrt(1 + (x / 9) ** 2 + (y / 9) ** 2)).max() < 0.55
