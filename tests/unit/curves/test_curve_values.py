"""Curves as values: text, pickles and documentation."""

from __future__ import annotations

import copy
import pickle
import pydoc

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.curves import Curve, Transformed

ZIGZAG = [[1, 2, 3], [4, 2, 1], [4, 6, 1], [0, 6, 5], [2, 9, 4]]


def spiral(t: np.ndarray) -> np.ndarray:
    return np.stack((t * np.cos(t), t * np.sin(t), t))


TEXTS = {
    "Parametric(x='5+a*cos(t)', y='t', z='2', t=(0, 3.14159), params={'a': 3})": vd.Parametric(
        "5+a*cos(t)", "t", 2, t=(0, "pi"), params={"a": 3}
    ),
    "Parametric(x=spiral, t=(0, 1), closed=False)": vd.Parametric(spiral, t=(0, 1), closed=False),
    "Segment(start=(1, 2, 3), end=(4, 5, 6.5))": vd.Segment((1, 2, 3), (4, 5, 6.5)),
    "Polyline(points=[(1, 2, 3), (4, 2, 1), (4, 6, 1), ... 2 more], closed=True)": vd.Polyline(
        ZIGZAG, closed=True
    ),
    "Points(points=[(1, 2, 3)])": vd.Points([(1, 2, 3)]),
    "Circle(center=(3, 5, 7), radius=2, normal=(0, 0, 1))": vd.Circle((3, 5, 7), 2),
    "Arc(center=(3, 5, 7), radius=2, start=0, end=1.5, normal=(0, 0, 1))": vd.Arc(
        (3, 5, 7), 2, 0, 1.5
    ),
    "Ellipse(center=(3, 5, 7), axes=[(1, 0, 0), (0, 2, 0)])": vd.Ellipse(
        (3, 5, 7), [(1, 0, 0), (0, 2, 0)]
    ),
    "Helix(center=(3, 5, 7), radius=2, pitch=1, turns=4, axis=(0, 0, 1), start=0)": vd.Helix(
        (3, 5, 7), 2, 1, 4
    ),
    "Lissajous(center=(3, 5, 7), amplitude=(1, 2, 3), frequency=(3, 4, 5), phase=(0, 0, 0))": (
        vd.Lissajous((3, 5, 7), (1, 2, 3), (3, 4, 5))
    ),
    "TorusKnot(p=2, q=3, center=(3, 5, 7), major=5, minor=1, axis=(0, 0, 1))": vd.TorusKnot(
        2, 3, (3, 5, 7), 5, 1
    ),
    "Bezier(points=[(1, 2, 3), (4, 2, 1), (4, 6, 1), ... 2 more])": vd.Bezier(ZIGZAG),
    "BSpline(points=[(1, 2, 3), (4, 2, 1), (4, 6, 1), ... 2 more], degree=2)": vd.BSpline(
        ZIGZAG, 2
    ),
    "CatmullRom(points=[(1, 2, 3), (4, 2, 1), (4, 6, 1), ... 2 more])": vd.CatmullRom(ZIGZAG),
    "Transformed(curve=Circle(center=(3, 5, 7), radius=2, normal=(0, 0, 1)), matrix=2, "
    "offset=(1, 0, 0))": Transformed(vd.Circle((3, 5, 7), 2), 2, (1, 0, 0)),
}


@pytest.mark.parametrize("text", TEXTS)
def test_its_text_names_what_it_was_made_from(text: str) -> None:
    assert repr(TEXTS[text]) == text


def test_the_text_of_much_is_short() -> None:
    assert len(repr(vd.Points(np.zeros((100_000, 3))))) < 100
    assert len(repr(vd.Parametric("+".join(["t"] * 500), "t", "t", t=(0, 1)))) < 150


def test_a_curve_of_ones_own_has_a_text() -> None:
    class Own(Curve):
        def position(self, t: np.ndarray) -> np.ndarray:
            return np.stack((t, t, t))

    assert repr(Own()) == "Own()"
    Own.t_range = (0.0, 2.0)
    assert repr(Own()) == "Own(t_range=(0, 2))"


@pytest.mark.parametrize("curve", TEXTS.values(), ids=lambda curve: type(curve).__name__)
def test_copies_and_pickles_are_the_same_curve(curve: Curve) -> None:
    t = np.linspace(*curve.t_range, 7)
    for twin in (pickle.loads(pickle.dumps(curve)), copy.copy(curve), copy.deepcopy(curve)):  # noqa: S301 - its own
        assert repr(twin) == repr(curve)
        assert np.array_equal(twin.position(t), curve.position(t))
        mine, other = curve.derivative(t), twin.derivative(t)
        assert (mine is None) == (other is None)
        if mine is not None:
            assert np.array_equal(mine, other)
        assert np.array_equal(twin.breaks, curve.breaks)
        assert twin.family == curve.family
        assert np.array_equal(vd.voxelize(twin).voxels, vd.voxelize(curve).voxels)


@pytest.mark.parametrize("name", [type(curve).__name__ for curve in TEXTS.values()])
def test_its_help_is_its_own(name: str) -> None:
    kind = getattr(vd, name, Transformed)
    text = pydoc.render_doc(kind, renderer=pydoc.plaintext)
    assert len(text.splitlines()) < 200
    assert "ndarray(shape" not in text


def test_breaks_can_be_assigned_and_are_none_by_default() -> None:
    curve = vd.Circle((3, 5, 7), 2)
    assert curve.breaks.size == 0
    curve.breaks = np.array([1.0])
    assert curve.breaks.tolist() == [1.0]


MASKED = np.ma.masked_array([[1, 2, 3], [4, 5, 6]], mask=[[0, 0, 0], [0, 1, 0]])


def test_masked_points_are_named() -> None:
    with pytest.raises(vd.CurveError, match=r"points\[1\]\[1\] is not finite: nan"):
        vd.Polyline(MASKED)
    assert vd.Polyline(MASKED[:1].repeat(2, axis=0)).position(np.zeros(1))[:, 0].tolist() == [
        1,
        2,
        3,
    ]


@pytest.mark.parametrize("kind", ["datetime64[D]", "timedelta64[s]", "complex", [("a", float)]])
def test_arrays_of_what_is_no_number_are_refused(kind: object) -> None:
    with pytest.raises(vd.CurveError, match="start is not an array of numbers"):
        vd.Segment(np.zeros(3, dtype=kind), (1, 2, 3))
