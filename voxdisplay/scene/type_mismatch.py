"""Explanation of JSON values that do not fit the annotations of `objects`.

msgspec converts what fits, and refuses the rest in words that depend on its version: this module
finds the first mismatch again, and words it for people. It must not know single keys or types of
objects.
"""

from __future__ import annotations

from functools import cache
from itertools import islice
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

import msgspec

from voxdisplay.errors import did_you_mean
from voxdisplay.expressions.parse import excerpt

MOST_COMPARED = 100
"""Most keys that are compared with a known one in search of a slip of the pen."""


class Mismatch(NamedTuple):
    """Place where a value does not fit, as a JSON path, the reason, and the remedy.

    An unknown key is named beside the path of the object that has it.
    """

    path: str
    message: str
    hint: str | None = None
    key: str | None = None


_JSON_TYPES: dict[Any, tuple[type, ...]] = {
    bool: (bool,),
    int: (int,),
    float: (int, float),
    str: (str,),
    NoneType: (NoneType,),
    Literal: (str,),
    list: (list,),
    tuple: (list,),
    dict: (dict,),
}
_EXPECTED: dict[Any, str] = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "text in double quotes",
    NoneType: "null",
    list: "a list [...]",
    tuple: "a list [...]",
    dict: "an object {...}",
}


def find_mismatch(value: Any, kind: Any, path: str = "$") -> Mismatch | None:
    """Return the first place where a JSON value does not fit an annotation, or None.

    Parameters
    ----------
    value : object
        Of dict, list, str, int, float, bool and None.
    kind : annotation
        A Struct, a union of Structs with tags, or what their fields are made of.
    path : str
        The value's JSON path.

    """
    bare, metadata = _split_annotation(kind)
    if get_origin(bare) not in {Union, UnionType}:
        if _is_struct(bare):
            return _object_mismatch(value, [bare], path)
        if not _is_type_of(value, bare):
            return _unexpected(value, _expectation(kind), path)
        return _limit_mismatch(value, metadata, path) or _part_mismatch(value, kind, path)
    alternatives = get_args(bare)
    structs = [each for each in alternatives if _is_struct(each)]
    if structs and (isinstance(value, dict) or len(structs) == len(alternatives)):
        return _object_mismatch(value, structs, path)
    for each in alternatives:
        if _is_type_of(value, each):
            return find_mismatch(value, each, path)
    return _unexpected(value, _expectation(kind), path)


def keys_of(struct: type[msgspec.Struct]) -> list[str]:
    """Return the keys that an object of a file may have, as a Struct names them."""
    tag = [struct.__struct_config__.tag_field] if struct.__struct_config__.tag_field else []
    return [*tag, *(field.encode_name for field in msgspec.structs.fields(struct))]


@cache
def field_types(struct: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the annotations of a Struct's fields, by key."""
    hints = get_type_hints(struct, include_extras=True)
    return {field.encode_name: hints[field.name] for field in msgspec.structs.fields(struct)}


def _split_annotation(kind: Any) -> tuple[Any, tuple[msgspec.Meta, ...]]:
    """Return an annotation's type and its metadata."""
    if get_origin(kind) is Annotated:
        return get_args(kind)[0], kind.__metadata__
    return kind, ()


def _is_struct(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)


def _is_type_of(value: Any, kind: Any) -> bool:
    """Return whether a JSON value is of an annotation's type, whatever its limits and parts."""
    bare, _ = _split_annotation(kind)
    origin = get_origin(bare) or bare
    if origin in {Union, UnionType}:
        return any(_is_type_of(value, each) for each in get_args(bare))
    return type(value) in _JSON_TYPES.get(origin, ())


def _expectation(kind: Any) -> str:
    bare, metadata = _split_annotation(kind)
    for meta in metadata:
        if meta.extra and "expected" in meta.extra:
            return str(meta.extra["expected"])
    origin = get_origin(bare) or bare
    if origin in {Union, UnionType}:
        parts = [_expectation(each) for each in get_args(bare) if each is not NoneType]
        return " or ".join(dict.fromkeys(parts))
    if origin is Literal:
        return " or ".join(f'"{each}"' for each in get_args(bare))
    return _EXPECTED[origin]


def _unexpected(value: Any, expected: str, path: str) -> Mismatch:
    return Mismatch(path, f"expected {expected}, found {describe_value(value)}")


def describe_value(value: Any) -> str:
    """Return a short description of a JSON value, for errors."""
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case str():
            return f"the text {excerpt(value)}"
        case list():
            return f"a list of {len(value)}" if value else "an empty list"
        case dict():
            return "an object {...}"
    return f"the number {value:.6g}"


def _object_mismatch(value: Any, structs: list[type[msgspec.Struct]], path: str) -> Mismatch | None:
    if not isinstance(value, dict):
        return _unexpected(value, _EXPECTED[dict], path)
    tagged = {str(each.__struct_config__.tag): each for each in structs}
    struct, tag_field = structs[0], structs[0].__struct_config__.tag_field
    if tag_field:
        if tag_field not in value:
            for key in islice(value, MOST_COMPARED):
                if hint := did_you_mean(key, [tag_field]):
                    return Mismatch(path, f"unknown key {excerpt(key)}", hint, key)
            return Mismatch(path, f"the key {tag_field!r} is missing", _known(tagged))
        tag = value[tag_field]
        if not isinstance(tag, str):
            return _unexpected(tag, _EXPECTED[str], f"{path}.{tag_field}")
        if tag not in tagged:
            hint = did_you_mean(tag, tagged) or _known(tagged)
            return Mismatch(f"{path}.{tag_field}", f"unknown {tag_field} {excerpt(tag)}", hint)
        struct = tagged[tag]
    return _key_mismatch(value, struct, path)


def _known(words: Any) -> str:
    return f"known: {', '.join(words)}"


def _key_mismatch(
    value: dict[str, Any], struct: type[msgspec.Struct], path: str
) -> Mismatch | None:
    known = keys_of(struct)
    for key in value:
        if key not in known:
            hint = did_you_mean(key, known) or _known(known)
            return Mismatch(path, f"unknown key {excerpt(key)}", hint, key)
    kinds = field_types(struct)
    for key, part in value.items():
        if key in kinds and (found := find_mismatch(part, kinds[key], f"{path}.{key}")):
            return found
    for field in msgspec.structs.fields(struct):
        if field.required and field.encode_name not in value:
            return Mismatch(path, f"the key {field.encode_name!r} is missing")
    return None


def _limit_mismatch(value: Any, metadata: tuple[msgspec.Meta, ...], path: str) -> Mismatch | None:
    """Return how a value exceeds the limits of its size or length."""
    for meta in metadata:
        size, unit = value, ""
        low, high = meta.ge, meta.le
        if isinstance(value, str | list | dict):
            size, unit = len(value), " characters" if isinstance(value, str) else " entries"
            low, high = meta.min_length, meta.max_length
        if meta.multiple_of == 1 and value % 1 != 0:
            return Mismatch(path, f"{value:.6g} is not a whole number")
        if high is not None and size > high:
            return Mismatch(path, f"{size:.6g}{unit} is more than {high}")
        if low is not None and size < low:
            return Mismatch(path, f"{size:.6g}{unit} is less than {low}")
    return None


def _part_mismatch(value: Any, kind: Any, path: str) -> Mismatch | None:
    """Return the first mismatch inside a value whose own type fits."""
    bare, _ = _split_annotation(kind)
    arguments = get_args(bare)
    origin = get_origin(bare)
    if origin is Literal:
        return None if value in arguments else _unexpected(value, _expectation(kind), path)
    if origin is list:
        return _row_mismatch(value, arguments[0], path)
    if origin is tuple:
        if len(value) != len(arguments):
            return _unexpected(value, _expectation(kind), path)
        parts = [(value[i], arguments[i], f"{path}[{i}]") for i in range(len(value))]
    elif origin is dict:
        parts = [
            (part, arguments[1], f"{path}.{key}" if _is_showable(key) else path)
            for key, part in value.items()
        ]
    else:
        return None
    return next(filter(None, (find_mismatch(*part) for part in parts)), None)


def _is_showable(key: str) -> bool:
    return key.isprintable() and len(key) <= 64


def _row_mismatch(rows: list[Any], kind: Any, path: str) -> Mismatch | None:
    # Of a million rows, all but one fit. It is found by halves, each converted at once.
    first, end = 0, len(rows)
    while end - first > 1:
        middle = (first + end) // 2
        try:
            msgspec.convert(rows[first:middle], list[kind])
        except msgspec.ValidationError:
            end = middle
        else:
            first = middle
    return find_mismatch(rows[first], kind, f"{path}[{first}]") if rows else None
