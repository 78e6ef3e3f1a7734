"""Meaning of scene files, and errors of wrong and hostile ones."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import ONE_OF_EACH, PARAMETRIC, POINTS, SEGMENT, refused, scene_of

from voxdisplay.errors import SceneError
from voxdisplay.expressions.parse import MAX_LENGTH
from voxdisplay.raster.grid import Grid
from voxdisplay.scene import load_scene, read_scene, reader

ROOT = Path(__file__).parents[3]
EXAMPLES = sorted((ROOT / "examples").glob("*.json"))


class TestMeaning:
    def test_the_papers_curve(self) -> None:
        scene = load_scene(ROOT / "examples" / "paper-curve.json")
        (item,) = scene.items
        assert scene.size == (128, 128, 128)
        assert item.type == "parametric"
        assert item.path == "$.objects[0]"
        assert item.color.tolist() == [[255, 136, 0]]
        assert item.curve.closed is False
        assert item.curve.t_range == (math.radians(-170), math.radians(170))
        t = np.linspace(*item.curve.t_range, 100)
        expected = np.stack(
            (50 + 40 * np.cos(t), 50 + 40 * np.sin(t), 50 + 40 * (1 - np.cos(4 * t)))
        )
        np.testing.assert_allclose(item.curve.position(t), expected)
        slope = np.stack((-40 * np.sin(t), 40 * np.cos(t), 160 * np.sin(4 * t)))
        np.testing.assert_allclose(item.curve.derivative(t), slope, atol=1e-12)

    @pytest.mark.parametrize(
        "scene_object", ONE_OF_EACH, ids=lambda scene_object: scene_object["type"]
    )
    def test_every_type(self, scene_object: dict[str, Any]) -> None:
        (item,) = scene_of(scene_object).items
        assert item.type == scene_object["type"]
        assert type(item.curve).__name__.lower() == scene_object["type"].replace("_", "")
        assert item.color.tolist() == [[255, 255, 255]]
        assert np.isfinite(item.curve.position(np.array(item.curve.t_range))).all()

    def test_every_type_is_tried(self) -> None:
        curve_types = {
            name for name, kind in reader.TYPES.items() if "closed" in kind.__struct_fields__
        }
        assert {scene_object["type"] for scene_object in ONE_OF_EACH} == curve_types

    @pytest.mark.parametrize(
        "scene_object", ONE_OF_EACH, ids=lambda scene_object: scene_object["type"]
    )
    def test_every_number_may_be_an_expression(self, scene_object: dict[str, Any]) -> None:
        def expressed(value: Any) -> Any:
            if isinstance(value, list):
                return [expressed(each) for each in value]
            number = isinstance(value, int) and not isinstance(value, bool)
            return f"one*{value}" if number else value

        written = {key: expressed(value) for key, value in scene_object.items()}
        (plain,) = scene_of(scene_object).items
        (item,) = scene_of(written, params={"one": "2 - 1"}).items
        t = np.linspace(*plain.curve.t_range, 7)
        np.testing.assert_array_equal(item.curve.position(t), plain.curve.position(t))

    def test_a_file_that_is_one_object_is_a_scene_of_it(self) -> None:
        scene = read_scene(json.dumps(SEGMENT))
        assert scene.size is None
        assert [item.path for item in scene.items] == ["$"]

    def test_an_empty_scene_is_a_scene(self) -> None:
        assert scene_of().items == ()

    def test_params_reach_every_number_of_every_object(self) -> None:
        (item,) = scene_of(
            SEGMENT | {"from": ["a", "b", "a*b"]}, params={"b": "a + 1", "a": 2}
        ).items
        assert item.curve.position(np.zeros(1)).T.tolist() == [[2, 3, 6]]

    def test_closed_and_colors(self) -> None:
        open_, closed, ring, cut = scene_of(
            SEGMENT | {"color": ["red", "#00f"]},
            {"type": "polyline", "points": POINTS, "closed": True},
            {"type": "circle", "center": [1, 2, 3], "radius": 2},
            {"type": "circle", "center": [1, 2, 3], "radius": 2, "closed": False},
        ).items
        assert [item.curve.closed for item in (open_, closed, ring, cut)] == [
            None,
            True,
            True,
            False,
        ]
        assert open_.color.tolist() == [[255, 0, 0], [0, 0, 255]]

    def test_three_whole_numbers_are_one_color(self) -> None:
        one, two = read_scene(
            json.dumps(
                {"objects": [SEGMENT | {"color": [255, 128, 0]},
                             SEGMENT | {"color": [[255, 128, 0], "lime"]}]}
            )
        ).items  # fmt: skip
        assert one.color.tolist() == [[255, 128, 0]]
        assert two.color.tolist() == [[255, 128, 0], [0, 255, 0]]

    def test_bytes_with_a_byte_order_mark(self) -> None:
        assert read_scene(b"\xef\xbb\xbf" + json.dumps(SEGMENT).encode()).items

    def test_the_schemas_address_may_be_given(self) -> None:
        assert read_scene('{"$schema": "scene.schema.json", "objects": []}').items == ()


class TestView:
    def test_it_stays_with_the_scene(self) -> None:
        angle = {"view": {"angle": ["-a", "2*a"], "zoom": 1.5}, "params": {"a": 20}}
        for more in ({}, {"duration": 1, "fps": 4}):
            scene = scene_of(SEGMENT, size=[9, 9, 9], **angle, **more)
            assert scene.view == (-20, 40, 1.5)
            assert scene.fitted(Grid(3, 5, 7))[0].view == scene.view
            assert scene.at_frame(0).view == scene.view
            assert scene.at(0).view == scene.view
        assert scene_of(SEGMENT).view is None
        assert scene_of(SEGMENT, view={}).view == (-34, 24, 1)

    @pytest.mark.parametrize(
        ("view", "path", "message"),
        [
            ({"angle": [0, 91]}, "$.view.angle[1]", "-90 to 90, not 91"),
            ({"angle": [-361, 0]}, "$.view.angle[0]", "-360 to 360"),
            ({"angle": [0, "q"]}, "$.view.angle[1]", "unknown name 'q'"),
            ({"angle": 3}, "$.view.angle", "two angles [yaw, pitch]"),
            ({"zoom": 9}, "$.view.zoom", "0.3 to 2.5, not 9"),
            ({"zom": 1}, "$.view", "unknown key 'zom'"),
            (1, "$.view", "a view {"),
        ],
        ids=str,
    )
    def test_mistakes(self, view: Any, path: str, message: str) -> None:
        error = refused({"objects": [SEGMENT], "view": view})
        assert str(error.path).startswith(path)
        assert message in str(error)
        assert error.line == 1


class TestFit:
    SCENE = scene_of(SEGMENT, size=[128, 128, 128])

    def test_equal_sizes_change_nothing(self) -> None:
        assert self.SCENE.fitted(Grid(128, 128, 128)) == (self.SCENE, None)

    def test_without_a_size_nothing_changes(self) -> None:
        scene = scene_of(SEGMENT)
        assert scene.fitted(Grid(3, 5, 7)) == (scene, None)

    def test_none_keeps_the_numbers(self) -> None:
        assert self.SCENE.fitted(Grid(3, 5, 7), "none") == (self.SCENE, None)

    def test_contain_scales_alike_and_centres(self) -> None:
        scene, note = self.SCENE.fitted(Grid(17, 64, 40))
        assert note == "scene composed for 128x128x128, scaled by 0.133 to 17x64x40"
        assert scene.size == (17, 64, 40)
        scale = 17 / 128
        middle = np.array([[17 / 2], [64 / 2], [40 / 2]])
        t = np.array([0.0, 1.0])
        expected = (np.array([[1.0, 4], [2, 5], [3, 6]]) - 64) * scale + middle
        (item,) = scene.items
        np.testing.assert_allclose(item.curve.position(t), expected)
        np.testing.assert_allclose(item.curve.derivative(t), np.full((3, 2), 3 * scale))

    def test_unknown_fit(self) -> None:
        with pytest.raises(ValueError, match="'cover'"):
            self.SCENE.fitted(Grid(3, 5, 7), "cover")  # type: ignore[arg-type]


class TestMistakes:
    @pytest.mark.parametrize(
        ("data", "path", "message", "hint"),
        [
            (SEGMENT | {"colour": "red"}, "$", "unknown key 'colour'", "'color'"),
            ({"objects": [SEGMENT | {"colr": 1}]}, "$.objects[0]", "unknown key 'colr'", "'color'"),
            (SEGMENT | {"qqq": 1}, "$", "unknown key 'qqq'", "from, to, color, transform"),
            ({"objets": []}, "$", "unknown key 'objets'", "'objects'"),
            (SEGMENT | {"params": {}}, "$", "unknown key 'params'", "beside objects"),
            (SEGMENT | {"type": "segmnt"}, "$.type", "unknown type 'segmnt'", "'segment'"),
            ({"objects": [{"type": "cube"}]}, "$.objects[0].type", "type 'cube'", "torus_knot"),
            ({"objects": [{"x": 1}]}, "$.objects[0]", "the key 'type' is missing", None),
            ({"type": "segment", "from": [1, 2, 3]}, "$", "the key 'to' is missing", None),
            ({}, "$", "the key 'objects' is missing", None),
            ([], "$", "not an empty list", "several objects"),
            (3, "$", "an object {...}, not the number 3", None),
            (None, "$", "not null", None),
            (
                {"objects": {}},
                "$.objects",
                "expected a list of objects [{...}, ...], found an object",
                None,
            ),
            (
                {"objects": [3]},
                "$.objects[0]",
                "expected an object {...}, found the number 3",
                None,
            ),
            (
                SEGMENT | {"to": [1, 2]},
                "$.to",
                "expected three numbers [x, y, z], found a list of 2",
                None,
            ),
            (SEGMENT | {"to": [1, 2, True]}, "$.to[2]", "a number or an expression", None),
            (SEGMENT | {"to": [1, 2, "t"]}, "$.to[2]", "'t' at column 1", "parametric"),
            (SEGMENT | {"to": [1, 2, "a +"]}, "$.to[2]", "unknown name 'a'", None),
            (
                SEGMENT | {"closed": 1},
                "$.closed",
                "expected true or false, found the number 1",
                None,
            ),
            (SEGMENT | {"color": "orang"}, "$.color", "did you mean 'orange'", None),
            (SEGMENT | {"color": ["red", "x"]}, "$.color[1]", "unknown colour 'x'", None),
            (SEGMENT | {"color": []}, "$.color", "0 entries is less than 1", None),
            (SEGMENT | {"color": [300, 0, 0]}, "$.color[0]", "more than 255", None),
            (SEGMENT | {"color": [255, 0]}, "$.color", "three whole numbers, 0 to 255", None),
            (SEGMENT | {"color": ["red", 3]}, "$.color", "a colour in a list", None),
            (
                SEGMENT | {"color": [[1, 2, 3], [1, 2]]},
                "$.color[1]",
                "2 entries is less than 3",
                None,
            ),
            (SEGMENT | {"to": [1, 2, 1e308]}, "$.to[2]", "is too large", None),
            (PARAMETRIC | {"x": "sine(t)"}, "$.x", "unknown function 'sine'", "'sin'"),
            (PARAMETRIC | {"dz": "9**9**9"}, "$.dz", "not finite", None),
            (PARAMETRIC | {"t": [1, 0]}, "$.t", "runs backwards", None),
            (PARAMETRIC | {"t": [0, "1e308*10"]}, "$.t[1]", "not finite", None),
            (
                {"objects": [SEGMENT, {"type": "circle", "center": [1, 2, 3], "radius": -1}]},
                "$.objects[1].radius",
                "must be positive",
                None,
            ),
            ({"type": "points"}, "$", "either the key 'points' or the key 'file'", None),
            ({"type": "points", "points": [], "file": "a.csv"}, "$", "either", None),
            ({"type": "points", "points": []}, "$.points", "0 points, at least 1", None),
            ({"type": "points", "file": "a.csv"}, "$.file", "no folder", None),
            ({"objects": [], "params": {"a": "b"}}, "$.params.a", "unknown name 'b'", None),
            ({"objects": [], "params": {"a": None}}, "$.params.a", "a number", None),
            ({"objects": [], "params": {"a": "a"}}, "$.params", "circle", None),
            ({"objects": [], "params": {"sin": 1}}, "$.params", "'sin'", None),
            ({"objects": [], "size": [1, 2]}, "$.size", "found a list of 2", "[64, 64, 64]"),
            ({"objects": [], "size": 17}, "$.size", "the number 17", '"size": [17, 17, 17]'),
            ({"objects": [], "size": "8x8x8"}, "$.size", "text '8x8x8'", "[64, 64, 64]"),
            ({"objects": [], "size": [1, 2, "n"]}, "$.size[2]", "unknown name 'n'", None),
            ({"objects": [], "size": [1, 2, "5/2"]}, "$.size[2]", "whole number", None),
            ({"objects": [], "size": [1, 2, 0]}, "$.size[2]", "0 is less than 1", None),
            ({"objects": [], "size": [1, 2, 65536]}, "$.size[2]", "65536 is more than 65535", None),
            ({"objects": [], "size": [1, 2, "0"]}, "$.size[2]", "from 1 to 65535, not 0", None),
            (
                {"objects": [], "size": [1, 2, None]},
                "$.size[2]",
                "whole number or an expression",
                None,
            ),
            ({"objects": [], "size": [9999] * 3}, "$.size", "more than 2147483648 voxels", None),
        ],
    )
    def test_where_and_what(self, data: Any, path: str, message: str, hint: str | None) -> None:
        error = refused(data)
        assert error.path == path
        assert message in str(error)
        assert (hint or "") in (error.hint or "")


class TestHostile:
    @pytest.mark.parametrize(
        ("data", "message"),
        [
            ("", "empty"),
            (b"  \n", "empty"),
            ("{", "line 1, column 2: .*not JSON: it ends too early"),
            ('{"objects": [],}', "not JSON"),
            (b"\0", "binary file"),
            ('{"objects": ["\0"]}', "not JSON: U.0000"),
            (b"\xff\xfe{\0}\0", "UTF-16 text, and must be UTF-8"),
            ('{"a":' * 100_000, "nested too deeply"),
            ("[" * 100_000, "nested too deeply"),
            ('{"objects": [], "size": [1, 2, NaN]}', "NaN"),
            ('{"objects": [], "size": [1, 2, -Infinity]}', "-Infinity"),
            ('{"objects": [], "size": [1, 2, 1e999]}', "size"),
            ('{"objects": [], "size": [1, 2, ' + "1" * 10**6 + "]}", "size"),
            (
                '{"type": "segment", "from": [1, 2, 1e999], "to": [1, 2, 3]}',
                r"from\[2\] is not fin",
            ),
            ('{"objects": [], "objects": []}', "'objects' is twice"),
            ('{"type": "points", "points": [[1, 2, 1e999]]}', r"points\[0\]\[2\] is not finite"),
            ('{"objects": [], "\\ud800": 1}', "surrogate"),
            ('{"type": "\\ud800"}', "surrogate"),
            ('{"objects": [], "params": {"\\ud800": 1}}', "surrogate"),
            ('{"objects": [], "params": {"a": "\\ud800"}}', "surrogate"),
            ('{"type": "bezier", "points": [' + "[1,2,3]," * 5000 + "[1,2,3]]}", "degree"),
            (json.dumps({"objects": [], "params": {f"a{i}": 1 for i in range(9999)}}), "1000"),
            (json.dumps(SEGMENT | {"x" * 10**6: 1}), "unknown key"),
            (json.dumps(SEGMENT | {"type": "x" * 10**6}), "unknown type"),
            (json.dumps(SEGMENT | {"color": "x" * 10**6}), "unknown colour"),
            (json.dumps(SEGMENT | {"` - at `$": 1}), "unknown"),
            ('{"objects": [], "x` - at `$.objects[5]": 1}', "unknown key"),
            ('{"objects": [], "x - at `$.params[...]": 1}', "unknown key"),
            ('{"objects": [], "params": {"\\ud800": null}}', "surrogate"),
        ],
    )
    def test_is_refused(self, data: str | bytes, message: str) -> None:
        with pytest.raises(SceneError, match=message):
            read_scene(data)
        refused(data)

    @pytest.mark.parametrize("length", [MAX_LENGTH + 1, 10_000_000])
    def test_a_long_expression(self, length: int) -> None:
        assert refused(PARAMETRIC | {"x": "1" * length}).path == "$.x"

    def test_a_large_file(self) -> None:
        refused(" " * (reader.MAX_BYTES + 1))

    def test_a_deep_expression(self) -> None:
        assert "nested" in str(refused(PARAMETRIC | {"x": "(" * 2000}))

    @pytest.mark.parametrize("name", ["__import__('os')", "open('x')", "t.__class__", "eval"])
    def test_names_of_python_are_unknown(self, name: str) -> None:
        assert refused(PARAMETRIC | {"x": name}).path == "$.x"


class TestLoad:
    def test_missing(self, tmp_path: Path) -> None:
        (tmp_path / "curve.json").write_text("{}")
        with pytest.raises(SceneError, match=r"^no such file: .*curv\.json") as caught:
            load_scene(tmp_path / "curv.json")
        assert caught.value.hint == "did you mean 'curve.json'?"
        with pytest.raises(SceneError, match="no such file") as caught:
            load_scene(tmp_path / "no" / "curve.json")
        assert "no folder" in str(caught.value.hint)

    @pytest.mark.parametrize("name", [".", "a\0b", "\ud800", "x" * 5000, ""])
    def test_what_cannot_be_read(
        self, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SceneError) as caught:
            load_scene(name)
        str(caught.value).encode()

    @pytest.mark.skipif(sys.platform == "win32", reason="has no /dev/zero")
    def test_a_file_without_end(self) -> None:
        with pytest.raises(SceneError, match="larger than"):
            load_scene("/dev/zero")
