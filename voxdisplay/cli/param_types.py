"""Parameter types of the command line: sizes, rates, times, angles, addresses, files.

They import nothing of the driver until a value is converted, so that help and completion are quick.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    from click import ParamType
    from click.shell_completion import CompletionItem

    from voxdisplay.display.baud import Baud
    from voxdisplay.raster.grid import Grid
else:

    class ParamType(click.ParamType):
        """Base of the types. Subscripted for type checkers alone: click's own is so from 8.4 on."""

        def __class_getitem__(cls, _value: object) -> type:
            return cls


MAX_SECONDS: Final = 1e6
PIXEL_FORMATS: Final = ("mono1", "index8", "rgb565", "rgb888")
# The keys of voxdisplay.view.save.WRITERS, which is not imported for them.
IMAGE_SUFFIXES: Final = (".png", ".gif", ".mp4", ".html")
_MIN_SIDE_PX, _MAX_SIDE_PX = 16, 4096
_MAX_SIDE: Final = 0xFFFF  # voxels, protocol.md, section 2


class NumbersType(ParamType[tuple[float, ...]]):
    """Numbers that are separated by commas.

    Parameters
    ----------
    count : int
        How many.
    example : str
        A value that is allowed.
    kind : type
        int or float.

    """

    name = "numbers"

    def __init__(self, count: int, example: str, kind: type[float]) -> None:
        self._count = count
        self._example = example
        self._kind = kind

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, ...]:
        """Return a tuple of numbers."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(self._kind(part) for part in str(value).split(","))
        except ValueError:
            numbers = ()
        if len(numbers) != self._count:
            self.fail(f"{value!r} should be {self._count} numbers, such as {self._example}",
                      param, ctx)  # fmt: skip
        return numbers


class RangeType(ParamType[float]):
    """A number within limits, which are named in errors alone: help texts name them where needed.

    Parameters
    ----------
    name : str
        Name of the kind of value in error messages.
    minimum, maximum : float
        Limits, both allowed.
    example : str
        A value that is allowed.

    """

    def __init__(self, name: str, minimum: float, maximum: float, example: str) -> None:
        self.name = name
        self._minimum, self._maximum, self._example = minimum, maximum, example

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Parse a finite number within the limits."""
        try:
            number = float(value)
        except (ValueError, OverflowError):
            number = math.nan
        if math.isnan(number):
            self.fail(f"{value!r} is not a number of {self.name}: write one like {self._example}")
        if not self._minimum <= number <= self._maximum:
            self.fail(
                f"{value} is out of range: {self.name} are {self._minimum:g} to {self._maximum:g}",
                param,
                ctx,
            )
        return number


class CountType(ParamType[int]):
    """A whole number of 1 or more.

    Parameters
    ----------
    name : str
        Name of what is counted, in error messages.
    maximum : int
        Limit, allowed.

    """

    def __init__(self, name: str, maximum: int) -> None:
        self.name = name
        self._maximum = maximum

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Parse a whole number within the limits."""
        text = str(value).strip()
        if not (text.isascii() and text.isdigit()):
            self.fail(f"{value!r} is not a number of {self.name}: write one like 4", param, ctx)
        number = int(text[:20])
        if not 1 <= number <= self._maximum:
            self.fail(f"{text} is out of range: {self.name} are 1 to {self._maximum}", param, ctx)
        return number


def seconds_type(minimum: float) -> RangeType:
    """Return the type of a time in seconds that the system can wait for."""
    return RangeType("seconds", minimum, MAX_SECONDS, "5")


class BaudType(ParamType["Baud"]):
    """A rate in bits per second, or ``auto``."""

    name = "rate"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Baud:
        """Parse a rate."""
        if str(value).lower() == "auto":
            return "auto"
        try:
            baud = int(value)
        except ValueError:
            self.fail(f"{value!r} is not a rate: write one like 115200, or auto", param, ctx)
        if not 50 <= baud < 1 << 32:
            self.fail(f"{baud} is not a rate of a serial line: write one like 115200", param, ctx)
        return baud

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Offer common rates."""
        from voxdisplay.display.baud import RATES  # noqa: PLC0415 - only for completion

        del ctx, param
        return _completions(("auto", *map(str, RATES)), incomplete)


class SizeType(ParamType["Grid"]):
    """The size of a display in voxels, such as 128x128x128 or 128,128,128.

    Parameters
    ----------
    for_two : str
        Added to the error of a size of two numbers.

    """

    name = "size"

    def __init__(self, for_two: str = "") -> None:
        self._for_two = for_two

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Grid:
        """Parse a size."""
        from voxdisplay.raster.grid import Grid  # noqa: PLC0415 - loads numpy

        if isinstance(value, Grid):
            return value
        try:
            grid = Grid.parse(str(value))
        except ValueError as error:
            is_two = re.fullmatch(r"[0-9]+[x,][0-9]+", str(value))
            self.fail(str(error) + (self._for_two if is_two else ""), param, ctx)
        if max(grid) > _MAX_SIDE:
            self.fail(f"{value!r} is too large: sides are 1 to {_MAX_SIDE} voxels", param, ctx)
        return grid


class PixelSizeType(ParamType[tuple[int, int]]):
    """The size of a picture in pixels, such as 800x600."""

    name = "size"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """Parse width and height."""
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"([0-9]{1,5})[x,]([0-9]{1,5})", str(value).strip().lower())
        sides = tuple(map(int, match.groups())) if match else ()
        if not sides or not all(_MIN_SIDE_PX <= side <= _MAX_SIDE_PX for side in sides):
            self.fail(
                f"{value!r} is not a size in pixels: write it like 800x600, each side "
                f"{_MIN_SIDE_PX} to {_MAX_SIDE_PX}",
                param,
                ctx,
            )
        return sides[0], sides[1]


class AngleType(ParamType[tuple[float, float]]):
    """A view direction such as -34,24: yaw and pitch in degrees; converted to radians."""

    name = "angle"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        """Parse yaw and pitch."""
        if isinstance(value, tuple):
            return value
        try:
            yaw, pitch = map(float, str(value).split(","))
        except ValueError:
            yaw = pitch = math.nan
        if not (abs(yaw) <= 360 and abs(pitch) <= 90):
            self.fail(
                f"{value!r} is not a view direction: write yaw,pitch in degrees, like -34,24; "
                "the pitch is -90 to 90",
                param,
                ctx,
            )
        return math.radians(yaw), math.radians(pitch)


class AddressType(ParamType[tuple[str, int]]):
    """An address to listen at, such as 127.0.0.1:8000 or [::1]:8000."""

    name = "address"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, int]:
        """Parse host and port."""
        if isinstance(value, tuple):
            return value
        from voxdisplay.view.live.address import parse_address  # noqa: PLC0415 - an extra

        try:
            return parse_address(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


class OriginType(ParamType[str]):
    """An origin of web pages, such as https://cube.example.com; or ``*``."""

    name = "origin"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Normalise it as a browser sends it."""
        from voxdisplay.view.live.origins import parse_origin  # noqa: PLC0415 - an extra

        try:
            return parse_origin(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


class FeaturesType(ParamType[tuple[str, ...]]):
    """Names of device features, such as line,box; ``all``; or ``none``."""

    name = "features"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, ...]:
        """Parse names, in the order of protocol.md."""
        every = _features()
        text = str(value).lower().strip()
        if text in ("all", "none"):
            return every if text == "all" else ()
        names = [name.strip() for name in text.split(",")]
        for name in names:
            if name not in every:
                known = ", ".join(every)
                self.fail(f"{name!r} is not a feature: take of {known}; all; none", param, ctx)
        return tuple(name for name in every if name in names)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Offer the features that are not named yet."""
        del ctx, param
        named, comma, _ = incomplete.rpartition(",")
        names = _features() if comma else ("all", "none", *_features())
        rest = [named + comma + name for name in names if name not in named.split(",")]
        return _completions(rest, incomplete)


class ImageFileType(ParamType[Path]):
    """An image file to write; its suffix names its kind."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Check the suffix and the folder, before any work is done."""
        path = Path(value)
        if path.suffix.lower() not in IMAGE_SUFFIXES:
            self.fail(f"{path} should end in {', '.join(IMAGE_SUFFIXES)}", param, ctx)
        try:
            why = "it is a folder" if path.is_dir() else ""
            why = why or ("" if path.parent.is_dir() else f"there is no folder {path.parent}")
        except (OSError, ValueError) as error:  # ValueError: a NUL in the name
            why = getattr(error, "strerror", None) or "it cannot be looked up"
        if why:
            self.fail(f"{path} cannot be written: {why}", param, ctx)
        return path

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Let the shell offer file names."""
        return click.Path().shell_complete(ctx, param, incomplete)


def _features() -> tuple[str, ...]:
    """Return the names of protocol.md's features, without the numpy of `display.plan`."""
    from voxdisplay.wire import spec  # noqa: PLC0415 - only when used

    names = (name for name in vars(spec) if name.startswith("FEATURE_"))
    return tuple(name.removeprefix("FEATURE_").lower() for name in names)


def _completions(words: tuple[str, ...] | list[str], incomplete: str) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem  # noqa: PLC0415 - only for completion

    return [CompletionItem(word) for word in words if word.startswith(incomplete)]
