"""JSON Schema of scene files, generated from the Structs of `objects`.

It is published as ``voxdisplay/scene.schema.json``, for editors; reading a scene does not use it.
``python -m voxdisplay.scene.schema > voxdisplay/scene.schema.json`` renews it.

msgspec can generate a schema too, but its text depends on its version. Here each part is made
from the annotations alone, so that every version of every dependency gives the same file.
"""

from __future__ import annotations

import inspect
import json
import sys
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import msgspec

from voxdisplay.scene.objects import TYPES, Color, Formula, Number, Object, SceneFile, Vector

# Parts that recur, and are written once.
_SHARED = {"Number": Number, "Vector": Vector, "Formula": Formula, "Color": Color}
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


def schema() -> dict[str, Any]:
    """Return the JSON Schema: of a scene if there is a key ``objects``, else of one object."""
    structs = {"SceneFile": SceneFile} | {kind.__name__: kind for kind in TYPES.values()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "voxdisplay scene",
        "type": "object",
        # Not anyOf, which would answer a mistake with the complaints of every type.
        "if": {"required": ["objects"]},
        "then": _reference("SceneFile"),
        "else": _part(Object),
        "$defs": {name: _part(kind, named=False) for name, kind in _SHARED.items()}
        | {name: _struct(kind) for name, kind in structs.items()},
    }


def _reference(name: str) -> dict[str, Any]:
    return {"$ref": f"#/$defs/{name}"}


def _struct(kind: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the schema of the objects that a Struct is made of."""
    hints = get_type_hints(kind, include_extras=True)
    fields = msgspec.structs.fields(kind)
    tag = kind.__struct_config__.tag
    properties = {"type": {"enum": [tag]}} if tag else {}
    required = ["type"] if tag else []
    for field in fields:
        part = _part(hints[field.name])
        if field.required:
            required.append(field.encode_name)
        else:
            made = field.default is msgspec.NODEFAULT
            part["default"] = field.default_factory() if made else field.default
        properties[field.encode_name] = part
    return {
        "title": kind.__name__,
        "description": inspect.cleandoc(kind.__doc__ or ""),
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _part(kind: Any, *, named: bool = True) -> dict[str, Any]:
    """Return the schema of the values that an annotation allows."""
    if named:
        for name, shared in _SHARED.items():
            if kind == shared:
                return _reference(name)
    if kind in _SCALARS:
        return dict(_SCALARS[kind])
    arguments = get_args(kind)
    origin = get_origin(kind)
    if origin is None:
        return _reference(kind.__name__)
    if origin is Annotated:
        return _limited(_part(arguments[0]), kind.__metadata__)
    if origin in {Union, UnionType}:
        return _union(arguments)
    return _container(origin, arguments)


def _container(origin: Any, arguments: tuple[Any, ...]) -> dict[str, Any]:
    if origin is list:
        return {"type": "array", "items": _part(arguments[0])}
    if origin is tuple:
        return {
            "type": "array",
            "minItems": len(arguments),
            "maxItems": len(arguments),
            "prefixItems": [_part(each) for each in arguments],
            "items": False,
        }
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin is dict:
        return {"type": "object", "additionalProperties": _part(arguments[1])}
    raise TypeError(f"no schema for {origin}")


def _union(kinds: tuple[Any, ...]) -> dict[str, Any]:
    parts: dict[str, Any] = {"anyOf": [_part(kind) for kind in kinds]}
    if set(kinds) <= set(TYPES.values()):
        mapping = {tag: _reference(kind.__name__)["$ref"] for tag, kind in TYPES.items()}
        parts["discriminator"] = {"propertyName": "type", "mapping": mapping}
    return parts


def _limited(part: dict[str, Any], metadata: tuple[msgspec.Meta, ...]) -> dict[str, Any]:
    """Add the limits and the text of annotations."""
    for meta in metadata:
        if meta.description:
            part["description"] = meta.description
        for limit, keywords in _LIMITS.items():
            value = getattr(meta, limit)
            if value is not None:
                part[keywords.get("*") or keywords[part["type"]]] = value
    return part


def text() -> str:
    """Return the text of the published schema."""
    return json.dumps(schema(), indent=1) + "\n"


if __name__ == "__main__":
    sys.stdout.write(text())
