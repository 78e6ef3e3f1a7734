"""Tables of the keys of scene objects: descriptions from the schema, defaults from the reader."""

from __future__ import annotations

import json
from typing import Any

import msgspec

from voxdisplay.scene.objects import TYPES
from voxdisplay.scene.schema import schema

_DEFINITIONS = schema()["$defs"]
_KEYS = {name: _DEFINITIONS[kind.__name__]["properties"] for name, kind in TYPES.items()}
_COMMON = [key for key in _KEYS["circle"] if all(key in keys for keys in _KEYS.values())]
# Keys that all curves have besides, and no body.
_OF_CURVES = ["closed", "thickness"]
_UNSEEN = {"type", "$schema"}


def types_of(kind: str) -> list[str]:
    """Return the names of the types that are a curve, a body or a group, in the schema's order."""
    kinds = {name: _kind_of(name) for name in TYPES}
    found = [name for name, of in kinds.items() if of == kind]
    if not found:
        raise SystemExit(f"no types of kind {kind}")
    return found


def own_keys(name: str) -> str:
    """Return what a type is, and the table of the keys that not every object has."""
    hidden = {*_COMMON, *_UNSEEN, *(_OF_CURVES if _kind_of(name) == "curve" else ())}
    keys = [key for key in _KEYS[name] if key not in hidden]
    return f"{_DEFINITIONS[TYPES[name].__name__]['description']}\n\n{_table(name, keys)}"


def common_keys() -> str:
    """Return the tables of the keys that all objects have, and all curves."""
    shared = [key for key in _COMMON if key not in _UNSEEN]
    return (
        f"Every object may have these keys.\n\n{_table('circle', shared)}\n\n"
        f"Every curve may have these, too.\n\n{_table('circle', _OF_CURVES)}"
    )


def _kind_of(name: str) -> str:
    if name == "group":
        return "group"
    return "curve" if set(_OF_CURVES) <= _KEYS[name].keys() else "body"


def _table(name: str, keys: list[str]) -> str:
    fields = {field.encode_name: field for field in msgspec.structs.fields(TYPES[name])}
    rows = [
        f"| `{key}` | {_description(_KEYS[name][key])} | {_default(fields[key])} |" for key in keys
    ]
    return "\n".join(["| key | what it is | default |", "| --- | --- | --- |", *rows])


def _description(part: dict[str, Any]) -> str:
    if "$ref" in part:
        part = _DEFINITIONS[part["$ref"].rpartition("/")[2]]
    text = " ".join(part["description"].split())
    return text.replace("|", "\\|").replace("*", "\\*").replace("<", "&lt;")


def _default(field: msgspec.structs.FieldInfo) -> str:
    if field.required:
        return "required"
    made = field.default is msgspec.NODEFAULT
    value = field.default_factory() if made else field.default
    return "none" if value is None or value in ([], (), {}) else f"`{json.dumps(value)}`"
