"""Questions of ``test-pattern --ask``: how a display stands, by lights that its owner looks at.

Writes a display profile. Must not know how an orientation is applied.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, Final

import click

from voxdisplay.cli.output import note, print_stdout

if TYPE_CHECKING:
    from pathlib import Path

    import voxdisplay as vd

# Directions, as a person sees a display: the user's axis, and whether it runs the other way.
_DIRECTIONS: Final = {
    "right": (0, False), "left": (0, True),
    "away": (1, False), "towards": (1, True),
    "up": (2, False), "down": (2, True),
}  # fmt: skip
_LONGEST_ANSWER: Final = 80


def prepare_profile(name: str) -> tuple[Path, dict[str, Any]]:
    """Return the file to write and the keys that it has; ask before a file is replaced.

    Raises
    ------
    ProfileError
        If the name is none, or the file is no profile.
    click.ClickException
        If it is not to be replaced.

    """
    from voxdisplay.display.profile_files import profile_keys, profile_path  # noqa: PLC0415

    path = profile_path(name)
    keys = profile_keys(path)
    if keys is None:
        return path, {}
    if "parts" in keys:
        raise click.ClickException(
            f"{path} is made of parts: ask of each with --port and another name, and copy its axes"
        )
    if _answer(f"{path} exists: replace its axes (yes, no)?", ["yes", "no"]) == "no":
        raise click.ClickException(f"{path} was left as it is")
    return path, keys


def _answer(question: str, known: list[str]) -> str:
    """Ask on the terminal until the answer is one of some words, or begins one of them.

    Raises
    ------
    click.ClickException
        If no more answers come.

    """
    stdin = sys.stdin
    while True:
        click.echo(f"{question} ", nl=False, err=True)
        line = stdin.readline(_LONGEST_ANSWER)
        if not line:
            click.echo(err=True)
            raise click.ClickException("no answer came on stdin: nothing was written")
        word = line.strip().lower()
        if found := [each for each in known if word and each.startswith(word)]:
            return found[0]
        click.echo(f"please answer with one of {', '.join(known)}", err=True)


def ask_axes(display: vd.Display, brightness: float) -> list[str]:
    """Show where each axis of the memory runs, and return where the user's axes run in it.

    By arrows, or on a small display by layers at the far ends. An axis of one voxel has no
    direction: it gets what is left, so that nothing is mirrored.

    Parameters
    ----------
    display : Display
        As its memory is.
    brightness : float
        0 to 1.

    Raises
    ------
    click.ClickException
        If the display has one voxel, or no more answers come.

    """
    from voxdisplay.display.test_patterns import (  # noqa: PLC0415 - help starts fast
        arrow_frame,
        has_room_for_arrows,
    )

    info = display.info
    asked = [axis for axis in range(3) if info.grid[axis] > 1]
    count = len(asked)
    if not count:
        raise click.ClickException(f"a display of {info.grid} looks the same however it stands")
    if has_room_for_arrows(info.grid):
        shown, question = "Three arrows are shown, one by one.", "Arrow {}: where does it point"
    else:
        shown = "It is small: one side of it is lit at a time."
        question = "Light {}: which side is lit"
    note(f"Look at the display from where it is usually seen. {shown}")
    found: dict[int, str] = {}
    for number, axis in enumerate(asked, 1):
        display.present(arrow_frame(axis, info.grid, info.format, brightness))
        left = [each for each, (user, _) in _DIRECTIONS.items() if user not in found]
        text = f"{question.format(f'{number} of {count}')} ({', '.join(left)})?"
        user, flips = _DIRECTIONS[_answer(text, left)]
        found[user] = ("-" if flips else "") + "xyz"[axis]
    return _completed(found)


def _completed(found: dict[int, str]) -> list[str]:
    """Return three axes, of which some are known by the user's; the others mirror nothing."""
    from voxdisplay.raster.orientation import Orientation  # noqa: PLC0415 - help starts fast

    users = [user for user in range(3) if user not in found]
    known = {each[-1] for each in found.values()}
    names = dict(zip(users, [each for each in "xyz" if each not in known], strict=True))
    axes = [(found | names)[user] for user in range(3)]
    if users and Orientation.of(axes).mirrors:
        axes[users[0]] = f"-{axes[users[0]]}"
    return axes


def write_profile(
    path: Path, keys: dict[str, Any], port: str | None, serial: str, axes: list[str]
) -> None:
    """Write a profile, with what it had before.

    Parameters
    ----------
    path : Path
    keys : dict
        Those of the file that is there.
    port : str or None
        The port that was named, if any.
    serial : str
        Serial number of the device, if it has one.
    axes : list of str

    Raises
    ------
    click.ClickException
        If the file cannot be written.

    """
    from voxdisplay.display.profile_files import save_profile  # noqa: PLC0415 - help starts fast
    from voxdisplay.raster.orientation import Orientation  # noqa: PLC0415

    added = {"port": port, "serial": serial or None}
    keys = keys | {key: value for key, value in added.items() if value} | {"axes": axes}
    try:
        save_profile(path, keys)
    except OSError as error:
        raise click.ClickException(
            f"{path} cannot be written: {error.strerror or error}"
        ) from error
    orientation = Orientation.of(axes)
    if orientation.mirrors:
        note(
            "by these answers the display mirrors what its memory holds. If letters look right on "
            "it, one answer was wrong: ask again"
        )
    print_stdout(f"{path}: axes {orientation}")
