"""Text tables of points as other programs write them: what is read, noted, or refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from voxdisplay.errors import SceneError
from voxdisplay.scene import Scene, read_scene
from voxdisplay.scene.column_names import axis_columns

POINTS = [[1, 2, 3], [4, 5, 6.5]]


def scene_of(folder: Path, text: str | bytes, name: str = "data.csv", **keys: str) -> Scene:
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_scene(json.dumps({"type": "points", "file": name} | keys), folder=folder)


def strands(scene: Scene) -> list[list[list[float]]]:
    found = []
    for item in scene.items:
        t = np.arange(item.curve.t_range[1] + 1)
        points = item.curve.position(t).T.tolist()
        found.append(points[:1] if len(points) == 2 and points[0] == points[1] else points)
    return found


def refused(folder: Path, text: str | bytes, name: str = "data.csv") -> SceneError:
    with pytest.raises(SceneError) as caught:
        scene_of(folder, text, name)
    assert caught.value.path == "$.file"
    assert len(f"{caught.value} {caught.value.hint}") < 500
    return caught.value


@pytest.mark.parametrize(
    "text",
    [
        "1,2,3\n4,5,6.5\n",
        "1,2,3\r\n4,5,6.5",
        "1,2,3\r4,5,6.5\r",
        "x,y,z\n1,2,3\n4,5,6.5\n",
        '"X", "Y", "Z"\r\n1,2,3\r\n4,5,6.5\r\n',
        "\ufeffx,y,z\n1,2,3\n4,5,6.5\n",
        " 1 , 2 , 3 \n4,5,6.5\n",
        "# x,y,z\n1,2,3\n4,5,6.5\n",
        "# made by hand\n#\n1,2,3\n# in between\n4,5,6.5 # the last\n",
        "x,y,z\n\n1,2,3\n4,5,6.5\n\n\n",
        '"1","2","3"\n"4","5","6.5"\n',
        "'1','2','3'\n'4','5','6.5'\n",
        "1,2,3,\n4,5,6.5,\n",
        "x,y,z,\n1,2,3,\n4,5,6.5\n",
        "x,y,z\nmm,mm,mm\n1,2,3\n4,5,6.5\n",
        "% x,y,z\n1,2,3\n4,5,6.5\n",
        "// x,y,z\n1,2,3\n// in between\n4,5,6.5\n",
        "! made by hand\n1,2,3\n4,5,6.5\n",
        "1,2,3\n4,5,6.5\n\x1a",
        "1e0,2.0D0,+3\n4,5,6.5\n",
        "1.0E+00,2,3\n4,5,6.5e0\n",
    ],
)
def test_columns_x_y_z_need_no_note(tmp_path: Path, text: str) -> None:
    scene = scene_of(tmp_path, text)
    assert strands(scene) == [POINTS]
    assert scene.notes == ()


@pytest.mark.parametrize(
    ("name", "text", "note"),
    [
        # numpy, Fortran
        ("a.csv", "1.0e+00 2.0e+00 3.0e+00\n4 5 6.5e+00\n", "columns 1, 2, 3, separated by blanks"),
        ("a.txt", "# x y z\n1 2 3\n4 5 6.5\n", "1, 2, 3 ('x', 'y', 'z'), separated by blanks"),
        ("a.txt", "# x, y, z\n1 2 3\n4 5 6.5\n", "1, 2, 3 ('x', 'y', 'z'), separated by blanks"),
        ("a.dat", "   1.0D+00   2.0D+00  3.0D+00\n  4 5 6.5\n", "separated by blanks"),
        ("a.xyz", "1 2 3\n4 5 6.5\n", "separated by blanks"),
        ("a.tsv", "1\t2\t3\n4\t5\t6.5\n", "separated by tabs"),
        ("A.TXT", "x\ty\tz\n1\t2\t3\n4\t5\t6.5\n", "separated by tabs"),
        # pandas, R
        ("a.csv", ",x,y,z\n0,1,2,3\n1,4,5,6.5\n", "columns 2, 3, 4 ('x', 'y', 'z') of 4"),
        ("a.csv", "index;x;y;z\n0;1;2;3\n1;4;5;6.5\n", "columns 2, 3, 4"),
        ("a.txt", '"x" "y" "z"\n"1" 1 2 3\n"2" 4 5 6.5\n', "columns 2, 3, 4"),
        ("a.csv", '"","x","y","z"\n"1",1,2,3\n"2",4,5,6.5\n', "columns 2, 3, 4"),
        # names, in any order
        ("a.csv", "name,x,y,z\np1,1,2,3\np2,4,5,6.5\n", "columns 2, 3, 4"),
        ("a.csv", "z,y,x\n3,2,1\n6.5,5,4\n", "columns 3, 2, 1 ('x', 'y', 'z')"),
        ("a.csv", "Z,t,X,Y\n3,0,1,2\n6.5,1,4,5\n", "columns 3, 4, 1 ('X', 'Y', 'Z') of 4"),
        ("a.csv", 'x,y,z,label\n1,2,3,"a, b"\n4,5,6.5,c\n', "columns 1, 2, 3"),
        ("a.csv", "p1,1,2,3\np2,4,5,6.5\n", "columns 2, 3, 4 of 4"),
        ("a.csv", "east,north,height\n1,2,3\n4,5,6.5\n", "('east', 'north', 'height')"),
        ("a.csv", "name,east,north,up\na,1,2,3\nb,4,5,6.5\n", "columns 2, 3, 4"),
        ("a.csv", "1,2,3,4\n4,5,6.5,7\n", "columns 1, 2, 3 of 4"),
        ("a.csv", "sep=;\r\nx;y;z\r\n1;2;3\r\n4;5;6,5\r\n", "semicolons with decimal commas"),
        ("a.csv", '"sep=\t"\n1\t2\t3\n4\t5\t6,5\n', "tabs with decimal commas"),
        # units and words
        ("a.csv", "x [mm],y [mm],z [mm]\n1,2,3\n4,5,6.5\n", "'x [mm]', 'y [mm]', 'z [mm]'"),
        ("a.txt", "x [mm] y [mm] z [mm]\n1 2 3\n4 5 6.5\n", "columns 1, 2, 3"),
        ("a.csv", "t (s);X (mm);Y (mm);Z (mm)\n0;1;2;3\n1;4;5;6.5\n", "columns 2, 3, 4"),
        ("a.csv", "x/mm,y/mm,z/mm\n1,2,3\n4,5,6.5\n", "columns 1, 2, 3"),
        ("a.csv", "posX,posY,posZ,speed\n1,2,3,9\n4,5,6.5,9\n", "columns 1, 2, 3"),
        ("a.csv", "X Position,Y Position,Z Position\n1,2,3\n4,5,6.5\n", "columns 1, 2, 3"),
        # ParaView
        (
            "a.csv",
            '"Temp","Points:0","Points:1","Points:2"\n9,1,2,3\n9,4,5,6.5\n',
            "columns 2, 3, 4 ('Points:0', 'Points:1', 'Points:2') of 4",
        ),
        ("a.csv", "Points_2,Points_1,Points_0\n3,2,1\n6.5,5,4\n", "columns 3, 2, 1"),
        # comments that name columns, as of numpy.savetxt, robots and simulations
        ("a.csv", "# z,y,x\n# mm,mm,mm\n3,2,1\n6.5,5,4\n", "columns 3, 2, 1"),
        ("a.txt", "# t x y z\n# [s] [m] [m] [m]\n0 1 2 3\n1 4 5 6.5\n", "columns 2, 3, 4"),
        ("a.txt", "# by hand\n# t x y z\n# -------\n\n0 1 2 3\n1 4 5 6.5\n", "columns 2, 3, 4"),
        ("a.txt", "# columns: t x y z\n0 1 2 3\n1 4 5 6.5\n", "columns 2, 3, 4"),
        ("a.txt", "# 1:t 2:x 3:y 4:z\n0 1 2 3\n1 4 5 6.5\n", "columns 2, 3, 4"),
        ("a.txt", "# timestamp tx ty tz qw\n0 1 2 3 1\n1 4 5 6.5 1\n", "columns 2, 3, 4"),
        (
            "a.csv",
            (
                "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z\n"
                "0,1,2,3\n1,4,5,6.5\n"
            ),
            "columns 2, 3, 4",
        ),
        # decimal commas
        ("a.csv", "1,0;2;3\n4;5;6,5\n", "separated by semicolons with decimal commas"),
        ("a.csv", "1;2;3\n4;5;6,5\n", "separated by semicolons with decimal commas"),
        ("a.csv", "x;y;z\n1;2;3\n4,000;5,000;6,500\n", "semicolons with decimal commas"),
        ("a.txt", "1,0\t2,0\t3,0\n4\t5\t6,5\n", "separated by tabs with decimal commas"),
        ("a.txt", "1,0 2,0 3,0\n4,0 5,0 6,5\n", "separated by blanks with decimal commas"),
        ("a.csv", '"1,0","2,0","3,0"\n4,5,"6,5"\n', "separated by commas with decimal commas"),
        # counted
        ("a.xyz", "2\nwater\nO 1 2 3\nH 4 5 6.5\n", "columns 2, 3, 4 of 4"),
        ("a.xyz", "2\n\nO 1 2 3\nH 4 5 6.5\n", "columns 2, 3, 4 of 4"),
        ("a.pts", "2\n1 2 3\n4 5 6.5\n", "columns 1, 2, 3"),
    ],
)
def test_what_is_unambiguous_is_read_and_noted(
    tmp_path: Path, name: str, text: str, note: str
) -> None:
    scene = scene_of(tmp_path, text, name)
    assert strands(scene) == [POINTS]
    (found,) = scene.notes
    assert found.startswith(f"{name!r}: x, y, z are columns ")
    assert note in found


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    text = "x\ty\tz\r\n1\t2\t3\r\n4\t5\t6,5\r\n"
    assert strands(scene_of(tmp_path, text.encode(encoding), "a.txt")) == [POINTS]


def test_names_in_another_encoding(tmp_path: Path) -> None:
    text = "x [\N{MICRO SIGN}m];y [\N{MICRO SIGN}m];z [\N{MICRO SIGN}m]\n1;2;3\n4;5;6,5\n"
    assert strands(scene_of(tmp_path, text.encode("cp1252"))) == [POINTS]


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        # ambiguous
        ("0,1,2,3\n1,4,5,6\n2,7,8,9\n", "line 1: column 1 counts rows, or is x", "first line"),
        ("1 1 2 3\n2 4 5 6\n3 7 8 9\n", "line 1: column 1 counts rows, or is x", "first line"),
        ("id,lat,lon,alt\n1,2,3,4\n", "'id', 'lat', 'lon', 'alt' are x, y and z?", "first line"),
        ("x,y,value\n1,2,3\n", "none of the columns 'x', 'y', 'value' is z", "first line"),
        ("x,y,z,X\n1,2,3,4\n", "which of the columns 'x', 'X' is x?", "first line"),
        ("1,5, 2,5, 3,5\n", "separate columns, or mark decimals", "decimal points"),
        ("1,000 2,000 3,000\n", "mark decimals, or thousands", "decimal points"),
        ("1,000\t20,500\t3,250\n4\t5\t6\n", "mark decimals, or thousands", "decimal points"),
        ('"1,000","2,000","3,000"\n', "mark decimals, or thousands", "decimal points"),
        (
            "1,5;2;3\n1.5;2;3\n",
            "line 2: a decimal point, after a decimal comma in line 1",
            "points",
        ),
        ("x,y,z\n1,2,3,4\n", "3 columns have names, but line 2 has 4", "first line"),
        (",".join("123456789") + "\n", "line 1: 9 columns: is each row a point", "in each row"),
        ("1 2 3 4 5 6 7 8\n" * 3, "8 columns: is each row a point, or each column?", "first line"),
        # wrong
        ("1,2,3\n1,2\n", "line 2: '1,2' has 2 columns, not 3", "x, y and z"),
        ("1,2,3\n1,2,3,4\n", "line 2: '1,2,3,4' has 4 columns, not 3", "x, y and z"),
        ("x,y,z\n1,2,three\n4,5,6\n", "line 2: '1,2,three' is not three numbers", "x, y and z"),
        ("x,y,z\n4,5,6\n1,2,three\n", "line 3: 'three' is not a number", "x, y and z"),
        ("1,2,3\nx,y,z\n", "line 2: 'x' is not a number", "x, y and z"),
        ("1,2,3\n1_0,2,3\n", "line 2: '1_0' is not a number", ""),
        ("1,2\n3,4\n", "line 1: '1,2' is not three numbers", "x, y and z"),
        ("(1, 2, 3)\n", "line 1: '(1, 2, 3)' is not three numbers", "x, y and z"),
        ("1.234,5;1;2\n", "is not three numbers", ""),
        ("a\nb\nc\nd\n1,2,3\n", "line 2: 'b' is not three numbers", ""),
        ('"1,2,3\n', "line 1", ""),
        ("", "'data.csv' holds no points", ""),
        ("x,y,z\n", "'data.csv' holds no points", ""),
        ("# x,y,z\n", "'data.csv' holds no points", ""),
        # no tables
        ("\0", "is a binary file, not a text of points", "CSV"),
        (b"PK\x03\x04\xff", "is a ZIP archive", "CSV"),
        ("\u00ff" * 9999, "line 1", ""),
        # hostile
        ("# time,lon,lat,alt\n0,1,2,3\n", "which of the columns 'time', 'lon'", "first line"),
        ("1,2,3\n4,5,-1.#IND\n", "line 2: the point 4, 5, nan is not finite", "gaps"),
        ("1,2,3\n4,5,1.#QNAN\n", "line 2: the point 4, 5, nan is not finite", "gaps"),
        ("1,2,3\n<NA>,1.#INF,-nan(ind)\n", "the point nan, inf, nan is not finite", "gaps"),
        ("t,x,y,z\n0,,,\n1,1,2,3\n", "line 2: the point nan, nan, nan is not finite", "gaps"),
        ("1,2,3\n" + "1," * 8_000_000, "line 2: 16000000 characters are more than 65536", ""),
        ("1" * 10**6 + ",2,3\n", "line 1: 1000004 characters are more than 65536", ""),
        ("1,2,3\n" + "9" * 60000 + ",2,3\n", "line 2: the point inf, 2, 3 is not finite", ""),
        ("1," * 30000 + "1\nx\n", "line 2: 'x' has 1 columns", ""),
        ('"' * 60000, "line 1", ""),
        ("1,2,3\n" + "\n" * 1_000_000 + "1,2,3\n1,2,3\n", "line 1000001: an empty line", ""),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str | bytes, message: str, hint: str) -> None:
    error = refused(tmp_path, text)
    assert message in str(error)
    assert hint in (error.hint or "")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("1,2,3\n4,5,6\nnan,nan,nan\n7,8,9\n1,1,1\n", 3),
        ("x,y,z\n1,2,3\n4,5,6\n,,\n7,8,9\n1,1,1\n", 4),
        ("# comment\n1,2,3\n# comment\n4,5,6\n\n7,8,9\n1,1,1\n", 5),
        ("1 2 3\n4 5 6\nNaN 1 2\n7 8 9\n1 1 1\n", 3),
        ("1;2;3\n4;5;6\n;;\n\n7;8;9\n1;1;1\n", 3),
        ("1,2,3\n4,5,6\n1,2,inf\n7,8,9\n1,1,1\n", 3),
        ("t,x,y,z\n" + "0,,,\n" * 9 + "1,1,2,3\n2,4,5,6\n3,,,\n4,7,8,9\n5,1,1,1\n", 2),
        ("1\t2\t3\n4\t5\t6\nNA\tNA\tNA\n7\t8\t9\n1\t1\t1\n\nnan\tnan\tnan\n", 3),
    ],
)
def test_strands(tmp_path: Path, text: str, line: int) -> None:
    error = refused(tmp_path, text)
    assert f"'data.csv', line {line}: " in str(error)
    assert '"gaps": "split"' in (error.hint or "")
    scene = scene_of(tmp_path, text, gaps="split")
    assert strands(scene) == [[[1, 2, 3], [4, 5, 6]], [[7, 8, 9], [1, 1, 1]]]


def test_a_long_comment_is_no_row(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, f"# {'x' * 100_000}\n# z,y,x\n3,2,1\n6.5,5,4\n")
    assert strands(scene) == [POINTS]


def test_lines_that_all_end_twice_are_no_strands(tmp_path: Path) -> None:
    text = "1,2,3\r\r\n4,5,6\r\r\n7,8,9\r\r\n"
    assert strands(scene_of(tmp_path, text)) == [[[1, 2, 3], [4, 5, 6], [7, 8, 9]]]


def test_gaps_belong_to_files(tmp_path: Path) -> None:
    for keys, message in (
        ({"points": [[1, 2, 3]], "gaps": "split"}, "the key 'gaps' belongs to the key 'file'"),
        ({"file": "a.csv", "gaps": "join"}, "expected \"split\", found the text 'join'"),
    ):
        with pytest.raises(SceneError) as caught:
            read_scene(json.dumps({"type": "points"} | keys), folder=tmp_path)
        assert message in str(caught.value)


@pytest.mark.parametrize(
    ("names", "axes"),
    [
        (["x", "y", "z"], [[0], [1], [2]]),
        (["Z", " Y", "X "], [[2], [1], [0]]),
        (["x", "y_mm", "z (in)"], [[0], [1], [2]]),
        (["x", "x [mm]", "y", "z"], [[0], [2], [3]]),
        (["px", "py", "pz"], [[0], [1], [2]]),
        (["coordinates.x", "coordinates.y", "coordinates.z"], [[0], [1], [2]]),
        (["coord[0]", "coords[0]", "coords[1]", "coords[2]"], [[1], [2], [3]]),
        (["tx", "ty", "tz", "qx"], [[0], [1], [2]]),
        (["vx", "vy", "vz"], [[], [], []]),
        (["velocity x", "normal:0", "xy", "axyz", "max"], [[], [], []]),
        (["index", "time", "zone"], [[], [], []]),
    ],
)
def test_names_of_axes(names: list[str], axes: list[list[int]]) -> None:
    assert axis_columns(names) == axes


@pytest.mark.parametrize(
    "data", [b"\x1f\x8b\x08 1,2,3\n", b"1,2,3\n\x1b[2J,5,6\n", b"\x89PNG\r\n\x1a\n"]
)
def test_bytes_that_no_text_has_are_told_from_rows(tmp_path: Path, data: bytes) -> None:
    assert "not a text of points" in str(refused(tmp_path, data))
