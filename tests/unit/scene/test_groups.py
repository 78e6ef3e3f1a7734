"""Groups, repeats, transforms, parts, and fitting to what is there."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.errors import SceneError
from voxdisplay.raster.grid import Grid
from voxdisplay.scene import Scene, builder, read_scene, schema

LINE = {"type": "segment", "from": [1, 2, 3], "to": [7, 2, 3]}
T = np.linspace(0, 1, 5)


def scene_of(*objects: dict[str, Any], **more: Any) -> Scene:
    return read_scene(json.dumps({"objects": objects} | more))


def ends(scene: Scene) -> list[list[float]]:
    """Return the first point of each curve."""
    return [np.round(item.curve.position(np.zeros(1)).ravel(), 9).tolist() for item in scene.items]


def refused(*objects: dict[str, Any], **more: Any) -> SceneError:
    with pytest.raises(SceneError) as caught:
        scene_of(*objects, **more)
    return caught.value


class TestTransform:
    @pytest.mark.parametrize(
        ("steps", "point"),
        [
            ([{"translate": [1, 2, 3]}], [2, 4, 6]),
            ([{"scale": 2}], [2, 4, 6]),
            ([{"scale": [1, 2, 3], "about": [1, 1, 1]}], [1, 3, 7]),
            ([{"rotate": [0, 0, 1], "angle": "90*deg"}], [-2, 1, 3]),
            ([{"rotate": [0, 0, 5], "angle": "90*deg", "about": [1, 1, 0]}], [0, 1, 3]),
            ([{"rotate": [1, 1, 1], "angle": "120*deg"}], [3, 1, 2]),
            ([{"translate": [1, 0, 0]}, {"scale": 2}], [4, 4, 6]),
            ([{"scale": 2}, {"translate": [1, 0, 0]}], [3, 4, 6]),
            ([{"scale": [1, 1, 0]}], [1, 2, 0]),
            ([], [1, 2, 3]),
        ],
    )
    def test_steps_apply_in_order(self, steps: list[dict[str, Any]], point: list[float]) -> None:
        assert ends(scene_of(LINE | {"transform": steps})) == [point]

    def test_a_quarter_turn_is_exact(self) -> None:
        turn = {"rotate": [0, 0, 1], "angle": "pi", "about": [4, 4, 4]}
        (item,) = scene_of(LINE | {"transform": [turn]}).items
        assert item.curve.position(np.zeros(1)).ravel().tolist() == [7, 6, 3]

    def test_certified_keeps_its_meaning(self) -> None:
        knot = {"type": "torus_knot", "p": 2, "q": 3, "center": [20, 20, 20], "major": 9}
        steps = [{"rotate": [1, 2, 3], "angle": 1}, {"scale": [1, 2, 1]}]
        knot |= {"minor": 4, "transform": steps}
        (sequence,) = scene_of(knot).voxelize(certified=True)
        assert isinstance(sequence, vd.Sequence)
        assert sequence.report.certified
        assert sequence.report.e_max < 0.7072

    def test_a_body_that_becomes_flat_is_not_there(self) -> None:
        ball = {"type": "sphere", "center": [1, 2, 3], "radius": 2, "transform": [{"scale": 0}]}
        assert scene_of(ball, LINE).items[0].type == "segment"

    @pytest.mark.parametrize(
        ("step", "path", "message"),
        [
            ({}, "", "one of 'rotate', 'scale' and 'translate', not none"),
            ({"scale": 1, "translate": [1, 2, 3]}, "", "both 'scale' and 'translate'"),
            ({"rotate": [0, 0, 1]}, "", "'angle' is missing"),
            ({"rotate": [0, 0, 0], "angle": 1}, ".rotate", "no direction"),
            ({"scale": 1, "angle": 1}, ".angle", "belongs to 'rotate'"),
            ({"translate": [1, 2, 3], "about": [1, 2, 3]}, ".about", "no meaning"),
            ({"scale": "q"}, ".scale", "unknown name 'q'"),
            ({"scale": [1, 2]}, ".scale", "2 entries is less than 3"),
            ({"rotat": 1}, "", "unknown key 'rotat'"),
        ],
        ids=str,
    )
    def test_mistakes(self, step: dict[str, Any], path: str, message: str) -> None:
        error = refused(LINE | {"transform": [step]})
        assert error.path == f"$.objects[0].transform[0]{path}"
        assert message in str(error)
        assert error.line == 1


class TestRepeat:
    def test_the_counter_runs_in_every_number(self) -> None:
        scene = scene_of(LINE | {"from": ["k", "2*k", 0], "repeat": {"k": 3}})
        assert ends(scene) == [[0, 0, 0], [1, 2, 0], [2, 4, 0]]
        assert [item.path for item in scene.items] == ["$.objects[0]"] * 3

    def test_several_counters_and_nested_ones(self) -> None:
        inner = LINE | {"from": ["i", "j", "k"], "repeat": {"k": 2}}
        group = {"type": "group", "objects": [inner], "repeat": {"i": 2, "j": "n"}}
        found = ends(scene_of(group, params={"n": 2}))
        assert found == [[i, j, k] for i in range(2) for j in range(2) for k in range(2)]

    def test_no_times(self) -> None:
        assert scene_of(LINE | {"repeat": {"k": 0}}).items == ()

    @pytest.mark.parametrize(
        ("repeat", "path", "message"),
        [
            ({"k": -1}, ".k", "whole number, 0 or more, not -1"),
            ({"k": 1.5}, ".k", "not 1.5"),
            ({"k": 1e12}, ".k", "1e+12 objects are more than 100000"),
            ({"i": 1000, "j": 1000}, ".j", "more than 100000"),
            ({"sin": 2}, "", "'sin'"),
            ({"t": 2}, "", "'t'"),
            ({"n": 2}, "", "'n' has a meaning already"),
            ({"a b": 2}, "", "cannot be the name"),
        ],
        ids=str,
    )
    def test_mistakes(self, repeat: dict[str, Any], path: str, message: str) -> None:
        error = refused(LINE | {"repeat": repeat}, params={"n": 1})
        assert error.path == f"$.objects[0].repeat{path}"
        assert message in str(error)

    def test_nested_repeats_are_bounded(self) -> None:
        scene_object: dict[str, Any] = LINE | {"from": ["a + b", 2, 3], "repeat": {"c": 1000}}
        for name in "ab":
            scene_object = {"type": "group", "objects": [scene_object], "repeat": {name: 1000}}
        error = refused(scene_object)
        assert "1e+06 objects are more than 100000" in str(error), "before any is made"
        assert error.path == "$.objects[0].objects[0].repeat.a"

    def test_objects_of_repeats_side_by_side_are_counted(self) -> None:
        inner = [LINE | {"repeat": {"i": 300}}, LINE | {"repeat": {"i": 300}}]
        group = {"type": "group", "objects": inner, "repeat": {"k": 200}}
        assert "the scene has more than 100000 objects" in str(refused(group))

    def test_empty_groups_are_bounded(self) -> None:
        scene_object: dict[str, Any] = {"type": "group", "objects": []}
        for name in "abc":
            scene_object = {"type": "group", "objects": [scene_object], "repeat": {name: 1000}}
        assert "objects are more than 100000" in str(refused(scene_object))


class TestGroup:
    def test_colours_and_transforms_are_inherited(self) -> None:
        group = {
            "type": "group", "color": "red", "transform": [{"translate": [1, 0, 0]}],
            "objects": [LINE | {"transform": [{"scale": 2}]}, LINE | {"color": "blue"}],
        }  # fmt: skip
        scene = scene_of(group)
        assert ends(scene) == [[3, 4, 6], [2, 2, 3]]
        assert [item.color.tolist() for item in scene.items] == [[[255, 0, 0]], [[0, 0, 255]]]  # type: ignore[union-attr]
        assert [item.path for item in scene.items] == [
            "$.objects[0].objects[0]",
            "$.objects[0].objects[1]",
        ]

    def test_a_file_may_be_a_group(self) -> None:
        scene = read_scene(json.dumps({"type": "group", "objects": [LINE, LINE]}))
        assert [item.path for item in scene.items] == ["$.objects[0]", "$.objects[1]"]
        validator = jsonschema.Draft202012Validator(schema.schema())
        validator.validate({"type": "group", "objects": [LINE, LINE]})
        assert not validator.is_valid({"type": "segment", "objects": [LINE]})

    def test_a_transform_that_is_too_large(self) -> None:
        error = refused(LINE | {"transform": [{"scale": 1e60}, {"scale": 1e60}]})
        assert error.path == "$.objects[0]"
        assert "too large" in str(error)

    def test_a_mistake_inside_is_found(self) -> None:
        error = refused({"type": "group", "objects": [LINE, LINE | {"to": [1, 2, "q"]}]})
        assert error.path == "$.objects[0].objects[1].to[2]"
        assert error.column
        error = refused({"type": "group", "objects": [{"type": "grop", "objects": []}]})
        assert error.path == "$.objects[0].objects[0].type"
        assert error.hint == "did you mean 'group'?"

    def test_deep_nesting_is_refused(self) -> None:
        scene_object: dict[str, Any] = LINE
        for _ in range(builder.MAX_DEPTH + 1):
            scene_object = {"type": "group", "objects": [scene_object]}
        assert "nested" in str(refused(scene_object))
        for _ in range(2000):
            scene_object = {"type": "group", "objects": [scene_object]}
        with pytest.raises(SceneError, match="nested"):
            read_scene(deep_text(20_000))

    @pytest.mark.parametrize("depth", [100, 200, 400, 800])
    def test_mistakes_deep_inside_are_refused(self, depth: int) -> None:
        for inner in (LINE, LINE | {"type": "segmen"}, 3):
            with pytest.raises(SceneError) as caught:
                read_scene(deep_text(depth, inner))
            str(caught.value).encode()


def deep_text(depth: int, inner: object = LINE) -> str:
    return '{"type": "group", "objects": [' * depth + json.dumps(inner) + "]}" * depth


class TestPart:
    def test_a_stretch_of_the_sequence_in_the_colours_of_the_whole(self) -> None:
        colors = {"color": ["#000000", "#060000"]}
        frame, whole = vd.Frame((9, 5, 7)), vd.Frame((9, 5, 7))
        frame.draw(scene_of(LINE | colors | {"part": [0.25, "2/3"]}))
        whole.draw(scene_of(LINE | colors))
        reds = frame.array()[3, 2, :, 0].tolist()
        assert whole.array()[3, 2, :, 0].tolist() == [0, 0, 1, 2, 3, 4, 5, 6, 0]
        assert reds == [0, 0, 0, 2, 3, 4, 0, 0, 0]

    @pytest.mark.parametrize(
        ("part", "count"), [([0, 1], 7), ([0, 0], 0), ([0.5, 0.2], 0), ([-3, 9], 7), ([0, 0.5], 4)]
    )
    def test_how_much(self, part: list[float], count: int) -> None:
        (found,) = scene_of(LINE | {"part": part}).voxelize()
        assert len(found) == count
        assert found.voxels[:, 0].tolist() == list(range(1, 1 + count))
        vd.Frame((9, 5, 7)).draw(scene_of(LINE | {"part": part}))

    def test_of_a_body_from_the_lowest_voxel_up(self) -> None:
        box = {"type": "box", "from": [1, 1, 1], "to": [4, 4, 5], "fill": "solid"}
        (found,) = scene_of(box | {"part": [0, 0.5]}).voxelize()
        assert sorted(set(found.voxels[:, 2].tolist())) == [1, 2]
        assert len(found) == 18

    def test_of_a_group_across_its_objects(self) -> None:
        other = {"type": "segment", "from": [1, 4, 3], "to": [3, 4, 3]}
        group = {"type": "group", "objects": [LINE, other], "part": [0.5, 0.9]}
        first, second = scene_of(group).voxelize()
        assert first.voxels[:, 0].tolist() == [6, 7]
        assert second.voxels[:, 0].tolist() == [1, 2]

    def test_of_a_closed_curve_is_open(self) -> None:
        ring = {"type": "circle", "center": [9, 9, 9], "radius": 6}
        (found,) = scene_of(ring | {"part": [0.25, 0.5]}).voxelize()
        assert isinstance(found, vd.Sequence)
        assert not found.closed
        assert found.report.gaps == 0

    def test_of_points_with_corners(self) -> None:
        zigzag = {"type": "polyline", "points": [[1, 1, 1], [5, 1, 1], [5, 5, 1], [1, 5, 1]]}
        for end in np.linspace(0, 1, 12):
            vd.Frame((9, 9, 9)).draw(scene_of(zigzag | {"part": [0, end]}))


class TestContent:
    @pytest.mark.parametrize(
        "scene_object",
        [
            {"type": "circle", "center": [500, 3, 2], "radius": 0.01},
            {"type": "sphere", "center": [-50, 3, 2], "radius": 400},
            {"type": "implicit", "f": "(x-60)**2 + (y-60)**2 + (z-60)**2 - 9"},
            {"type": "scatter", "points": [[1, 1, 1], [1, 1, 99]]},
        ],
        ids=lambda each: each["type"],
    )
    def test_what_is_there_fills_the_grid(self, scene_object: dict[str, Any]) -> None:
        grid = Grid(30, 40, 50)
        fitted, note = scene_of(scene_object).fitted(grid, "content")
        assert "scaled" in str(note)
        (found,) = fitted.voxelize(clip=grid)
        low, high = found.voxels.min(axis=0), found.voxels.max(axis=0)
        assert (low >= 0).all()
        assert (high < grid).all()
        slack = np.array(grid) - (high - low + 1)
        assert slack.min() <= 1
        assert np.abs(low - (np.array(grid) - 1 - high)).max() <= 2

    def test_nothing(self) -> None:
        scene = scene_of()
        assert scene.fitted(Grid(3, 5, 7), "content") == (
            scene,
            "nothing to fit: the scene shows nothing",
        )
