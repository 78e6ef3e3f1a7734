"""Initial and adaptive sampling: density by degree, limits, no missed turns."""

from bisect import bisect_left
from collections.abc import Callable

import numpy as np
import pytest
from space_curves import Function

from voxdisplay.curves import Bezier, Circle, Parametric, Polyline, Segment
from voxdisplay.errors import CurveError
from voxdisplay.voxelization import voxelize, voxelize_many
from voxdisplay.voxelization.adaptive_sampling import (
    INITIAL_STEPS,
    initial_samples,
    limit_chords,
    refine_samples,
)
from voxdisplay.voxelization.curve_batch import CurveBatch, Samples


def refined(batch: CurveBatch) -> Samples:
    return refine_samples(batch, initial_samples(batch))


def test_curves_are_looked_at_as_closely_as_their_degree_asks() -> None:
    rng = np.random.default_rng(1)
    unknown = Function(lambda t: (9 * t, 0.0, 0.0))
    beziers = [Bezier(rng.uniform(0, 9, (degree + 1, 3))) for degree in (1, 3, 40)]
    batch = CurveBatch([unknown, *beziers])
    samples = initial_samples(batch)
    sizes = np.bincount(samples.piece).tolist()
    assert sizes[1] < sizes[2] < sizes[3] == sizes[0] == INITIAL_STEPS + 1
    for index in range(4):
        t = samples.t[samples.piece == index]
        assert (t[0], t[-1]) == (0.0, 1.0)
        assert (np.diff(t) > 0).all()


def test_breaks_are_looked_at_once() -> None:
    chain = Polyline([[0, 0, 0], [2, 9, 1], [4, 0, 2], [6, 9, 3]])
    samples = initial_samples(CurveBatch([Segment((0, 0, 0), (1, 2, 3)), chain, chain]))
    for index in (1, 2):
        t = samples.t[samples.piece == index]
        assert {0.0, 1.0, 2.0, 3.0} <= set(t.tolist())
        assert (np.diff(t) > 0).all()
    assert (samples.t[samples.piece == 0] <= 1).all()


def test_no_parameter_is_looked_at_twice() -> None:
    # There are 33 numbers in this range, fewer than there are looks at it.
    coarse = Function(lambda t: (3.5 * (t - 1e15), 0.0, 0.0), 1e15, 1e15 + 4)
    chain = Polyline([[0, 0, 0], [2, 9, 1], [4, 0, 2]])
    looks = [
        initial_samples(batch) for batch in (CurveBatch([coarse]), CurveBatch([coarse, chain]))
    ]
    alone, beside = (look.t[look.piece == 0] for look in looks)
    assert (np.diff(alone) > 0).all()
    assert np.array_equal(alone, beside)


@pytest.mark.parametrize(
    "look", [refined, lambda batch: limit_chords(batch, initial_samples(batch), 0.1)]
)
def test_curves_are_too_rough_alone_or_not_at_all(
    look: Callable[[CurveBatch], Samples], monkeypatch: pytest.MonkeyPatch
) -> None:
    wriggle = Function(lambda t: (t, 0.4 * np.sin(700 * t), 0.0))

    def settles(limit: int, curves: int) -> bool:
        monkeypatch.setattr("voxdisplay.voxelization.adaptive_sampling.MAX_SAMPLES", limit)
        try:
            look(CurveBatch([wriggle] * curves))
        except CurveError:
            return False
        return True

    enough = bisect_left(range(20_000), True, key=lambda limit: settles(limit, 1))
    assert enough > 64
    assert settles(enough, 3)


@pytest.mark.parametrize("degree", range(2, 12))
def test_no_turn_of_a_polynomial_is_missed(degree: int) -> None:
    # Zeros close together: the wildest polynomial of its degree inside the range.
    roots = np.cos((np.arange(degree) + 0.5) * np.pi / degree)
    t = np.linspace(-1, 1, degree + 1)
    wave = 20 * np.prod(t[:, None] - roots, axis=1) * 2.0 ** (degree - 1)
    samples = np.linspace(0, 1, degree + 1)
    curve = Bezier(_control(samples, np.stack((30 * samples, wave, 0 * t), axis=1)))
    found = refined(CurveBatch([curve]))
    fine = np.linspace(0, 1, 20_001)
    straight = np.stack([np.interp(fine, found.t, row) for row in found.points])
    assert np.abs(straight - curve.position(fine)).max() < 0.1


def test_one_more_look_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    looks = []
    evaluate = CurveBatch.evaluate

    def counted(batch: CurveBatch, curve: np.ndarray, t: np.ndarray) -> np.ndarray:
        looks.append(t.size)
        return evaluate(batch, curve, t)

    monkeypatch.setattr(CurveBatch, "evaluate", counted)
    found = refined(
        CurveBatch([Parametric("80*cos(t)", "80*sin(t)", "80*(1 - cos(4*t))", t=(-3, 3))])
    )
    assert len(looks) == 2
    assert sum(looks) == found.t.size


def _control(t: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the control points of the Bezier curve that goes through points at t."""
    degree = len(t) - 1
    unit = [Bezier(np.eye(degree + 1)[:, [j, j, j]]).position(t)[0] for j in range(degree + 1)]
    return np.linalg.solve(np.stack(unit, axis=1), points)


ENDLESS_TOGETHER = {
    "long circles": [Circle((0, 0, 0), 1e6, normal=(1, 2, 3))] * 100,
    "long formulas": [Parametric("9e5*t", "9e5*sin(t)", "3", t=(0, 9))] * 9,
    "many jumps": [Parametric("t", "9*mod(floor(3000*t), 2)", "3", t=(0, 5))] * 9,
}


@pytest.mark.parametrize("name", ENDLESS_TOGETHER)
def test_curves_that_are_too_much_together_are_refused(name: str) -> None:
    with pytest.raises(CurveError, match=r"the curves (are too|jump).*(limit|settle)") as caught:
        voxelize_many(ENDLESS_TOGETHER[name])
    assert "fewer" in str(caught.value.hint)


@pytest.mark.parametrize(
    "formula", ["20 + 5*cos(1e5*t)", "20 + .6*sin(1e5*t)", "8 + round(5*sin(1e5*t))"]
)
def test_oscillations_are_refused_before_they_are_resolved(formula: str) -> None:
    evaluated = 0

    class Counted(Parametric):
        def position(self, t: np.ndarray) -> np.ndarray:
            nonlocal evaluated
            evaluated += t.size
            return super().position(t)

    with pytest.raises(CurveError, match=r"too rough|jumps"):
        voxelize(Counted(formula, "t", "5*sin(1e5*t)", t=(0, 10)))
    assert evaluated < 2_000_000
