"""Objects of plain numbers, which are read in columns: as if each were alone in its scene."""

import json
import pickle

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.scene.columns import MIN_COLUMN

COUNT = 3 * MIN_COLUMN


def circles():
    rng = np.random.default_rng(6)
    found = [
        {
            "type": "circle",
            "center": rng.uniform(-9, 9, 3).tolist(),
            "radius": rng.uniform(0.1, 9),
            "normal": (rng.normal(size=3) * 10.0 ** rng.integers(-30, 30)).tolist(),
            "color": ["teal", "#123456"][k % 2],
        }
        for k in range(COUNT)
    ]
    found[1] |= {"radius": "2*3"}
    found[2] |= {"transform": [{"translate": [1, 2, 3]}]}
    found[3] |= {"repeat": {"k": 2}, "radius": "1 + k"}
    found[4] |= {"thickness": 2}
    found[5] |= {"closed": False}
    found[6] |= {"center": [1, 2, 3], "normal": [1, 0, 0]}
    del found[7]["normal"], found[8]["color"]
    found[9] |= {"color": ["red", "blue"]}
    found[10] |= {"color": {"map": "viridis", "by": "z"}}
    return found


def read(objects):
    return vd.read_scene(json.dumps({"size": [17, 17, 17], "objects": objects}, indent=1))


def test_many_objects_are_those_that_each_is_alone() -> None:
    many = read(circles()).items
    alone = [item for each in circles() for item in read([each]).items]
    t = np.linspace(0, 2 * np.pi, 9)
    assert len(many) == len(alone) == COUNT + 1
    for one, other in zip(many, alone, strict=True):
        assert (one.type, repr(one.shape)) == (other.type, repr(other.shape))
        if isinstance(one.shape, vd.Circle):
            assert np.array_equal(one.curve.position(t), other.curve.position(t))
            assert (one.curve.closed, one.curve.t_range) == (other.curve.closed, (0, 2 * np.pi))
        if isinstance(one.color, np.ndarray):
            assert np.array_equal(one.color, other.color)
    assert [item.path for item in many[:3]] == [f"$.objects[{i}]" for i in range(3)]


def arc(rng):
    start, end = rng.uniform(-9, 9, 2).tolist()
    normal = rng.normal(size=3).round(1).tolist()
    return {"center": vector(rng), "radius": 3.5, "start": start, "end": end, "normal": normal}


def vector(rng):
    return rng.uniform(-9, 9, 3).round(2).tolist()


KINDS = {
    "arc": arc,
    "ellipse": lambda rng: {"center": vector(rng), "axes": [vector(rng), vector(rng)]},
    "segment": lambda rng: {"from": vector(rng), "to": vector(rng)},
    "bezier": lambda rng: {"points": [vector(rng) for _ in range(rng.integers(2, 5))]},
}
WRONG = {
    "arc": [
        {"start": 1.5, "end": 1.5},
        {"end": 1e101},
        {"radius": 0},
        {"normal": [0, 0, 0]},
    ],
    "ellipse": [{"axes": [[1, 0, 0], [0, -1e101, 0]]}, {"center": [1e101, 0, 0]}],
    "segment": [{"to": [0, 0, 1e101]}, {"from": ["nope", 0, 0]}],
    "bezier": [{"points": []}, {"points": [[1, 2, 3]]}, {"points": [[1, 2, 3]] * 66}],
}


def of_kind(kind):
    rng = np.random.default_rng(7)
    found = [{"type": kind} | KINDS[kind](rng) for _ in range(COUNT)]
    found[1] |= {"thickness": 2}
    found[2] |= {"color": ["red", "blue"]}
    found[3] |= {"closed": False}
    number = next(each for each in found[4].values() if isinstance(each, list))
    number[0] = "1 + 2" if isinstance(number[0], float) else ["1 + 2", 3, 4]
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_many_of_a_kind_are_those_that_each_is_alone(kind: str) -> None:
    many = read(of_kind(kind)).items
    alone = [item for each in of_kind(kind) for item in read([each]).items]
    assert len(many) == len(alone) == COUNT
    for one, other in zip(many, alone, strict=True):
        assert (one.type, repr(one.shape)) == (other.type, repr(other.shape))
        if isinstance(one.shape, vd.Curve):
            first, second = one.curve, other.curve
            assert (first.closed, first.t_range) == (second.closed, second.t_range)
            assert (first.family, first.degree) == (second.family, second.degree)
            t = np.linspace(*first.t_range, 9)
            assert np.array_equal(first.position(t), second.position(t))
            found = vd.voxelize(first)
            assert np.array_equal(found.voxels, vd.voxelize(second).voxels)


@pytest.mark.parametrize(("kind", "wrong"), [(k, each) for k, of in WRONG.items() for each in of])
def test_the_first_wrong_object_of_a_kind_is_named(kind: str, wrong: dict[str, object]) -> None:
    objects = of_kind(kind)
    place = COUNT - 5
    objects[place] |= wrong
    objects[-1] |= WRONG[kind][0]
    with pytest.raises(vd.SceneError) as alone:
        read([objects[place]])
    with pytest.raises(vd.SceneError) as many:
        read(objects)
    assert many.value.path.startswith(f"$.objects[{place}]")
    assert (
        str(many.value).replace(f"[{place}]", "[0]", 1).partition(":")[2:]
        == str(alone.value).partition(":")[2:]
    )
    assert many.value.hint == alone.value.hint


@pytest.mark.parametrize("kind", KINDS)
def test_one_of_many_is_pickled_alone(kind: str) -> None:
    curve = read(of_kind(kind)).items[-1].curve
    alone = pickle.loads(pickle.dumps(curve))  # noqa: S301 - our own
    assert repr(alone) == repr(curve)
    assert len(pickle.dumps(curve)) < 1000


def test_a_circle_of_many_is_pickled_alone() -> None:
    curve = read(circles()).items[-1].curve
    alone = pickle.loads(pickle.dumps(curve))  # noqa: S301 - our own
    assert repr(alone) == repr(curve)
    assert len(pickle.dumps(curve)) < 1000


@pytest.mark.parametrize(
    "wrong",
    [
        {"radius": -1},
        {"radius": 0},
        {"radius": 1e101},
        {"center": [0, 1e101, 0]},
        {"normal": [0, 0, 0]},
        {"normal": [1e101, 0, 0]},
        {"color": "grren"},
        {"radius": "nope"},
    ],
)
def test_the_first_wrong_object_is_named(wrong: dict[str, object]) -> None:
    objects = circles()
    place = COUNT - 5
    objects[place] |= wrong
    objects[-1] |= {"radius": -5}
    with pytest.raises(vd.SceneError) as alone:
        read([circles()[place] | wrong])
    with pytest.raises(vd.SceneError) as many:
        read(objects)
    assert many.value.path.startswith(f"$.objects[{place}]")
    assert many.value.path == alone.value.path.replace("[0]", f"[{place}]", 1)
    assert many.value.hint == alone.value.hint
    assert many.value.line > alone.value.line


def in_motion(kind):
    """Return objects of which the first number depends on the time in all but one."""
    found = of_kind(kind)
    for k, each in enumerate(found[6:]):
        numbers = next(value for value in each.values() if isinstance(value, list))
        if isinstance(numbers[0], list):
            numbers = numbers[0]
        numbers[0] = f"{numbers[0]} + {k + 1}*sin({k + 2}*time)"
    return found


def read_moving(objects, **more):
    return vd.read_scene(
        json.dumps({"size": [17, 17, 17], "duration": 4, "fps": 40, "objects": objects} | more)
    )


@pytest.mark.parametrize("kind", KINDS)
def test_many_in_motion_are_those_that_each_is_alone(kind: str) -> None:
    objects = in_motion(kind)
    scene, alone = read_moving(objects), [read_moving([each]) for each in objects]
    for number in (3, 4, 100, 4):
        many = scene.at_frame(number).items
        for one, each in zip(many, alone, strict=True):
            (other,) = each.at_frame(number).items
            assert (one.type, repr(one.shape)) == (other.type, repr(other.shape))
            assert np.array_equal(one.color, other.color)
            if isinstance(one.shape, vd.Curve):
                t = np.linspace(*one.curve.t_range, 9)
                assert np.array_equal(one.curve.position(t), other.curve.position(t))
    assert [item.path for item in many] == [f"$.objects[{i}]" for i in range(COUNT)]
    assert scene.at_frame(5).items[0] is many[0]
    assert scene.at_frame(5).items[-1] is not many[-1]
    again = pickle.loads(pickle.dumps(scene))  # noqa: S301 - our own
    for _ in range(2):
        assert repr(again.at_frame(4).items[-1].shape) == repr(many[-1].shape)


def test_many_in_motion_are_fitted_together() -> None:
    objects = in_motion("segment")
    whole = read_moving(objects)
    fitted, _ = whole.fitted(vd.Grid(33, 33, 33), "contain")
    alone, _ = read_moving(objects[-1:]).fitted(vd.Grid(33, 33, 33), "contain")
    t = np.linspace(0, 1, 5)
    for number in (0, 7):
        plain, one, other = (
            each.at_frame(number).items[-1].curve.position(t) for each in (whole, fitted, alone)
        )
        assert np.array_equal(one, other)
        assert not np.array_equal(one, plain)


def test_one_of_many_in_motion_that_fails_later_is_named() -> None:
    objects = in_motion("arc")
    objects[-2] |= {"radius": "1/(1 - time)"}
    scene = read_moving(objects)
    for number, problem in ((40, "not finite"), (80, "positive"), (40, "not finite")):
        with pytest.raises(vd.SceneError, match=problem) as caught:
            scene.at_frame(number)
        assert caught.value.path == f"$.objects[{COUNT - 2}].radius"
    assert len(scene.at_frame(39).items) == COUNT
