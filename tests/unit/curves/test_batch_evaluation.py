"""Batch evaluation of curves: to the last bit what each curve returns alone."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain, zip_longest
from operator import attrgetter

import numpy as np
import pytest

from voxdisplay.curves import (
    Arc,
    Bezier,
    Circle,
    Curve,
    Ellipse,
    Helix,
    Parametric,
    Points,
    Polyline,
    Segment,
    TorusKnot,
    Transformed,
)
from voxdisplay.curves.batch_evaluation import BLOCK_SIZE, MIN_FAMILY_SIZE, BatchEvaluator
from voxdisplay.voxelization import voxelize, voxelize_many

Make = Callable[[np.random.Generator], Curve]


def points(rng: np.random.Generator, count: int) -> np.ndarray:
    return rng.uniform(0, 60, (count, 3))


def formula(template: str) -> Make:
    """Make curves of one formula and different numbers: A, B, C in the template."""

    def make(rng: np.random.Generator) -> Curve:
        rows = []
        for _ in "xyz":
            text = template
            for name in "ABC":
                text = text.replace(name, repr(rng.uniform(0.5, 9)))
            rows.append(text)
        return Parametric(*rows, t=(0.25, 3))

    return make


FAMILIES: dict[str, Make] = {
    "cubic": lambda rng: Bezier(points(rng, 4)),
    "line": lambda rng: Bezier(points(rng, 2)),
    "segment": lambda rng: Segment(*points(rng, 2)),
    "polyline": lambda rng: Polyline(points(rng, 5)),
    "points": lambda rng: Points(points(rng, 1)),
    "circle": lambda rng: Circle(points(rng, 1)[0], rng.uniform(1, 30), rng.normal(size=3)),
    "ellipse": lambda rng: Ellipse(points(rng, 1)[0], points(rng, 2)),
    "arc": lambda rng: Arc(points(rng, 1)[0], 20, *rng.uniform(-9, 9, 2), rng.normal(size=3)),
    "helix": lambda rng: Helix(points(rng, 1)[0], 9, rng.uniform(-9, 9), 2, rng.normal(size=3)),
    "waves": formula("A + B*sin(2*pi*t + C)"),
    "powers": formula("A + B*t**2 - C*t**0.5 + A/t**-1 + 2**(t/A) + t**1.5"),
    "functions": formula("atan2(A, t) + max(B, t*t) + hypot(t, C, 2) + exp(-A*t) + log(B*t)"),
    "constants": formula("A"),
    "transformed": lambda rng: Transformed(Bezier(points(rng, 4)), rng.uniform(1, 2), (1, 2, 3)),
    "turned": lambda rng: Transformed(
        Bezier(points(rng, 4)), [[0, rng.uniform(1, 2), 0], [1, 1, 0], [0, 3, rng.uniform(1, 2)]]
    ),
    "twice": lambda rng: Transformed(Transformed(Circle(points(rng, 1)[0], 20), 0.5), 3),
}


def family(name: str, count: int) -> list[Curve]:
    rng = np.random.default_rng(1)
    return [FAMILIES[name](rng) for _ in range(count)]


@pytest.mark.parametrize("name", FAMILIES)
def test_a_family_is_where_its_curves_are(name: str) -> None:
    rng = np.random.default_rng(2)
    members = family(name, 20)
    assert members[0].family is not None
    assert len({curve.family for curve in members}) == 1
    which = np.repeat(np.arange(20), rng.integers(0, 2 * BLOCK_SIZE // 20, 20))
    low, high = np.array([curve.t_range for curve in members])[which].T
    t = low + (high - low) * rng.uniform(size=which.size)
    together = type(members[0]).batch_evaluator(members)(which, t)
    assert together.shape == (3, which.size)
    for index, curve in enumerate(members):
        mine = which == index
        assert np.array_equal(together[:, mine], curve.position(t[mine]))


@pytest.mark.parametrize("name", FAMILIES)
def test_a_family_is_voxelised_as_its_curves_are(name: str) -> None:
    members = family(name, 2 * MIN_FAMILY_SIZE)
    for curve, many in zip(members, voxelize_many(members), strict=True):
        alone = voxelize(curve)
        assert np.array_equal(alone.voxels, many.voxels)
        assert np.array_equal(alone.t, many.t)


def test_families_and_strangers_mix() -> None:
    rng = np.random.default_rng(3)
    strangers = [TorusKnot(2, 3, (20, 20, 20), 9, 4) for _ in range(5)]
    mixed = [family(name, MIN_FAMILY_SIZE + 1) for name in ("cubic", "waves", "segment", "circle")]
    few = family("helix", MIN_FAMILY_SIZE - 1)
    curves = [each for each in chain(*zip_longest(strangers, *mixed, few)) if each is not None]
    which = np.sort(np.concatenate((rng.integers(0, len(curves), 500), [3] * (BLOCK_SIZE + 1))))
    low, high = np.array([curve.t_range for curve in curves])[which].T
    t = low + (high - low) * rng.uniform(size=which.size)
    positions = BatchEvaluator(curves).positions(which, t)
    for index, curve in enumerate(curves):
        mine = which == index
        assert np.array_equal(positions[:, mine], curve.position(t[mine]))


def test_exponents_part_families() -> None:
    squares, cubes = (Parametric(f"t**{n}", "3*t", "t", t=(0, 1)) for n in (2, 3))
    assert squares.family != cubes.family
    assert squares.family == Parametric("t**2", "4*t", "t", t=(0, 2)).family


def test_callables_have_no_family() -> None:
    assert Parametric(lambda t: (t, t, t), t=(0, 1)).family is None


def test_a_class_with_its_own_position_leaves_the_family() -> None:
    class Shifted(Segment):
        def position(self, t: np.ndarray) -> np.ndarray:
            return super().position(t) + 5

    curves = [Shifted((0, 0, 0), (9, 4, i)) for i in range(MIN_FAMILY_SIZE)]
    curves += [Segment((0, 0, 0), (9, 4, i)) for i in range(MIN_FAMILY_SIZE)]
    for curve, sequence in zip(curves, voxelize_many(curves), strict=True):
        assert np.array_equal(sequence.voxels[0], np.floor(curve.position(np.zeros(1))[:, 0]))


def test_what_a_family_has_in_common_is_asked_of_one_and_given_to_each():
    class Bent(Curve):
        t_range = (0.0, 1.0)

        def __init__(self, degree):
            self.power = degree

        @property
        def degree(self):
            return self.power

        def position(self, t):
            return np.stack((t, t * t, t**self.power))

    class Steep(Bezier):
        degree = 40

    points = np.arange(12.0).reshape(4, 3)
    plain = [Bezier(points), Bezier(points[:3]), Steep(points), Bezier(points)]
    curves = [*plain, Bent(3), Bent(5), Parametric("t", "t", "t", t=(0, 1)), Bezier(points)]
    curves.append(Parametric(lambda t: (t, t, t), t=(0, 1)))
    for some in (curves, [curves[0], curves[3]], curves[4:6], curves[::-1]):
        together = BatchEvaluator(some)
        for name in ("degree", "thread_safe"):
            assert together.map_curves(attrgetter(name)) == [getattr(curve, name) for curve in some]
