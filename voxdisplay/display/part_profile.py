"""Keys of one part of a display that is made of several, checked and explained.

Must not know pipes or sessions, nor how parts lie to each other.
"""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from voxdisplay.argument_checks import whole_number, wrong_kind
from voxdisplay.errors import ProfileError, did_you_mean
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.orientation import UPRIGHT, Orientation
from voxdisplay.wire import spec

MAX_PARTS: Final = 32
_MAX_NAME: Final = 40


@dataclass(frozen=True, slots=True)
class PartProfile:
    """One of the displays that make up another.

    Attributes
    ----------
    name : str
        What messages call it.
    port : str
        Where it is plugged in.
    size : Grid
        Its sides, as the user of the whole display sees it.
    at : tuple of int
        Its lowest voxel (x, y, z) in the whole display.
    axes : Orientation
        Where the user's x, y and z run in its memory.
    serial : str or None
        Serial number that it must have.
    sink : mapping
        Settings of an LED cube, besides those of its port's name.

    """

    name: str
    port: str
    size: Grid
    at: tuple[int, int, int] = (0, 0, 0)
    axes: Orientation = UPRIGHT
    serial: str | None = None
    sink: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def box(self) -> tuple[slice, slice, slice]:
        """Where it lies in an array of the whole display, [z, y, x]."""
        (x, y, z), (nx, ny, nz) = self.at, self.size
        return slice(z, z + nz), slice(y, y + ny), slice(x, x + nx)


def read_parts(value: Any) -> tuple[PartProfile, ...]:
    """Return the parts of a profile's key ``parts``, a list of tables.

    Raises
    ------
    ProfileError, ValueError, TypeError
        If a key is unknown or missing, or a value is wrong; it names the part and the key.

    """
    if not isinstance(value, list | tuple) or not all(isinstance(each, Mapping) for each in value):
        raise wrong_kind("parts", "tables [[parts]]", value)
    if not 1 <= len(value) <= MAX_PARTS:
        raise ValueError(f"parts: expected 1 to {MAX_PARTS}, found {len(value)}")
    parts = tuple(_read_part(keys, number) for number, keys in enumerate(value, 1))
    for key in ("name", "port"):
        seen: set[str] = set()
        for part in parts:
            text: str = getattr(part, key)
            # Each emulator in this process is another one.
            if text in seen and not (key == "port" and text.lower().startswith("sim:")):
                raise ValueError(f"parts: two of them have the {key} {reprlib.repr(text)}")
            seen.add(text)
    return parts


def _read_part(keys: Mapping[str, Any], number: int) -> PartProfile:
    name = keys.get("name", f"part {number}")
    where = f"parts: {name}" if isinstance(name, str) else f"parts: part {number}"
    found: dict[str, Any] = {"name": name}
    for key, value in keys.items():
        reader = _READERS.get(key)
        if reader is None:
            raise ProfileError(
                f"{where[:60]}: unknown key {str(key)[:40]!r}", hint=_nearest(str(key))
            )
        try:
            found[key] = reader(value)
        except (ValueError, TypeError) as error:
            text = str(error)
            raise ValueError(
                f"{where[:60]}: {text if text.startswith(key) else f'{key}: {text}'}"
            ) from None
    for key in ("port", "size"):
        if key not in found:
            raise ValueError(
                f'{where[:60]}: {key} is missing: write port = "/dev/ttyUSB0", '
                "size = [64, 64, 64], at = [0, 0, 0]"
            )
    part = PartProfile(**found)
    for axis, at, side in zip("xyz", part.at, part.size, strict=True):
        if at + side > spec.LIMIT_MAX_SIDE:
            raise ValueError(
                f"{where[:60]}: it ends at {axis} = {at + side}, and a display has at most "
                f"{spec.LIMIT_MAX_SIDE} voxels a side"
            )
    return part


def _nearest(key: str) -> str:
    near = difflib.get_close_matches(key[:40].lower(), _READERS, 1, 0.5)
    hint = did_you_mean(key, _READERS) or (f"did you mean {near[0]!r}?" if near else None)
    if not hint and key in {"brightness", "limit", "dither", "fit", "pitch_mm"}:
        hint = f"{key} is of the whole display: write it above the parts"
    return hint or f"known keys of a part are {', '.join(_READERS)}"


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError(f"expected a text, found {reprlib.repr(value)}")
    return value


def _name(value: Any) -> str:
    text = _text(value)
    if len(text) > _MAX_NAME or not text.isprintable():
        raise ValueError(f"expected at most {_MAX_NAME} printable characters")
    return text


def _size(value: Any) -> Grid:
    if not isinstance(value, list | tuple):
        raise wrong_kind("size", "three whole numbers [nx, ny, nz]", value)
    return Grid.of(value)


def _place(value: Any) -> tuple[int, int, int]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise wrong_kind("at", "three whole numbers [x, y, z]", value)
    x, y, z = (whole_number("at", each, 0, spec.LIMIT_MAX_SIDE - 1) for each in value)
    return x, y, z


def _sink(value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise wrong_kind("sink", 'a table {wiring = "serpentine"}', value)
    return dict(value)


_READERS: Final[dict[str, Callable[[Any], Any]]] = {
    "name": _name,
    "port": _text,
    "size": _size,
    "at": _place,
    "axes": Orientation.of,
    "serial": _text,
    "sink": _sink,
}
