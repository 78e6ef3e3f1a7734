"""Order of the runs of a line of mixed direction: a part of the Unicode bidirectional algorithm.

Embeddings by control characters are not followed; letters, digits and what is between them are.
After UAX 9, rules P2, W1, W2, W7, N1, N2, I1, I2 and L2.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator

_RIGHT = {"R", "AL"}
_DIGITS = {"EN", "AN"}


def visual_runs(text: str) -> list[tuple[int, int, bool]]:
    """Return the runs of a line from left to right.

    Parameters
    ----------
    text : str

    Returns
    -------
    list of (int, int, bool)
        Start and end of each run, and whether it runs to the left.

    """
    levels = _levels(text)
    runs: list[tuple[int, int, int]] = []
    for i, level in enumerate(levels):
        if runs and runs[-1][2] == level:
            runs[-1] = runs[-1][0], i + 1, level
        else:
            runs.append((i, i + 1, level))
    for least in range(max(levels, default=0), 0, -1):  # L2
        at = 0
        while at < len(runs):
            end = at
            while end < len(runs) and runs[end][2] >= least:
                end += 1
            runs[at:end] = runs[at:end][::-1]
            at = max(end, at + 1)
    return [(start, end, level % 2 == 1) for start, end, level in runs]


def _levels(text: str) -> list[int]:
    kinds = list(_resolved(text))
    base = next((int(kind == "R") for kind in kinds if kind in {"L", "R"}), 0)  # P2
    levels = []
    for i, kind in enumerate(kinds):
        side = kind
        if kind == "N":  # N1, N2: digits count as R here
            before = next((each for each in reversed(kinds[:i]) if each != "N"), "LR"[base])
            after = next((each for each in kinds[i:] if each != "N"), "LR"[base])
            before, after = ("R" if each == "D" else each for each in (before, after))
            side = before if before == after else "LR"[base]
        levels.append({"L": 2 * base, "R": 1, "D": 2}[side])
    return levels


def _resolved(text: str) -> Iterator[str]:
    """Yield L, R, D for digits beside R, or N for each character."""
    strong = last = "N"
    for character in text:
        kind = unicodedata.bidirectional(character)
        if kind == "L":
            strong = last = "L"
        elif kind in _RIGHT:
            strong = last = "R"
        elif kind in _DIGITS:  # W7
            last = "D" if strong == "R" or kind == "AN" else "L"
        elif kind != "NSM":  # W1: a mark is of the kind of its letter
            last = "N"
        yield last
