"""Diagnosis of JSON syntax errors: from the position where a parser stopped to plain words.

Knows JSON and the habits of those who write it by hand, who come from Python, JavaScript or YAML.
It does not parse: the text before the position is taken to be well-formed.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from voxdisplay.expressions.parse import excerpt

_BLANK = " \t\n\r"
# A list of plain numbers is skipped as one: long files consist of them. An unfinished string takes
# the rest of the text, so that nothing is tried twice.
_BRACKET = re.compile(
    r'(?P<string>"(?:[^"\\]|\\.)*+")|(?P<unfinished>"(?:[^"\\]|\\.)*+\\?)|\[[^][{}"]*+\]|[][{}]',
    re.DOTALL,
)
_KEY = re.compile(r"[\w$-]+(?=\s*:)")
_QUOTES = "'`\u2018\u2019\u201c\u201d"
_QUOTED_KEY = re.compile(rf"[{_QUOTES}]([^{_QUOTES}\n]{{1,64}})[{_QUOTES}]\s*:")
_UNQUOTED = re.compile(r"[^\s,\]}][^,\]}\n\r]{0,60}")
_NUMBER_BEFORE = re.compile(r"[-\w.]{1,40}\Z")
_CLOSING = {"{": "}", "[": "]"}
_OTHER_WORDS = {"True": "true", "False": "false", "None": "null", "undefined": "null"}


class SyntaxProblem(NamedTuple):
    """Mistake in a JSON text: its position, its name, and the remedy."""

    at: int
    problem: str
    hint: str | None = None


class _Context(NamedTuple):
    """Surroundings of the position where a parser stopped."""

    bracket: int | None  # the innermost one that is open
    before: int | None  # the last character that is not blank
    string: int | None  # the string that ends there
    unfinished: int | None  # the string that the position is inside of


def explain_syntax_error(text: str, at: int) -> SyntaxProblem:
    """Return what is wrong where a parser of JSON stopped.

    Parameters
    ----------
    text : str
        Not JSON; its comments are blanked.
    at : int
        Where the parser stopped: at the first character that cannot be there, at the beginning
        of a string without an end, or at a comma that nothing follows.

    """
    context = _context_of(text, at)
    if context.unfinished is not None:
        return _explain_in_string(text, at, context.unfinished)
    at = _skip_blanks(text, at)
    if at == len(text):
        return _explain_truncation(text, at, context.bracket)
    if text[at] == ",":  # parsers differ in whether they stop at a comma or behind it
        behind = _skip_blanks(text, at + 1)
        if text[behind : behind + 1] in ("]", "}"):
            return _trailing_comma(at, text[behind])
    before = "" if context.before is None else text[context.before]
    if before == "," and text[at] in "]}" and context.before is not None:
        return _trailing_comma(context.before, text[at])
    in_object = context.bracket is not None and text[context.bracket] == "{"
    if before == "" and text[at] not in "#/":
        return _explain_beginning(text, at)
    if before == "" or before in "[:" or (before == "," and not in_object):
        return _explain_value(text, at)
    if before in "{,":
        return _explain_key(text, at)
    if context.bracket is None:
        return _explain_trailing_text(text, at)
    return _explain_delimiter(text, at, context)


def _skip_blanks(text: str, at: int) -> int:
    """Return the position of the next character that is not blank."""
    return len(text) - len(text[at:].lstrip(_BLANK))


def _context_of(text: str, at: int) -> _Context:
    opened: list[int] = []
    match = None
    for match in _BRACKET.finditer(text, 0, at):
        if match[0] in _CLOSING:
            opened.append(match.start())
        elif match[0] in {"}", "]"} and opened:
            opened.pop()
    before = len(text[:at].rstrip(_BLANK)) - 1
    string = unfinished = None
    if match and match["unfinished"]:
        unfinished = match.start()
    elif match and match["string"] and match.end() == before + 1:
        string = match.start()
    return _Context(
        opened[-1] if opened else None, before if before >= 0 else None, string, unfinished
    )


def _position(text: str, at: int) -> str:
    line = text.count("\n", 0, at) + 1
    return f"line {line}, column {at - text.rfind(chr(10), 0, at)}"


def _explain_in_string(text: str, at: int, begin: int) -> SyntaxProblem:
    if text[at] in "\n\r":
        return _open_quote(begin)
    if text[at] == "\t":
        return SyntaxProblem(at, "a tab inside quotes", r"write \t, or a blank")
    # A parser may stop at the backslash, or at what makes it no escape.
    escape = text.rfind("\\", max(begin, at - 6), at + 1)
    if escape >= 0:
        return SyntaxProblem(
            escape,
            f"{excerpt(text[escape : escape + 2])[1:-1]} inside quotes has no meaning",
            r"a backslash itself is written \\; folders are parted by /",
        )
    return _explain_character(text, at)


def _open_quote(begin: int) -> SyntaxProblem:
    return SyntaxProblem(begin, "this quote is not closed on its line", 'add the closing "')


def _explain_truncation(text: str, at: int, bracket: int | None) -> SyntaxProblem:
    if bracket is None:
        return SyntaxProblem(at, "the file ends before its value is complete")
    missing = _CLOSING[text[bracket]]
    opened = f"the {text[bracket]} of {_position(text, bracket)} is not closed"
    hint = f"add the missing {missing}; or was the file cut off?"
    return SyntaxProblem(at, f"it ends too early: {opened}", hint)


def _trailing_comma(at: int, closing: str) -> SyntaxProblem:
    return SyntaxProblem(at, f"a trailing comma before the closing {closing}", "remove the comma")


def _explain_beginning(text: str, at: int) -> SyntaxProblem:
    found = _UNQUOTED.match(text, at)
    begin = excerpt(found[0].rstrip() if found else text[at])
    return SyntaxProblem(
        at, f"it begins with {begin} in place of {{", 'a scene is written as {"objects": [...]}'
    )


def _explain_trailing_text(text: str, at: int) -> SyntaxProblem:
    if text[at] in "]}":
        return SyntaxProblem(at, f"one closing {text[at]} too many", "remove it")
    if text[at] in ",{[":
        problem = "something follows after the end of the scene"
        return SyntaxProblem(
            at, problem, 'several objects are written as {"objects": [{...}, {...}]}'
        )
    return _explain_character(text, at, "after the end of the scene")


def _explain_key(text: str, at: int) -> SyntaxProblem:
    if found := _QUOTED_KEY.match(text, at):
        return SyntaxProblem(
            at, "a key in other than double quotes", f'write "{found[1]}" with double quotes'
        )
    if found := _KEY.match(text, at):
        return SyntaxProblem(
            at, f"the key {excerpt(found[0])} has no quotes", f'write "{found[0]}":'
        )
    if text[at] == '"':
        return _open_quote(at)
    if text[at] == ",":
        return SyntaxProblem(at, "a comma with nothing before it", "remove the comma")
    if text[at] in "{[":
        return SyntaxProblem(at, "a value without a key", 'each value is written as "key": value')
    return _explain_character(text, at, "in place of a key", 'keys are written as "key": value')


def _explain_value(text: str, at: int) -> SyntaxProblem:
    start = text[at]
    if start in _QUOTES:
        return SyntaxProblem(at, "text in other than double quotes", 'use the plain double quote "')
    if start == '"':
        return _open_quote(at)
    if start in ",:]}":
        name = {",": "comma", ":": "colon"}.get(start, f"closing {start}")
        return SyntaxProblem(at, f"a value is missing before this {name}")
    if start == "(":
        return SyntaxProblem(at, "a list in round brackets", "lists are written with [ and ]")
    if start in "+.":
        hint = "write a digit before the point: 0.5" if start == "." else "leave the + out"
        return SyntaxProblem(at, f"a number cannot begin with {start}", hint)
    found = _UNQUOTED.match(text, at)
    word = found[0].rstrip() if found else start
    if word in _OTHER_WORDS:
        return SyntaxProblem(
            at, f"{word} is not a word of JSON", f"write {_OTHER_WORDS[word]}, or leave the key out"
        )
    if start.isalpha() or start in "_-$":
        return SyntaxProblem(
            at,
            f"{excerpt(word)} has no quotes",
            f'text and expressions are written in double quotes: "{_short(word)}"',
        )
    return _explain_character(text, at, "in place of a value")


def _explain_delimiter(text: str, at: int, context: _Context) -> SyntaxProblem:
    """Explain text that follows a value inside brackets, and is neither a comma nor the end."""
    assert context.bracket is not None  # noqa: S101 - as its caller knows
    bracket, start = text[context.bracket], text[at]
    adjacent = text[at - 1 : at] not in _BLANK
    number = _NUMBER_BEFORE.search(text, max(0, at - 40), at) if adjacent else None
    if context.string is not None and bracket == "{" and _is_key(text, context.string):
        key = _short(text[context.string : at].strip())
        return SyntaxProblem(at, f"a colon is missing after the key {key}")
    if start in "]}":
        opened = f"the {bracket} of {_position(text, context.bracket)} is still open"
        return SyntaxProblem(
            at, f"a closing {start} where {_CLOSING[bracket]} is expected: {opened}"
        )
    if number and number[0].lstrip("-") == "0" and start in "0123456789xX":
        return SyntaxProblem(
            number.start(), "a number with a leading 0", "write decimal numbers without it"
        )
    if number and start == "." and "." not in number[0]:
        return SyntaxProblem(number.start(), "a number that ends with its point", "write 1.0 or 1")
    if start == ":":
        problem = "a colon inside a list" if bracket == "[" else "a colon where none belongs"
        return SyntaxProblem(at, problem, 'keys and values stand in braces: {"key": value}')
    if start == ";":
        return SyntaxProblem(at, "a semicolon", "values are parted by commas")
    if start in "*/+-^(" or (number and (start.isalpha() or start in "_°")):
        begin = number.start() if number else at
        found = _UNQUOTED.match(text, begin)
        word = found[0].rstrip() if found else start
        hint = f'expressions are written in double quotes: "{_short(word)}"'
        if start == "/" and not number:
            return _explain_character(text, at)
        return SyntaxProblem(begin, f"the expression {excerpt(word)} has no quotes", hint)
    if start in '"[{' or start.isalnum() or start in "-_" or start in _QUOTES:
        return SyntaxProblem(at, "a comma is missing before this", "values are parted by commas")
    return _explain_character(text, at)


def _is_key(text: str, string: int) -> bool:
    """Return whether a string inside braces is in the place of a key."""
    return text[:string].rstrip(_BLANK)[-1:] in {"{", ","}


def _explain_character(
    text: str, at: int, where: str = "here", hint: str | None = None
) -> SyntaxProblem:
    start = text[at]
    if start == "#" or text.startswith("/*", at):
        problem = f"a comment that begins with {'#' if start == '#' else '/*'}"
        return SyntaxProblem(at, problem, "comments begin with // and end with the line")
    shown = start if start.isprintable() else f"U+{ord(start):04X}"
    return SyntaxProblem(at, f"{shown} {where} has no meaning", hint)


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
