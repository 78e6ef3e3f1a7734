"""Quoting of given text in messages, so that none of it steers a terminal."""

from typing import Final

_MAX_CHARACTERS: Final = 60


def excerpt(text: str) -> str:
    """Return a text in quotes: its first 60 characters, with unprintable ones escaped."""
    return repr(text if len(text) <= _MAX_CHARACTERS else text[:_MAX_CHARACTERS] + "...")


def printable(text: str) -> str:
    """Return a text with all escaped that is not printable, but for line feeds."""
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text
    )
