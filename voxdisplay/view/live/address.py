"""Parsing of listen addresses."""

from __future__ import annotations

import re


def parse_address(text: str) -> tuple[str, int]:
    """Return host and port of HOST:PORT, with an IPv6 number in brackets.

    Raises
    ------
    ValueError
        If it is no such address.

    """
    match = re.fullmatch(r"\[?([^\[\]\s/?#@*]+?)\]?:([0-9]{1,5})", text)
    if not match or int(match[2]) > 0xFFFF or not _may_be_host(match[1]):
        raise ValueError(f"{text!r} is no address: write HOST:PORT like 127.0.0.1:8000")
    return match[1], int(match[2])


def _may_be_host(name: str) -> bool:
    """Return whether a name can be looked up: its labels are of a legal length."""
    try:
        name.encode("idna")
    except UnicodeError:
        return False
    return True
