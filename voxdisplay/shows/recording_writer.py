"""Writer of recordings: front to back, and atomic (recording.md).

The file appears under its name when it is complete; until then it is ``NAME.part``. Must not know
where payloads come from.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from voxdisplay.errors import VoxDisplayError
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.shows import recording_spec
from voxdisplay.shows.recording_packets import (
    TIME_UNITS,
    End,
    FrameHeader,
    Segment,
    encode_index,
    encode_segment,
)
from voxdisplay.shows.show import EncodedFrame
from voxdisplay.wire import packet, spec
from voxdisplay.wire.features import feature_bits

SESSION: Final = 1
"""Session of HELLO and INFO in recordings made here: equal shows make equal files."""

DEFAULT_MAX_PAYLOAD: Final = 1024
"""Longest payload that small boards take."""

_MAX_TIME = 0xFFFF_FFFF
_MAX_META_BYTES = spec.LIMIT_MAX_PAYLOAD


_FIRST_OF_1_1 = spec.FEATURE_SLABS  # protocol.md, section 15
# All but HOLD: a frame is due when its FRAME says so.
_DRAWING = (
    *("line", "box", "dots", "oct", "diff", "arc", "palette"),
    *("slabs", "fade", "arc2", "values"),
)
# Range coding saves bytes on slow lines, but small boards lack it and it takes long.
_USUAL = ("line", "box", "dots", "oct", "diff", "palette")
_OF_INDEX8 = ("diff", "palette")
_NOT_OF_MONO1 = ("fade", "values")


def drawing_features(format_: PixelFormat, wanted: Collection[str] = _USUAL) -> tuple[str, ...]:
    """Return the features of a recording that draw and that a pixel format allows.

    Parameters
    ----------
    format_ : PixelFormat
    wanted : collection of str
        Others are left out. By default those that small boards have, too.

    """
    unfit = {
        *(() if format_ is PixelFormat.INDEX8 else _OF_INDEX8),
        *(_NOT_OF_MONO1 if format_ is PixelFormat.MONO1 else ()),
    }
    return tuple(name for name in _DRAWING if name in wanted and name not in unfit)


@dataclass(frozen=True)
class RecordingFormat:
    """The device that a recording is encoded for, and the rate of its frames.

    Attributes
    ----------
    grid : Grid
    format : PixelFormat
    millihertz : int
        Frames in 1000 seconds, at least 1.
    features : tuple of str
        Those whose ops the payloads may use.
    max_payload : int
        Bytes of the longest payload.
    loop : bool
        Whether the end is meant to be followed by the beginning.
    meta : mapping
        Further keys of META, such as ``name``.

    """

    grid: Grid
    format: PixelFormat
    millihertz: int
    features: tuple[str, ...] = ()
    max_payload: int = DEFAULT_MAX_PAYLOAD
    loop: bool = False
    meta: Mapping[str, Any] = field(default_factory=dict)

    def time_of(self, number: int) -> int:
        """Return when a frame is due, in units of 0.1 ms: n / fps, from its number alone."""
        return (2 * number * TIME_UNITS * 1000 + self.millihertz) // (2 * self.millihertz)

    def number_at(self, time: int) -> int:
        """Return the number of the frame that is due nearest to a time in units of 0.1 ms."""
        unit = 1000 * TIME_UNITS
        return (2 * time * self.millihertz + unit) // (2 * unit)

    def encode(self) -> bytes:
        """Return the bytes at the beginning of a file: 00, HELLO, INFO and META.

        Raises
        ------
        VoxDisplayError
            If META is longer than a packet.

        """
        meta = {"version": recording_spec.RECORDING_VERSION, "loop": self.loop, **self.meta}
        text = json.dumps(meta, ensure_ascii=False, separators=(",", ":")).encode()
        if len(text) > _MAX_META_BYTES:
            raise VoxDisplayError(
                f"META has {len(text)} bytes, at most {_MAX_META_BYTES} fit a packet",
                hint="leave out the scene, or shorten the texts",
            )
        nx, ny, nz = self.grid
        bits = feature_bits(self.features)
        minor = spec.VERSION_MINOR if bits >> _FIRST_OF_1_1 else 0
        info = packet.Info(
            major=spec.VERSION_MAJOR,
            session=SESSION,
            boot=0,
            minor=minor,
            format=self.format.wire,
            nx=nx,
            ny=ny,
            nz=nz,
            pages=2,
            max_payload=self.max_payload,
            rx_buffer=spec.LIMIT_RESERVE
            + packet.max_wire_bytes(self.max_payload + spec.LIMIT_OVERHEAD),
            refresh=self.millihertz,
            features=bits,
        )
        hello = packet.Hello(session=SESSION, minor=minor)
        segment = encode_segment(recording_spec.RECORDING_TYPE_META, 0, 0, 0, text)
        return b"\0" + packet.encode(hello) + packet.encode(info) + segment


class RecordingWriter:
    """Writer of one recording: use it in a ``with`` block, which completes the file.

    After an exception in the block, ``NAME.part`` is left as it is; its whole frames can be
    recovered.

    Parameters
    ----------
    path : path
        Of the file. An older one is replaced when the new one is complete.
    format : RecordingFormat

    Raises
    ------
    VoxDisplayError
        If the file cannot be written.

    """

    def __init__(self, path: str | os.PathLike[str], format: RecordingFormat) -> None:  # noqa: A002 - as of Frame
        self.path = Path(path)
        self.format = format
        self.part = self.path.with_name(self.path.name + ".part")
        self._sizes: list[int] = []
        self._seq = 0
        head = format.encode()
        try:
            self._file = self.part.open("wb")
            self._file.write(head)
        except OSError as error:
            raise _unwritable(self.part, error) from error
        self._start = self._offset = len(head)

    @property
    def frame_count(self) -> int:
        """Number of frames written."""
        return len(self._sizes)

    def append(
        self, frame: EncodedFrame, time: int | None = None, others: Iterable[Segment] = ()
    ) -> None:
        """Write the next frame.

        Parameters
        ----------
        frame : EncodedFrame
            Payloads of at most ``format.max_payload`` bytes.
        time : int, optional
            When it is due, in units of 0.1 ms, if not by its number.
        others : iterable of Segment
            Packets of other kinds, which are kept behind it.

        """
        number = len(self._sizes)
        due = self.format.time_of(number) if time is None else time
        if due > _MAX_TIME:
            raise VoxDisplayError(
                f"frame {number} is due after {due / TIME_UNITS:.0f} s, and a recording has at "
                f"most {_MAX_TIME / TIME_UNITS:.0f} s",
                hint="record it in parts, and play them by a playlist",
            )
        payloads = frame.payloads or (b"",)
        size = sum(map(len, payloads))
        data = [FrameHeader(number % 256, due, frame.digest, size).encode()]
        for at, payload in enumerate(payloads):
            flags = spec.DATA_FLAG_CLEAR
            if at == len(payloads) - 1:
                flags |= spec.DATA_FLAG_COMMIT
            data.append(encode_segment(spec.TYPE_DATA, flags, self._seq, number % 256, payload))
            self._seq = (self._seq + 1) % 256
        data += [
            encode_segment(other.kind, other.flags, other.seq, other.frame, other.payload)
            for other in others
        ]
        self._write(data)
        self._sizes.append(sum(map(len, data)))

    def _write(self, data: list[bytes]) -> None:
        try:
            self._file.writelines(data)
        except OSError as error:
            raise _unwritable(self.part, error) from error
        self._offset += sum(map(len, data))

    def close(self) -> None:
        """Write index and END, and give the file its name."""
        index = self._offset
        self._write(encode_index(self._start, self._sizes, self.format.max_payload))
        count = len(self._sizes)
        duration = min(self.format.time_of(count), _MAX_TIME)
        self._write([End(index, count, duration).encode()])
        try:
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            self.part.replace(self.path)
        except OSError as error:
            raise _unwritable(self.path, error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is None:
            self.close()
        else:
            self._file.close()


def _unwritable(path: Path, error: OSError) -> VoxDisplayError:
    return VoxDisplayError(
        f"cannot write {path}: {error.strerror}", hint="choose another place with -o"
    )
