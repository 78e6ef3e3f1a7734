"""JSON text of scenes: comments, syntax errors in plain words, line and column of every value."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest

from voxdisplay.errors import SceneError
from voxdisplay.scene import load_scene, read_scene
from voxdisplay.scene.json_text import JsonText

CIRCLE = '{"type": "circle", "center": [1, 2, 3], "radius": 2}'


def refused(data: bytes | str) -> SceneError:
    with pytest.raises(SceneError) as caught:
        read_scene(data)
    assert len(f"{caught.value} {caught.value.hint}") < 500
    return caught.value


@pytest.mark.parametrize(
    ("text", "place", "problem", "hint"),
    [
        # commas
        ('{"objects": [1, 2,],\n}', (1, 18), "a trailing comma before the closing ]", "remove"),
        ('{"objects": [],\n "params": {"a": 1,\n}}', (2, 19), "trailing comma", "remove"),
        ('{"objects": [1,  // last\n ]}', (1, 15), "trailing comma", "remove"),
        ('{"a": 1\n "b": 2}', (2, 2), "a comma is missing before this", "commas"),
        ('{"a": [1, 2]\n "b": 2}', (2, 2), "a comma is missing", "commas"),
        ('{"a": "x"\n "b": 2}', (2, 2), "a comma is missing", "commas"),
        ("[1 2]", (1, 4), "a comma is missing", "commas"),
        ('[{"a": 1} {"b": 2}]', (1, 11), "a comma is missing", "commas"),
        ('{"a": 1;\n"b": 2}', (1, 8), "a semicolon", "commas"),
        ('{"a": [1,, 2]}', (1, 10), "a value is missing before this comma", ""),
        ('{"a": 1,, "b": 2}', (1, 9), "a comma with nothing before it", "remove"),
        # colons
        ('{"type" "circle"}', (1, 9), 'a colon is missing after the key "type"', ""),
        ('{"type"}', (1, 8), "a colon is missing", ""),
        ('{"type" = 1}', (1, 9), "a colon is missing", ""),
        ('{"a":}', (1, 6), "a value is missing before this closing }", ""),
        ('["a": 1]', (1, 5), "a colon inside a list", "braces"),
        # quotes
        ("{'type': 'circle'}", (1, 2), "a key in other than double quotes", '"type"'),
        ("{\"type\": 'circle'}", (1, 10), "text in other than double quotes", "double quote"),
        ('{"type": \u201ccircle\u201d}', (1, 10), "text in other than double quotes", ""),
        ("{\u201ctype\u201d: 1}", (1, 2), "a key in other than double quotes", '"type"'),
        ("{type: 1}", (1, 2), "the key 'type' has no quotes", '"type":'),
        ('{"a": 1, b2: 1}', (1, 10), "the key 'b2' has no quotes", '"b2":'),
        ("{1: 2}", (1, 2), "the key '1' has no quotes", '"1":'),
        ('{"color": red}', (1, 11), "'red' has no quotes", '"red"'),
        ('{"a": "b\n}', (1, 7), "this quote is not closed on its line", 'closing "'),
        ('{"a": "b}', (1, 7), "this quote is not closed", 'closing "'),
        ('{"a', (1, 2), "this quote is not closed", 'closing "'),
        ('{"file": "C:\\data\\x.csv"}', (1, 13), "\\d inside quotes has no meaning", "parted by /"),
        ('{"a": "\\u12"}', (1, 8), "\\u inside quotes has no meaning", ""),
        ('{"a": "b\tc"}', (1, 9), "a tab inside quotes", "\\t"),
        # numbers, expressions, words
        ('{"a": 2*pi}', (1, 7), "the expression '2*pi' has no quotes", '"2*pi"'),
        ('{"a": [90deg]}', (1, 8), "the expression '90deg' has no quotes", '"90deg"'),
        ('{"a": -pi/2, "b": 1}', (1, 7), "'-pi/2' has no quotes", '"-pi/2"'),
        ('{"a": 1.5e3x}', (1, 7), "'1.5e3x' has no quotes", ""),
        ('{"a": .5}', (1, 7), "a number cannot begin with .", "0.5"),
        ('{"a": +5}', (1, 7), "a number cannot begin with +", "leave"),
        ('{"a": 5.}', (1, 7), "a number that ends with its point", "1.0"),
        ('{"a": 007}', (1, 7), "a number with a leading 0", ""),
        ('{"a": 0x10}', (1, 7), "a number with a leading 0", ""),
        ('{"closed": True}', (1, 12), "True is not a word of JSON", "write true"),
        ('{"closed": None}', (1, 12), "None is not a word of JSON", "write null"),
        ('{"a": (1, 2, 3)}', (1, 7), "a list in round brackets", "[ and ]"),
        ('{"a": [1, NaN]}', (1, 11), "NaN is not a number", ""),
        ('{"NaN": "NaN", "a": -Infinity}', (1, 21), "-Infinity is not a number", ""),
        # ends
        ("{", (1, 2), "ends too early: the { of line 1, column 1", "}"),
        ('{"objects": [\n{"a": 1},\n', (3, 1), "the [ of line 1, column 13 is not closed", "]"),
        ('{"objects": [{"a": "x", ', (1, 25), "the { of line 1, column 14", "cut off"),
        ('{"a": [1, 2}', (1, 12), "a closing } where ] is expected: the [ of line 1", ""),
        ('{"a": 1]', (1, 8), "a closing ] where } is expected", ""),
        ('{"a": 1}}', (1, 9), "one closing } too many", "remove"),
        (f"{CIRCLE}\n{CIRCLE}", (2, 1), "something follows after the end", '"objects"'),
        # comments and other notations
        ("# a circle\n" + CIRCLE, (1, 1), "a comment that begins with #", "//"),
        ("{/* no */}", (1, 2), "a comment that begins with /*", "//"),
        ('{"a": 1 # no\n}', (1, 9), "a comment that begins with #", "//"),
        ("type: circle\nradius: 2\n", (1, 1), "it begins with 'type: circle'", '{"objects"'),
        ('{"a": 1 \0}', (1, 9), "U+0000 here has no meaning", ""),
        # not of the syntax, but found while it is parsed
        ('{"objects": [],\n "objects": []}', (2, 2), "the key 'objects' is twice", ""),
        ('{"objects": [{"a": {"b": 1}, "b": 1, "a": 1}]}', (1, 38), "'a' is twice", ""),
    ],
)
def test_syntax_errors(text: str, place: tuple[int, int], problem: str, hint: str) -> None:
    error = refused(text)
    assert (error.line, error.column) == place
    assert problem in str(error)
    assert str(error).startswith(f"line {place[0]}, column {place[1]}: ")
    assert hint in (error.hint or "")


@pytest.mark.parametrize("text", ["", " \n", "\ufeff", "// nothing\n"])
def test_an_empty_file(text: str) -> None:
    assert str(refused(text)) == "the file is empty"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('{"objects": [\n  {"type": "circle",\n   "colour": 1}]}', (3, 4)),
        ('{"objects": [],\n "sise": [1, 2, 3]}', (2, 2)),
        (CIRCLE[:-1] + ',\n "color":\n  "orang"}', (3, 3)),
        (CIRCLE[:-1] + ',\n "color": ["red",\n  "orang"]}', (3, 3)),
        (CIRCLE.replace("2}", "\n -2}"), (2, 2)),
        (CIRCLE.replace("[1, 2, 3]", "[1, 2]"), (1, 30)),
        (CIRCLE.replace("3]", '"a +"]'), (1, 37)),
        ('{"objects": [\n ' + CIRCLE + ",\n " + CIRCLE.replace("circle", "cirle") + "]}", (3, 11)),
        ('{"objects": [], "params": {"a": 1,\n"b": "c"}}', (2, 6)),
        ('{"size": 64, "objects": []}', (1, 10)),
        ('{"size": [1,\n 2,\n 0.5], "objects": []}', (3, 2)),
        ('{"type": "bezier", "points": [[1, 2, 3],\n[4, 5, 6],\n[7, 8]]}', (3, 1)),
        ('{"type": "bezier", "points": [[1, 2, 3],\n[4, 5, "x"]]}', (2, 8)),
        ('// "type"\n{"type": "circle", // "center"\n"center": [1, 2, 3]}', (2, 1)),
        ('{"a.b": 1, "type": "circle"}', (1, 2)),
        ('{"type": "parametric", "x": "1/(t - 1)", "y": "sine(t)"}', (1, 1)),
        ('\n {"type": "points"}', (2, 2)),
        ("\n [1]", (2, 2)),
    ],
)
def test_values_have_a_line_and_column(text: str, place: tuple[int, int]) -> None:
    error = refused(text)
    assert (error.line, error.column) == place


def test_files_are_named(tmp_path: Path) -> None:
    path = tmp_path / "curve.json"
    for text, place in (
        (CIRCLE[:-1], "line 1, column 52"),
        (CIRCLE.replace("2}", "-2}"), "line 1, column 51"),
    ):
        path.write_text(text)
        with pytest.raises(SceneError) as caught:
            load_scene(path)
        assert str(caught.value).startswith(f"{path}, {place}: ")
        assert caught.value.file == str(path)


@pytest.mark.parametrize(
    "text",
    [
        "// one\n" + CIRCLE + "// two",
        CIRCLE.replace(", ", ", // more\r\n"),
        CIRCLE.replace(":", "://:\n"),
        '{"$schema": "https://example.org/a//b", "objects": []} // "',
        CIRCLE[:-1] + ', "color": "red" /' + "/ }\n}",
        '{"$schema": "https://example.org/s", ' + CIRCLE[1:],
    ],
)
def test_comments_and_schemas_are_taken(text: str) -> None:
    assert read_scene(text).size is None
    assert read_scene(text.encode()).size is None


def test_what_looks_like_a_comment_in_a_string_is_text() -> None:
    text = '{"a": "// \\" // ", "b//": "\\\\"} // "'
    assert JsonText(text).parse() == {"a": '// " // ', "b//": "\\"}


def test_one_objects_schema_is_a_text() -> None:
    error = refused('{"$schema": 1, ' + CIRCLE[1:])
    assert (error.path, error.column) == ("$.$schema", 13)
    nested = '{"objects": [{"$schema": "s", ' + CIRCLE[1:] + "]}"
    assert "unknown key '$schema'" in str(refused(nested))


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"solid cube\n  facet normal 0 0 1\n", "an STL mesh"),
        (b"solid\nendsolid\n", "an STL mesh"),
        (bytes(80) + (2).to_bytes(4, "little") + bytes(100), "an STL mesh"),
        (b"# a cube\nmtllib a.mtl\no cube\nv 1.0 -2 3e0\n", "an OBJ mesh"),
        (b"v 0 0 0\nv 1 0 0\n", "an OBJ mesh"),
        (b"ply\nformat ascii 1.0\n", "a PLY mesh"),
        (b"ply\r\nformat binary_little_endian 1.0\r\n\xff", "a PLY mesh"),
        (b"OFF\n8 6 12\n", "an OFF mesh"),
        (b"glTF\x02\0\0\0\xff", "a glTF mesh"),
        (b"\x93NUMPY\x01\0", "a numpy array"),
        (b"PK\x03\x04\xff\xff", "a ZIP archive"),
        (b"\x89PNG\r\n\x1a\n", "a picture"),
        (b"<?xml version='1.0'?>", "HTML or XML text"),
        (b"x,y,z\n1,2,3\n", "a table of numbers"),
        (b"1.0 2.0 3.0\n", "a table of numbers"),
        (b"# x y z\n1;2;3\n", "a table of numbers"),
        (b"\x00\x01\x02\x03", "a binary file"),
        ('{"objects": []}'.encode("utf-16"), "UTF-16 text, and must be UTF-8"),
        ('{"objects": []}'.encode("utf-16-le"), "UTF-16 text"),
        ('{"objects": []}'.encode("utf-32"), "UTF-32 text"),
        (b'{"color": "\xe9"}', "not UTF-8 text: byte 11"),
    ],
)
def test_files_of_other_kinds_are_named(data: bytes, kind: str) -> None:
    error = refused(data)
    assert kind in str(error)
    assert error.hint


@pytest.mark.parametrize("row", range(9))
def test_the_first_wrong_row_is_named(row: int) -> None:
    points: list[list[int]] = [[1, 2, 3]] * 9
    points[row:] = [[4, 5]] * (9 - row)
    error = refused(json.dumps({"type": "points", "points": points}))
    assert error.path == f"$.points[{row}]"


def test_errors_of_large_files() -> None:
    rows = "[12.25,7,33.5],\n" * 600_000
    start = '{"type": "points", "points": [\n'
    for end, message in (
        ("[1,2,3],]}", "line 600002, column 8: the file is not JSON: a trailing comma"),
        ("[1,2]]}", "line 600002, column 1: $.points[600000]: expected three numbers"),
        ('["x",2,3]]}', "line 600002, column 2: $.points[600000][0]: unknown name"),
        ("[1,2,3", "it ends too early: the [ of line 600002, column 1"),
    ):
        with pytest.raises(SceneError) as caught:
            read_scene(start + rows + end)
        assert message in str(caught.value)


@pytest.mark.parametrize("text", ['"' * 200_001, '{"a": "' + '\\"' * 200_000, "//" * 200_000])
def test_quotes_without_an_end_take_linear_time(text: str) -> None:
    refused(text)


def test_wordings_do_not_come_from_msgspec(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = [
        CIRCLE.replace("2}", "null}"),
        CIRCLE.replace("circle", "cirle"),
        CIRCLE[:-1] + ', "colour": 1}',
        CIRCLE[:-1] + ', "color": []}',
        CIRCLE.replace("[1, 2, 3]", "[1, 2]"),
        CIRCLE[:-1] + ', "closed": 1}',
        '{"objects": 1}',
        '{"size": [0, 1, 2], "objects": []}',
        json.dumps({"objects": [], "params": {f"a{i}": 1 for i in range(1001)}}),
    ]
    before = [str(refused(text)) for text in texts]
    convert = msgspec.convert

    def reworded(*arguments: object) -> object:
        try:
            return convert(*arguments)
        except msgspec.ValidationError:
            raise msgspec.ValidationError("other words") from None

    monkeypatch.setattr(msgspec, "convert", reworded)
    assert [str(refused(text)) for text in texts] == before
