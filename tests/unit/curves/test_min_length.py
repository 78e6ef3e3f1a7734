"""Lower bounds of curve lengths, and refusal of endless curves before sampling."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.curves import Curve, Transformed
from voxdisplay.errors import CurveError
from voxdisplay.voxelization import adaptive_sampling
from voxdisplay.voxelization.length_estimate import estimated_min_length

C = (3.0, 5.0, 7.0)
LONG = [
    vd.Helix(C, 0.5, 0.2, 400),
    vd.Helix(C, 2, -30, 250.5, (1, 2, 3), start=1),
    vd.Arc(C, 4, -9, 2000, (1, 1, 0)),
    vd.Lissajous(C, (3, 2, 0.1), (150, 7, 900.5)),
    vd.TorusKnot(2, 3, C, 5, 2),
    vd.TorusKnot(101, -300, C, 5, 2, (1, 0, 2)),
    Transformed(vd.TorusKnot(7, 8, C, 5, 2), 3.5),
    Transformed(vd.TorusKnot(7, 8, C, 5, 2), [[0, -2, 0], [1.8, 0.3, 0], [0, 0, -2]]),
]


def length(curve: Curve) -> float:
    t = np.linspace(*curve.t_range, 400_001)
    return float(np.abs(np.diff(curve.position(t), axis=1)).max(axis=0).sum())


@pytest.mark.parametrize("curve", LONG, ids=lambda curve: type(curve).__name__)
def test_a_bound_is_below_the_length_and_not_far(curve: Curve) -> None:
    assert 0.2 * length(curve) < curve.min_length <= length(curve) * (1 + 1e-6)


def test_a_subclass_with_another_position_has_no_bound() -> None:
    class Straight(vd.Helix):
        def position(self, t: np.ndarray) -> np.ndarray:
            return np.stack((t, t, t)) / 1e12

    curve = Straight(C, 2, 1, 1e12)
    assert curve.min_length == 0
    assert len(vd.voxelize(curve)) == 7


ENDLESS = {
    "helix": vd.Helix((50, 50, 0), 30, 1, 1e12),
    "helix of no radius": vd.Helix((50, 50, 0), 1e-9, 1e-3, 1e12),
    "helix of no pitch": vd.Helix((50, 50, 0), 30, 0, 1e9),
    "arc": vd.Arc((50, 50, 0), 30, 0, 1e15),
    "clockwise arc": vd.Arc((50, 50, 0), 30, 1e15, 0),
    "lissajous": vd.Lissajous((50, 50, 50), (30, 30, 30), (1, 1e12, 1)),
    "torus knot around": vd.TorusKnot(10**12, 1, (50, 50, 50), 30, 5),
    "torus knot along": vd.TorusKnot(1, 10**12, (50, 50, 50), 30, 5),
    "scaled": Transformed(vd.Helix((50, 50, 0), 0.3, 1e-3, 1e6), 1e3),
    "expression": vd.Parametric("64 + 30*sin(1e9*t)", "t", "t", t=(0, 100)),
    "three expressions": vd.Parametric(
        "30*sin(1e9*t)", "30*cos(1e7*t)", "t*sin(1e12*t)", t=(0, 100)
    ),
    "chirp": vd.Parametric("30*sin(exp(t))", "t", "t", t=(0, 60)),
    "sawtooth": vd.Parametric("mod(1e9*t, 60)", "t", "t", t=(0, 100)),
    "callable": vd.Parametric(lambda t: (30 * np.sin(1e9 * t), t, t), t=(0, 100)),
}


@pytest.mark.parametrize("name", ENDLESS)
def test_endless_curves_are_refused_at_once_and_without_memory(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # With fewer samples than are spent on a picture's curve.
    monkeypatch.setattr(adaptive_sampling, "MAX_SAMPLES", 300_000)
    for method in ("grid-plane", "march"):
        tracemalloc.start()
        try:
            with pytest.raises(CurveError, match=r"too long: .* voxels at least") as caught:
                vd.voxelize(ENDLESS[name], method=method)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert caught.value.hint
        assert peak < 20_000_000


@pytest.mark.parametrize(
    "curve",
    [
        vd.Circle(C, 30),
        vd.Parametric("30*cos(9*t)", "20*sin(8*t)", "t", t=(0, 6)),
        vd.Parametric("30*floor(t)", "t", "t", t=(0, 60)),
        vd.Parametric("t", "t", "exp(-1e6*t*t)", t=(-50, 50)),
        vd.Bezier([(0, 0, 0), (900, 3, 2), (-700, 9, 80), (5, 5, 5)]),
    ],
)
def test_an_estimate_is_below_the_length(curve: Curve) -> None:
    assert 0.1 * length(curve) < estimated_min_length(curve)[0] < 1.05 * length(curve)


def test_an_estimate_is_the_same_every_time() -> None:
    curve = vd.Parametric("30*sin(1e9*t)", "t", "t", t=(0, 100))
    assert estimated_min_length(curve) == estimated_min_length(curve)


@pytest.mark.parametrize("text", ["20*sign(sin(1e6*t))", "if(mod(1e5*t, 2) < 1, 0, 9)"])
def test_a_curve_that_jumps_all_along_is_refused_early(text: str) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(CurveError, match=r"jumps at \d+ parameters or more") as caught:
            vd.voxelize(vd.Parametric(text, "t", "t", t=(0, 1)))
        assert caught.value.hint
        assert tracemalloc.get_traced_memory()[1] < 200_000_000
    finally:
        tracemalloc.stop()


def test_many_jumps_are_drawn() -> None:
    sequence = vd.voxelize(
        vd.Parametric("20*if(mod(500*t, 2) < 1, 0, 1)+.5", "t", "t", t=(0, 0.999))
    )
    assert len(sequence.jumps) == 499


def test_a_long_curve_that_can_be_drawn_is_drawn() -> None:
    sequence = vd.voxelize(vd.Helix((100, 100, 0), 90, 0.5, 600))
    assert 250_000 < len(sequence) < 400_000
