"""Loading of what can be played: scenes, recordings, other files of frames, and playlists.

Must not know displays.
"""

from __future__ import annotations

import os
from pathlib import Path

from voxdisplay.argument_checks import wrong_kind
from voxdisplay.errors import RecordingError, SceneError
from voxdisplay.scene.json_text import JsonText
from voxdisplay.scene.model import Scene
from voxdisplay.scene.reader import load_scene
from voxdisplay.shows.fixed_format_show import FixedFormatShow
from voxdisplay.shows.playable import Playable
from voxdisplay.shows.playlist import Playlist, PlaylistEntry, PlaylistFile, check_playlist
from voxdisplay.shows.recording import Recording
from voxdisplay.shows.show_files import SHOW_SUFFIXES, open_show

_MAX_PLAYLIST_BYTES = 1 << 22
_MAX_ENTRIES = 10_000  # of a playlist with those that it includes


def load_show(path: str | os.PathLike[str]) -> Playable:
    """Read a scene, a recording or a playlist.

    Parameters
    ----------
    path : str or path
        ``"-"`` is a scene on standard input.

    Raises
    ------
    SceneError, RecordingError
        If it cannot be read, or a playlist includes itself. Files of a playlist that are missing or
        wrong are left out, and stand in `Playlist.notes`.

    """
    if not isinstance(path, str | os.PathLike):
        raise wrong_kind("path", "a str or path", path)
    data = None if str(path) == "-" else _playlist_data(Path(path))
    if data is None:
        return _load_one(path)
    notes: list[str] = []
    root = _read_playlist(Path(path), data)
    entries = _entries(root, (_identity(Path(path)),), notes)
    if not entries:
        why = f": {notes[0]}" if notes else ""
        raise SceneError(f"nothing of the playlist can be played{why}", file=str(path))
    return Playlist(tuple(entries), root.repeat, root.shuffle, tuple(notes))


def _load_one(path: str | os.PathLike[str]) -> Recording | FixedFormatShow | Scene:
    """Read a file of frames or a scene; a recording by its first byte, which is 00 of one alone."""
    if str(path) != "-":
        if str(path).lower().endswith(SHOW_SUFFIXES):
            return open_show(Path(path))
        try:
            with Path(path).open("rb") as file:
                is_recording = file.read(1) == b"\0"
        except (OSError, ValueError):
            is_recording = False  # the scene's reader says what is wrong
        if is_recording:
            return Recording(path)
    return load_scene(path)


def _playlist_data(path: Path) -> str | None:
    """Return the text of a playlist; None if the file is something else, or cannot be read."""
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_PLAYLIST_BYTES + 1)
    except (OSError, ValueError):
        return None
    if b'"playlist"' not in data or len(data) > _MAX_PLAYLIST_BYTES:
        return None
    return data.decode("utf-8", "replace")


def _read_playlist(path: Path, text: str) -> PlaylistFile:
    return check_playlist(JsonText(text, str(path)).parse(), str(path))


def _identity(path: Path) -> Path:
    return path.resolve()


def _entries(file: PlaylistFile, chain: tuple[Path, ...], notes: list[str]) -> list[PlaylistEntry]:
    """Return the entries of a playlist, with those of the playlists that it includes."""
    found: list[PlaylistEntry] = []
    for item in file.items:
        path = chain[-1].parent / item.show
        identity = _identity(path)
        if identity in chain:
            raise SceneError(
                f"the playlist includes itself, by {item.show!r}",
                path=item.path,
                file=str(chain[-1]),
                hint='take that entry out; for ever is "repeat": 0',
            )
        text = _playlist_data(path)
        if text is not None:
            inner = _read_playlist(path, text)
            found += item.repeat * _entries(inner, (*chain, identity), notes) * (inner.repeat or 1)
        else:
            try:
                found.append(PlaylistEntry(item, _load_one(path)))
            except (SceneError, RecordingError) as error:
                notes.append(f"left out of the playlist: {error}")
        if len(found) > _MAX_ENTRIES:
            raise SceneError(
                f"the playlist has more than {_MAX_ENTRIES} entries with those that it includes",
                file=str(chain[0]),
            )
    return found
