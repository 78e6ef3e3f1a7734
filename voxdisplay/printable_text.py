"""Cleaning of foreign text: what devices, drivers and files say, before it is shown.

The one place that does it. Text of a device reaches terminals, web pages and logs; it must not
steer them by escape sequences, forge lines, or reverse the reading direction. Knows no device.
"""

from __future__ import annotations

_REPLACEMENT = "\N{REPLACEMENT CHARACTER}"


def printable(text: str) -> str:
    """Return the text as one line, with each character that is not printable replaced by U+FFFD.

    Not printable are control characters (ESC, BEL, line breaks), format characters (bidirectional
    overrides, zero width), lone surrogates and private or unassigned code points: the categories
    C* and Z* of Unicode but for the space.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _REPLACEMENT for c in text)


def printable_lines(text: str) -> str:
    """Return the text cleaned line by line: as `printable`, but line feeds of our own stay."""
    return "\n".join(map(printable, text.split("\n")))
