"""Settings of an LED cube: size, wiring, colours, and addresses in its protocol.

They come from the parameters of a port's URL or from any other mapping, such as a table of a TOML
file. Must not know packets or sockets.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from reprlib import repr as _short
from typing import Any, Final

from voxdisplay.errors import did_you_mean
from voxdisplay.raster.grid import Grid

MAX_LEDS: Final = 1 << 21
MAX_FPS: Final = 60.0
WIRINGS: Final = ("straight", "serpentine", "continuous")
COLOR_ORDERS: Final = "a permutation of rgb or rgbw, such as grb"
LAYOUT_KEYS: Final = ("size", "wiring", "panels", "start", "order", "gamma", "white", "fps")

_MAX_UNIVERSE: Final = 63_999  # of sACN; Art-Net has fewer


@dataclass(frozen=True, slots=True)
class SinkSettings:
    """Settings of one LED cube.

    Attributes
    ----------
    size : Grid
    wiring : str
        ``"straight"``: all rows run the same way; ``"serpentine"``: every second row of a panel
        runs backwards; ``"continuous"``: so does every second panel, as one wire through the cube.
    panels : str
        The axes along a row, from row to row of a panel, and from panel to panel.
    start : tuple of int
        Corner of the first LED, for x, y, z: 0 for the near end of the axis, 1 for the far one.
    order : str
        Order of the colours of an LED; with ``w``, white takes what red, green and blue share.
    gamma : float
        Exponent that makes LED values of pixel values; 1 leaves them as they are.
    white : tuple of float
        White balance: factors of red, green and blue, 0 to 1.
    fps : float
        Frames per second at most.
    universe : tuple of int
        Universes of Art-Net and sACN. If there are too few, those behind the last follow.
    pixels : int or None
        LEDs of a universe or of a channel of OPC; None: as many as there can be.
    address : int
        Slot of the first LED in the first universe, from 1.
    channel : int
        Channel of OPC of the first LED.
    offset : int
        Number of the first LED, from 0, in DDP and WLED.
    priority : int
        Priority of an sACN source.
    hold : int
        Seconds until WLED goes back to its effects; 255: never.
    sync : bool
        Whether a packet ends each frame that has the universes shown together.
    broadcast : bool
        Whether broadcast and multicast addresses are allowed.

    """

    size: Grid
    wiring: str = "straight"
    panels: str = "xyz"
    start: tuple[int, int, int] = (0, 0, 0)
    order: str = "rgb"
    gamma: float = 1.0
    white: tuple[float, float, float] = (1.0, 1.0, 1.0)
    fps: float = MAX_FPS
    universe: tuple[int, ...] = ()
    pixels: int | None = None
    address: int = 1
    channel: int = 1
    offset: int = 0
    priority: int = 100
    hold: int = 255
    sync: bool = True
    broadcast: bool = False

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any], keys: Iterable[str]) -> SinkSettings:
        """Return the settings that a mapping holds.

        Parameters
        ----------
        values : mapping
            Texts as in a URL, or numbers, truth values and lists as in a TOML file.
        keys : iterable of str
            Those that the kind of sink has.

        Raises
        ------
        ValueError
            If a key is unknown, a value is wrong, or the size is missing.

        """
        known = sorted(keys)
        for key in values:
            if key not in known:
                near = did_you_mean(key, known)
                raise ValueError(
                    f"unknown key {_short(key)}; {near or 'there are ' + ', '.join(known)}"
                )
        if "size" not in values:
            raise ValueError("the size is missing, which nothing can be asked for: size=16x16x16")
        settings = cls(**{key: _READERS[key](key, value) for key, value in values.items()})
        if settings.size.voxels > MAX_LEDS:
            raise ValueError(f"size: {settings.size} has more than {MAX_LEDS} LEDs")
        return settings

    @property
    def leds(self) -> int:
        """Number of LEDs."""
        return self.size.voxels

    @property
    def bytes_per_led(self) -> int:
        """Bytes of one LED: 3, or 4 with white."""
        return len(self.order)


def _text(key: str, value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{key}: expected a text, found {_short(value)}")  # noqa: TRY004 - of a file
    return value.strip().lower()


def _items(value: Any) -> list[Any]:
    """Return the items of a list, or of a text with commas."""
    return value.split(",") if isinstance(value, str) else list(value)


def _size(key: str, value: Any) -> Grid:
    del key
    if isinstance(value, str):
        return Grid.of(Grid.parse(value))
    try:
        return Grid.of(value)
    except TypeError as error:
        raise ValueError(str(error)) from error


def _wiring(key: str, value: Any) -> str:
    wiring = _text(key, value)
    if wiring not in WIRINGS:
        raise ValueError(f"{key}: expected one of {', '.join(WIRINGS)}, found {_short(wiring)}")
    return wiring


def _panels(key: str, value: Any) -> str:
    axes = _text(key, value)
    if sorted(axes) != ["x", "y", "z"]:
        raise ValueError(
            f"{key}: expected x, y and z, each once, such as xyz; found {_short(axes)}"
        )
    return axes


def _order(key: str, value: Any) -> str:
    order = _text(key, value)
    if sorted(order) not in (sorted("rgb"), sorted("rgbw")):
        raise ValueError(f"{key}: expected {COLOR_ORDERS}; found {_short(order)}")
    return order


def _number(key: str, value: Any, least: float, most: float) -> float:
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not least <= number <= most:
        raise ValueError(
            f"{key}: expected a number from {least:g} to {most:g}, found {_short(value)}"
        )
    return number


def _whole(least: int, most: int) -> Callable[[str, Any], int]:
    def read(key: str, value: Any) -> int:
        if isinstance(value, str) and re.fullmatch(r"\s*[0-9]{1,9}\s*", value):
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise ValueError(
                f"{key}: expected a whole number from {least} to {most}, found {_short(value)}"
            )
        return value

    return read


def _ranged(least: float, most: float) -> Callable[[str, Any], float]:
    return lambda key, value: _number(key, value, least, most)


def _triple(key: str, value: Any) -> list[Any]:
    items = _items(value) if isinstance(value, str | list | tuple) else []
    if len(items) != 3:
        raise ValueError(
            f"{key}: expected three numbers with commas between, found {_short(value)}"
        )
    return items


def _start(key: str, value: Any) -> tuple[int, int, int]:
    x, y, z = (_whole(0, 1)(key, item) for item in _triple(key, value))
    return x, y, z


def _white(key: str, value: Any) -> tuple[float, float, float]:
    red, green, blue = (_number(key, item, 0, 1) for item in _triple(key, value))
    return red, green, blue


def _universe(key: str, value: Any) -> tuple[int, ...]:
    """Read universes: ``0``, ``1,2,7``, ``0-15,32-40``."""
    items = value if isinstance(value, str | list | tuple) else [value]
    found: list[int] = []
    whole = _whole(0, _MAX_UNIVERSE)
    for item in _items(items):
        first, dash, last = item.partition("-") if isinstance(item, str) else (item, "", "")
        begin = whole(key, first)
        end = whole(key, last) if dash else begin
        if end < begin:
            raise ValueError(f"{key}: {item.strip()} runs backwards: write the lower number first")
        found += range(begin, end + 1)
        if len(found) > _MAX_UNIVERSE:
            raise ValueError(f"{key}: there are more than {_MAX_UNIVERSE} universes")
    for number, times in Counter(found).items():
        if times > 1:
            raise ValueError(f"{key}: universe {number} is named twice")
    return tuple(found)


_TRUTHS: Final = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}


def _truth(key: str, value: Any) -> bool:
    if isinstance(value, bool):
        return value
    if isinstance(value, str) and (text := value.strip().lower()) in _TRUTHS:
        return _TRUTHS[text]
    raise ValueError(f"{key}: expected yes or no, found {_short(value)}")


_READERS: Final[dict[str, Callable[[str, Any], Any]]] = {
    "size": _size,
    "wiring": _wiring,
    "panels": _panels,
    "start": _start,
    "order": _order,
    "gamma": _ranged(0.1, 10),
    "white": _white,
    "fps": _ranged(0.1, MAX_FPS),
    "universe": _universe,
    "pixels": _whole(1, 21_845),
    "address": _whole(1, 512),
    "channel": _whole(0, 255),
    "offset": _whole(0, MAX_LEDS),
    "priority": _whole(0, 200),
    "hold": _whole(1, 255),
    "sync": _truth,
    "broadcast": _truth,
}
