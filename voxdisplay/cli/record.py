"""``voxdisplay record``: moving scenes to recordings, on all processors or many machines."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

import voxdisplay as vd
from voxdisplay.cli.options import (
    DEFAULT_SIZE_TEXT,
    display_size_option,
    fit_option,
    format_option,
    json_option,
    quiet_option,
    scene_argument,
)
from voxdisplay.cli.output import note, plural, print_json, progress_bar
from voxdisplay.cli.param_types import CountType, FeaturesType
from voxdisplay.cli.profile_options import current_profile, display_option, pitch_option

if TYPE_CHECKING:
    from voxdisplay.frame import Fit
    from voxdisplay.shows.render_engines import Engine

_SUFFIX: Final = ".vxs"


@click.command(
    epilog="""\b
    Examples:
      voxdisplay record spin.json -o spin.vxs
      voxdisplay record spin.json -o spin.vxs --size 64x64x64 --jobs 4
      voxdisplay record spin.json -o spin.vxs --display wall
      voxdisplay record spin.json -o spin.vxs --dask tcp://render:8786 --check 5
      voxdisplay play spin.vxs --port /dev/ttyUSB0

    A run that is interrupted goes on where it ended when it is started again.
    """
)
@scene_argument()
@click.option(
    "--output",
    "-o",
    "output",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    metavar="FILE.vxs",
    help="The recording; it appears when it is complete.",
)
@display_size_option(
    "Size of the display in voxels.  [default: that of the parts of --display, else the scene's, "
    f"else {DEFAULT_SIZE_TEXT}]"
)
@format_option("Pixel format of the display.  [default: rgb888]", "rgb888")
@click.option(
    "--features",
    type=FeaturesType(),
    metavar="NAMES",
    help="Features of the display that may be used, such as line,box; all; none.  "
    "[default: all that small boards have, nothing range-coded, no fades]",
)
@click.option(
    "--jobs",
    type=CountType("processes", 1024),
    default=1,
    metavar="N",
    help="Render in N processes.  [default: 1, in this process]",
)
@click.option(
    "--dask", metavar="ADDRESS", help="Render on a Dask scheduler, such as tcp://127.0.0.1:8786."
)
@click.option(
    "--check",
    "checked",
    type=CountType("frames", 1_000_000_000),
    metavar="N",
    help="Afterwards render N frames again in this process, and compare them.",
)
@fit_option
@display_option
@pitch_option
@quiet_option
@json_option
def record(
    *,
    scene: str,
    output: Path,
    size: vd.Grid | None,
    format_: str,
    features: tuple[str, ...] | None,
    jobs: int,
    dask: str | None,
    checked: int | None,
    fit: Fit,
    as_json: bool,
) -> None:
    """Record SCENE, which has a duration, as packets that a display of its size plays as they are.

    SCENE is a JSON file, or - for stdin. All ways to render give the same bytes.

    Of --display, the size of its parts together, pitch_mm and fit count. How it stands and its
    light are seen to when the recording is played.
    """
    from voxdisplay.cli.scene_drawing import fit_scene  # noqa: PLC0415 - as in push
    from voxdisplay.shows import record as recording  # noqa: PLC0415
    from voxdisplay.shows.recording_writer import (  # noqa: PLC0415
        RecordingFormat,
        drawing_features,
    )
    from voxdisplay.shows.rendering import Rendering  # noqa: PLC0415

    if output.suffix.lower() != _SUFFIX:
        raise click.UsageError(f"{output.name}: a recording is a file {_SUFFIX}")
    if dask and jobs > 1:
        raise click.UsageError("--jobs are processes of this machine: leave it out with --dask")
    began_s = time.monotonic()
    loaded = vd.load_scene(scene)
    profile = current_profile()
    grid = size or (profile.grid if profile else None) or loaded.size or vd.Grid(128, 128, 128)
    pitch = profile.output.pitch if profile and profile.output else (1.0, 1.0, 1.0)
    pixel_format = vd.PixelFormat(format_)
    fitted = fit_scene(loaded, grid, fit, pitch)
    name = "stdin" if scene == "-" else Path(scene).name
    wanted = RecordingFormat(
        grid,
        pixel_format,
        round(loaded.fps * 1000),
        drawing_features(pixel_format)
        if features is None
        else drawing_features(pixel_format, features),
        loop=loaded.loop,
        meta={"name": name, "software": f"voxdisplay {vd.__version__}"},
    )
    rendering = Rendering(fitted, wanted, own_palette="palette" in wanted.features)
    with progress_bar("record") as progress:
        frames = recording.record(rendering, output, engine=_engine(jobs, dask), progress=progress)
    compared = recording.check(rendering, output, checked) if checked else 0
    seconds = time.monotonic() - began_s
    if as_json:
        print_json(
            {
                "file": str(output),
                "frames": frames,
                "duration_s": frames / loaded.fps,
                "fps": loaded.fps,
                "bytes": output.stat().st_size,
                "checked": compared,
                "seconds": seconds,
            }
        )
        return
    also = f", {plural(compared, 'frame')} rendered again alike" if compared else ""
    size_text = f"{output.stat().st_size / max(frames, 1):.0f} bytes a frame"
    note(f"{output}: {plural(frames, 'frame')}, {size_text}{also}")


def _engine(jobs: int, dask: str | None) -> Engine:
    from voxdisplay.shows.render_engines import (  # noqa: PLC0415
        dask_scheduler,
        process_pool,
        serial,
    )

    if dask:
        return dask_scheduler(dask)
    return process_pool(jobs) if jobs > 1 else serial
