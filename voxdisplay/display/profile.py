"""Display profile: how one display stands, what it can show, and where it is plugged in.

Keys of a TOML file, checked and explained. Must not know pipes or sessions.
"""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from voxdisplay.argument_checks import choice, distances, number, positive, wrong_kind
from voxdisplay.errors import ProfileError, did_you_mean
from voxdisplay.frame import FITS, Fit
from voxdisplay.frame.output_transform import CUBIC, OutputTransform
from voxdisplay.raster.light import CurrentLimit
from voxdisplay.raster.orientation import UPRIGHT, Orientation
from voxdisplay.raster.pixel_format import PixelFormat

if TYPE_CHECKING:
    from voxdisplay.display.display import Display
    from voxdisplay.display.part_profile import PartProfile
    from voxdisplay.raster.grid import Grid

DITHERS: Final = ("none", "ordered")
_LIMIT_KEYS: Final = ("amps", "ma_per_channel")


@dataclass(frozen=True, slots=True)
class DisplayProfile:
    """What is known of one display.

    Attributes
    ----------
    source : str
        File that it was read from; empty without one.
    port, serial : str or None
        Where it is plugged in; serial number of the only device that is meant.
    axes : Orientation
        Where the user's x, y and z run in its memory.
    pitch_mm : tuple of float
        Distances of its voxels along the user's x, y and z.
    brightness : float
        Factor of linear light, 0 to 1.
    limit : CurrentLimit or None
    dither : {"none", "ordered"}
    fit : {"contain", "none", "content"} or None
    sink : mapping
        Settings of an LED cube, besides those of its port's name.
    parts : tuple of PartProfile
        The displays that make it up; empty if it is one.

    """

    source: str = field(default="", compare=False)
    port: str | None = None
    serial: str | None = None
    axes: Orientation = UPRIGHT
    pitch_mm: tuple[float, float, float] = CUBIC
    brightness: float = 1.0
    limit: CurrentLimit | None = None
    dither: str = "none"
    fit: Fit | None = None
    sink: Mapping[str, Any] = field(default_factory=dict, hash=False)
    parts: tuple[PartProfile, ...] = ()

    @property
    def output(self) -> OutputTransform | None:
        """What lies between pictures and the display's memory; None if they are the same."""
        x, y, z = self.pitch_mm
        output = OutputTransform(
            self.axes,
            CUBIC if x == y == z else self.pitch_mm,
            self.brightness,
            self.limit,
            self.dither == "ordered",
        )
        return None if output == OutputTransform() else output

    @property
    def grid(self) -> Grid | None:
        """Grid of pictures, if it has parts; of any other display, only its device tells."""
        from voxdisplay.display.part_layout import PartLayout  # noqa: PLC0415 - few have parts

        return PartLayout(self.parts).grid if self.parts else None

    def upright(self) -> DisplayProfile:
        """Return the profile without what it says of the axes."""
        return replace(self, axes=UPRIGHT, pitch_mm=CUBIC)

    def applied(self, display: Display, note: Callable[[str], None]) -> Display:
        """Return an open display that has this profile; note what its user should know.

        Raises
        ------
        IncompatibleDevice
            If it is another than the one that is meant. It is closed.

        """
        try:
            display.set_output(self.output, serial=self.serial)
        except BaseException:
            display.close()
            raise
        if self.axes.mirrors:
            note(f"axes {self.axes} mirror what the memory holds: no rotation leads there")
        if self.brightness != 1 and display.info.format is PixelFormat.MONO1:
            note("brightness does nothing: a mono1 display has one light only")
        if self.sink and display.answers:
            note("the profile's sink does nothing: what answers on this port wires its own voxels")
        return display


def read_profile(keys: Mapping[str, Any], source: str = "") -> DisplayProfile:
    """Return the profile of some keys, as a TOML file has them.

    Raises
    ------
    ProfileError
        If a key is unknown, or a value is wrong; it names the file and the key.

    """
    found: dict[str, Any] = {"source": source}
    for key, value in keys.items():
        reader = _READERS.get(key)
        if reader is None:
            raise _error(source, f"unknown key {str(key)[:40]!r}", _nearest(key, _READERS))
        try:
            found[key] = reader(value)
        except ProfileError as error:
            raise _error(source, str(error), error.hint) from None
        except (ValueError, TypeError) as error:
            text = str(error)
            raise _error(source, text if text.startswith(key) else f"{key}: {text}") from None
    profile = DisplayProfile(**found)
    check_parts(profile)
    return profile


def check_parts(profile: DisplayProfile) -> None:
    """Raise `ProfileError` if a profile with parts has keys that belong to each of them."""
    if not profile.parts:
        return
    for key in ("port", "serial", "axes", "sink"):
        if getattr(profile, key) != getattr(DisplayProfile(), key):
            raise _error(
                profile.source,
                f"{key}: this display has {len(profile.parts)} parts, and each has its own",
                f"write {key} into a table [[parts]]",
            )


def with_keys(profile: DisplayProfile, keys: Mapping[str, Any]) -> DisplayProfile:
    """Return a profile in which some keys, such as options of a command, replace others."""
    given = read_profile(keys)
    profile = replace(profile, **{key: getattr(given, key) for key in keys})
    check_parts(profile)
    return profile


def _nearest(key: str, known: Iterable[str]) -> str:
    """Return a hint that names the known key most like one, or all of them."""
    if hint := did_you_mean(key, known):
        return hint
    near = difflib.get_close_matches(str(key)[:40].lower(), known, 1, 0.5)
    return f"did you mean {near[0]!r}?" if near else f"known keys are {', '.join(known)}"


def _error(source: str, text: str, hint: str | None = None) -> ProfileError:
    return ProfileError(f"{source}: {text}" if source else text, hint=hint)


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError(f"expected a text, found {reprlib.repr(value)}")
    return value


def _pitch(value: Any) -> tuple[float, float, float]:
    x, y, z = distances("pitch_mm", value)
    if max(x, y, z) > 1000 * min(x, y, z):
        raise ValueError("pitch_mm: no display's voxels are a thousand times as long as wide")
    return x, y, z


def _brightness(value: Any) -> float:
    share = number("brightness", value)
    if not 0 <= share <= 1:
        raise ValueError(f"brightness: expected 0 to 1, found {share:g}")
    return share


def _sink(value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise wrong_kind("sink", 'a table {size = [16, 16, 16], wiring = "serpentine"}', value)
    return dict(value)


def _parts(value: Any) -> tuple[PartProfile, ...]:
    from voxdisplay.display.part_layout import PartLayout  # noqa: PLC0415 - few have parts
    from voxdisplay.display.part_profile import read_parts  # noqa: PLC0415

    parts = read_parts(value)
    try:
        PartLayout(parts)
    except ValueError as error:
        raise ValueError(f"parts: together they are no display: {error}") from None
    return parts


def _limit(value: Any) -> CurrentLimit:
    if not isinstance(value, Mapping):
        raise wrong_kind("limit", "a table {amps = 8.0, ma_per_channel = 20}", value)
    for key in value:
        if key not in _LIMIT_KEYS:
            raise ProfileError(
                f"limit: unknown key {str(key)[:40]!r}", hint=_nearest(str(key), _LIMIT_KEYS)
            )
    for key in _LIMIT_KEYS:
        if key not in value:
            raise ValueError(f"limit: {key} is missing: write {{amps = 8.0, ma_per_channel = 20}}")
    amps, each = (positive(f"limit.{key}", value[key]) for key in _LIMIT_KEYS)
    return CurrentLimit(amps, each)


def _one_of(key: str, known: tuple[str, ...]) -> Callable[[Any], str]:
    def read(value: Any) -> str:
        choice(key, value, known)
        return str(value)

    return read


_READERS: Final[dict[str, Callable[[Any], Any]]] = {
    "port": _text,
    "serial": _text,
    "axes": Orientation.of,
    "pitch_mm": _pitch,
    "brightness": _brightness,
    "limit": _limit,
    "dither": _one_of("dither", DITHERS),
    "fit": _one_of("fit", FITS),
    "sink": _sink,
    "parts": _parts,
}
