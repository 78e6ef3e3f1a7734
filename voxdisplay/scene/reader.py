"""Scene files: bytes -> Scene, or a SceneError that says where and what.

The file is not trusted. Knows JSON and how to say what is wrong with it; what the keys mean is
known to `objects`.
"""

from __future__ import annotations

import json
import os
import re
import sys
from collections import Counter
from pathlib import Path
from typing import Any, NoReturn

import msgspec

from voxdisplay.errors import SceneError, did_you_mean
from voxdisplay.expressions.params import param_order
from voxdisplay.expressions.parse import MAX_LENGTH, constant, excerpt
from voxdisplay.raster.color import parse_color, parse_colors
from voxdisplay.raster.grid import Grid
from voxdisplay.scene.evaluation_context import EvaluationContext, as_scene_error
from voxdisplay.scene.model import Scene, SceneItem
from voxdisplay.scene.objects import TYPES, Object, SceneFile, SceneObject

MAX_BYTES = 16 << 20
"""Largest scene file. Long lists of points fit better in a file of their own."""
MAX_VOXELS = 1 << 31


def load_scene(path: str | Path) -> Scene:
    """Read a scene file.

    Parameters
    ----------
    path : str or Path
        ``"-"`` is standard input; files of points are then looked for in the current directory.

    Raises
    ------
    SceneError
        If the file cannot be read, or as `read_scene`.

    """
    if str(path) == "-":
        return read_scene(sys.stdin.buffer.read(MAX_BYTES + 1), folder=Path())
    path = Path(path)
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        missing = f"no such file: {excerpt(str(path))}"
        raise SceneError(missing, path="", hint=_similar(path)) from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        what = error.strerror if isinstance(error, OSError) else error
        raise SceneError(f"cannot read {excerpt(str(path))}: {what}", path="") from error
    return read_scene(data, folder=path.parent)


def _similar(path: Path) -> str | None:
    try:
        with os.scandir(path.parent) as entries:
            names = [entry.name for entry, _ in zip(entries, range(1000), strict=False)]
    except OSError:
        return f"there is no folder {excerpt(str(path.parent))}"
    return did_you_mean(path.name, names)


def read_scene(data: bytes | str, *, folder: Path | None = None) -> Scene:
    """Read a scene from the text of a scene file.

    Parameters
    ----------
    data : bytes or str
        JSON; bytes are UTF-8. Either a scene, or one object, which is a scene of that object.
    folder : Path, optional
        Where the files are that the scene names. Without it, it may name none.

    Raises
    ------
    SceneError
        If anything is wrong with it; ``.path`` says where.

    """
    raw = _parse(data)
    alone = isinstance(raw, dict) and "type" in raw and "objects" not in raw
    if alone:
        scene_object: SceneObject = _convert(raw, Object)
        return Scene(None, (_item(scene_object, EvaluationContext("$", {}, folder)),))
    file: SceneFile = _convert(raw, SceneFile)
    size = Grid(*file.size) if file.size else None
    if size and size.voxels > MAX_VOXELS:
        raise SceneError(f"{size} is more than {MAX_VOXELS} voxels", path="$.size")
    names = _params(file.params)
    return Scene(
        size,
        tuple(
            _item(scene_object, EvaluationContext(f"$.objects[{i}]", names, folder))
            for i, scene_object in enumerate(file.objects)
        ),
    )


def _params(params: dict[str, str | float]) -> dict[str, float]:
    values: dict[str, float] = {}
    with as_scene_error("$.params"):
        order = param_order(params)
    for name in order:
        with as_scene_error(f"$.params.{name}"):
            values[name] = constant(params[name], values)
    return values


def _item(scene_object: SceneObject, context: EvaluationContext) -> SceneItem:
    with as_scene_error(context.path):
        curve = scene_object.curve(context)
    names = [scene_object.color] if isinstance(scene_object.color, str) else scene_object.color
    for i, name in enumerate(names):
        try:
            parse_color(name)
        except ValueError as error:
            index = "" if isinstance(scene_object.color, str) else f"[{i}]"
            raise SceneError(str(error), path=f"{context.path}.color{index}") from None
    return SceneItem(
        str(scene_object.__struct_config__.tag),
        curve,
        parse_colors(scene_object.color),
        context.path,
    )


def _parse(data: bytes | str) -> Any:
    """Parse JSON, more strictly than json does: no NaN, no key twice, no numbers without end."""
    if len(data) > MAX_BYTES:
        raise SceneError(
            f"the file is larger than {MAX_BYTES >> 20} MiB",
            hint="put long lists of points into a .npy file beside it",
        )
    try:
        text = data if isinstance(data, str) else data.decode("utf-8-sig")
        if not text.strip():
            raise SceneError("the file is empty")
        return json.loads(
            text, object_pairs_hook=_unique, parse_constant=_no_constant, parse_int=_integer
        )
    except UnicodeDecodeError as error:
        raise SceneError(f"the file is not UTF-8 text: byte {error.start}") from error
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise SceneError(f"the file is not JSON: {error.msg}: {where}") from error
    except RecursionError:
        raise SceneError("the file is nested too deeply") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    for key, _ in pairs:
        # No key that means anything; and one that could not be quoted, or would be taken for a
        # part of the message that quotes it.
        if len(key) > 64 or "`" in key or not key.isprintable():
            raise SceneError(f"unknown key {excerpt(key)}")
    content = dict(pairs)
    if len(content) != len(pairs):
        twice, _ = Counter(key for key, _ in pairs).most_common(1)[0]
        raise SceneError(f"the key {excerpt(twice)} is twice in one object")
    return content


def _no_constant(name: str) -> NoReturn:
    raise SceneError(f"{name} is not a number that JSON has")


def _integer(digits: str) -> int | float:
    return int(digits) if len(digits) < 20 else float(digits)


def _convert(raw: Any, kind: Any) -> Any:
    """Make Structs of plain JSON values."""
    try:
        return msgspec.convert(raw, kind)
    except msgspec.ValidationError as error:
        raise _explained(str(error), raw) from None
    except UnicodeEncodeError:
        raise SceneError("the file has half of a surrogate pair") from None


_UNKNOWN_KEY = re.compile(r"Object contains unknown field `(.*)`", re.DOTALL)
_MISSING_KEY = re.compile(r"Object missing required field `(.*)`", re.DOTALL)
_UNKNOWN_TYPE = re.compile(r"Invalid value '(.*)'", re.DOTALL)


def _explained(message: str, raw: Any) -> SceneError:
    """Say a message of msgspec in the words of scene files, with the nearest known word."""
    what, at, path = message.rpartition(" - at `")
    what, path = (what, path.removesuffix("`")) if at else (message, "$")
    if found := _UNKNOWN_KEY.fullmatch(what):
        known = _keys_at(path, raw)
        hint = did_you_mean(found[1], known) or f"known: {', '.join(known)}"
        if found[1] in {"size", "params"}:
            hint = "size and params stand in a scene, beside objects"
        return SceneError(f"unknown key {excerpt(found[1])}", path=path, hint=hint)
    if found := _MISSING_KEY.fullmatch(what):
        return SceneError(f"the key {found[1]!r} is missing", path=path)
    if found := _UNKNOWN_TYPE.fullmatch(what):
        hint = did_you_mean(found[1], TYPES) or f"known: {', '.join(TYPES)}"
        return SceneError(f"unknown type {excerpt(found[1])}", path=path, hint=hint)
    if path == "$.params[...]":
        path = _path_of_wrong_param(raw["params"])
    what = what[:1].lower() + what[1:]
    return SceneError(what.replace("`float | str`", "a number or an expression"), path=path)


def _keys_at(path: str, raw: Any) -> list[str]:
    """Give the keys that the object at a path can have."""
    kind: type[msgspec.Struct] = SceneFile
    if index := re.fullmatch(r"\$\.objects\[([0-9]+)\]", path):
        kind = TYPES[raw["objects"][int(index[1])]["type"]]
    elif "objects" not in raw and "type" in raw:
        kind = TYPES[raw["type"]]
    return [field.encode_name for field in msgspec.structs.fields(kind)]


def _path_of_wrong_param(params: dict[str, Any]) -> str:
    return next(
        f"$.params.{name}"
        for name, value in params.items()
        if type(value) not in {str, int, float}
        or (isinstance(value, str) and len(value) > MAX_LENGTH)
    )
