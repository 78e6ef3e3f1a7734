"""Certified sequences: nothing missed, and no certificate without a proof."""

import json
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from space_curves import Function

import voxdisplay as vd
from voxdisplay.compute.kernel_backend import set_enabled
from voxdisplay.curves import Transformed
from voxdisplay.voxelization import measure, thinning, voxelize, voxelize_many
from voxdisplay.voxelization.certify import COVERAGE, END_ERROR, ERROR, Certificate, certify
from voxdisplay.voxelization.restoring import restore_coverage
from voxdisplay.voxelization.voxel_events import NO_HEADING, VoxelEvents

POINTS = np.random.default_rng(3).normal(size=(7, 3)) * 30
ANY = {
    "expressions": vd.Parametric("t**3 - 2", "abs(t)**1.5", "atan2(t, t*t + 1)", t=(-2, 3)),
    "numbers": vd.Parametric(1, "t", 2.5, t=(0, 9)),
    "segment": vd.Segment((0, 0, 0), (3, 4, 5)),
    "polyline": vd.Polyline(POINTS),
    "closed polyline": vd.Polyline(POINTS, closed=True),
    "points": vd.Points(POINTS),
    "one point": vd.Points(POINTS[:1]),
    "circle": vd.Circle((1, 2, 3), 20, (1, 2, 3)),
    "ellipse": vd.Ellipse((1, 2, 3), POINTS[:2]),
    "arc": vd.Arc((0, 0, 0), 5, 2, -3, (0, 1, 1)),
    "helix": vd.Helix((0, 0, 0), 9, 3, 5, (1, 1, 0), start=1),
    "lissajous": vd.Lissajous((50, 50, 50), (40, 30, 20), (3, 4, 5), (0.1, 0.2, 0.3)),
    "torus knot": vd.TorusKnot(2, 3, (50, 50, 50), 30, 10, (1, 2, 3)),
    "bezier": vd.Bezier(POINTS),
    "line as bezier": vd.Bezier(POINTS[:2]),
    "b-spline": vd.BSpline(POINTS),
    "periodic b-spline": vd.BSpline(POINTS, closed=True),
    "nurbs": vd.BSpline(POINTS, 2, weights=[1, 2, 3, 4, 3, 2, 1]),
    "double knots": vd.BSpline(POINTS, 3, knots=[0, 0, 0, 0, 1, 1, 2, 2, 2, 2, 2]),
    "catmull-rom": vd.CatmullRom(POINTS),
    "closed catmull-rom": vd.CatmullRom(POINTS, closed=True),
    "transformed": Transformed(vd.CatmullRom(POINTS), 0.3, (1, -2, 3)),
    "turned": Transformed(vd.CatmullRom(POINTS), [[0, -1, 0], [0.6, 0.3, 0], [0, 0.5, -2]]),
}
PAPER = [(40, 2), (80, 2), (40, 4), (80, 4)]


def paper(radius, frequency):
    return vd.Parametric(
        "m + R*cos(t)", "m + R*sin(t)", "m + R*(1 - cos(w*t))",
        t=("-170*deg", "170*deg"), params={"R": radius, "w": frequency, "m": 1.25 * radius + 0.5},
    )  # fmt: skip


def spike(width, height=100):
    return vd.Parametric(
        "10 + 20*t", "10 + 5*t", f"10 + {height}*exp(-((t - 0.123456)/{width})**2)", t=(0, 1)
    )


def assert_proven(sequence):
    """The certificate, and that independent measurements do not contradict it."""
    assert isinstance(sequence.proof, Certificate), sequence.proof
    assert sequence.report.certified
    assert sequence.proof.coverage <= COVERAGE
    assert sequence.proof.error <= ERROR
    assert sequence.proof.end_error <= END_ERROR
    assert sequence.report.gaps == 0
    assert sequence.report.pieces == 1
    assert sequence.report.e_max <= max(sequence.proof.error, sequence.proof.end_error)
    seen = measure.coverage(sequence.voxels, sequence.curve)
    assert seen <= sequence.proof.coverage * np.sqrt(3)


@pytest.mark.parametrize("name", ANY)
@pytest.mark.parametrize("size", [4, 61, 2000])
def test_enclosures_hold_the_curve(name, size):
    curve = ANY[name]
    rng = np.random.default_rng(size)
    ends = np.sort(np.r_[curve.t_range, rng.uniform(*curve.t_range, size)])
    low, high = curve.enclosure(ends[:-1], ends[1:])
    for share in (0, 1, *rng.uniform(size=20)):
        t = np.clip(ends[:-1] + share * np.diff(ends), ends[:-1], ends[1:])
        points = curve.position(t)
        unknown = np.isnan(low) | np.isnan(high)
        assert (unknown | (low <= points) & (points <= high)).all()
    if size == 2000:
        assert not unknown.any()
        wide = (high - low).max() / np.abs(np.diff(curve.position(ends), axis=1)).max(initial=1e-12)
        assert wide < 2 or name == "one point"
    point_low, point_high = curve.enclosure(ends, ends)
    assert (point_high - point_low).max() < 1e-9


@pytest.mark.parametrize("name", ANY)
def test_every_kind_of_curve_is_certified(name):
    assert_proven(voxelize(ANY[name], certified=True))


@pytest.mark.parametrize(("radius", "frequency"), PAPER)
def test_where_nothing_is_narrow_voxels_are_the_same(radius, frequency):
    curve = paper(radius, frequency)
    sequence = voxelize(curve, certified=True)
    assert_proven(sequence)
    assert np.array_equal(sequence.voxels, voxelize(curve).voxels)
    assert sequence.report.contacts == 0


@pytest.mark.parametrize("width", ["1e-3", "1e-5", "1e-7", "1e-10", "1e-12"])
def test_a_spike_is_seen_whole_however_narrow(width):
    sequence = voxelize(spike(width), certified=True)
    assert_proven(sequence)
    column = {tuple(voxel) for voxel in sequence.voxels.tolist()}
    x, y = 12, 10
    assert {(x, y, z) for z in range(11, 110)} <= column  # and from its foot up
    assert sequence.proof.coverage < 1.5


def test_without_a_certificate_the_spike_is_missed_and_no_one_says_otherwise():
    report = voxelize(spike("1e-7")).report
    assert report.voxels < 30
    assert not report.certified


def test_several_spikes_on_several_axes_and_low_ones():
    curve = vd.Parametric(
        "20*t",
        "30*exp(-((t - 0.2)/1e-6)**2)",
        "0.3 - 3*exp(-((t - 0.7)/1e-8)**2) + 40*max(0, 1 - abs(t - 0.4)/1e-9)",
        t=(0, 1),
    )
    sequence = voxelize(curve, certified=True)
    assert_proven(sequence)
    assert sequence.voxels[:, 1].max() == 29
    assert sequence.voxels[:, 2].max() == 39
    assert sequence.voxels[:, 2].min() == -3


def test_a_tip_that_is_never_longer_than_a_voxel_in_any_step():
    """Wriggling across hides the way along from who looks at the dominant axis only."""
    curve = vd.Parametric("10 + 0.3*sin(200*t)", "10 + 5*sin(t)", "5", t=(0, 10))
    sequence = voxelize(curve, certified=True)
    assert_proven(sequence)
    assert sequence.voxels[:, 1].max() == 14


@pytest.mark.parametrize(
    "curve",
    [
        vd.Parametric("10*t", "10.5", "3", t=(-1, 1)),
        vd.Parametric("10.5 + 5*cos(t)", "10.5 + 5*sin(t)", "10.5", t=(0, "tau")),
        vd.Parametric("10*t", "10*t", "10*t", t=(-1, 1)),
        vd.Parametric("0.5 + 10*t", "0.5 + 10*t", "0.5 - 10*t", t=(-1, 1)),
        vd.Parametric("10*t", "0.5 + abs(t)*10", "0.5 + min(t, 0)*20", t=(-1, 1)),
        vd.Parametric("10*t", "10*sqrt(1 - t*t)", "5", t=(-1, 1)),
        vd.Parametric("t", "10*sqrt(t)", "5", t=(0, 20)),
        vd.Parametric("3e8 + t", "-3e8 + t*t", "5", t=(0, 20)),
        vd.Parametric("40*t", "10 + 0.3*sin(5000*t)", "5", t=(0, 1)),
    ],
    ids=range(9),
)
def test_ties_borders_and_far_places(curve):
    assert_proven(voxelize(curve, certified=True))


@pytest.mark.parametrize(
    ("curve", "why"),
    [
        (vd.Parametric("t", "10*atan2(sin(t), cos(t))", "5", t=(0, 20)), "jump"),
        (vd.Parametric("t", "40*max(0, 1 - abs(t - 3.3)*1e30)", "5", t=(0, 20)), "jump"),
        (vd.Parametric("20*t", "sqrt((t - .123456)**2 - 1e-18)", "5", t=(0, 1)), "no curve"),
        (vd.Parametric("20*t", "5*sin(t)/t", "5", t=(-0.9, 1)), "no value"),
        (vd.Parametric(lambda t: np.stack((t, t, t)), t=(0, 9)), "function"),
        (Function(lambda t: (t, t, t)), "function"),
    ],
    ids=["jump", "spike narrower than floats", "hole", "0/0", "callable", "other curve"],
)
def test_no_certificate_without_a_proof(curve, why):
    sequence = voxelize(curve, certified=True)
    assert why in sequence.proof
    assert not sequence.report.certified
    assert np.array_equal(sequence.voxels, voxelize(curve).voxels)


@pytest.mark.parametrize(
    "y", ["1/(t - 0.123456)", "tan(t)", "1e-9/(t - 0.123456)**2", "1e-12/abs(t - 0.5000001)"]
)
def test_a_pole_is_an_error_or_no_proof(y):
    try:
        sequence = voxelize(vd.Parametric("t", y, "5", t=(0, 2)), certified=True)
    except vd.CurveError as error:
        assert error.axis == "y"  # noqa: PT017 - one of two right answers
    else:
        assert not sequence.report.certified


@pytest.mark.parametrize(
    "harm",
    [
        lambda voxels, t: (np.delete(voxels, 50, axis=0), np.delete(t, 50)),
        lambda voxels, t: (voxels + np.array((0, 0, 1), dtype=np.int32), t),
        lambda voxels, t: (voxels[:-4], t[:-4]),
        lambda voxels, t: (
            np.where(np.arange(len(t))[:, None] == 9, voxels + np.eye(3)[2], voxels),
            t,
        ),
    ],
    ids=["gap", "moved", "cut short", "one aside"],
)
def test_the_proof_is_of_the_voxels_it_is_given(harm):
    curve = vd.Parametric("10*t", "20*sin(t)", "3.3", t=(0, 9))
    good = voxelize(curve, certified=True)
    ends = np.linspace(0, 9, 5000)
    boxes = curve.enclosure(ends[:-1], ends[1:])
    args = (curve, (ends[:-1], ends[1:]), boxes)
    assert isinstance(certify(*args, good.voxels, good.t, closed=False), Certificate)
    assert isinstance(certify(*args, *harm(good.voxels, good.t), closed=False), str)


def test_a_batch_proves_what_each_proves_alone():
    curves = [*ANY.values(), Function(lambda t: (t, t, t)), spike("1e-9")]
    for curve, many in zip(curves, voxelize_many(curves, certified=True), strict=True):
        alone = voxelize(curve, certified=True)
        assert np.array_equal(alone.voxels, many.voxels)
        assert alone.proof == many.proof


def test_what_one_curve_needs_for_its_proof_is_no_fault_beside_another(monkeypatch):
    monkeypatch.setattr("voxdisplay.voxelization.adaptive_sampling.MAX_SAMPLES", 16_000)

    class Loose(vd.Segment):
        def enclosure(self, t_lo, t_hi):
            low, high = super().enclosure(t_lo, t_hi)
            return low, high + 3000 * (t_hi - t_lo)

    loose = Loose((0, 0, 0), (9, 8, 7))
    alone = voxelize(loose, certified=True)
    beside, _ = voxelize_many([loose, spike(1e-3)], certified=True)
    assert np.array_equal(alone.voxels, beside.voxels)
    assert alone.proof == beside.proof


@pytest.mark.parametrize("compiled", [False, True])
def test_tips_are_left_whatever_curve_comes_before(compiled):
    if compiled:
        pytest.importorskip("numba")
    before = set_enabled(compiled)
    try:
        there = [(0.5, 0.5, 0.5), (0.5, 1.5, 0.5)]
        back = vd.Polyline([*there, there[0]])
        alone = voxelize(back, certified=True)
        _, beside, _ = voxelize_many([vd.Segment(*there)] + [back] * 2, certified=True)
        assert np.array_equal(alone.voxels, beside.voxels)
    finally:
        set_enabled(before)


def test_nothing_is_proven_of_the_march():
    with pytest.raises(ValueError, match="grid-plane"):
        voxelize(ANY["circle"], method="march", certified=True)


SHAPES = [
    "sin({}*t + {})",
    "cos({}*t)*sin({}*t)",
    "tanh({}*t - {})",
    "exp(-({}*t - {})**2)",
    "abs(sin({}*t + {}))",
]
NUMBERS = st.floats(0.1, 9).map(lambda x: round(x, 3))
WAVES = st.lists(
    st.tuples(st.floats(-12, 12), st.sampled_from(SHAPES), NUMBERS, NUMBERS), min_size=1, max_size=4
).map(lambda terms: " + ".join(f"{a:.3f}*{shape.format(b, c)}" for a, shape, b, c in terms))


@given(WAVES, WAVES, WAVES, st.sampled_from([1, 6, 20]))
@settings(max_examples=60, deadline=None)
def test_random_curves_are_certified(x, y, z, last):
    sequence = voxelize(vd.Parametric(x, y, z, t=(-1, last)), certified=True)
    assert_proven(sequence)


@pytest.mark.parametrize(
    "curve",
    [
        # Seen along x only, the way along y and back hides between two crossings.
        vd.Parametric("4.2 + 1.3*sin(397*t)", "2 + 12*sin(t)", "0.3*cos(200*t)", t=(0, 10)),
        vd.Parametric("3.1 + 0.35*sin(90*t)", "1 + 5*sin(t)", "2", t=(0, 10)),
        # Legs less than two voxels apart all along: the two-neighbour rule has nothing to say.
        vd.Parametric("20*t", "3 + 20*sin(40*t)", "20*t*t", t=(0, 1)),
    ],
    ids=["fast", "narrow", "close legs"],
)
def test_wriggling_across(curve):
    assert_proven(voxelize(curve, certified=True))


def test_what_thinning_took_is_put_back():
    """Across the seam of a closed curve, thinning may cut off a tip that is 3 voxels long."""
    thin = voxelize(vd.Parametric("t", "6*exp(-(t - 5)**2*4)", "2", t=(0, 10)), certified=True)
    full = _events(thin)
    cut = full.take(np.flatnonzero(thin.voxels[:, 1] < 2))
    ends = np.linspace(0, 10, 300)
    boxes = thin.curve.enclosure(ends[:-1], ends[1:])
    args = (ends[:-1], ends[1:]), boxes
    mended = restore_coverage(cut, full, *args, closed=False)
    assert cut.t.size < mended.t.size <= full.t.size
    assert isinstance(
        certify(thin.curve, *args, mended.voxels.T, mended.t, closed=False), Certificate
    )


def test_a_sequence_without_its_tip_is_restored_before_it_is_certified(monkeypatch):
    curve = vd.Parametric("t", "6*exp(-(t - 5)**2*4)", "2", t=(0, 10))
    whole = voxelize(curve)

    def thin(events, samples, *, keep_tips=False):
        kept = thinning.thin_events(events, samples, keep_tips=keep_tips)
        return kept.take(np.flatnonzero(kept.voxels[1] < 2))

    module = sys.modules["voxdisplay.voxelization.digitise"]  # its function has the same name
    monkeypatch.setattr(module, "thin_events", thin)
    cut = voxelize(curve)
    mended = voxelize(curve, certified=True)
    assert len(cut) < len(whole) <= len(mended)
    assert_proven(mended)


def _events(sequence):
    size = len(sequence)
    return VoxelEvents(
        np.zeros(size, np.int32),
        sequence.t.copy(),
        sequence.voxels.T.copy(),
        np.full(size, NO_HEADING),
    )


def test_the_command_says_what_is_certified(tmp_path):
    scene = tmp_path / "scene.json"
    objects = [
        {"type": "circle", "center": [9, 9, 9], "radius": 5},
        {"type": "parametric", "x": "t", "y": "5*atan2(sin(t), cos(t))", "z": 3, "t": [0, 9]},
    ]
    scene.write_text(json.dumps({"objects": objects}))
    run = subprocess.run(
        [sys.executable, "-m", "voxdisplay", "voxelize", scene, "--certified", "--json"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert [each["certified"] for each in json.loads(run.stdout)["objects"]] == [True, False]
    assert "object 1 (parametric) is not certified: y may jump" in run.stderr
    assert "object 0" not in run.stderr


def test_a_subclass_with_another_position_is_not_proven_by_its_parents_boxes() -> None:
    class Wobbly(vd.Segment):
        def position(self, t: np.ndarray) -> np.ndarray:
            return super().position(t) + 9 * np.sin(50 * t)

    straight = vd.Segment((1, 2, 3), (30, 2, 3))
    wobbly = Wobbly((1, 2, 3), (30, 2, 3))
    assert voxelize(straight, certified=True).report.certified
    assert wobbly.enclosure(np.zeros(1), np.ones(1)) is None
    assert not voxelize(wobbly, certified=True).report.certified
