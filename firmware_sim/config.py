"""Configuration of an emulated device: validation, and parsing of its values from text.

Everything here is checked before the device starts.
"""

import operator
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from typing import Final

from firmware_sim import spec
from firmware_sim.grid import Grid
from firmware_sim.memory import FORMATS, PixelFormat
from firmware_sim.quoting import excerpt
from firmware_sim.sender import max_wire_bytes

FEATURES: Final = {
    "line": spec.FEATURE_LINE,
    "box": spec.FEATURE_BOX,
    "dots": spec.FEATURE_DOTS,
    "oct": spec.FEATURE_OCT,
    "diff": spec.FEATURE_DIFF,
    "arc": spec.FEATURE_ARC,
    "palette": spec.FEATURE_PALETTE,
    "read": spec.FEATURE_READ,
    "digest": spec.FEATURE_DIGEST,
    "slabs": spec.FEATURE_SLABS,
    "fade": spec.FEATURE_FADE,
    "arc2": spec.FEATURE_ARC2,
    "hold": spec.FEATURE_HOLD,
    "values": spec.FEATURE_VALUES,
}
_INDEXED: Final = frozenset(("diff", "palette"))  # section 5: only with the format INDEX8
_COLORED: Final = frozenset(("fade", "values"))  # not with MONO1
_TICKING: Final = frozenset(("hold",))  # not without refresh ticks
_FIRST_OF_1_1: Final = 9  # section 15: features from this bit on are of version 1.1
LIES: Final = ("grid", "credit", "format", "features", "payload", "boot")
_INFO_FIXED: Final = 29  # bytes of an INFO's payload before its strings (5)
_U32: Final = 0xFFFFFFFF
_MILLI: Final = 1000  # INFO has ticks per 1000 seconds


@dataclass(frozen=True)
class Config:
    """Configuration of a device.

    Parameters
    ----------
    grid
        Number of voxels along x, y and z.
    pixel_format
        ``"mono1"``, ``"index8"``, ``"rgb565"`` or ``"rgb888"``.
    refresh
        Refresh ticks per 1000 seconds; 0: a swap happens at once.
    rx_buffer
        Size of the receive ring in bytes, which is the credit.
    max_payload
        Longest payload in bytes.
    boot
        Boot id, 0 to 65535; None for a random one.
    name, firmware, serial
        Strings of INFO.
    features
        Names of the announced features, of `FEATURES`; None for all that the pixel format and the
        refresh allow.
    max_silent_acks
        How many ACKs in a row are left out while more packets can be taken, 0 to 8 (9).
    lies
        Names of what INFO announces but the device does not do, of `LIES`.

    Attributes
    ----------
    shape : Grid
        The grid.
    pixels : PixelFormat
        The pixel format.
    feature_bits : int
        The announced features, a bit for each ``spec.FEATURE_*``.

    Raises
    ------
    ValueError
        If the protocol has no such device; the message says what to change.
    TypeError
        If a value is of another type; the message names it.
    """

    grid: tuple[int, int, int] = (128, 128, 128)
    pixel_format: str = "rgb888"
    refresh: int = 30_000
    rx_buffer: int = 16_384
    max_payload: int = 1024
    boot: int | None = None
    name: str = "voxdisplay emulator"
    firmware: str = "1.0"
    serial: str = ""
    features: frozenset[str] | None = None
    max_silent_acks: int = 0
    lies: frozenset[str] = frozenset()
    shape: Grid = field(init=False, repr=False, compare=False)
    pixels: PixelFormat = field(init=False, repr=False, compare=False)
    feature_bits: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "shape", Grid(*_three_numbers(self.grid)))
        object.__setattr__(self, "grid", self.shape.sides)
        if self.pixel_format not in FORMATS:
            raise ValueError(
                f"pixel format {self.pixel_format!r}: take one of {', '.join(FORMATS)}"
            )
        object.__setattr__(self, "pixels", FORMATS[self.pixel_format])
        allowed = [
            name
            for name in FEATURES
            if (name not in _INDEXED or self.pixels.code == spec.FORMAT_INDEX8)
            and (name not in _COLORED or self.pixels.code != spec.FORMAT_MONO1)
            and (name not in _TICKING or self.refresh)
        ]
        features = frozenset(allowed)
        if self.features is not None:
            features = _names(self.features)
            object.__setattr__(self, "features", features)
        ticks = "" if self.refresh else " and no refresh ticks"
        _check_names("feature", features, allowed, f" with the format {self.pixel_format}{ticks}")
        bits = sum(1 << FEATURES[name] for name in features)
        object.__setattr__(self, "feature_bits", bits)
        object.__setattr__(self, "lies", _names(self.lies))
        _check_names("lie", self.lies, LIES)
        _check("refresh", self.refresh, 0, _U32)
        _check("max_payload", self.max_payload, spec.LIMIT_MIN_PAYLOAD, spec.LIMIT_MAX_PAYLOAD)
        longest = max_wire_bytes(self.max_payload + spec.LIMIT_OVERHEAD)
        _check("rx_buffer", self.rx_buffer, spec.LIMIT_RESERVE + longest, _U32)
        _check("max_silent_acks", self.max_silent_acks, 0, spec.LIMIT_MAX_SILENT)
        if self.boot is not None:
            _check("boot", self.boot, 0, 0xFFFF)
        for name, text in (
            ("name", self.name),
            ("firmware", self.firmware),
            ("serial", self.serial),
        ):
            _check(f"bytes of the {name}", len(text.encode()), 0, 0xFF)
        info = _INFO_FIXED + len(self.strings)
        if info > self.max_payload:
            raise ValueError(
                f"INFO needs {info} bytes: take shorter strings or a max_payload of {info} or more"
            )

    @property
    def minor(self) -> int:
        """Minor version that it announces: 0 without a feature of a later one (15)."""
        return spec.VERSION_MINOR if self.feature_bits >> _FIRST_OF_1_1 else 0

    @property
    def strings(self) -> bytes:
        """Name, firmware and serial in the form in which they end INFO."""
        texts = (text.encode() for text in (self.name, self.firmware, self.serial))
        return b"".join(bytes((len(text),)) + text for text in texts)


def _three_numbers(grid: object) -> tuple[int, int, int]:
    if isinstance(grid, str):
        return parse_size(grid)
    try:
        nx, ny, nz = map(operator.index, grid)  # type: ignore[call-overload]
    except (TypeError, ValueError):
        raise TypeError(f"grid is {grid!r}: take three numbers of voxels, (nx, ny, nz)") from None
    return nx, ny, nz


def _names(names: str | Iterable[str]) -> frozenset[str]:
    return parse_names(names) if isinstance(names, str) else frozenset(names)


def _check(what: str, value: int, low: int, high: int) -> None:
    if not isinstance(value, int):
        raise TypeError(f"{what} is {value!r}: take a whole number")
    if not low <= value <= high:
        raise ValueError(f"{what} is {value}: take a number from {low} to {high}")


def _check_names(what: str, names: Iterable[str], known: Collection[str], where: str = "") -> None:
    unknown = sorted(name for name in names if name not in known)
    if unknown:
        known_names = ", ".join(known)
        raise ValueError(f"unknown {what} {excerpt(unknown[0])}: take of {known_names}{where}")


def parse_number(text: str) -> int:
    """Parse a whole number, decimal or with the prefix 0x.

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        return int(text, 0)
    except ValueError:
        raise ValueError(f"{excerpt(text)} is no whole number: write one like 16384") from None


def parse_baud(text: str) -> int:
    """Parse a line rate in bits per second; 0: unlimited.

    Raises
    ------
    ValueError
        If it is no whole number, or one below 50.
    """
    baud = parse_number(text)
    if baud and not 50 <= baud <= _U32:
        raise ValueError(f"baud is {baud}: take a number from 50 to {_U32}")
    return baud


def parse_size(text: str) -> tuple[int, int, int]:
    """Parse a grid such as ``128x128x128`` or ``128,128,128``.

    Raises
    ------
    ValueError
        If it is not three numbers joined by x or by commas.
    """
    number = "([0-9]{1,9})"
    match = re.fullmatch(f"{number}[x,]{number}[x,]{number}", text, re.IGNORECASE)
    if not match:
        raise ValueError(
            f"{excerpt(text)} is no grid: write three numbers of voxels like 128x128x128"
        )
    nx, ny, nz = map(int, match.groups())
    return nx, ny, nz


def parse_refresh(text: str) -> int:
    """Parse a refresh rate in hertz.

    Returns
    -------
    int
        Ticks per 1000 seconds.

    Raises
    ------
    ValueError
        If it is neither 0 nor a rate that INFO can announce.
    """
    try:
        hertz = float(text)
        ticks = round(hertz * _MILLI)
    except (ValueError, OverflowError):
        raise ValueError(
            f"{excerpt(text)} is no number of hertz: write one like 30 or 29.97"
        ) from None
    if hertz and not 1 <= ticks <= _U32:
        raise ValueError(f"refresh is {hertz:g} Hz: take 0, or from 0.001 to {_U32 / _MILLI} Hz")
    return ticks


def parse_names(text: str) -> frozenset[str]:
    """Parse names joined by commas, as of features or of lies."""
    return frozenset(filter(None, (name.strip() for name in text.lower().split(","))))
