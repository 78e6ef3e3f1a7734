"""``voxdisplay show``: recordings examined, repaired and converted."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from voxdisplay.cli.options import json_option, quiet_option
from voxdisplay.cli.output import note, plural, print_json, print_stdout, progress_bar
from voxdisplay.cli.param_types import PixelSizeType, RangeType
from voxdisplay.cli.show_films import MAX_FPS
from voxdisplay.errors import RecordingError

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
      voxdisplay show convert day.vxs -o day.gif
      voxdisplay show convert cube.lcanimraw -o cube.vxs
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
    help="Its suffix says what is written: .npz, an array of all frames; .vxs; .vox, MagicaVoxel; "
    ".gif, .mp4 or .html, a film.",
)
@click.option(
    "--fps",
    type=RangeType("frames per second", 0.001, 4_000_000, "25"),
    metavar="N",
    help="From .npz and .vox: frames per second; of a film: pictures per second.  [default: as in "
    "the file, else 30]",
)
@click.option(
    "--pixels",
    "size_px",
    type=PixelSizeType(),
    default="800x600",
    metavar="WxH",
    help="Size of the pictures of a film.  [default: 800x600]",
)
@quiet_option
def convert(*, file: Path, output: Path, fps: float | None, size_px: tuple[int, int]) -> None:
    """Convert FILE into another kind of file.

    FILE is a recording (.vxs), an array of frames (.npz), or an animation of MagicaVoxel (.vox) or
    of an LED cube (.lcanimraw). `preview` has more options for films.
    """
    from voxdisplay.cli.show_films import FILM_SUFFIXES, film_of  # noqa: PLC0415 - help starts fast
    from voxdisplay.shows.conversion import write_show  # noqa: PLC0415
    from voxdisplay.shows.show_files import open_show  # noqa: PLC0415

    suffix = output.suffix.lower()
    if file.suffix.lower() == suffix:
        raise click.UsageError(f"{file.name} is a file {suffix} already")
    if suffix not in FILM_SUFFIXES:
        converted = open_show(file, fps)
        if remark := write_show(converted, output):
            note(f"{output}: {remark}")
        note(f"{output}: {plural(converted.frame_count, 'frame')}")
        return
    from voxdisplay.cli.image_output import save_image  # noqa: PLC0415
    from voxdisplay.view.picture import RenderOptions  # noqa: PLC0415 - an extra
    from voxdisplay.view.save import FILM_SUFFIXES as DRAWN  # noqa: PLC0415

    if fps is not None and fps > MAX_FPS:
        raise click.BadParameter(f"{fps:g}: films have at most {MAX_FPS:g}", param_hint="--fps")
    converted = open_show(file, None)
    if not converted.frame_count:
        raise RecordingError(f"{file.name} has no whole frame")
    film = film_of(
        converted, RenderOptions(size=size_px), file.stem, fps=fps, drawn=suffix in DRAWN
    )
    with progress_bar("drawing") as progress:
        save_image(output, film, progress)
    note(f"{output}: {plural(len(film.pages), 'picture')}")


def _open(path: Path) -> Recording:
    from voxdisplay.shows.recording import Recording  # noqa: PLC0415

    try:
        return Recording(path)
    except OSError as error:
        raise click.ClickException(f"cannot read {path}: {error.strerror}") from error
