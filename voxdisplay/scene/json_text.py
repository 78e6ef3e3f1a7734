"""JSON text with ``//`` comments: parser, syntax errors in plain words, positions of values.

Knows JSON, and more of it than `json`: no NaN, no key twice, no numbers without end. It must not
know which keys a scene has.
"""

from __future__ import annotations

import json
import re
from typing import Any, NoReturn

from voxdisplay.errors import SceneError
from voxdisplay.expressions.parse import excerpt

# An unfinished string ends with the text, so that no match is tried twice.
_STRING_OR_COMMENT = re.compile(r'"(?:[^"\\]|\\.)*+"?|//[^\n\r]*', re.DOTALL)
_STRING = r'"(?:[^"\\]|\\.)*+"'
_KEYS_AND_BRACES = re.compile(rf"(?P<key>{_STRING})\s*+:|{_STRING}|[{{}}]", re.DOTALL)
_CONSTANTS = re.compile(rf"{_STRING}|(?P<name>-?Infinity|NaN)", re.DOTALL)
_PATH_STEP = re.compile(r"\[([0-9]+)\]")
_SPACE = re.compile(r"[ \t\n\r]*")


class JsonText:
    """Text of a JSON file.

    Parameters
    ----------
    text : str
        JSON, perhaps with comments from ``//`` to the end of a line.
    file : str, optional
        The name that errors show.

    """

    def __init__(self, text: str, file: str | None = None) -> None:
        text = text.removeprefix("\ufeff")
        self.file = file
        # Blanks in place of comments leave every position as it is.
        self._text = _STRING_OR_COMMENT.sub(_blank_comment, text) if "//" in text else text

    def parse(self) -> Any:
        """Return the value of the text.

        Raises
        ------
        SceneError
            If the text is not JSON, has a key twice in one object, half of a surrogate pair, or
            is nested too deeply.

        """
        if not self._text.strip(" \t\r\n"):
            raise SceneError("the file is empty", path="", file=self.file)
        try:
            value = json.loads(
                self._text,
                object_pairs_hook=_object_without_repeats,
                parse_constant=_refuse_constant,
                parse_int=_integer,
            )
            if "\\u" in self._text or not self._text.isascii():
                json.dumps(value, ensure_ascii=False).encode()
        except json.JSONDecodeError as error:
            from voxdisplay.scene.json_syntax import explain_syntax_error  # noqa: PLC0415 - rare

            found = explain_syntax_error(self._text, error.pos)
            raise self._error_at(
                found.at, f"the file is not JSON: {found.problem}", found.hint
            ) from None
        except RecursionError:
            raise SceneError("the file is nested too deeply", path="", file=self.file) from None
        except UnicodeEncodeError:
            raise SceneError(
                "the file has half of a surrogate pair", path="", file=self.file
            ) from None
        except _RepeatedKeyError:
            at, key = self._first_repeated_key()
            raise self._error_at(at, f"the key {excerpt(key)} is twice in one object") from None
        except _ConstantError as error:
            raise self._error_at(
                self._first_constant(), f"{error} is not a number that JSON has"
            ) from None
        return value

    def add_location(self, error: SceneError, key: str | None = None) -> SceneError:
        """Return an error, with the file, line and column of its JSON path added to it.

        Parameters
        ----------
        error : SceneError
            Changed in place.
        key : str, optional
            One of the keys of the object at the path, to be pointed at in place of the object.

        """
        error.file = self.file
        if error.path and not error.line:
            at = self._find(error.path)
            if at is not None and key is not None:
                at = self._member(at, f".{key}")[0] or at
            if at is not None:
                error.line, error.column = self._line_and_column(at)
        return error

    def _error_at(self, at: int, message: str, hint: str | None = None) -> SceneError:
        line, column = self._line_and_column(at)
        return SceneError(message, path="", hint=hint, file=self.file, line=line, column=column)

    def _line_and_column(self, at: int) -> tuple[int, int]:
        return self._text.count("\n", 0, at) + 1, at - self._text.rfind("\n", 0, at)

    def _find(self, path: str) -> int | None:
        """Return where the value of a path begins, or the nearest value around it that is there."""
        at, rest = self._skip(0), path.removeprefix("$")
        try:
            while rest:
                if step := _PATH_STEP.match(rest):
                    found, rest = self._element(at, int(step[1])), rest[step.end() :]
                else:
                    _, found, rest = self._member(at, rest)
                if found is None:
                    return at
                at = found
        except (ValueError, RecursionError):
            return None
        return at

    def _element(self, at: int, index: int) -> int | None:
        if self._text[at] != "[":
            return None
        at = self._skip(at + 1)
        for _ in range(index):
            if self._text[at] == "]":
                return None
            at = self._skip(_DECODER.raw_decode(self._text, at)[1])
            at = self._skip(at + (self._text[at] == ","))
        return None if self._text[at] == "]" else at

    def _member(self, at: int, rest: str) -> tuple[int | None, int | None, str]:
        """Return where a path's next key and its value begin, and the path's rest."""
        if self._text[at] != "{":
            return None, None, ""
        at = self._skip(at + 1)
        while self._text[at] != "}":
            key_at = at
            key, at = _DECODER.raw_decode(self._text, at)
            at = self._skip(self._skip(at) + 1)
            after = rest[len(key) + 1 :]
            if rest.startswith(f".{key}") and (not after or after[0] in ".["):
                return key_at, at, after
            at = self._skip(_DECODER.raw_decode(self._text, at)[1])
            at = self._skip(at + (self._text[at] == ","))
        return None, None, ""

    def _skip(self, at: int) -> int:
        found = _SPACE.match(self._text, at)
        assert found is not None  # noqa: S101 - it matches nothing, too
        return found.end()

    def _first_repeated_key(self) -> tuple[int, str]:
        seen: list[set[str]] = []
        for match in _KEYS_AND_BRACES.finditer(self._text):
            if match["key"]:
                key = match["key"][1:-1]
                if "\\" in key:
                    key = json.loads(match["key"])
                if key in seen[-1]:
                    return match.start(), key
                seen[-1].add(key)
            elif match[0] == "{":
                seen.append(set())
            elif match[0] == "}":
                seen.pop()
        raise AssertionError("no key is twice in the text")

    def _first_constant(self) -> int:
        return next(m.start() for m in _CONSTANTS.finditer(self._text) if m["name"])


class _RepeatedKeyError(Exception):
    """An object has a key twice."""


class _ConstantError(Exception):
    """A number is NaN or infinite, which `json` would take."""


def _blank_comment(match: re.Match[str]) -> str:
    return match[0] if match[0][0] == '"' else " " * len(match[0])


def _object_without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        raise _RepeatedKeyError
    return content


def _refuse_constant(name: str) -> NoReturn:
    raise _ConstantError(name)


def _integer(digits: str) -> int | float:
    # Longer than 20 digits is not a number of anything here, and int() may take its time.
    return int(digits) if len(digits) < 20 else float(digits)


_DECODER = json.JSONDecoder(parse_int=_integer)
