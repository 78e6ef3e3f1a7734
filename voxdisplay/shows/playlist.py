"""Playlists: entries with their parts, speeds and fades, and the schedule that they make.

Must not read files or know displays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from voxdisplay.errors import SceneError, did_you_mean
from voxdisplay.frame import Drawable, Fit, Frame
from voxdisplay.shows.fade import FadedShow
from voxdisplay.shows.frame_schedule import FrameSchedule, Segment
from voxdisplay.shows.playable import bind_show
from voxdisplay.shows.show import Show, ShowSource

_STILL_S: Final = 5.0
_ENTRY_KEYS: Final = ("show", "repeat", "speed", "fade", "from", "until")
_FILE_KEYS: Final = ("playlist", "repeat", "shuffle")
_MAX_REPEAT: Final = 10_000


@dataclass(frozen=True, slots=True)
class PlaylistItem:
    """One entry as its file says it.

    Attributes
    ----------
    show : str
        A file, beside the playlist's.
    path : str
        Its JSON path, for errors.
    repeat : int
    speed, fade_s, start_s, until_s : float

    """

    show: str
    path: str
    repeat: int = 1
    speed: float = 1.0
    fade_s: float = 0.0
    start_s: float = 0.0
    until_s: float = math.inf


@dataclass(frozen=True, slots=True)
class PlaylistFile:
    """Contents of one file: its entries, how often they are repeated (0: for ever), and order."""

    items: tuple[PlaylistItem, ...]
    repeat: int = 1
    shuffle: bool = False


@dataclass(frozen=True, slots=True)
class PlaylistEntry:
    """One entry, and what it plays."""

    item: PlaylistItem
    source: Show | ShowSource | Drawable


@dataclass(frozen=True, slots=True)
class Playlist:
    """Shows in a row.

    Attributes
    ----------
    entries : tuple of PlaylistEntry
    repeat : int
        How often all are played; 0: for ever.
    shuffle : bool
        Whether each turn has another order.
    notes : tuple of str
        What was left out, one line each, for people.

    """

    entries: tuple[PlaylistEntry, ...]
    repeat: int = 1
    shuffle: bool = False
    notes: tuple[str, ...] = ()

    def schedule_on(
        self, blank: Frame, *, fit: Fit = "contain", until_s: float | None = None
    ) -> FrameSchedule:
        """See `ScheduleSource.schedule_on`."""
        if until_s is not None:
            raise ValueError("until: a playlist ends its entries where its file says")
        segments = []
        for entry in self.entries:
            item = entry.item
            show = bind_show(entry.source, blank, fit)
            until_s = item.until_s
            if show.frame_count == 1 and math.isinf(until_s):
                until_s = item.start_s + _STILL_S
            segment = Segment(show, item.start_s, until_s, item.speed)
            if item.fade_s:
                faded = FadedShow(show, item.start_s, segment.end_s, item.fade_s * item.speed)
                segment = Segment(faded, item.start_s, until_s, item.speed)
            segments += [segment] * item.repeat
        return FrameSchedule(segments, self.repeat, shuffle=self.shuffle)


def check_playlist(value: Any, file: str) -> PlaylistFile:
    """Return a playlist from the value of its JSON text.

    Raises
    ------
    SceneError
        If something in it is wrong; it names the place.

    """
    if not isinstance(value, dict):
        raise SceneError("a playlist is an object with the key playlist", path="$", file=file)
    _check_keys(value, _FILE_KEYS, "$", file)
    listed = value["playlist"]
    if not isinstance(listed, list) or not listed:
        raise SceneError("expected a list of entries", path="$.playlist", file=file)
    items = tuple(_item(each, f"$.playlist[{k}]", file) for k, each in enumerate(listed))
    shuffle = value.get("shuffle", False)
    if not isinstance(shuffle, bool):
        raise SceneError("expected true or false", path="$.shuffle", file=file)
    return PlaylistFile(items, _count(value, "repeat", 0, "$", file), shuffle)


def _item(value: Any, path: str, file: str) -> PlaylistItem:
    if isinstance(value, str):
        value = {"show": value}
    if not isinstance(value, dict) or not isinstance(value.get("show"), str) or not value["show"]:
        raise SceneError('expected the name of a file, or {"show": the name}', path=path, file=file)
    _check_keys(value, _ENTRY_KEYS, path, file)
    start_s = _number(value, "from", 0.0, path, file)
    until_s = _number(value, "until", math.inf, path, file)
    if until_s <= start_s:
        raise SceneError(
            f"until is {until_s:g} and from {start_s:g}: nothing is between",
            path=f"{path}.until",
            file=file,
        )
    speed = _number(value, "speed", 1.0, path, file)
    if not speed:
        raise SceneError("expected a number above 0", path=f"{path}.speed", file=file)
    return PlaylistItem(
        value["show"],
        path,
        _count(value, "repeat", 1, path, file),
        speed,
        _number(value, "fade", 0.0, path, file),
        start_s,
        until_s,
    )


def _check_keys(value: dict[str, Any], known: tuple[str, ...], path: str, file: str) -> None:
    for key in value:
        if key not in known:
            hint = did_you_mean(key, known) or f"there are {', '.join(known)}"
            raise SceneError(f"unknown key {key[:40]!r}", path=path, file=file, hint=hint)


def _count(value: dict[str, Any], key: str, least: int, path: str, file: str) -> int:
    found = value.get(key, 1)
    is_whole = isinstance(found, int) and not isinstance(found, bool)
    if not is_whole or not least <= found <= _MAX_REPEAT:
        wanted = f"expected a whole number from {least} to {_MAX_REPEAT}"
        raise SceneError(wanted, path=f"{path}.{key}", file=file)
    return int(found)


def _number(value: dict[str, Any], key: str, default: float, path: str, file: str) -> float:
    if key not in value:
        return default
    found = value[key]
    if isinstance(found, bool) or not isinstance(found, int | float) or not 0 <= found < 1e9:
        raise SceneError("expected a number from 0 to 1e9", path=f"{path}.{key}", file=file)
    return float(found)
