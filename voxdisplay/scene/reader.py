"""Scene reader: bytes -> Scene, or a SceneError that names file, line, column and remedy.

The file is not trusted. What the keys mean is known to `objects`.
"""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from voxdisplay.argument_checks import wrong_kind
from voxdisplay.compute.garbage_collection import garbage_collection_paused
from voxdisplay.errors import SceneError, did_you_mean, similar_file
from voxdisplay.expressions.params import param_order
from voxdisplay.expressions.parse import constant, excerpt
from voxdisplay.raster.grid import Grid
from voxdisplay.scene.best_view import BestView, best_view
from voxdisplay.scene.builder import SceneBuilder
from voxdisplay.scene.environment import MovingEnvironment, StillEnvironment, ValueTable
from voxdisplay.scene.evaluation_context import EvaluationContext, as_scene_error
from voxdisplay.scene.foreign_files import recognise, unicode_encoding
from voxdisplay.scene.json_text import JsonText
from voxdisplay.scene.model import Scene
from voxdisplay.scene.objects import TYPES, Object, SceneFile, View
from voxdisplay.scene.scene_files import SceneFiles
from voxdisplay.scene.scene_object import SceneObject
from voxdisplay.scene.type_mismatch import MOST_COMPARED, describe_value, find_mismatch
from voxdisplay.scene.values import MAX_SIDE, Track

MAX_BYTES = 16 << 20
"""Largest scene file. Long lists of points fit better in a file of their own."""
MAX_VOXELS = 1 << 31

_MANY_OBJECTS = 'several objects are written as {"objects": [{...}, {...}]}'


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Read a scene file.

    Parameters
    ----------
    path : str or path
        ``"-"`` is standard input; files of points are then looked for in the current directory.

    Raises
    ------
    SceneError
        If the file cannot be read, or as `read_scene`.

    """
    if not isinstance(path, str | os.PathLike):
        raise wrong_kind("path", "a str or path", path)
    if str(path) == "-":
        return _read(sys.stdin.buffer.read(MAX_BYTES + 1), Path(), "standard input")
    path = Path(path)
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        missing = f"no such file: {excerpt(str(path))}"
        raise SceneError(missing, path="", hint=_similar_file_hint(path)) from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        what = error.strerror if isinstance(error, OSError) else error
        raise SceneError(f"cannot read {excerpt(str(path))}: {what}", path="") from error
    return _read(data, path.parent, _display_name(path))


def _display_name(path: Path) -> str:
    """Return a file's name as errors show it."""
    name = str(path)
    return name if name.isprintable() and len(name) < 200 else excerpt(name)


def _similar_file_hint(path: Path) -> str | None:
    try:
        with os.scandir(path.parent) as entries:
            names = [entry.name for entry, _ in zip(entries, range(1000), strict=False)]
    except OSError:
        return f"there is no folder {excerpt(str(path.parent))}"
    return similar_file(path.name, names)


def read_scene(data: bytes | str, *, folder: str | os.PathLike[str] | None = None) -> Scene:
    """Read a scene from the text of a scene file.

    Parameters
    ----------
    data : bytes or str
        JSON, perhaps with ``//`` comments; bytes are UTF-8. Either a scene, or one object, which
        is a scene of that object.
    folder : str or path, optional
        Where the files are that the scene names. Without it, it may name none.

    Raises
    ------
    SceneError
        If anything is wrong with it: ``.path``, ``.line`` and ``.column`` are where.

    """
    if isinstance(data, bytearray | memoryview):
        data = bytes(data)
    if not isinstance(data, str | bytes):
        raise wrong_kind("data", "the text of a scene, str or bytes", data)
    if folder is not None and not isinstance(folder, str | os.PathLike):
        raise wrong_kind("folder", "a path or None", folder)
    return _read(data, None if folder is None else Path(folder), None)


def _read(data: bytes | str, folder: Path | None, file: str | None) -> Scene:
    if len(data) > MAX_BYTES:
        raise SceneError(
            f"the file is larger than {MAX_BYTES >> 20} MiB",
            path="",
            file=file,
            hint="put long lists of points into a .npy file beside it",
        )
    source = JsonText(data if isinstance(data, str) else _decode(data, file), file)
    try:
        with garbage_collection_paused():
            return _scene(_parsed(source, data), folder, source)
    except SceneError as error:
        raise source.add_location(error) from error.__cause__


def _parsed(source: JsonText, data: bytes | str) -> Any:
    """Return the value of a text; raise SceneError that says what it is if it is no scene."""
    try:
        return source.parse()
    except SceneError as error:
        start = data[:4096].encode(errors="replace") if isinstance(data, str) else data
        if foreign := recognise(start):
            problem = f"this is {foreign.kind}, not a scene"
            raise SceneError(problem, path="", hint=foreign.hint, file=source.file) from error
        raise


def _decode(data: bytes, file: str | None) -> str:
    encoding = unicode_encoding(data)
    try:
        if not encoding:
            return data.decode("utf-8")
        problem, hint = f"the file is {encoding} text, and must be UTF-8", "save it as UTF-8"
    except UnicodeDecodeError as error:
        problem, hint = f"the file is not UTF-8 text: byte {error.start}", "save it as UTF-8"
        if foreign := recognise(data):
            problem, hint = f"this is {foreign.kind}, not a scene", foreign.hint
    raise SceneError(problem, path="", hint=hint, file=file)


def _scene(raw: Any, folder: Path | None, source: JsonText) -> Scene:
    if not isinstance(raw, dict):
        hint = _MANY_OBJECTS if isinstance(raw, list) else None
        raise SceneError(f"a scene is an object {{...}}, not {describe_value(raw)}", hint=hint)
    is_group = raw.get("type") == "group"
    if is_group or ("objects" not in raw and ("type" in raw or _has_key_like("type", raw))):
        if not isinstance(raw.pop("$schema", ""), str):
            raise SceneError("expected text in double quotes", path="$.$schema")
        scene_object: SceneObject = _convert(raw, _object_type(raw), source)
        environment = StillEnvironment({})
        files = SceneFiles(folder, None)
        built = SceneBuilder([scene_object], ["$"], environment, files, source).build()
        return Scene(files.size, built.items, built.notes, built.spans)
    file: SceneFile = _convert(raw, SceneFile, source)
    del raw  # of a large scene, it takes more memory than the rest
    paths = [f"$.objects[{i}]" for i in range(len(file.objects))]
    notes = () if file.objects else ("the scene has no objects: there is nothing to show",)
    if file.duration is not None:
        return _moving_scene(file, paths, folder, source, notes)
    for key, value, default in (("fps", file.fps, 30.0), ("loop", file.loop, False)):
        if value != default:
            hint = 'write "duration", in seconds, beside "objects"'
            raise SceneError("the scene has no duration", path=f"$.{key}", hint=hint)
    names = _params(file.params)
    size = _size(file.size, names) if file.size else None
    files = SceneFiles(folder, size)
    view = _view(file.view, names)
    built = SceneBuilder(file.objects, paths, StillEnvironment(names), files, source).build()
    return Scene(files.size, built.items, (*built.notes, *notes), built.spans, view)


def _moving_scene(
    file: SceneFile,
    paths: list[str],
    folder: Path | None,
    source: JsonText,
    notes: tuple[str, ...],
) -> Scene:
    # Most scenes are still, and are read sooner without these.
    from voxdisplay.scene.moving_scene import Film, MovingScene  # noqa: PLC0415
    from voxdisplay.scene.timeline import Timeline  # noqa: PLC0415

    assert file.duration is not None  # noqa: S101 - see the caller
    timeline = Timeline(file.duration, file.fps, loop=file.loop, params=file.params)
    size = _size(file.size, timeline.constants) if file.size else None
    view = _view(file.view, timeline.constants)
    table = ValueTable(timeline.variables, timeline.values_at)
    environment = MovingEnvironment(timeline.constants, table)
    duration = timeline.duration
    files = SceneFiles(folder, size)
    builder = SceneBuilder(file.objects, paths, environment, files, source, duration)
    film = Film(timeline, table, builder, source)
    scene = MovingScene.of_film(film, size, notes, view=view)
    return scene if files.size == size else replace(scene, size=files.size)


def _view(view: View | None, names: dict[str, float]) -> BestView | None:
    if view is None:
        return None
    return best_view(
        view, EvaluationContext("$.view", StillEnvironment(names), SceneFiles(None, None))
    )


def _has_key_like(key: str, raw: dict[str, Any]) -> bool:
    """Return whether a scene has a key that resembles one."""
    return any(did_you_mean(key, [written]) for written in islice(raw, MOST_COMPARED))


def _params(params: dict[str, str | float | Track]) -> dict[str, float]:
    values: dict[str, float] = {}
    plain: dict[str, str | float] = {}
    for name, source in params.items():
        if isinstance(source, Track):
            hint = 'a track is for scenes that have a "duration"'
            raise SceneError("the scene has no duration", path=f"$.params.{name}", hint=hint)
        plain[name] = source
    with as_scene_error("$.params"):
        order = param_order(plain)
    for name in order:
        with as_scene_error(f"$.params.{name}"):
            values[name] = constant(plain[name], values)
    return values


def _size(sides: tuple[str | float, ...], names: dict[str, float]) -> Grid:
    numbers = (
        EvaluationContext("$", StillEnvironment(names), SceneFiles(None, None))
        .numbers("size", sides)
        .tolist()
    )
    for i, number in enumerate(numbers):
        if not (number.is_integer() and 1 <= number <= MAX_SIDE):
            problem = f"must be a whole number from 1 to {MAX_SIDE}, not {number:g}"
            raise SceneError(problem, path=f"$.size[{i}]")
    grid = Grid(*map(int, numbers))
    if grid.voxels > MAX_VOXELS:
        raise SceneError(f"{grid} is more than {MAX_VOXELS} voxels", path="$.size")
    return grid


def _object_type(raw: dict[str, Any]) -> Any:
    """Return the type of an object, which is known sooner than the annotations of all types are."""
    tag = raw.get("type")
    return TYPES.get(tag, Object) if isinstance(tag, str) else Object


def _convert(raw: Any, kind: Any, source: JsonText) -> Any:
    """Make Structs of plain JSON values."""
    try:
        return msgspec.convert(raw, kind)
    except RecursionError:
        raise SceneError("the file is nested too deeply", path="") from None
    except msgspec.ValidationError:
        try:
            found = find_mismatch(raw, kind)
        except RecursionError:
            raise SceneError("the file is nested too deeply", path="") from None
        # The message of msgspec would depend on its version.
        if found is None:
            raise SceneError("a value is of the wrong kind") from None
    hint = _key_hint(raw, found.path) or found.hint
    raise source.add_location(SceneError(found.message, path=found.path, hint=hint), found.key)


def _key_hint(raw: dict[str, Any], path: str) -> str | None:
    """Return a hint that needs the meaning of a key."""
    if path == "$.size":
        side = raw["size"] if type(raw["size"]) is int else 64
        return f'write "size": [{side}, {side}, {side}]'
    single = "objects" not in raw
    meant = "type" in raw or _has_key_like("type", raw) or _has_key_like("objects", raw)
    if path == "$" and single and not meant:
        return 'a scene has the key "objects", a file of one object the key "type"'
    of_scenes = {"size", "params", "view"}
    if path == "$" and single and raw.get("type") in TYPES and raw.keys() & of_scenes:
        return "size, params and view belong to a scene, beside objects"
    return None
