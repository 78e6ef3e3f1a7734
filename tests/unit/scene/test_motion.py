"""Scenes in time: frames, tracks, what depends on the time, and what is wrong."""

from __future__ import annotations

import copy
import json
import pickle
import time
from typing import Any

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.errors import SceneError
from voxdisplay.raster.grid import Grid
from voxdisplay.scene import Scene, read_scene
from voxdisplay.scene.moving_scene import MovingScene
from voxdisplay.scene.timeline import BLOCK_FRAMES
from voxdisplay.shows.show import Show, ShowSource

LINE: dict[str, Any] = {"type": "segment", "from": ["time", 2, 3], "to": [9, 2, 3]}
STILL: dict[str, Any] = {"type": "circle", "center": [9, 9, 9], "radius": 5}


def scene_of(*objects: dict[str, Any], **more: Any) -> MovingScene:
    scene = read_scene(json.dumps({"objects": objects, "duration": 4, "fps": 8} | more))
    assert isinstance(scene, MovingScene)
    return scene


def start_x(scene: Scene) -> float:
    """Return the x of the first point of the first curve."""
    return float(scene.items[0].curve.position(np.zeros(1))[0, 0])


def refused(*objects: dict[str, Any], **more: Any) -> SceneError:
    began = time.monotonic()
    with pytest.raises(SceneError) as caught:
        read_scene(json.dumps({"objects": objects, "duration": 4} | more))
    assert time.monotonic() - began < 30  # of bounded work, however slow the machine is
    assert len(str(caught.value)) < 400
    return caught.value


class TestFrames:
    def test_how_many_and_when(self) -> None:
        scene = scene_of(LINE, loop=True)
        assert (scene.duration, scene.fps, scene.loop) == (4.0, 8.0, True)
        assert scene.frame_count == 32  # a loop does not show its beginning twice
        assert [start_x(scene.at_frame(n)) for n in (0, 1, 31)] == [0.0, 0.125, 3.875]

    @pytest.mark.parametrize(
        ("duration", "fps", "count"), [(10, 30, 300), (0.1, 30, 3), (1, 29.97, 30), ("1/3", 30, 10)]
    )
    def test_counts(self, duration: Any, fps: float, count: int) -> None:
        assert scene_of(LINE, duration=duration, fps=fps).frame_count == count

    def test_the_default_rate(self) -> None:
        scene = read_scene(json.dumps({"objects": [LINE], "duration": 2}))
        assert (scene.fps, scene.loop, scene.frame_count) == (30.0, False, 60)

    def test_times_are_computed_and_not_summed(self) -> None:
        scene = scene_of(LINE, duration=1000, fps=30)
        for n in (7, 29_999):
            assert start_x(scene.at_frame(n)) == n / 30

    def test_its_beginning_is_what_a_still_scene_would_be(self) -> None:
        assert start_x(scene_of(LINE)) == 0.0
        frame = vd.Frame((17, 17, 17))
        frame.draw(scene_of(LINE))
        assert frame.array().any(axis=-1)[3, 2, 0]

    def test_any_time(self) -> None:
        scene = scene_of(LINE)
        assert start_x(scene.at(0.3)) == 0.3
        assert start_x(scene.at(4)) == 4.0
        assert not scene.at(1).duration
        with pytest.raises(ValueError, match=r"4\.5 s is not from 0 to 4"):
            scene.at(4.5)
        with pytest.raises(ValueError, match="number"):
            scene.at_frame(32)

    def test_a_still_scene_has_one_frame(self) -> None:
        scene = read_scene(json.dumps(STILL))
        assert (scene.duration, scene.frame_count) == (0.0, 1)
        assert scene.at_frame(0) is scene
        assert scene.at(3.0) is scene


class TestNumbers:
    @pytest.mark.parametrize(
        "scene_object",
        [
            LINE,
            STILL | {"radius": "4 + k*sin(time)"},
            {"type": "parametric", "x": "8 + a*cos(t + time)", "y": "8 + sin(a*t)**2/(t + a)",
             "z": "9", "t": ["0.1*a", "3 + time"]},
            {"type": "bezier", "points": [["a", 1, 2], ["a*k", "time", 5], [9, "5 - time", 9]]},
            {"type": "sphere", "center": ["a", 9, 9], "radius": "3 + time/4"},
            {"type": "height_field", "z": "8 + a*sin(x + time)", "x": [0, 9], "y": [0, "5 + a"]},
            STILL | {"transform": [{"rotate": [0, "a", 1], "angle": "time"}, {"scale": "a"}]},
            STILL | {"color": {"map": "viridis", "by": "x*a + time", "range": [0, "20*a"]}},
            STILL | {"repeat": {"j": "1 + floor(time)"}, "radius": "5 - j - time/9"},
        ],
        ids=lambda each: each["type"],
    )  # fmt: skip
    def test_a_moment_is_the_still_scene_of_its_numbers(self, scene_object: dict[str, Any]) -> None:
        params = {"k": 3, "a": "1 + time/duration", "b": "a*2"}
        scene = scene_of(scene_object, params=params, size=[17, 17, 17])
        for number in (0, 5, 31):
            time_s = number / 8
            text = json.dumps({"objects": [scene_object], "size": [17, 17, 17]})
            for name, value in (("time", time_s), ("duration", 4.0)):
                text = text.replace(name, repr(value))
            still = read_scene(
                json.dumps(json.loads(text) | {"params": {"k": 3, "a": 1 + time_s / 4}})
            )
            frame, expected = vd.Frame((17, 17, 17)), vd.Frame((17, 17, 17))
            frame.draw(scene.at_frame(number))
            expected.draw(still)
            assert frame == expected

    def test_frames_do_not_depend_on_which_were_made_before(self) -> None:
        texts = [f"8 + {a}*sin(tau*time/{a + 1} + {a}*time**2)" for a in range(1, 7)]
        line = {"type": "polyline", "points": [texts[:3], texts[3:]]}
        numbers = [0, 3, BLOCK_FRAMES - 1, BLOCK_FRAMES, 150]
        forward, backward = (scene_of(line, duration=20) for _ in range(2))
        one = [forward.at_frame(n).items[0].curve.position(np.array([0.5])) for n in numbers]
        other = [
            backward.at_frame(n).items[0].curve.position(np.array([0.5])) for n in numbers[::-1]
        ]
        np.testing.assert_array_equal(one, other[::-1])

    def test_what_does_not_move_stays_the_same_object(self) -> None:
        turn = {"rotate": [0, 0, 1], "angle": 1}
        still = STILL | {"transform": [turn], "color": ["red", "blue"]}
        scene = scene_of(still, LINE, {"type": "group", "objects": [STILL], "transform": [turn]})
        first, second = scene.at_frame(1), scene.at_frame(30)
        assert first.items[0] is second.items[0]
        assert first.items[1] is not second.items[1]
        assert first.items[2] is second.items[2]

    def test_time_and_duration_may_be_params_of_still_scenes(self) -> None:
        scene = read_scene(json.dumps({"objects": [LINE], "params": {"time": 5, "duration": 1}}))
        assert start_x(scene) == 5.0

    def test_a_value_that_fails_later_is_blamed_with_its_time(self) -> None:
        scene = scene_of(STILL | {"radius": "1 - time"})
        with pytest.raises(SceneError, match=r"positive.*, at time = 1") as caught:
            scene.at_frame(8)
        assert caught.value.path == "$.objects[0].radius"
        assert caught.value.line == 1
        line = {"type": "polyline", "points": [[1, 2, 3], [4, 5, "1/(1 - time)"]]}
        scene = scene_of(line)
        with pytest.raises(SceneError, match="not finite") as caught:
            scene.at_frame(8)
        assert caught.value.path == "$.objects[0].points[1][2]"
        assert start_x(scene.at_frame(7)) == 1.0


class TestTracks:
    def values(self, track: dict[str, Any], *times: float, **params: Any) -> list[float]:
        line = LINE | {"from": ["a", 2, 3]}
        scene = scene_of(line, params={"a": track} | params, duration=10)
        return [start_x(scene.at(time_s)) for time_s in times]

    def test_linear(self) -> None:
        track = {"keys": [[1, 10], [3, 20], [4, 0]]}
        assert self.values(track, 0, 1, 2, 3, 3.5, 4, 9) == [10, 10, 15, 20, 10, 0, 0]

    def test_smooth(self) -> None:
        track = {"keys": [[0, 0], [4, 8]], "ease": "smooth"}
        assert self.values(track, 0, 1, 2, 3, 4) == [0, 1.25, 4, 6.75, 8]

    def test_step(self) -> None:
        track = {"keys": [[1, 5], [3, 7]], "ease": "step"}
        assert self.values(track, 0, 1, 2.9, 3, 9) == [5, 5, 5, 7, 7]

    def test_a_jump_by_two_keys_at_one_time(self) -> None:
        assert self.values({"keys": [[0, 0], [2, 2], [2, 9]]}, 1.75, 2, 3) == [1.75, 9, 9]

    def test_expressions_in_keys(self) -> None:
        track = {"keys": [["s/2", "b + time"], ["duration", "s"]]}
        assert self.values(track, 0, 2, b="s*10", s=2) == [20, pytest.approx(22 * 8 / 9 + 2 / 9)]

    @pytest.mark.parametrize(
        ("track", "path", "message"),
        [
            ({"keys": [[1, 0], [0.5, 1]]}, ".keys[1][0]", "0.5 s stands behind that at 1 s"),
            ({"keys": []}, ".keys", "0 entries is less than 1"),
            ({"keys": [[1]]}, ".keys[0]", "a key [seconds, value]"),
            ({"keys": [["time", 1]]}, ".keys[0][0]", "'time'"),
            ({"keys": [[0, "q"]]}, ".keys[0][1]", "unknown name 'q'"),
            ({"keys": [[0, 1]], "ease": "fast"}, ".ease", '"linear" or "smooth" or "step"'),
            ({"key": [[0, 1]]}, "", "unknown key 'key'"),
            ({"keys": [[0, "a"]]}, None, "circle"),
        ],
        ids=str,
    )
    def test_mistakes(self, track: dict[str, Any], path: str | None, message: str) -> None:
        error = refused(LINE, params={"a": track})
        assert error.path == ("$.params" if path is None else f"$.params.a{path}")
        assert message in str(error)
        assert error.line


class TestDuring:
    def test_from_its_beginning_to_before_its_end(self) -> None:
        scene = scene_of(STILL | {"during": [1, "duration/2"]}, LINE)
        counts = [len(scene.at_frame(n).items) for n in range(32)]
        assert counts == [1] * 8 + [2] * 8 + [1] * 16

    def test_of_repeats_and_groups(self) -> None:
        group = {"type": "group", "objects": [STILL], "repeat": {"k": 4}, "during": ["k", 9]}
        scene = scene_of(group)
        assert [len(scene.at(time_s).items) for time_s in (0, 1.5, 3.9)] == [1, 2, 4]

    @pytest.mark.parametrize(
        ("during", "message"),
        [
            ([2, 1], "is empty or runs backwards: 2 to 1"),
            ([1, 1], "is empty"),
            ([5, 6], "5 to 6 s is outside of the scene, which lasts 4 s"),
            ([-2, 0], "outside"),
            (["q", 1], "unknown name 'q'"),
            ([1], "two numbers [from, to]"),
        ],
        ids=str,
    )
    def test_mistakes(self, during: list[Any], message: str) -> None:
        error = refused(LINE | {"during": during})
        assert str(error.path).startswith("$.objects[0].during")
        assert message in str(error)


class TestMistakes:
    @pytest.mark.parametrize(
        ("keys", "path", "message"),
        [
            ({"duration": 0}, "$.duration", "more than 0, not 0"),
            ({"duration": -1}, "$.duration", "more than 0, not -1"),
            ({"duration": "time"}, "$.duration", "'time'"),
            ({"duration": 1e9, "fps": 1e6}, "$.fps", "1e+06 is more than 10000"),
            ({"duration": 1e9}, "$.duration", "1e+09 s at 30 frames a second are 3e+10 frames"),
            ({"duration": 1e300, "fps": 1e4}, "$.duration", "more than 10000000"),
            ({"duration": 0.001}, "$.duration", "less than one frame"),
            ({"fps": 0}, "$.fps", "more than 0"),
            ({"fps": "x"}, "$.fps", "unknown name 'x'"),
            ({"loop": 1}, "$.loop", "true or false"),
            ({"params": {"time": 1}}, "$.params.time", "cannot be called 'time'"),
            ({"params": {"duration": 1}}, "$.params.duration", "cannot be called 'duration'"),
            ({"params": {"a": "1/0"}}, "$.params.a", "not finite"),
            ({"size": ["8 + time", 8, 8]}, "$.size[0]", "'time'"),
        ],
        ids=str,
    )
    def test_where_and_what(self, keys: dict[str, Any], path: str, message: str) -> None:
        error = refused(LINE, **keys)
        assert error.path == path
        assert message in str(error)
        assert error.line == 1

    @pytest.mark.parametrize(
        ("scene", "path"),
        [
            ({"objects": [STILL | {"during": [0, 1]}]}, "$.objects[0].during"),
            ({"objects": [], "fps": 25}, "$.fps"),
            ({"objects": [], "loop": True}, "$.loop"),
            ({"objects": [], "params": {"a": {"keys": [[0, 1]]}}}, "$.params.a"),
            ({"objects": [LINE]}, "$.objects[0].from[0]"),
        ],
        ids=str,
    )
    def test_without_a_duration(self, scene: dict[str, Any], path: str) -> None:
        with pytest.raises(SceneError) as caught:
            read_scene(json.dumps(scene))
        assert caught.value.path == path
        assert "duration" in f"{caught.value} {caught.value.hint}"


class TestShow:
    def test_it_is_a_show(self) -> None:
        scene = scene_of(LINE, STILL)
        assert isinstance(scene, ShowSource)
        show = scene.show_on(vd.Frame((17, 17, 17)))
        assert isinstance(show, Show)
        assert (show.duration, show.fps, show.loop, show.frame_count) == (4.0, 8.0, False, 32)
        assert "2 objects" in repr(show)

    def test_frames_are_those_of_the_scene(self) -> None:
        scene = scene_of(STILL, LINE | {"part": [0, "time/4"], "color": ["red", "blue"]})
        show = scene.show_on(vd.Frame((17, 17, 17)))
        for number in (0, 31, 30, 7):
            expected = vd.Frame((17, 17, 17))
            expected.draw(scene.at_frame(number))
            assert show.frame(number) == expected

    def test_copies_show_the_same(self) -> None:
        scene = scene_of(STILL | {"color": {"map": "hot", "by": "t + time"}}, LINE, size=[9, 9, 9])
        show = scene.show_on(vd.Frame((17, 17, 17)))
        picture = show.frame(9)
        for copied in (pickle.loads(pickle.dumps(show)), copy.deepcopy(show)):  # noqa: S301
            assert copied.frame(9) == picture
        again = pickle.loads(pickle.dumps(scene)).show_on(vd.Frame((17, 17, 17)))  # noqa: S301
        assert again.frame(9) == picture

    def test_fitted_like_a_still_scene(self) -> None:
        scene = scene_of(LINE, STILL, size=[17, 17, 17])
        fitted, note = scene.fitted(Grid(34, 34, 51))
        assert note == "scene composed for 17x17x17, scaled by 2 to 34x34x51"
        assert isinstance(fitted, MovingScene)
        assert fitted.size == (34, 34, 51)
        still, _ = scene.at_frame(8).fitted(Grid(34, 34, 51))
        one, other = vd.Frame((34, 34, 51)), vd.Frame((34, 34, 51))
        one.draw(fitted.at_frame(8))
        other.draw(still)
        assert one == other

    def test_content_fits_at_all_times(self) -> None:
        grow = {"type": "sphere", "center": [0, 0, 0], "radius": "1 + 9*time"}
        fitted, _ = scene_of(grow).fitted(Grid(30, 40, 50), "content")
        assert isinstance(fitted, MovingScene)
        largest = 0
        for number in range(32):
            (found,) = fitted.at_frame(number).voxelize()
            largest = max(largest, len(set(found.voxels[:, 0].tolist())))
        assert 28 <= largest <= 31

    def test_a_still_scene_is_a_show_of_one_frame(self) -> None:
        show = read_scene(json.dumps(STILL)).show_on(vd.Frame((17, 17, 17)))
        assert isinstance(show, Show)
        assert (show.duration, show.frame_count) == (0.0, 1)
        assert len(show.frame(0).lit()[0]) > 10
