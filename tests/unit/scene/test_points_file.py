"""Files of points beside a scene: access to them, arrays, and hostile ones."""

from __future__ import annotations

import io
import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from voxdisplay.errors import SceneError
from voxdisplay.scene import load_scene, points_file, read_scene

POINTS = [[1, 2, 3], [4, 2, 1], [4, 6, 1], [0, 6, 5]]

posix = pytest.mark.skipif(sys.platform == "win32", reason="makes links and pipes")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "inside").mkdir()
    return tmp_path / "inside"


def points(folder: Path, name: str) -> list[list[float]]:
    """Read a scene that names a file of points."""
    (item,) = read_scene(json.dumps({"type": "points", "file": name}), folder=folder).items
    t = np.arange(item.curve.t_range[1] + 1)
    return item.curve.position(t).T.tolist()


def refused(folder: Path, name: str) -> str:
    """Read a scene that names a file that must be refused, in few words."""
    with pytest.raises(SceneError) as caught:
        points(folder, name)
    message = f"{caught.value} ({caught.value.hint})"
    assert caught.value.path in {"$.file", "$.points"}
    assert len(message.encode()) < 400
    return message


@pytest.mark.parametrize("header", ["", "x,y,z\n", '"X", "Y", "Z"\r\n', "\ufeffx,y,z\n"])
def test_csv(folder: Path, header: str) -> None:
    text = f"{header}1,2,3\n\n 4.5 , 5e0 ,-6\r\n"
    (folder / "data.csv").write_bytes(text.encode())
    assert points(folder, "data.csv") == [[1, 2, 3], [4.5, 5, -6]]


@pytest.mark.parametrize("dtype", ["<f8", ">f4", "<i4", "|u1", "<f2", ">i8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_npy(folder: Path, dtype: str, order: Any) -> None:
    (folder / "sub").mkdir()
    np.save(folder / "sub" / "data.npy", np.array(POINTS, dtype=dtype, order=order))
    assert points(folder, "sub/data.npy") == POINTS


def test_npy_of_a_later_version(folder: Path) -> None:
    for version in ((2, 0), (3, 0)):
        with (folder / "data.npy").open("wb") as file:
            np.lib.format.write_array(file, np.array(POINTS), version=version)
        assert points(folder, "data.npy") == POINTS


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999, 3), }", "claims"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }", "claims"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }", r"shape (3,)"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 3), }", "real numbers"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (1, 3), }", "Python objects"),
        ("{'descr': '<c8', 'fortran_order': False, 'shape': (1, 3), }", "real numbers"),
        ("{'descr': '|f1', 'fortran_order': False, 'shape': (1, 3), }", "of the kind |f1"),
        ("__import__('os').abort()", "real numbers"),
        ("(" * 60000, "real numbers"),
    ],
)
def test_wrong_npy(folder: Path, header: str, message: str) -> None:
    start = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little")
    (folder / "data.npy").write_bytes(start + header.encode() + bytes(24))
    assert message in refused(folder, "data.npy")


@pytest.mark.parametrize("data", [b"", b"\x93NUMPY", b"\x93NUMPY\x09\x00abcd", b"PK\x03\x04"])
def test_what_is_no_npy(folder: Path, data: bytes) -> None:
    (folder / "data.npy").write_bytes(data)
    assert "is not a .npy file" in refused(folder, "data.npy")


@pytest.mark.parametrize(
    ("shape", "hint"),
    [
        ((3, 5), "(save array.T)"),
        ((4, 4), "(save array[:, :3])"),
        ((4, 2), "(save numpy.insert(array, 2, 0, axis=1) for z = 0)"),
        ((4, 1, 3), "(save array.reshape(-1, 3))"),
        ((2, 3, 4), "(None)"),
        ((4, 1), "(None)"),
    ],
)
def test_arrays_of_another_shape(folder: Path, shape: tuple[int, ...], hint: str) -> None:
    np.save(folder / "data.npy", np.zeros(shape))
    message = refused(folder, "data.npy")
    assert f"has shape ({', '.join(map(str, shape))}), not (n, 3)" in message
    assert hint in message


def test_rows_that_are_not_finite(folder: Path) -> None:
    rows = np.array([*POINTS[:2], [1, math.nan, 2], POINTS[2], [math.inf] * 3, POINTS[3]])
    np.save(folder / "data.npy", rows)
    assert "row 2 of 'data.npy' is not finite" in refused(folder, "data.npy")
    scene = {"type": "points", "file": "data.npy", "gaps": "split"}
    strands = read_scene(json.dumps(scene), folder=folder).items
    assert [item.curve.t_range[1] for item in strands] == [1, 1, 1]
    assert [item.path for item in strands] == ["$", "$", "$"]


def test_strands_without_number(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(points_file, "MAX_STRANDS", 2)
    scene = json.dumps({"type": "points", "file": "data.csv", "gaps": "split"})
    (folder / "data.csv").write_text("1,2,3\n\n4,5,6\n")
    assert len(read_scene(scene, folder=folder).items) == 2
    (folder / "data.csv").write_text("1,2,3\n\n4,5,6\n\n7,8,9\n")
    with pytest.raises(SceneError, match="holds 3 strands, more than 2"):
        read_scene(scene, folder=folder)


def test_pickles_are_not_loaded(folder: Path) -> None:
    np.save(folder / "data.npy", np.array([[print, 1, 2]], dtype=object), allow_pickle=True)
    assert "Python objects" in refused(folder, "data.npy")


@pytest.mark.parametrize(
    "name",
    [
        "../data.csv",
        "sub/../../data.csv",
        "/etc/data.csv",
        "..\\data.csv",
        "C:\\data.csv",
        "C:data.csv",
        "\\\\host\\share\\data.csv",
    ],
)
def test_never_outside_the_folder(folder: Path, name: str) -> None:
    (folder.parent / "data.csv").write_text("1,2,3\n")
    assert "outside the folder" in refused(folder, name)


@posix
def test_links_are_followed_before_they_are_judged(folder: Path) -> None:
    (folder.parent / "data.csv").write_text("1,2,3\n")
    (folder / "inner.csv").write_text("4,5,6\n")
    (folder / "out.csv").symlink_to(folder.parent / "data.csv")
    (folder / "in.csv").symlink_to("inner.csv")
    (folder / "dir").symlink_to(folder.parent)
    (folder / "loop.csv").symlink_to("loop.csv")
    assert "outside" in refused(folder, "out.csv")
    assert "outside" in refused(folder, "dir/data.csv")
    assert "cannot read" in refused(folder, "loop.csv")
    assert points(folder, "in.csv")[0] == [4, 5, 6]


@posix
def test_only_regular_files(folder: Path) -> None:
    (folder / "dir.csv").mkdir()
    os.mkfifo(folder / "pipe.csv")
    assert "data" not in refused(folder, "dir.csv")
    assert "not a regular file" in refused(folder, "pipe.csv")


def test_missing_and_unreadable_files(folder: Path) -> None:
    (folder / "data.csv").write_text("1,2,3\n")
    assert "dat.csv (did you mean 'data.csv'?)" in refused(folder, "dat.csv")
    for name in ("", ".csv", "a\0.csv", "x" * 5000 + ".csv", "data.txt"):
        refused(folder, name)


def test_rows_that_are_all_comments(folder: Path) -> None:
    (folder / "data.csv").write_text("color,x,y,z\n#ff0000,1,2,3\n#00ff00,2,3,4\n")
    assert "holds no points (lines that begin with # or %" in refused(folder, "data.csv")


def test_large_files(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(points_file, "MAX_BYTES", 1 << 20)
    with (folder / "data.csv").open("wb") as file:
        file.truncate(2 << 20)
    assert "larger than 1 MiB" in refused(folder, "data.csv")


def test_files_are_beside_the_scene(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "data.csv").write_text("1,2,3\n")
    text = json.dumps({"type": "points", "file": "data.csv"})
    (folder / "scene.json").write_text(text)
    assert load_scene(folder / "scene.json").items
    monkeypatch.chdir(folder)
    assert load_scene("scene.json").items
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    assert load_scene("-").items


@pytest.mark.parametrize("kind", ["points", "scatter"])
@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({}, "needs either the key 'points' or the key 'file'"),
        ({"points": POINTS, "file": "data.csv"}, "needs either the key 'points' or the key"),
        ({"points": POINTS, "gaps": "split"}, "the key 'gaps' belongs to the key 'file'"),
    ],
)
def test_points_are_inline_or_in_a_file(
    kind: str, keys: dict[str, Any], message: str, folder: Path
) -> None:
    with pytest.raises(SceneError, match=message) as caught:
        read_scene(json.dumps({"type": kind, **keys}), folder=folder)
    assert caught.value.path == "$"
