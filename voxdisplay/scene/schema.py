"""JSON Schema of scene files, generated from the annotations of `objects`.

It is published as ``voxdisplay/scene.schema.json``, for editors; reading a scene does not use it.
``python -m voxdisplay.scene.schema > voxdisplay/scene.schema.json`` renews it.

msgspec can generate a schema too, but its text depends on its version. Here each part is made
from the annotations alone, so that every version of every dependency gives the same file.

A mistake must be answered by what is wrong, not by "not valid under any of the given schemas": no
part has anyOf or oneOf. Object types are told apart by if and then, and values of several JSON
types have a list of types. No text stands beside $ref, where editors overlook it.
"""

from __future__ import annotations

import inspect
import json
import sys
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec

from voxdisplay.scene.objects import TYPES, SceneFile, View
from voxdisplay.scene.type_mismatch import field_types
from voxdisplay.scene.values import (
    Color,
    ColorMap,
    Formula,
    Number,
    OneColor,
    Param,
    Side,
    Track,
    Transform,
    TransformStep,
    Vector,
)

ID = "urn:voxdisplay:scene"

# Parts that recur, and are written once.
_SHARED = {
    "Number": Number,
    "Vector": Vector,
    "Formula": Formula,
    "Side": Side,
    "OneColor": OneColor,
    "Color": Color,
    "Param": Param,
    "Transform": Transform,
}
_TITLES: dict[type, str] = {
    SceneFile: "Scene",
    View: "View",
    ColorMap: "Colour map",
    Track: "Track",
    TransformStep: "Step of a transform",
}
_SCALARS = {
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: {"type": "number"},
    str: {"type": "string"},
    NoneType: {"type": "null"},
}
_LIMITS = {
    "ge": {"*": "minimum"},
    "le": {"*": "maximum"},
    "multiple_of": {"*": "multipleOf"},
    "min_length": {"string": "minLength", "array": "minItems", "object": "minProperties"},
    "max_length": {"string": "maxLength", "array": "maxItems", "object": "maxProperties"},
}
_TYPE_KEY = {
    "title": "Type",
    "description": "The type of the object, which says what other keys it has.",
    "type": "string",
}
_SCHEMA_KEY = field_types(SceneFile)["$schema"]


def schema() -> dict[str, Any]:
    """Return the JSON Schema: of one object if there is a key ``type``, else of a scene."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": ID,
        "title": "voxdisplay scene",
        "description": "A scene of curves and bodies for a volumetric display, or one object.",
        "type": "object",
        # Offered by editors where a file has neither key yet.
        "properties": {"type": _TYPE_KEY | {"enum": list(TYPES)}},
        "if": {"required": ["type"]},
        "then": _reference("Object"),
        "else": _reference("Scene"),
        "$defs": {
            "Scene": _struct(SceneFile),
            "Object": _object(),
            **{name: _part(kind, refer=False) for name, kind in _SHARED.items()},
            **{kind.__name__: _struct(kind) for kind in TYPES.values()},
        },
    }


def _reference(name: str) -> dict[str, Any]:
    return {"$ref": f"#/$defs/{name}"}


def _object() -> dict[str, Any]:
    """Return the schema of an object of any type, with a branch for each type."""
    return {
        "title": "Object",
        "description": "One object of a scene.",
        "type": "object",
        "properties": {"type": _TYPE_KEY | {"enum": list(TYPES)}},
        "required": ["type"],
        "allOf": [
            {
                "if": {"properties": {"type": {"const": tag}}, "required": ["type"]},
                "then": _reference(kind.__name__),
            }
            for tag, kind in TYPES.items()
        ],
    }


def _struct(kind: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the schema of the objects that a Struct is made of."""
    kinds = field_types(kind)
    tag = kind.__struct_config__.tag
    title = _TITLES.get(kind) or str(tag).replace("_", " ").capitalize()
    properties: dict[str, Any] = {"type": _TYPE_KEY | {"const": tag}} if tag else {}
    required = ["type"] if tag else []
    for field in msgspec.structs.fields(kind):
        part = _part(kinds[field.encode_name])
        if field.required:
            required.append(field.encode_name)
        else:
            made = field.default is msgspec.NODEFAULT
            default = field.default_factory() if made else field.default
            if default:  # an editor would insert null, {} or ""
                part["default"] = default
        properties[field.encode_name] = part
    if tag:  # a file of one object may have the key, too
        properties["$schema"] = _part(_SCHEMA_KEY)
    return {
        "title": title,
        "description": inspect.cleandoc(kind.__doc__ or ""),
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _part(kind: Any, *, refer: bool = True) -> dict[str, Any]:
    """Return the schema of the values that an annotation allows."""
    if get_origin(kind) is Annotated:
        name = next((name for name, shared in _SHARED.items() if kind == shared), None)
        if name and refer:
            return _reference(name)
        return _described(_part(get_args(kind)[0]), kind.__metadata__)
    if kind in _SCALARS:
        return dict(_SCALARS[kind])
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        return _struct(kind)
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in {Union, UnionType}:
        return _union(arguments)
    if origin is list:
        return {"type": "array", "items": _part(arguments[0])}
    if origin is tuple and len(set(arguments)) == 1:
        count = len(arguments)
        return {"type": "array", "items": _part(arguments[0])} | dict.fromkeys(
            ("minItems", "maxItems"), count
        )
    if origin is dict:
        return {"type": "object", "additionalProperties": _part(arguments[1])}
    if origin is Literal:
        return {"type": "string", "enum": list(arguments)}
    raise TypeError(f"no schema for {kind}")


def _union(kinds: tuple[Any, ...]) -> dict[str, Any]:
    """Return one schema of several JSON types, whose other keywords do not clash."""
    if set(kinds) <= set(TYPES.values()):
        # Only the object that is the file may have the key $schema.
        return {"allOf": [_reference("Object"), {"properties": {"$schema": False}}]}
    merged: dict[str, Any] = {"type": []}
    for kind in kinds:
        part = _part(kind, refer=False)
        types = part.pop("type")
        merged["type"] += types if isinstance(types, list) else [types]
        if "enum" in merged and part == {}:
            merged["enum"] = [*merged["enum"], None]
        if merged.keys() & (part.keys() - {"title", "description"}):
            raise TypeError(f"{kinds} have limits that clash")
        merged |= part
    return merged


def _described(part: dict[str, Any], metadata: tuple[msgspec.Meta, ...]) -> dict[str, Any]:
    """Add the titles, descriptions and limits of annotations; the last title counts."""
    text: dict[str, Any] = {}
    for meta in metadata:
        text |= {"title": meta.title} if meta.title else {}
        text |= {"description": meta.description} if meta.description else {}
        for limit, keywords in _LIMITS.items():
            value = getattr(meta, limit)
            if value is not None:
                part[keywords.get("*") or keywords[part["type"]]] = value
    part = {key: value for key, value in part.items() if key not in text}
    return text | part


def text() -> str:
    """Return the text of the published schema."""
    return json.dumps(schema(), indent=1) + "\n"


if __name__ == "__main__":
    sys.stdout.write(text())
