"""Glyphs of texts: fonts, shaping and outlines by HarfBuzz.

Any script is shaped as far as the font knows it. Must not know where a text stands.
"""

from __future__ import annotations

import os
import sys
import unicodedata
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from voxdisplay.bodies.bidirectional_text import visual_runs
from voxdisplay.compute.array_types import Floats
from voxdisplay.errors import BodyError, MissingExtra

MAX_CHARACTERS = 10_000
_MAX_POINTS = 1 << 20
_MAX_FONT_BYTES = 64 << 20
_MAX_STEPS = 64  # of a curve
_NAMED = 5  # characters that an error names
_FAMILY = "Noto Sans"
# Fonts of the system, in the order in which they are tried.
_SYSTEM_FONTS = ("DejaVuSans", "NotoSans-Regular", "LiberationSans-Regular", "FreeSans", "Arial",
                 "Helvetica", "NotoSans", "NotoNaskh", "NotoSerif", "unifont")  # fmt: skip
_COMMON = {"Zyyy", "Zinh", "Zzzz"}


class Glyphs:
    """A font with which texts are set.

    Parameters
    ----------
    name : str
        For errors.
    data : bytes
        A TrueType or OpenType font.

    """

    def __init__(self, name: str, data: bytes) -> None:
        self.name = name
        self._harfbuzz = _harfbuzz()
        hint = "fonts are .ttf or .otf files"
        if len(data) > _MAX_FONT_BYTES:
            raise BodyError(f"{name} is larger than {_MAX_FONT_BYTES >> 20} MiB", hint=hint)
        if data[:4] not in {b"\0\1\0\0", b"OTTO", b"true", b"ttcf"}:
            packed = " (WOFF: unpack it)" if data[:3] == b"wOF" else ""
            raise BodyError(f"{name} is not a font{packed}", hint=hint)
        face = self._harfbuzz.Face(data)
        if not face.glyph_count or not face.unicodes:
            raise BodyError(f"{name} is not a font, or it is damaged: it has no glyphs", hint=hint)
        self._font = self._harfbuzz.Font(face)
        self._units = max(1, int(face.upem))
        self._codes = face.unicodes
        self._outlines: dict[int, list[Floats]] = {}
        if not self.cap_height > 0:
            raise BodyError(f"{name} has no heights of letters: it is damaged", hint=hint)

    @property
    def cap_height(self) -> float:
        """Height of a capital letter, in units of the font."""
        for letter in "HXZ0":
            glyph = self._font.get_nominal_glyph(ord(letter))
            extents = self._font.get_glyph_extents(glyph) if glyph else None
            if extents is not None and extents.y_bearing > 0:
                return float(extents.y_bearing)
        return float(self._units) * 0.7

    @property
    def line_height(self) -> float:
        """Distance of lines, in units of the font."""
        extents = self._font.get_font_extents("ltr")
        height = extents.ascender - extents.descender + extents.line_gap
        return float(height) if height > 0 else 1.2 * self._units

    def lacking(self, text: str) -> list[str]:
        """Return the characters of a text that the font lacks."""
        return [
            letter
            for letter in dict.fromkeys(text)
            if ord(letter) not in self._codes and not _is_silent(letter)
        ]

    def set_line(self, line: str, tolerance: float) -> list[tuple[list[Floats], float, float]]:
        """Return the glyphs of a line: closed outlines, and the place of each.

        Parameters
        ----------
        line : str
        tolerance : float
            Largest distance of outlines from their curves, in units of the font.

        Returns
        -------
        list of (outlines, x, y)
            Outlines are (n, 2) arrays, x to the right, y up; equal glyphs share theirs.

        """
        placed = []
        x = y = 0.0
        for run, script, leftward in _runs(line):
            buffer = self._harfbuzz.Buffer()
            buffer.add_str(run)
            buffer.direction = "rtl" if leftward else "ltr"
            buffer.script = script
            buffer.guess_segment_properties()
            self._harfbuzz.shape(self._font, buffer)
            positions = buffer.glyph_positions or []
            for info, place in zip(buffer.glyph_infos, positions, strict=True):
                outlines = self._outlines_of(info.codepoint, tolerance)
                if outlines:
                    placed.append((outlines, x + place.x_offset, y + place.y_offset))
                x += place.x_advance
                y += place.y_advance
        if sum(len(each) for outlines, _, _ in placed for each in outlines) > _MAX_POINTS:
            raise BodyError(f"the text has outlines of more than {_MAX_POINTS} points")
        return placed

    def _outlines_of(self, glyph: int, tolerance: float) -> list[Floats]:
        found = self._outlines.get(glyph)
        if found is None:
            pen = _Pen(tolerance)
            self._font.draw_glyph_with_pen(glyph, pen)
            found = self._outlines[glyph] = pen.finished()
        return found


class _Pen:
    """Collector of outlines, as HarfBuzz draws them; curves become chords."""

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self._outlines: list[Floats] = []
        self._points: list[tuple[float, float]] = []

    def moveTo(self, point: tuple[float, float]) -> None:  # noqa: N802 - pens are called so
        self.closePath()
        self._points = [point]

    def lineTo(self, point: tuple[float, float]) -> None:  # noqa: N802
        self._points.append(point)

    def qCurveTo(self, *points: tuple[float, float]) -> None:  # noqa: N802
        self._curve(points)

    def curveTo(self, *points: tuple[float, float]) -> None:  # noqa: N802
        self._curve(points)

    def closePath(self) -> None:  # noqa: N802
        points = np.array(self._points, dtype=np.float64).reshape(-1, 2)
        if len(points) > 1 and (points[0] == points[-1]).all():
            points = points[:-1]
        if len(points) > 2:
            self._outlines.append(points)
        self._points = []

    def endPath(self) -> None:  # noqa: N802
        self.closePath()

    def finished(self) -> list[Floats]:
        """Return the outlines."""
        self.closePath()
        return self._outlines

    def _curve(self, points: tuple[tuple[float, float], ...]) -> None:
        control = np.array([self._points[-1], *points], dtype=np.float64)
        # Chords are off by at most 1/8 of the second derivative times the square of the step.
        degree = len(control) - 1
        bend = np.abs(np.diff(control, n=2, axis=0)).max(initial=0) * degree * (degree - 1)
        steps = min(_MAX_STEPS, max(1, int(np.ceil(np.sqrt(bend / (8 * self._tolerance))))))
        part = np.linspace(0, 1, steps + 1)[1:, None]
        level = [np.broadcast_to(point, (steps, 2)) for point in control]
        while len(level) > 1:  # de Casteljau
            level = [(1 - part) * a + part * b for a, b in pairwise(level)]
        self._points += [(float(x), float(y)) for x, y in level[0]]


def choose_font(text: str) -> Glyphs:
    """Return the first font of the extra and of the system that has all characters of a text.

    Raises
    ------
    BodyError
        If none has them, or there is no font.
    MissingExtra
        Without HarfBuzz.

    """
    _harfbuzz()
    first: Glyphs | None = None
    for path in _font_paths():
        font = _system_font(path)
        if font is None:
            continue
        if not font.lacking(text):
            return font
        first = first or font
    if first is None:
        hint = "name a font, or: pip install 'voxdisplay[text]'"
        raise BodyError("there is no font on this system", hint=hint)
    raise lacking_error(first, text)


def lacking_error(font: Glyphs, text: str) -> BodyError:
    """Return the error of a font that lacks characters of a text."""
    lacking = font.lacking(text)
    named = ", ".join(f"{unicodedata.name(each, f'U+{ord(each):04X}')} ({each})"
                      for each in lacking[:_NAMED])  # fmt: skip
    more = f" and {len(lacking) - _NAMED} more" if len(lacking) > _NAMED else ""
    return BodyError(f"{font.name} has no {named}{more}", hint="name a font that has, by `font`")


def _is_silent(letter: str) -> bool:
    """Return whether a character shows nothing by itself: controls, joiners, selectors."""
    return unicodedata.category(letter) in {"Cc", "Cf"} or "\ufe00" <= letter <= "\ufe0f"


def _runs(line: str) -> Iterator[tuple[str, str, bool]]:
    """Yield runs of one direction and script from left to right, and whether they run leftward."""
    for start, end, leftward in visual_runs(line):
        pieces: list[tuple[str, str]] = []
        for letter in line[start:end]:
            script = _script(letter)
            if pieces and (script in _COMMON or pieces[-1][1] in {*_COMMON, script}):
                known = pieces[-1][1] if script in _COMMON else script
                pieces[-1] = pieces[-1][0] + letter, known
            else:
                pieces.append((letter, script))
        for piece, script in reversed(pieces) if leftward else pieces:
            yield piece, script, leftward


@lru_cache(maxsize=4096)
def _script(letter: str) -> str:
    buffer = _harfbuzz().Buffer()
    buffer.add_str(letter)
    buffer.guess_segment_properties()
    return str(buffer.script or "Zyyy")


def _harfbuzz() -> Any:
    try:
        import uharfbuzz  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        raise MissingExtra("text needs HarfBuzz, which is not installed",
                           hint="pip install 'voxdisplay[text]'") from None  # fmt: skip
    return uharfbuzz


@lru_cache(maxsize=64)
def _system_font(path: Path) -> Glyphs | None:
    """Return a font; None if the file is none."""
    try:
        if path.stat().st_size > _MAX_FONT_BYTES:
            return None
        return Glyphs(path.name, path.read_bytes())
    except (OSError, BodyError):
        return None


def _font_paths() -> Iterator[Path]:
    """Yield the files of fonts that are tried when none is named."""
    try:
        import fontpkg  # noqa: PLC0415 - an extra

        yield Path(fontpkg.path(_FAMILY))
    except Exception:  # noqa: BLE001, S110 - not installed, or without this family
        pass
    yield from _installed_fonts()


@lru_cache(maxsize=1)
def _installed_fonts() -> tuple[Path, ...]:
    """Return the fonts of the system that may have what is lacking, the preferred ones first."""
    home = Path(os.path.expanduser("~"))  # noqa: PTH111 - it does not fail without a home
    folders = {
        "win32": [Path(os.environ.get("WINDIR", "C:/Windows")) / "Fonts"],
        "darwin": [Path("/System/Library/Fonts"), Path("/Library/Fonts"), home / "Library/Fonts"],
    }.get(sys.platform, [Path("/usr/share/fonts"), Path("/usr/local/share/fonts"), home / ".fonts",
                         home / ".local/share/fonts"])  # fmt: skip
    found = [
        path
        for folder in folders
        for path in sorted(folder.rglob("*"))
        if path.suffix.lower() in {".ttf", ".otf", ".ttc"}
    ]

    def rank(path: Path) -> int:
        stem = path.stem.lower()
        exact = [i for i, name in enumerate(_SYSTEM_FONTS) if stem == name.lower()]
        begin = [
            i + len(_SYSTEM_FONTS)
            for i, name in enumerate(_SYSTEM_FONTS)
            if stem.startswith(name.lower())
        ]
        return min([*exact, *begin, 2 * len(_SYSTEM_FONTS)])

    return tuple(path for path in sorted(found, key=rank) if rank(path) < 2 * len(_SYSTEM_FONTS))
