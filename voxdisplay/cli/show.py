"""``voxdisplay show``: recordings examined, repaired and converted."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from voxdisplay.cli.options import json_option, quiet_option
from voxdisplay.cli.output import note, plural, print_json, print_stdout
from voxdisplay.cli.param_types import RangeType

if TYPE_CHECKING:
    from voxdisplay.shows.recording import Recording

_file_argument = click.argument("file", type=click.Path(path_type=Path))


@click.group(
    epilog="""\b
    Examples:
      voxdisplay show info day.vxs
      voxdisplay show repair day.vxs.part -o day.vxs
      voxdisplay show convert day.vxs -o day.npz
      voxdisplay show convert frames.npz -o day.vxs
    """
)
def show() -> None:
    """Examine, repair or convert recordings of moving scenes (.vxs)."""


@show.command()
@_file_argument
@json_option
def info(*, file: Path, as_json: bool) -> None:
    """Print length, size and format of FILE, and whether it is whole."""
    recording = _open(file)
    facts = {
        "frames": recording.frame_count,
        "duration_s": recording.duration,
        "fps": recording.fps,
        "grid": list(recording.format.grid),
        "format": recording.format.format.value,
        "bytes": recording.bytes,
        "whole": recording.whole,
        "loop": recording.loop,
        "features": list(recording.format.features),
        "max_payload_bytes": recording.format.max_payload,
        "meta": dict(recording.format.meta),
    }
    if as_json:
        print_json(facts)
        return
    features = ", ".join(recording.format.features) or "none"
    print_stdout(
        f"{plural(recording.frame_count, 'frame')}, {recording.duration:g} s at "
        f"{recording.fps:g} fps{', in a loop' if recording.loop else ''}\n"
        f"for displays of {recording.format.grid} {recording.format.format.value}, features: "
        f"{features}\n"
        f"{recording.bytes} bytes, {recording.bytes / max(recording.frame_count, 1):.0f} a frame"
    )
    for key, value in recording.format.meta.items():
        print_stdout(f"{key}: {value}")
    if not recording.whole:
        note(
            f"{file.name} is cut off or damaged: {plural(recording.whole_frames, 'whole frame')} "
            f"found; voxdisplay show repair {file} keeps them"
        )


@show.command()
@_file_argument
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Where to write it.  [default: NAME.repaired.vxs beside FILE]",
)
@quiet_option
@json_option
def repair(*, file: Path, output: Path | None, as_json: bool) -> None:
    """Copy the whole frames of FILE, which is cut off or damaged, into a whole recording."""
    from voxdisplay.shows.recording_copy import copy_whole_frames  # noqa: PLC0415

    recording = _open(file)
    stem = file.name.removesuffix(".part").removesuffix(".vxs")
    target = output or file.with_name(f"{stem}.repaired.vxs")
    result = copy_whole_frames(recording, target)
    if as_json:
        print_json({"file": str(target), "frames": result.frames, "lost": result.lost})
        return
    lost = f", {plural(result.lost, 'frame')} lost" if result.lost else ""
    note(f"{target}: {plural(result.frames, 'frame')}{lost}")


@show.command()
@_file_argument
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    metavar="FILE",
    help="Its suffix says what is written: .npz, an array of all frames; .vxs; .gif, .mp4.",
)
@click.option(
    "--fps",
    type=RangeType("frames per second", 0.001, 4_000_000, "25"),
    metavar="N",
    help="From .npz: frames per second.  [default: as in the file, else 30]",
)
@quiet_option
def convert(*, file: Path, output: Path, fps: float | None) -> None:
    """Convert FILE, a recording or an .npz of frames, into another kind of file."""
    from voxdisplay.shows.conversion import convert_show  # noqa: PLC0415

    frames = convert_show(file, output, fps=fps)
    note(f"{output}: {plural(frames, 'frame')}")


def _open(path: Path) -> Recording:
    from voxdisplay.shows.recording import Recording  # noqa: PLC0415

    try:
        return Recording(path)
    except OSError as error:
        raise click.ClickException(f"cannot read {path}: {error.strerror}") from error
