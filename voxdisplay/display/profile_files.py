"""Files of display profiles: where they are, and how they are read, listed and written.

Must not know what their keys mean.
"""

from __future__ import annotations

import json
import os
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from voxdisplay.argument_checks import wrong_kind
from voxdisplay.display.profile import DisplayProfile, read_profile
from voxdisplay.errors import ProfileError, did_you_mean
from voxdisplay.view.atomic_write import atomic_write

SUFFIX: Final = ".toml"
_MAX_BYTES: Final = 1 << 16


def _toml(value: Any) -> str:
    """Return a value of a profile as TOML; its texts and lists are written as in JSON."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def profile_folder() -> Path:
    """Return the folder of the user's profiles, which may not exist."""
    if sys.platform == "win32":
        base = os.environ.get("APPDATA") or str(Path.home() / "AppData" / "Roaming")
    else:
        base = os.environ.get("XDG_CONFIG_HOME") or str(Path.home() / ".config")
    return Path(base) / "voxdisplay" / "displays"


def profile_path(name: str) -> Path:
    """Return the file of a profile, by its name or by a path that ends in ``.toml``.

    Raises
    ------
    ProfileError
        If the name is none.

    """
    if name.lower().endswith(SUFFIX):
        return Path(name)
    if not name or name.startswith(".") or any(mark in name for mark in "/\\:\0"):
        raise ProfileError(
            f"{name!r} is no name of a display profile",
            hint=f"name a file of {profile_folder()}, or write a path that ends in {SUFFIX}",
        )
    return profile_folder() / f"{name}{SUFFIX}"


def profile_names() -> list[str]:
    """Return the names of the user's profiles, in order."""
    try:
        return sorted(
            path.stem for path in profile_folder().iterdir() if path.suffix.lower() == SUFFIX
        )
    except OSError:
        return []


def as_profile(display: Any) -> DisplayProfile:
    """Return the profile of a name, a path, a mapping of keys, or a profile itself.

    Raises
    ------
    TypeError
        If it is something else.
    ProfileError
        If the profile is not there, or wrong.

    """
    if isinstance(display, DisplayProfile):
        return display
    if isinstance(display, Mapping):
        return read_profile(display)
    if isinstance(display, os.PathLike):
        return load_profile(str(Path(os.fsdecode(display)).absolute()))
    if isinstance(display, str):
        return load_profile(display)
    raise wrong_kind("display", "a name, a path or a mapping of keys", display)


def load_profile(name: str) -> DisplayProfile:
    """Read a profile.

    Parameters
    ----------
    name : str
        As of `profile_path`.

    Raises
    ------
    ProfileError
        If there is no such file, or it is wrong.

    """
    path = profile_path(name)
    try:
        keys = _read_toml(path)
    except FileNotFoundError:
        raise ProfileError(
            f"there is no display profile {path}",
            hint=did_you_mean(name, profile_names())
            or "voxdisplay displays lists them; test-pattern --ask NAME writes one",
        ) from None
    return read_profile(keys, str(path))


def _read_toml(path: Path) -> dict[str, Any]:
    """Return the keys of a file.

    Raises
    ------
    FileNotFoundError
        If there is none.
    ProfileError
        If it cannot be read.

    """
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_BYTES + 1)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ProfileError(f"{path} cannot be read: {reason}") from None
    if len(data) > _MAX_BYTES:
        raise ProfileError(f"{path} is larger than {_MAX_BYTES} bytes: it is no display profile")
    try:
        return tomllib.loads(data.decode())
    except UnicodeDecodeError:
        raise ProfileError(f"{path} is no UTF-8 text") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ProfileError(f"{path} is no TOML: {error}") from None


def profile_keys(path: Path) -> dict[str, Any] | None:
    """Return the keys of a file that is a profile; None if there is no file.

    Raises
    ------
    ProfileError
        If there is one, and it is no profile.

    """
    try:
        keys = _read_toml(path)
    except FileNotFoundError:
        return None
    read_profile(keys, str(path))
    return keys


def save_profile(path: Path, keys: Mapping[str, Any]) -> None:
    """Write a profile; a file that is there is replaced as a whole.

    Raises
    ------
    OSError
        If it cannot be written.

    """
    lines = [f"{key} = {_toml(value)}\n" for key, value in keys.items()]
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as unfinished:
        unfinished.write_text("".join(lines), encoding="utf-8")
