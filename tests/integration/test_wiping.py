"""Curves drawn in white and wiped by the same curve in black from its other end."""

import numpy as np
import pytest

import voxdisplay as vd

GRID = (32, 32, 32)
COUNT = 150


def polylines(rng):
    points = rng.uniform(1, 31, (4, 3))
    return vd.Polyline(points), vd.Polyline(points[::-1])


def segments(rng):
    """Ends on voxel corners and centres, where every tie is met."""
    ends = rng.integers(2, 62, (2, 3)) / 2
    return vd.Segment(*ends), vd.Segment(*ends[::-1])


def beziers(rng):
    points = rng.uniform(1, 31, (4, 3))
    return vd.Bezier(points), vd.Bezier(points[::-1])


def splines(rng):
    points = rng.uniform(4, 28, (5, 3))
    return vd.CatmullRom(points), vd.CatmullRom(points[::-1])


def formulas(rng):
    a, b, c = rng.uniform(3, 12, 3)

    def curve(s):
        return vd.Parametric(
            f"16 + {a}*cos({s})", f"16 + {b}*sin(2*{s})", f"16 + {c}*sin({s} + 1)", t=(0, 3)
        )

    return curve("t"), curve("(3 - t)")


@pytest.mark.parametrize("curves", [polylines, segments, beziers, splines, formulas])
def test_nothing_is_left(curves):
    rng = np.random.default_rng(11)
    left = []
    for number in range(COUNT):
        curve, reverse = curves(rng)
        frame = vd.Frame(GRID)
        frame.draw(curve, "white")
        assert len(frame.lit()[0]) > 0
        frame.draw(reverse, "black")
        if len(frame.lit()[0]):
            left.append(number)
    assert left == []


def test_the_display_is_dark_as_well():
    rng = np.random.default_rng(12)
    with vd.open("sim:?size=32x32x32&refresh=0") as display:
        frame = display.frame()
        for curve, reverse in (polylines(rng) for _ in range(20)):
            frame.draw(curve, "white")
            frame.draw(reverse, "black")
        display.present(frame)
        assert display.digest() == 0
        assert not display.read().any()
