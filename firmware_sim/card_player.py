"""Player of a recording from a card: feeds its packets to the device's receiver (recording.md, 6).

Reads the file in sectors, as a board would from a card, and goes by the device's refresh ticks.
Knows nothing of what is drawn.
"""

import json
import struct
from dataclasses import dataclass
from typing import BinaryIO, Final

from firmware_sim import spec
from firmware_sim.config import FEATURES, Config
from firmware_sim.device import Device
from firmware_sim.memory import FORMATS
from firmware_sim.receiver import Receiver
from firmware_sim.sender import encode_packet
from firmware_sim.session import Session

_SECTOR: Final = 512
_TYPE_FRAME: Final = 6  # recording.md, section 1
_TYPE_END: Final = 7
_TYPE_META: Final = 12
_FLAG_LAST: Final = 1
_VERSION: Final = 1  # section 2
_FRAME: Final = struct.Struct("<IIIB")
_END: Final = struct.Struct("<QII")
_INFO: Final = struct.Struct("<BHHBBHHHBBHIII")
_UNITS_MILLI: Final = 10_000_000  # units of time in 1000 seconds
_LONGEST: Final = spec.LIMIT_MAX_PAYLOAD + spec.LIMIT_OVERHEAD
_HEAD_PACKETS: Final = 16  # HELLO, INFO and META are among so many


@dataclass(frozen=True)
class ShowHead:
    """Contents of INFO and META at the beginning of a recording.

    Parameters
    ----------
    grid
        (nx, ny, nz).
    pixel_format
        ``"mono1"``, ``"index8"``, ``"rgb565"`` or ``"rgb888"``.
    features
        Bits of the features whose ops it may use.
    max_payload
        Bytes of its longest payload.
    loop
        True if its end is meant to be followed by the beginning.
    """

    grid: tuple[int, int, int]
    pixel_format: str
    features: int
    max_payload: int
    loop: bool

    def check(self, config: Config) -> None:
        """Raise ValueError if a device cannot play the recording."""
        if (self.grid, self.pixel_format) != (config.grid, config.pixel_format):
            size = "x".join(map(str, self.grid))
            raise ValueError(
                f"the recording is of {size} {self.pixel_format}: leave out --size and --format"
            )
        missing = [
            name
            for name, bit in FEATURES.items()
            if (self.features & ~config.feature_bits) >> bit & 1
        ]
        if missing:
            raise ValueError(f"the recording needs the features {', '.join(missing)}")
        if self.max_payload > config.max_payload:
            raise ValueError(
                f"the recording has payloads of {self.max_payload} bytes, the device takes "
                f"{config.max_payload}"
            )


class Packets:
    """Packets of a file, one after the other, read in sectors.

    Parameters
    ----------
    file
        Opened for reading bytes; it must allow to go back to the beginning.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.rewind()

    def rewind(self) -> None:
        """Go back to the beginning."""
        self._file.seek(0)
        self._receiver = Receiver(_LONGEST)
        self._sector = b""
        self._at = 0

    def next(self) -> bytes | None:
        """Return header and payload of the next packet; None at the end of the file."""
        while True:
            if self._at == len(self._sector):
                self._sector, self._at = self._file.read(_SECTOR), 0
                if not self._sector:
                    return None
            self._at = self._receiver.read(self._sector, self._at)
            if self._receiver.packet is not None:
                return self._receiver.packet


def read_head(packets: Packets) -> ShowHead:
    """Read what a recording says at its beginning, and go back there.

    Raises
    ------
    ValueError
        If the file is no recording, or one of another version.
    """
    info = None
    for _ in range(_HEAD_PACKETS):
        packet = packets.next()
        if packet is None:
            break
        if packet[0] >> 4 == spec.TYPE_INFO and len(packet) >= 3 + _INFO.size:
            info = _INFO.unpack_from(packet, 3)
        elif packet[0] >> 4 == _TYPE_META and info:
            packets.rewind()
            return _head(info, packet[3:])
    raise ValueError("it does not begin with INFO and META: it is no recording")


def _head(info: tuple[int, ...], meta: bytes) -> ShowHead:
    try:
        keys = json.loads(meta)
    except (ValueError, RecursionError):
        raise ValueError("its META is no JSON") from None
    version = keys.get("version") if isinstance(keys, dict) else None
    if version != _VERSION:
        raise ValueError(f"it is of version {version!r}, this program plays version {_VERSION}")
    major, code, grid = info[0], info[4], info[5:8]
    names = [name for name, form in FORMATS.items() if form.code == code]
    if major != spec.VERSION_MAJOR or not names:
        raise ValueError("its INFO is of another protocol, or of an unknown pixel format")
    if info[13] >> spec.FEATURE_HOLD & 1:
        raise ValueError("its INFO has the feature HOLD, which recordings must not use")
    nx, ny, nz = grid
    return ShowHead((nx, ny, nz), names[0], info[13], info[10], keys.get("loop") is True)


@dataclass(frozen=True)
class _Frame:
    """A frame of the file: when it is due, its digest, and flags and payload of its packets."""

    time: int
    digest: int
    data: list[tuple[int, bytes]]


class CardPlayer:
    """Player of one recording on one device, until a host opens a session.

    Parameters
    ----------
    device
        The device.
    file
        The recording.
    loop
        True to begin again at the end; None as the recording says.

    Attributes
    ----------
    rate : int
        Ticks in 1000 seconds: units of time of the recording if the device has no ticks.
    due : int or None
        Number of the tick after which there is something to feed; None when it has ended.
    shown, wrong, skipped : int
        Number of frames that were exchanged, of those with another digest than recorded, and of
        those left out, because they are damaged or another one is due at the same tick.

    Raises
    ------
    ValueError
        If the file is no recording, or not of this device.
    """

    def __init__(self, device: Device, file: BinaryIO, loop: bool | None = None) -> None:
        self._device = device
        self._packets = Packets(file)
        head = read_head(self._packets)
        head.check(device.config)
        self._loop = head.loop if loop is None else loop
        self.rate = device.config.refresh or _UNITS_MILLI
        self._session: Session | None = None
        self._base: int | None = None  # tick at which the first frame is exchanged
        self._past = 0  # time of the rounds before this one
        self._seq = self._id = 0
        self._header: bytes | None = None  # FRAME that has been read
        self._digest: int | None = None  # of the frame that waits for its tick
        self._end_time = 0
        self.due: int | None = 0
        self.shown = self.wrong = self.skipped = 0
        self._next = self._read_frame()
        if self._next is None:
            raise ValueError("it has no frames")

    @property
    def active(self) -> bool:
        """True until it has ended, or a host has opened a session of its own."""
        return self.due is not None and self._device.session is self._session

    def exchanged(self) -> None:
        """Compare the page on display with the recording: to be called after each swap."""
        if self._digest is not None and self.active:
            self.shown += 1
            self.wrong += self._device.memory.front.digest != self._digest
        self._digest = None

    def feed(self, tick: int) -> None:
        """Feed what is due.

        Parameters
        ----------
        tick
            Number of the last tick that has passed.
        """
        if not self.active:
            self.due = None
        elif self._base is None:
            self._base = tick + 1
            self._begin()
        while self.due is not None and self.due <= tick:
            frame = self._next
            if frame is None:
                self._restart()
                continue
            self._next = self._read_frame()
            self._set_due()
            if self._next and self.due <= tick:
                self.skipped += 1
            else:
                self._feed_frame(frame)

    def _restart(self) -> None:
        """Begin again, or end."""
        if not self._loop:
            self.due = None
            return
        self._past += self._end_time
        self._packets.rewind()
        self._next = self._read_frame()
        self._begin()

    def _begin(self) -> None:
        self._open_session()
        self._set_due()

    def _set_due(self) -> None:
        """Find the tick after which the next frame, or the end of the round, is due."""
        time = self._past + (self._next.time if self._next else self._end_time)
        # Times are rounded: half a unit before them a tick is right, too.
        ticks = -((1 - 2 * time) * self.rate // (2 * _UNITS_MILLI))
        due = (self._base or 0) - 1 + ticks
        if self._next is None and self.due is not None:
            due = max(due, self.due + 1)  # the last frame is exchanged before
        self.due = due

    def _open_session(self) -> None:
        self._seq = self._id = 0
        hello = struct.pack("<BHBB", spec.VERSION_MAJOR, 1, spec.VERSION_MINOR, 0)
        self._give(encode_packet(spec.TYPE_HELLO, 0, 0, 0, hello))
        self._session = self._device.session

    def _feed_frame(self, frame: _Frame) -> None:
        self._digest = frame.digest
        for flags, payload in frame.data:
            self._give(encode_packet(spec.TYPE_DATA, flags, self._seq, self._id, payload))
            self._seq = (self._seq + 1) % 256
        self._id = (self._id + 1) % 256

    def _give(self, data: bytes) -> None:
        self._device.receive(data)
        self._device.transmit()  # nobody reads the responses

    def _read_frame(self) -> _Frame | None:
        """Read the next whole frame; None at the end of the file."""
        data: list[tuple[int, bytes]] = []
        while (packet := self._packets.next()) is not None:
            kind, flags = packet[0] >> 4, packet[0] & 15
            if kind == spec.TYPE_DATA:
                data.append((flags, packet[3:]))
            elif kind == _TYPE_FRAME and len(packet) >= 3 + _FRAME.size:
                header, self._header = self._header, packet
                if frame := self._frame(header, data):
                    return frame
                data = []
            elif kind == _TYPE_END and flags & _FLAG_LAST and len(packet) >= 3 + _END.size:
                self._end_time = _END.unpack_from(packet, 3)[2]
                break
        header, self._header = self._header, None
        return self._frame(header, data)

    def _frame(self, header: bytes | None, data: list[tuple[int, bytes]]) -> _Frame | None:
        """Return a frame if all of its packets are there."""
        if header is None:
            return None
        time, digest, size, _ = _FRAME.unpack_from(header, 3)
        self._end_time = max(self._end_time, time + 1)
        commits = [flags & spec.DATA_FLAG_COMMIT for flags, _ in data]
        if sum(len(payload) for _, payload in data) == size and any(commits[-1:]):
            return _Frame(time, digest, data)
        self.skipped += 1
        return None
