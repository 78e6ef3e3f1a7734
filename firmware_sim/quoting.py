"""Quoting of given text in error messages."""

from typing import Final

_MAX_CHARACTERS: Final = 60


def excerpt(text: str) -> str:
    """Return a text in quotes: its first 60 characters, with unprintable ones escaped."""
    return repr(text if len(text) <= _MAX_CHARACTERS else text[:_MAX_CHARACTERS] + "...")
