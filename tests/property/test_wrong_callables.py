"""Callables and classes of users that return or raise what they should not, or do so later on.

Every one fails by an error of this package that names the argument or the method, wherever it is
called; or it succeeds.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from wrong_kinds import WRONG, assert_raised_on_purpose

import voxdisplay as vd
from voxdisplay.curves import Curve, Transformed
from voxdisplay.voxelization import measure

Function = Callable[..., Any]


def raises(error: Exception) -> Function:
    def function(*_: Any, **__: Any) -> None:
        raise error

    return function


def rows(*shape: int, kind: Any = float) -> Function:
    """Return a function to zeros of a shape, in which -1 is the number of parameters."""
    return lambda t, *_, **__: np.zeros(
        [np.size(t) if side == -1 else side for side in shape], dtype=kind
    )


RESULTS: dict[str, Function] = {
    "None": lambda *_, **__: None,
    "number": lambda *_, **__: 3.0,
    "text": lambda *_, **__: "xyz",
    "three texts": lambda *_, **__: ["a", "b", "c"],
    "two numbers": lambda *_, **__: (1, 2),
    "ragged": lambda *_, **__: ([1, 2], [1, 2, 3], [4]),
    "generator": lambda *_, **__: (each for each in (1, 2, 3)),
    "function": lambda *_, **__: len,
    "larger than any float": lambda *_, **__: (10**400,) * 3,
    "columns": rows(-1, 3),
    "two rows": rows(2, -1),
    "complex": rows(3, -1, kind=complex),
    "complex values": rows(-1, kind=complex),
    "objects": rows(3, -1, kind=object),
    "dates": rows(3, -1, kind="M8[D]"),
    "dated values": rows(-1, kind="M8[D]"),
    "raises ValueError": raises(ValueError("what it says")),
    "raises TypeError": raises(TypeError("what it says")),
    "raises KeyError": raises(KeyError("what it says")),
    "raises AttributeError": raises(AttributeError("what it says")),
    "raises RuntimeError": raises(RuntimeError("what it says")),
    "raises StopIteration": raises(StopIteration("what it says")),
    "raises ZeroDivisionError": raises(ZeroDivisionError("what it says")),
    "raises OSError": raises(OSError("what it says")),
}
# Calls after which a callable goes wrong.
AFTER = (0, 2)


def points(t: np.ndarray) -> np.ndarray:
    return np.stack((20 + t, 20 + 0 * t, 20 + 0 * t))


def slopes(t: np.ndarray) -> np.ndarray:
    return np.stack((1 + 0 * t, 0 * t, 0 * t))


def boxes(t_lo: np.ndarray, t_hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return points(t_lo), points(t_hi)


def goes_wrong(good: Function, bad: Function, after: int) -> Function:
    count = itertools.count()

    def function(*given: Any, **named: Any) -> Any:
        return (good if next(count) < after else bad)(*given, **named)

    return function


def own_curve(**attributes: Any) -> Curve:
    usual = {"t_range": (0.0, 3.0), "position": lambda _, t: points(t)}
    return type("Own", (Curve,), usual | attributes)()


def own_body(**attributes: Any) -> vd.Body:
    ball = vd.Sphere((5, 5, 5), 3)
    usual = {
        "bounds": lambda _: ball.bounds(),
        "geometry": lambda _, box, *, certified=False: ball.geometry(box, certified=certified),
    }
    return type("Own", (vd.Body,), usual | attributes)()


VOXEL = np.array([[20, 20, 20]])
USES_OF_CURVES: dict[str, Callable[[Any], Any]] = {
    "voxelize": vd.voxelize,
    "certified": lambda curve: vd.voxelize(curve, certified=True),
    "march": lambda curve: vd.voxelize(curve, method="march"),
    "report": lambda curve: vd.voxelize(curve).report,
    "distances": lambda curve: measure.distances(VOXEL, curve),
    "coverage": lambda curve: measure.coverage(VOXEL, curve),
    "tube": lambda curve: vd.voxelize(vd.Tube(curve, 2)),
    "transformed": lambda curve: vd.voxelize(
        Transformed(curve, np.eye(3)[::-1], (1, 1, 1)), certified=True
    ),
    "many": lambda curve: vd.voxelize_many([curve] * 5 + [vd.Circle((3, 3, 3), 2)]),
    "draw": lambda curve: vd.Frame((3, 5, 7)).draw(curve, ["red", "blue"]),
}
USES_OF_BODIES: dict[str, Callable[[Any], Any]] = {
    "voxelize": vd.voxelize,
    "clipped": lambda body: vd.voxelize(body, clip=(5, 7, 9), certified=True),
    "report": lambda body: vd.voxelize(body).report,
    "bounds": lambda body: body.bounds(),
    "turned": lambda body: vd.voxelize(body.transformed(np.eye(3)[::-1], (1, 1, 1))),
}


def check(uses: dict[str, Callable[[Any], Any]], make: Callable[[], Any], named: str) -> None:
    """Use what is made; an error is on purpose, and names what failed if it says what it found."""
    for name, use in uses.items():
        error = caught(use, make)
        if error is not None:
            assert_raised_on_purpose(error, name)
            if re.search(r"returned|what it says|\.\w+:", str(error)):
                assert named in str(error), f"{name}: {error}"


def caught(use: Callable[[Any], Any], make: Callable[[], Any]) -> Exception | None:
    try:
        use(make())
    except Exception as error:  # noqa: BLE001 - any is judged
        return error
    return None


@pytest.mark.parametrize("after", AFTER)
@pytest.mark.parametrize("kind", RESULTS)
def test_callables_of_curves(kind: str, after: int) -> None:
    bad = RESULTS[kind]
    made: dict[str, Callable[[], Curve]] = {
        "the curve": lambda: vd.Parametric(goes_wrong(points, bad, after), t=(0, 3)),
        "the derivative": lambda: vd.Parametric(
            points, t=(0, 3), derivative=goes_wrong(slopes, bad, after)
        ),
    }
    for named, make in made.items():
        check(USES_OF_CURVES, make, named)


@pytest.mark.parametrize("after", AFTER)
@pytest.mark.parametrize("kind", RESULTS)
def test_methods_of_a_curve_class(kind: str, after: int) -> None:
    methods: dict[str, Function] = {
        "position": points,
        "derivative": slopes,
        "enclosure": boxes,
        "unbounded": lambda t_lo, _: np.zeros(t_lo.size, dtype=bool),
        "batch_evaluator": lambda _: lambda _, t: points(t),
    }
    for name, good in methods.items():

        def make(name: str = name, good: Function = good) -> Curve:
            wrong = goes_wrong(good, RESULTS[kind], after)
            if name == "batch_evaluator":
                return own_curve(batch_evaluator=staticmethod(wrong), family="own")

            def method(_: Curve, *given: Any) -> Any:
                return wrong(*given)

            method.__qualname__ = f"Own.{name}"
            usual: dict[str, Function] = {"enclosure": lambda _, a, b: boxes(a, b)}
            return own_curve(**usual | {name: method})

        check(USES_OF_CURVES, make, "" if name == "batch_evaluator" else f"Own.{name}")


@pytest.mark.parametrize(
    "name",
    ["breaks", "closed", "t_range", "degree", "min_length", "always_defined", "thread_safe",
     "family", "point_count"],
)  # fmt: skip
def test_attributes_of_a_curve_class(name: str) -> None:
    uses = {use: USES_OF_CURVES[use] for use in ("voxelize", "distances", "many")}

    def assigned(value: Any) -> Curve:
        curve = own_curve()
        setattr(curve, name, value)
        return curve

    for value in WRONG.values():
        ways: list[Callable[[], Curve]] = [
            lambda value=value: own_curve(**{name: value}),
            lambda value=value: own_curve(**{name: property(lambda _: value)}),
        ]
        if name == "breaks":
            ways.append(
                lambda value=value: own_curve(breaks=cached_property(lambda _: value)),
            )
        if name in {"breaks", "closed", "t_range", "family", "point_count"}:
            ways.append(lambda value=value: assigned(value))
        for make in ways:
            check(uses, make, name)


@pytest.mark.parametrize("make", [list, tuple, np.array], ids=["list", "tuple", "array"])
def test_breaks_are_taken_in_any_form_and_order(make: Callable[[Any], Any]) -> None:
    class OfTheClass(Curve):
        t_range = (0.0, 3.0)
        breaks = make([2.5, 1])

        def position(self, t: np.ndarray) -> np.ndarray:
            return points(t)

    class OfTheObject(OfTheClass):
        def __init__(self, breaks: Any) -> None:
            self.breaks = breaks

    class Computed(OfTheClass):
        @property
        def breaks(self) -> Any:
            return make([2.5, 1])

    for curve in OfTheClass(), OfTheObject(make([2.5, 1])), Computed():
        assert curve.breaks.tolist() == [1, 2.5]
        assert curve.breaks.dtype == np.float64
        assert not curve.breaks.flags.writeable
        for certified in (False, True):
            voxels = vd.voxelize(curve, certified=certified).voxels
            assert np.array_equal(voxels, vd.voxelize(own_curve()).voxels)
    with pytest.raises(vd.CurveError, match=r"^OfTheObject\.breaks is not an array of numbers"):
        OfTheObject("abc")
    with pytest.raises(vd.CurveError, match=r"^OfTheObject\.breaks\[1\] is not finite"):
        OfTheObject([1.0, np.nan])


def wrong_enclosures() -> Iterator[tuple[Function, str]]:
    yield lambda a, b: boxes(b, a), r"Own\.enclosure returned 20\.\d+ as the low end of x and 20"
    yield lambda a, _: points(a), r"Own\.enclosure returned ndarray"
    yield lambda a, b: (points(a).T, points(b).T), r"Own\.enclosure returned shape \(\d+, 3\)"
    yield lambda a, b: (points(a)[:2], points(b)), r"Own\.enclosure returned shape \(2, \d+\)"
    yield raises(RuntimeError("no bounds")), r"^Own\.enclosure raised RuntimeError: no bounds$"


@pytest.mark.parametrize(("enclosure", "message"), list(wrong_enclosures()))
def test_a_wrong_enclosure_is_named(enclosure: Function, message: str) -> None:
    def method(_: Curve, *given: np.ndarray) -> Any:
        return enclosure(*given)

    method.__qualname__ = "Own.enclosure"
    with pytest.raises(vd.CurveError, match=message):
        vd.voxelize(own_curve(enclosure=method), certified=True)


def test_errors_of_users_are_the_cause() -> None:
    cause = KeyError("no such knot")
    with pytest.raises(vd.CurveError, match="the curve raised KeyError: 'no such knot'") as caught:
        vd.voxelize(vd.Parametric(goes_wrong(points, raises(cause), 1), t=(0, 3)))
    assert caught.value.__cause__ is cause
    surface = vd.Surface(raises(cause), u=(0, 1), v=(0, 1))
    with pytest.raises(vd.BodyError, match="the surface raised KeyError: 'no such knot'"):
        vd.voxelize(surface)


def test_a_class_whose_position_raises_at_one_parameter_is_completed() -> None:
    def position(_: Curve, t: np.ndarray) -> np.ndarray:
        if (t == 1).any():
            raise ZeroDivisionError
        return points(t)

    sequence = vd.voxelize(own_curve(position=position))
    assert {point.t for point in sequence.undefined} == {1.0}
    assert np.array_equal(sequence.voxels, vd.voxelize(own_curve()).voxels)


# What has no value anywhere, as what raises one of these always, takes long to search.
SEARCHED = {"raises ValueError", "raises ZeroDivisionError"}


@pytest.mark.parametrize("after", AFTER)
@pytest.mark.parametrize("kind", [kind for kind in RESULTS if kind not in SEARCHED])
def test_callables_of_bodies(kind: str, after: int) -> None:
    def wrong(good: Function) -> Function:
        return goes_wrong(good, RESULTS[kind], after)

    made: dict[str, Callable[[], vd.Body]] = {
        "the surface": lambda: vd.Surface(
            wrong(lambda u, v: (u + 5, v + 5, 0 * u + 5)), u=(0, 3), v=(0, 3)
        ),
        "z": lambda: vd.HeightField(wrong(lambda x, y: x + y), x=(0, 3), y=(0, 3)),
        "f": lambda: vd.Implicit(wrong(lambda x, _y, _z: x - 5), box=[(1, 1, 1), (8, 8, 8)]),
        "radius": lambda: vd.Tube(vd.Circle((5, 5, 5), 3), wrong(lambda t: 2 + 0 * t)),
    }
    for named, make in made.items():
        uses = USES_OF_BODIES
        if named == "z" and kind == "number":  # turned, it is a surface that jumps
            uses = {name: use for name, use in uses.items() if name != "turned"}
        check(uses, make, named)


@pytest.mark.parametrize("kind", RESULTS)
def test_methods_of_a_body_class(kind: str) -> None:
    for name in ("bounds", "geometry"):

        def method(_: vd.Body, *_given: Any, **_named: Any) -> Any:
            return RESULTS[kind](np.zeros(3))

        method.__qualname__ = f"Own.{name}"
        check(USES_OF_BODIES, lambda name=name, method=method: own_body(**{name: method}), name)


@pytest.mark.parametrize("name", ["fill", "kind"])
def test_attributes_of_a_body_class(name: str) -> None:
    for value in WRONG.values():
        uses = {"voxelize": vd.voxelize, "report": lambda body: vd.voxelize(body).report}
        check(uses, lambda value=value: own_body(**{name: value}), name)
