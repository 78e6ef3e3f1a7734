"""Playlists: their files, what is wrong with them, and the schedules that they make."""

import json
import re

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.shows.fade import FadedShow
from voxdisplay.shows.playlist import Playlist
from voxdisplay.shows.sequence import ShowSequence

SIZE = (3, 5, 7)
MOVING = {
    "size": SIZE, "duration": 2, "fps": 10,
    "objects": [{"type": "segment", "from": [0.5, 0.5, 0.5], "to": ["0.5 + time", 4.5, 6.5]}],
}  # fmt: skip
STILL = {"type": "segment", "from": [0.5, 0.5, 0.5], "to": [2.5, 4.5, 6.5]}


@pytest.fixture
def write(tmp_path):
    """Write files beside each other; return the path of the last."""

    def write(**files):
        for name, content in files.items():
            path = tmp_path / f"{name}.json"
            text = content if isinstance(content, str) else json.dumps(content)
            path.write_text(text, encoding="utf-8")
        return path

    return write


def frames_of(schedule):
    slots = [schedule.slot(ordinal) for ordinal in range(schedule.turn_frames)]
    return [(slot.segment, slot.number, round(slot.begins_s, 6)) for slot in slots]


def test_entries_are_played_with_their_parts_speeds_and_repeats(write):
    path = write(
        a=MOVING,
        s=STILL,
        list={
            "playlist": [
                {"show": "a.json", "repeat": 2},
                {"show": "a.json", "from": 0.5, "until": 1.5, "speed": 0.5},
                {"show": "s.json", "until": 3},
                "s.json",
            ]
        },
    )
    playlist = vd.load_show(path)
    assert isinstance(playlist, Playlist)
    schedule = playlist.schedule_on(vd.Frame(SIZE))
    lengths = [segment.length_s for segment in schedule.segments]
    assert lengths == pytest.approx([2, 2, 2, 3, 5])
    frames = frames_of(schedule)
    assert frames[:20] == [(0, n, n / 10) for n in range(20)]
    assert frames[40:50] == [(2, 5 + n, 4 + n / 5) for n in range(10)]
    assert frames[50:] == [(3, 0, 6.0), (4, 0, 9.0)]
    assert schedule.duration_s == pytest.approx(14)


def test_repeat_and_shuffle(write):
    path = write(a=MOVING, list={"playlist": ["a.json"], "repeat": 0, "shuffle": True})
    playlist = vd.load_show(path)
    assert playlist.schedule_on(vd.Frame(SIZE)).duration_s == float("inf")
    assert playlist.shuffle
    path = write(list={"playlist": ["a.json"], "repeat": 3})
    assert vd.load_show(path).schedule_on(vd.Frame(SIZE)).duration_s == 6
    with pytest.raises(ValueError, match="until"):
        vd.load_show(path).schedule_on(vd.Frame(SIZE), until_s=1.0)


def test_playlists_of_playlists(write):
    path = write(
        a=MOVING,
        inner={"playlist": ["a.json"], "repeat": 2},
        list={"playlist": [{"show": "inner.json", "repeat": 2}, "a.json"]},
    )
    assert len(vd.load_show(path).entries) == 5


def test_a_playlist_that_includes_itself_is_an_error(write):
    path = write(a={"playlist": ["b.json"]}, b={"playlist": ["./a.json"]})
    with pytest.raises(vd.SceneError, match=r"includes itself, by 'b.json'") as caught:
        vd.load_show(path)
    assert '"repeat": 0' in caught.value.hint


def test_many_playlists_in_each_other_are_refused_at_once(write):
    files = {
        f"l{k}": {"playlist": [{"show": f"l{k + 1}.json", "repeat": 10_000}]} for k in range(9)
    }
    path = write(**files, l9={"playlist": ["a.json"]}, a=MOVING)
    with pytest.raises(vd.SceneError, match="more than 10000 entries"):
        vd.load_show(path.with_name("l0.json"))


def test_missing_and_wrong_files_are_left_out_and_named(write):
    path = write(a=MOVING, bad='{"type": "circel"}', list={
        "playlist": ["gone.json", "a.json", "bad.json"]})  # fmt: skip
    playlist = vd.load_show(path)
    assert len(playlist.entries) == 1
    assert len(playlist.notes) == 2
    assert "gone.json" in playlist.notes[0]
    assert "circel" in playlist.notes[1]
    path = write(list={"playlist": ["gone.json"]})
    with pytest.raises(vd.SceneError, match=r"nothing of the playlist can be played.*gone.json"):
        vd.load_show(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"playlist": []}, r"\$.playlist: expected a list"),
        ({"playlist": "a.json"}, r"\$.playlist: expected a list"),
        ({"playlist": [3]}, r"playlist\[0\]: expected the name"),
        ({"playlist": [{"show": ""}]}, r"playlist\[0\]: expected the name"),
        ({"playlist": [{"show": "a", "repaet": 2}]}, "did you mean .*repeat"),
        ({"playlist": ["a"], "loop": True}, "unknown key 'loop'"),
        ({"playlist": ["a"], "repeat": -1}, r"\$.repeat: expected a whole number from 0"),
        ({"playlist": ["a"], "repeat": True}, r"\$.repeat"),
        ({"playlist": ["a"], "shuffle": 1}, r"\$.shuffle: expected true or false"),
        ({"playlist": [{"show": "a", "repeat": 0}]}, r"\[0\].repeat: expected .* from 1"),
        ({"playlist": [{"show": "a", "speed": 0}]}, r"\[0\].speed: expected a number above 0"),
        ({"playlist": [{"show": "a", "speed": "2"}]}, r"\[0\].speed: expected a number"),
        ({"playlist": [{"show": "a", "from": 1e9}]}, r"\[0\].from"),
        ({"playlist": [{"show": "a", "from": 3, "until": 2}]}, r"\[0\].until: until is 2"),
        ('["playlist"]', "a playlist is an object|expected"),
        ('{"playlist": [,]}', "not JSON"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(write, content, message):
    with pytest.raises(vd.SceneError) as caught:
        vd.load_show(write(list=content))
    text = f"{caught.value} {caught.value.hint or ''}"
    assert re.search(message, text), text


def test_a_scene_is_read_as_a_scene(write):
    assert isinstance(vd.load_show(write(a=STILL)), vd.Scene)
    with pytest.raises(vd.SceneError, match="no such file"):
        vd.load_show("gone.json")


def test_shows_in_a_row(write):
    path = write(a=MOVING, s=STILL, list={"playlist": ["a.json"], "repeat": 2})
    row = ShowSequence((vd.load_show(path), vd.load_show(path.with_name("s.json"))))
    schedule = row.schedule_on(vd.Frame(SIZE))
    assert [segment.length_s for segment in schedule.segments] == pytest.approx([2, 2, 1 / 30])
    row = ShowSequence((vd.load_show(path.with_name("a.json")),) * 2)
    assert row.schedule_on(vd.Frame(SIZE), until_s=0.5).duration_s == 1.0


# -- fades


class Bright:
    loop, fps, frame_count, duration = False, 10.0, 20, 2.0

    def __init__(self, format_="rgb888"):
        self._format = format_

    def frame(self, number):
        assert 0 <= number < 20
        frame = vd.Frame(SIZE, self._format)
        frame.draw([(x, 1, 2) for x in range(3)], "white")
        return frame


@pytest.mark.parametrize("format_", ["rgb888", "rgb565", "index8"])
def test_a_fade_rises_and_falls(format_):
    show = FadedShow(Bright(format_), 0.0, 2.0, 0.5)
    light = [int(show.frame(number).rgb().sum()) for number in range(20)]
    assert light[0] == 0
    assert light[:6] == sorted(light[:6])
    assert light[5:15] == [9 * 255] * 10
    assert light[15:] == sorted(light[15:], reverse=True)
    assert 0 < light[19] < light[17] < 9 * 255


def test_one_bit_a_voxel_does_not_fade():
    show = FadedShow(Bright("mono1"), 0.0, 2.0, 0.5)
    assert show.frame(0) == Bright("mono1").frame(0)


def test_a_still_picture_fades_frame_by_frame(write):
    path = write(s=STILL, list={"playlist": [{"show": "s.json", "until": 1, "fade": 9}]})
    schedule = vd.load_show(path).schedule_on(vd.Frame(SIZE))
    (segment,) = schedule.segments
    assert segment.frames == schedule.frames > 20
    light = [int(segment.show.frame(n).rgb().sum()) for n in range(segment.frames)]
    assert np.argmax(light) == pytest.approx(segment.frames / 2, abs=1)
