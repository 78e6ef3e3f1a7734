"""``voxdisplay play``: play moving scenes, recordings and playlists on a display."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final, Literal, TextIO

import click

import voxdisplay as vd
from voxdisplay.cli.options import (
    capture_option,
    fit_option,
    json_option,
    on_exit_option,
    open_display,
    port_options,
    quiet_option,
    reconnect_option,
)
from voxdisplay.cli.output import (
    exit_if_lost,
    is_quiet,
    note,
    parts_json,
    plural,
    print_json,
    print_stdout,
)
from voxdisplay.cli.param_types import RangeType, seconds_type
from voxdisplay.cli.profile_options import picture_options

if TYPE_CHECKING:
    from voxdisplay.cli.signals import OnExit
    from voxdisplay.display.baud import Baud
    from voxdisplay.display.player import Player
    from voxdisplay.frame import Fit
    from voxdisplay.shows.play_report import PlayReport
    from voxdisplay.shows.playable import Playable

_PROGRESS_S: Final = 0.25
_SEEK_S: Final = 5.0
_KEYS: Final = {
    b"\x1b[C": _SEEK_S, b"\x1b[D": -_SEEK_S, b"\x1b[A": 60.0, b"\x1b[B": -60.0,
    b"\x1bOC": _SEEK_S, b"\x1bOD": -_SEEK_S, b"\x1bOA": 60.0, b"\x1bOB": -60.0,
}  # fmt: skip


@click.command(
    epilog="""\b
    Examples:
      voxdisplay play spin.json --port /dev/ttyUSB0
      voxdisplay play spin.json growing.json --loop
      voxdisplay play evening.json --speed 0.5 --from 3 --json
    """
)
@click.argument("shows", metavar="SHOW...", type=click.Path(), nargs=-1, required=True)
@port_options
@picture_options
@fit_option
@click.option("--loop", is_flag=True, help="Begin again at the end, until q or Ctrl-C.")
@click.option(
    "--speed",
    type=RangeType("factor", 0.001, 1000, "0.5"),
    default=1.0,
    metavar="F",
    help="Seconds of the show per second.  [default: 1]",
)
@click.option(
    "--from",
    "start_s",
    type=seconds_type(0),
    default=0.0,
    metavar="SECONDS",
    help="Where to begin.  [default: 0]",
)
@click.option(
    "--until",
    "until_s",
    type=seconds_type(0),
    metavar="SECONDS",
    help="Where each SHOW ends; a still picture is shown so long.  [default: its end]",
)
@click.option(
    "--clock",
    type=click.Choice(["device", "host"]),
    default="device",
    help="device: each refresh tick of the display gets a frame, so that motion is as even as it "
    "can be. host: frames are sent by the clock of this machine.  [default: device]",
)
@click.option(
    "--late",
    type=click.Choice(["drop", "delay"]),
    default="drop",
    help="What becomes of frames that are late: they are dropped, or all that follow wait for "
    "them.  [default: drop]",
)
@quiet_option
@reconnect_option
@on_exit_option
@capture_option
@json_option
def play(
    *,
    shows: tuple[str, ...],
    port: str | None,
    baud: Baud,
    timeout_s: float,
    fit: Literal["contain", "none", "content"],
    loop: bool,
    speed: float,
    start_s: float,
    until_s: float | None,
    clock: Literal["device", "host"],
    late: Literal["drop", "delay"],
    reconnect_s: float,
    on_exit: OnExit,
    capture: TextIO | None,
    as_json: bool,
) -> None:
    """Play each SHOW in turn: a scene that moves, a recording, or a playlist.

    One SHOW that says "loop": true is played for ever; several are, each once, unless --loop.
    On a terminal, space pauses, the arrows seek by 5 and 60 seconds, and q ends it. The digest of
    every frame is known before it is shown, and compared.
    """
    from voxdisplay.cli.keyboard import open_keyboard  # noqa: PLC0415 - help starts fast
    from voxdisplay.cli.signals import close_on_exit  # noqa: PLC0415

    loaded = _load(shows)
    display = open_display(port, baud, timeout_s, reconnect_s=reconnect_s, capture=capture)
    with close_on_exit(display, on_exit), open_keyboard() as keyboard, _progress() as progress:
        _note_fits(loaded, display.frame(), fit)

        def observe(player: Player) -> None:
            for key in keyboard.pressed():
                _handle_key(key, player)
            progress(player)

        try:
            report = display.play(
                loaded,
                speed=speed,
                start=start_s,
                until=until_s,
                loop=True if loop else None,
                clock=clock,
                late=late,
                fit=fit,
                observer=observe,
            )
        except ValueError as error:
            if type(error) is not ValueError:  # a scene's errors are ValueErrors, too
                raise
            raise click.UsageError(str(error)) from error
    if as_json:
        print_json(report.as_json() | parts_json(display))
    else:
        print_stdout(_summary(report, answers=display.answers))
    exit_if_lost(display)


def _load(paths: tuple[str, ...]) -> Playable:
    """Read all shows before the port is opened; note what is left out."""
    from voxdisplay.shows.loading import load_show  # noqa: PLC0415
    from voxdisplay.shows.playlist import Playlist  # noqa: PLC0415
    from voxdisplay.shows.sequence import ShowSequence  # noqa: PLC0415

    loaded = [load_show(path) for path in paths]
    for each in loaded:
        if isinstance(each, Playlist):
            for remark in each.notes:
                note(remark)
    return loaded[0] if len(loaded) == 1 else ShowSequence(tuple(loaded))


def _note_fits(loaded: Playable, blank: vd.Frame, fit: Fit) -> None:
    """Note how shows that were made for other displays are changed, each way once."""
    remarks = (_fit_remark(each, blank, fit) for each in _single_shows(loaded))
    for remark in dict.fromkeys(remarks):
        if remark:
            note(remark)


def _single_shows(loaded: Any) -> Iterator[Any]:
    """Yield all shows of sequences and playlists."""
    from voxdisplay.shows.playlist import Playlist  # noqa: PLC0415
    from voxdisplay.shows.sequence import ShowSequence  # noqa: PLC0415

    if isinstance(loaded, ShowSequence):
        for each in loaded.shows:
            yield from _single_shows(each)
    elif isinstance(loaded, Playlist):
        for entry in loaded.entries:
            yield entry.source
    else:
        yield loaded


def _fit_remark(show: Any, blank: vd.Frame, fit: Fit) -> str | None:
    if isinstance(show, vd.Scene):  # to fit contents, all of a scene would be measured
        if fit == "content":
            return None
        return show.placement_for(blank.grid, fit, blank.pitch)[1]
    if not hasattr(show, "pixel_format"):
        return None
    made_for = f"{show.grid} {show.pixel_format.value}"
    here = f"{blank.grid} {blank.format.value}"
    if made_for == here:
        return None
    return f"recorded for {made_for}; decoded, and encoded again for {here}"


def _handle_key(key: bytes, player: Player) -> None:
    if key == b" ":
        player.pause()
    elif key in (b"q", b"Q"):
        player.stop()
    elif key in _KEYS:
        player.seek(_KEYS[key])


@contextlib.contextmanager
def _progress() -> Iterator[Callable[[Player], None]]:
    """Yield a function that prints the position, and frames per second asked and shown."""
    stream = sys.stderr
    if is_quiet() or not stream.isatty():
        yield lambda _player: None
        return
    due_s, before = 0.0, (0.0, 0)

    def update(player: Player) -> None:
        nonlocal due_s, before
        now = time.monotonic()
        if now < due_s:
            return
        due_s = now + _PROGRESS_S
        passed_s, shown = now - before[0], player.shown - before[1]
        before = now, player.shown
        state = "paused" if player.paused else f"{shown / passed_s:4.1f} shown"
        total_s = player.schedule.duration_s
        of = "" if total_s == float("inf") else f" of {total_s:.1f}"
        stream.write(f"\r{player.position_s:7.1f}{of} s   {player.asked_fps:g} fps asked, {state}"
                     "\x1b[K")  # fmt: skip
        stream.flush()

    try:
        yield update
    finally:
        stream.write("\r\x1b[K")
        stream.flush()


def _summary(report: PlayReport, *, answers: bool) -> str:
    late, gap = report.late_ms, report.gap_ms
    done = "shown" if answers else "sent"
    shown = (
        f"{plural(report.shown, 'frame')} of {report.frames} {done} in {report.seconds:.1f} s: "
        f"{report.fps:.1f} fps, {plural(report.dropped, 'frame')} dropped, "
        f"{plural(report.wire_bytes, 'byte')}"
    )
    pace = (
        f"late by {late['p50']:g} ms, 95 % by less than {late['p95']:g} ms; "
        f"between frames {gap['p5']:g} to {gap['p95']:g} ms"
    )
    lines = [shown, pace] if report.shown > 1 else [shown]
    if report.wrong:
        lines.append(
            f"{plural(report.wrong, 'frame')} shown wrongly, after which the display was right "
            f"again {plural(report.repaired, 'time')}"
        )
    if not answers:
        lines.append("not proved: nothing answers on this port")
    return "\n".join(lines)
