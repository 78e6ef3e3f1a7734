"""Grid-plane digitisation: the paper's curves, named hard cases, refused curves."""

import numpy as np
import pytest
from space_curves import Function, chain, fourier_curve, paper_curve

import voxdisplay as vd
from voxdisplay.curves import Circle
from voxdisplay.errors import CurveError
from voxdisplay.voxelization import Sequence, clip, measure, voxelize, voxelize_many


def assert_guaranteed(sequence: Sequence) -> None:
    """Connected, ends in place, near the curve, two neighbours but for listed contacts."""
    voxels, curve = sequence.voxels, sequence.curve
    ends = np.floor(curve.position(np.array(curve.t_range))).T
    start = curve.position(np.array(curve.t_range[:1]))[:, 0]
    inner_side = sequence.closed and (np.abs(voxels[0] + 0.5 - start) <= 0.5 + 1e-6).all()
    assert np.array_equal(voxels[0], ends[0]) or inner_side
    assert sequence.closed or np.array_equal(voxels[-1], ends[1])
    assert sequence.report.gaps == 0
    assert not (np.diff(voxels, axis=0) == 0).all(axis=1).any()
    assert sequence.distances.max() <= 0.8661
    inner = np.ones(len(voxels), dtype=bool)
    inner[[*sequence.starts, *(sequence.starts - 1)]] = False
    if sequence.closed and not np.array_equal(voxels[-1], ends[1]):
        inner[-1] = True
    assert sequence.distances[inner].max(initial=0.0) <= 0.7072
    violations = measure.neighbour_violations(
        voxels, closed=sequence.closed, starts=sequence.starts
    )
    assert set(violations) <= set(sequence.contact_pairs.reshape(-1))
    assert np.all(np.diff(sequence.t) >= 0)


@pytest.mark.parametrize(
    ("radius", "frequency", "offset", "voxels", "e_max", "e_av"),
    [
        (40, 2, 50, 347, 0.584, 0.3442),
        (80, 2, 100, 693, 0.611, 0.3421),
        (40, 4, 50, 633, 0.645, 0.3695),
        (80, 4, 100, 1267, 0.664, 0.3689),
    ],
)
def test_paper_curves(
    radius: int, frequency: int, offset: int, voxels: int, e_max: float, e_av: float
) -> None:
    sequence = voxelize(paper_curve(radius, frequency, offset))
    report = sequence.report
    assert report.voxels <= voxels
    assert report.e_max <= e_max
    assert report.e_av <= e_av
    assert (report.gaps, report.contacts, report.pieces, report.closed) == (0, 0, 1, False)
    assert measure.neighbour_violations(sequence.voxels).size == 0
    assert_guaranteed(sequence)


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0), (1, 1, 0), (-1, 0, 1), (1, -1, 1)])
@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (0.5, 0.5, 0.5), (0.5, 0.0, 0.25)])
def test_lattice_lines_are_as_short_as_can_be(
    direction: tuple[int, int, int], start: tuple[float, float, float]
) -> None:
    def line(t: np.ndarray) -> tuple[np.ndarray, ...]:
        return tuple(s + d * t for s, d in zip(start, direction, strict=True))

    sequence = voxelize(Function(line, 0, 100))
    # A line through corners may begin or end in a voxel that it only touches.
    assert len(sequence) == 101 if start[0] == 0.5 else len(sequence) <= 102
    assert sequence.report.contacts == 0
    assert_guaranteed(sequence)


CURVES = {
    "along an edge": Function(lambda t: (100 * t + 0.5, 5.0, 7.0)),
    "in a mid-plane": Function(lambda t: (100 * t, 5.5, 7.5 + 33 * t)),
    "in three mid-planes": Function(lambda t: (100 * t, 5.5, 7.5)),
    "slanted": Function(lambda t: (100 * t, 61.8 * t, 38.1 * t)),
    "cusp": Function(lambda t: (64.2 + 40 * t**2, 64.1 + 40 * t**3, 64.3), -1, 1),
    "square root": Function(lambda t: (100 * np.sqrt(np.abs(t)), 50 * np.cbrt(t), 7.3), -0.3, 0.7),
    "small loops": Function(
        lambda t: (10 + 60 * t + 0.3 * np.cos(1257 * t), 20 + 0.3 * np.sin(1257 * t), 30.3)
    ),
    "wriggle": Function(lambda t: (60 * t, 20 + 3 * np.sin(600 * t), 9.9)),
    "helix with touching turns": Function(
        lambda t: (64 + 17 * np.cos(t), 64 + 17 * np.sin(t), 64 + 0.24 * t), 0, 38
    ),
    "figure of eight": Function(
        lambda t: (64 + 50 * np.sin(t), 64 + 25 * np.sin(2 * t), 9.2), 0, 2 * np.pi
    ),
    "there and back": Function(lambda t: (50 * np.sin(t), 3.3, 20 * np.sin(t)), 0, np.pi),
    "corners": chain(np.array([[0, 0, 0], [30, 3, 3], [30.3, 40, 10], [5, 5, 50], [5, 6, 50.0]])),
    "far away": Function(lambda t: (1e8 + 50 * np.cos(t), -1e8 + 50 * np.sin(t), t), 0, 6),
    "fine parameter": Function(
        lambda t: (50 * np.cos(1e6 * t), 50 * np.sin(1e6 * t), 0.3), 7.0, 7.000003
    ),
}


@pytest.mark.parametrize("name", CURVES)
def test_hard_curves(name: str) -> None:
    sequence = voxelize(CURVES[name])
    assert len(sequence.starts) == 1
    assert_guaranteed(sequence)


def test_wriggles_within_voxels_leave_a_clean_line() -> None:
    sequence = voxelize(CURVES["small loops"])
    assert len(sequence) <= 62
    assert sequence.report.contacts == 0


def test_steep_hairpins_keep_their_tips() -> None:
    curve = Function(
        lambda t: (50 + 40 * np.cos(t), 50 + 40 * np.sin(t), 50 + 40 * (1 - np.cos(32 * t))),
        0,
        2 * np.pi,
    )
    sequence = voxelize(curve)
    assert_guaranteed(sequence)
    assert sequence.closed
    assert measure.coverage(sequence.voxels, curve) < 2.5
    assert sequence.report.contacts > 0  # the legs of a hairpin stay less than two voxels apart


@pytest.mark.parametrize(
    ("function", "voxels"),
    [
        (lambda _: (3.2, 4.0, -5.9), {(3, 4, -6)}),
        (lambda t: (3.2 + 0.5 * t, 4.1, 5.5), {(3, 4, 5)}),
        (lambda t: (3.8 + 0.5 * t, 4.1, 5.5), {(3, 4, 5), (4, 4, 5)}),
        (lambda t: (3.8 + 0.5 * t, 3.8 + 0.5 * t, 3.8 + 0.5 * t), {(3, 3, 3), (4, 4, 4)}),
    ],
)
def test_curves_smaller_than_a_voxel(function, voxels: set[tuple[int, int, int]]) -> None:
    sequence = voxelize(Function(function))
    assert {tuple(voxel) for voxel in sequence.voxels.tolist()} == voxels
    assert len(sequence) == len(voxels)


# ---------------------------------------------------------------------------------- closed


@pytest.mark.parametrize("start", np.linspace(0, 6, 13))
def test_closed_curves_have_no_seam(start: float) -> None:
    curve = Function(
        lambda t: (50 + 40 * np.cos(t), 50.1 + 40 * np.sin(t), 50.2 + 40 * np.cos(4 * t)),
        start,
        start + 2 * np.pi,
    )
    sequence = voxelize(curve)
    assert sequence.closed
    assert sequence.report.contacts == 0
    assert measure.neighbour_violations(sequence.voxels, closed=True).size == 0
    assert_guaranteed(sequence)


@pytest.mark.parametrize(("around", "through"), [(2, 3), (3, 2), (5, 8)])
def test_torus_knots(around: int, through: int) -> None:
    def knot(t: np.ndarray) -> tuple[np.ndarray, ...]:
        reach = 40 + 16 * np.cos(through * t)
        return (
            64 + reach * np.cos(around * t),
            64 + reach * np.sin(around * t),
            64 + 16 * np.sin(through * t),
        )

    sequence = voxelize(Function(knot, 0, 2 * np.pi))
    assert (sequence.closed, sequence.report.contacts) == (True, 0)
    assert sequence.report.e_av < 0.38
    assert_guaranteed(sequence)


@pytest.mark.parametrize("radius", [0.1, 0.5, 0.8, 1, 1.3, 2, 3])
def test_small_circles(radius: float) -> None:
    curve = Function(
        lambda t: (9.3 + radius * np.cos(t), 9.4 + radius * np.sin(t), 9.5), 0, 2 * np.pi
    )
    sequence = voxelize(curve)
    assert sequence.closed
    assert_guaranteed(sequence)


def test_closed_is_found_or_said() -> None:
    def arc(t: np.ndarray) -> tuple[np.ndarray, ...]:
        return 20 * np.cos(t), 20 * np.sin(t), t * 0

    assert voxelize(Function(arc, 0, 2 * np.pi)).closed
    assert not voxelize(Function(arc, 0, 2 * np.pi, closed=False)).closed
    assert not voxelize(Function(arc, 0, 6)).closed
    with pytest.raises(CurveError, match=r"said to be closed, but its ends are .* voxels apart"):
        voxelize(Function(arc, 0, 6, closed=True))


# -------------------------------------------------------------------- jumps, poles, the rest


@pytest.mark.parametrize("size", [1.5, 10, 1e5])
def test_a_jump_splits_the_sequence(size: float) -> None:
    curve = Function(lambda t: (100 * t, 5.2 + size * (t > 1 / 3), 7.3))
    sequence = voxelize(curve)
    assert len(sequence.starts) == 2
    assert_guaranteed(sequence)
    first, second = np.split(sequence.voxels, sequence.starts[1:])
    assert set(first[:, 1]) == {5}
    assert set(second[:, 1]) == {int(5.2 + size)}
    assert first[-1, 0] == second[0, 0] == 33


def test_many_jumps() -> None:
    sequence = voxelize(Function(lambda t: (100 * t, 10 * np.floor(10 * t), 7.3), 0, 0.99))
    assert len(sequence.starts) == 10
    assert sequence.report.pieces == 10
    assert_guaranteed(sequence)


def test_a_plane_that_is_jumped_over_is_not_crossed(monkeypatch: pytest.MonkeyPatch) -> None:
    # Where no crossing is found, memory may hold anything.
    def dirty(shape: int | tuple[int, ...], dtype: type = float) -> np.ndarray:
        return np.full(shape, np.nan if dtype is float else 0, dtype)

    monkeypatch.setattr(np, "empty", dirty)
    sequence = voxelize(Function(lambda t: (20 * t, 5.3 + 0.5 * (t > 1 / 3), 7.3)))
    assert set(sequence.voxels[:, 1]) == {5}
    assert_guaranteed(sequence)


@pytest.mark.parametrize(
    ("function", "axis", "where"),
    [
        (lambda t: (1 / (t - 0.5), t, t), "x", "t = 0.49999|t = 0.5"),
        (lambda t: (t, 40 * np.tan(np.pi * t), t), "y", "t = 0.49999|t = 0.5"),
        (lambda t: (t, t, 9 * (t > 0.3) + 1e-10 / (t - 0.3)), "z", "t = 0.3"),
        (lambda t: (t, np.log(t), t), "y", "t = 0.0 is not finite"),
        (lambda t: (t, t, np.sqrt(t - 0.2)), "z", "t = 0.0 is not finite"),
        (lambda t: (t * 1e11, t, t), "x", "too far out"),
    ],
)
def test_curves_that_run_off_are_refused(function, axis: str, where: str) -> None:
    with pytest.raises(CurveError, match=where) as caught:
        voxelize(Function(function))
    assert caught.value.axis == axis
    assert f"{axis} " in str(caught.value)
    assert caught.value.hint


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda t: (t, t, 40 * np.sin(1e9 * t)), "too long"),
        (lambda t: (t, t, 0.4 * np.sin(1e9 * t)), "too rough"),
        (lambda t: (t * 1e8, t, t), "too long"),
        (lambda t: (t, t, 40 * np.modf(1e15 * np.sin(1e15 * t))[0]), "too long"),
    ],
)
def test_endless_curves_are_refused(function, message: str) -> None:
    with pytest.raises(CurveError, match=message) as caught:
        voxelize(Function(function))
    assert caught.value.hint


@pytest.mark.parametrize(
    "t_range", [(0.0, np.inf), (1.0, 1.0), (2.0, 1.0), (np.nan, 1.0), (-1e308, 1e308)]
)
def test_bad_ranges_are_refused(t_range: tuple[float, float]) -> None:
    with pytest.raises(CurveError, match="range of t"):
        voxelize(Function(lambda t: (t, t, t), *t_range))


@pytest.mark.parametrize("t_range", [(0,), "ab", None, (0, 1, 2)])
def test_ranges_that_are_not_two_numbers_are_named(t_range: object) -> None:
    curve = Function(lambda t: (t, t, t))
    curve.t_range = t_range
    with pytest.raises(CurveError, match="t_range must be two numbers"):
        voxelize(curve)


def test_breaks_may_be_a_list() -> None:
    class Bent(Function):
        breaks = [0.25, 0.5]  # noqa: RUF012 - as people write it

    curve = Bent(lambda t: (9 * t, np.abs(t - 0.5), 0.0))
    assert np.array_equal(voxelize(curve).voxels[0], [0, 0, 0])


def test_a_batch_says_which_curve_is_wrong() -> None:
    good, bad = Function(lambda t: (t, t, t)), Function(lambda t: (t, np.log(t), t))
    with pytest.raises(CurveError, match=r"curve 2: y = -inf at t = 0\.0"):
        voxelize_many([good, good, bad])
    with pytest.raises(CurveError, match=r"curve 40: y = -inf at t = 0\.0"):
        voxelize_many([*[good] * 40, bad])


def test_slopes_may_be_infinite() -> None:
    # No number holds 60 / 1e-310: the tangents that choose between corners are lost, no more.
    def coil(t: np.ndarray) -> tuple[np.ndarray, ...]:
        turn = t / 1e-310
        return 60 * np.cos(3 * turn), 60 * np.sin(3 * turn), 30 * turn

    assert_guaranteed(voxelize(Function(coil, 0.0, 1e-310)))


# ------------------------------------------------------------------------ batches and faces


def test_no_curves() -> None:
    assert voxelize_many([]) == []


def rectangle(rng: np.random.Generator, width: float, height: float) -> vd.Polyline:
    across, up = np.array([[width], [height]]) * np.eye(3)[rng.permutation(3)[:2]]
    corner = rng.integers(9, 99, 3) + rng.choice((0.0, 0.3, 0.5))
    return vd.Polyline(np.array([0 * up, across, across + up, up]) + corner, closed=True)


def test_a_curve_is_the_same_alone_and_in_a_batch() -> None:
    curves = [
        fourier_curve(seed, kind, closed=closed)
        for seed in range(8)
        for kind in ("smooth", "rough", "tiny")
        for closed in (False, True)
    ]
    curves += [*CURVES.values(), Function(lambda t: (9 * t, 9 * (t > 0.5), t))]
    # Some sides are as long as corners must be apart, up to rounding.
    rng = np.random.default_rng(2)
    sides = np.where(rng.random((80, 2)) < 0.5, 8, rng.integers(2, 20, (80, 2)))
    curves += [rectangle(rng, *pair) for pair in sides]
    for curve, many in zip(curves, voxelize_many(curves), strict=True):
        alone = voxelize(curve)
        assert np.array_equal(alone.voxels, many.voxels)
        assert np.array_equal(alone.t, many.t)
        assert np.array_equal(alone.starts, many.starts)
        assert alone.closed == many.closed


def test_ranges_of_t_in_a_batch_may_be_of_any_size() -> None:
    tiny = Function(lambda t: (50e300 * t, 40 * (1e300 * t) ** 2, 0.0), 0.0, 1e-300)
    far = Function(lambda t: (t - 1e15, (t - 1e15) ** 2 / 4, 0.0), 1e15, 1e15 + 4)
    curves = [tiny, far, tiny]
    for curve, many in zip(curves, voxelize_many(curves), strict=True):
        assert np.array_equal(voxelize(curve).voxels, many.voxels)


def test_a_long_curve_is_the_same_alone_and_in_a_batch() -> None:
    long = paper_curve(8000, 4, 0)  # several blocks
    other = fourier_curve(1, "smooth", closed=False)
    _, many, _ = voxelize_many([other, long, other])
    assert np.array_equal(voxelize(long).voxels, many.voxels)


def test_voxelize_is_a_public_function() -> None:
    curve = Function(lambda t: (9 * t, t, t))
    assert np.array_equal(vd.voxelize(curve).voxels, voxelize(curve).voxels)
    assert vd.voxelize is voxelize
    with pytest.raises(
        ValueError, match="method: expected one of 'grid-plane', 'march', found 'magic'"
    ):
        voxelize(curve, method="magic")


def test_sequences_are_values() -> None:
    sequence = voxelize(Function(lambda t: (9 * t, t, t)))
    assert sequence.voxels.dtype == np.int32
    assert sequence.voxels.flags.c_contiguous
    with pytest.raises(ValueError, match="read-only"):
        sequence.voxels[0] = 0
    assert sequence.report is sequence.report
    assert sequence.report.seconds > 0


def test_representations_fit_on_a_line() -> None:
    sequence = voxelize(Function(lambda t: (9.5 * t, 2.0 + 5 * (t > 0.5), t)))
    assert repr(sequence) == "<Sequence: 11 voxels, open, 2 pieces, from (0, 2, 0) to (9, 7, 1)>"
    assert repr(sequence.report).startswith("Report(voxels=11, closed=False, pieces=2, e_max=0.")
    assert "jumps=(0.50" in repr(sequence.report)
    whole = voxelize(Function(lambda t: (9.5 * t, 2.0, t)))
    assert "jumps" not in repr(whole.report)


# ---------------------------------------------------------------------------------- clipping


def test_clip_gives_maximal_stretches() -> None:
    sequence = voxelize(paper_curve(40, 4, 50))
    grid = (128, 128, 128)
    runs = clip(sequence, grid)
    inside = ((sequence.voxels >= 0) & (sequence.voxels < grid)).all(axis=1)
    assert len(runs) == 5
    assert (runs[:, 1] - runs[:, 0]).sum() == inside.sum() == 609
    for start, stop in runs:
        assert inside[start:stop].all()
        assert start == 0 or not inside[start - 1]
        assert stop == len(inside) or not inside[stop]


def test_clip_on_a_grid_that_is_no_cube() -> None:
    sequence = voxelize(Function(lambda t: (9 * t - 0.5, 2.0, 3.0)))
    assert clip(sequence, (3, 5, 7)).tolist() == [[1, 4]]
    assert clip(sequence, (7, 5, 3)).tolist() == []
    assert clip(sequence, (5, 3, 7)).tolist() == [[1, 6]]


def test_clip_separates_pieces() -> None:
    sequence = voxelize(Function(lambda t: (10 * t, 2.0 + 4 * (t > 0.5), 3.0)))
    start = sequence.starts[1]
    assert clip(sequence, (20, 20, 20)).tolist() == [[0, start], [start, len(sequence)]]


# -------------------------------------------------------------------------------- symmetries


@pytest.mark.parametrize("middle", [64.0, 64.5])
def test_circles_are_symmetric(middle: float) -> None:
    for radius in np.arange(2, 20, 0.5):
        circle = Circle(center=(middle, middle, 7.5), radius=float(radius))
        voxels = voxelize(circle).voxels
        mirrored = int(2 * middle) - 1 - voxels
        x, y, z = voxels.T
        images = [(mirrored[:, 0], y), (x, mirrored[:, 1]), (y, x)]
        lit = set(map(tuple, voxels.tolist()))
        for image in images:
            assert set(map(tuple, np.stack((*image, z), axis=1).tolist())) == lit
