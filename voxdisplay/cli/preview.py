"""``voxdisplay preview``: a picture of a scene, without a display."""

from __future__ import annotations

import threading
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

import voxdisplay as vd
from voxdisplay.cli.model_files import ModelOptions, load_shown, model_options
from voxdisplay.cli.options import (
    DEFAULT_SIZE_TEXT,
    display_size_option,
    fit_option,
    format_option,
    image_file_option,
    quiet_option,
    scene_argument,
)
from voxdisplay.cli.output import note, plural, progress_bar
from voxdisplay.cli.param_types import AngleType, PixelSizeType, RangeType

if TYPE_CHECKING:
    from voxdisplay.frame import Fit
    from voxdisplay.raster.grid import Grid
    from voxdisplay.view.film import FilmJob

_FPS: Final = 20.0  # of a film that turns once


@click.command(
    epilog="""\b
    Examples:
      voxdisplay preview curve.json -o curve.png
      voxdisplay preview curve.json -o curve.gif --pixels 480x360 --seconds 4
      voxdisplay preview spin.json -o spin.mp4
      voxdisplay preview spin.json -o moment.png --at 1.5
      voxdisplay preview curve.json -o curve.png --watch
      voxdisplay preview curve.json -o small.png --size 16x16x32 --format mono1
    """
)
@scene_argument()
@image_file_option(
    "-o",
    "--output",
    help_text="File to write: .png, or .gif and .mp4 that turn once, or .html to turn by hand; "
    "of a scene that has a duration its film.",
    required=True,
)
@click.option(
    "--pixels",
    "size_px",
    type=PixelSizeType(),
    default="800x600",
    metavar="WxH",
    help="Size of the picture in pixels.  [default: 800x600]",
)
@click.option(
    "--view-angle",
    type=AngleType(),
    metavar="YAW,PITCH",
    help="View direction in degrees: 0,0 is from the front, x to the right and z up; a greater "
    "pitch looks from above.  [default: the scene's, else -34,24]",
)
@click.option(
    "--zoom",
    type=RangeType("times", 0.3, 2.5, "1.5"),
    metavar="FACTOR",
    help="0.3 to 2.5; above 1 is nearer.  [default: the scene's, else 1]",
)
@display_size_option(
    f"Size of the display in voxels.  [default: the scene's, else {DEFAULT_SIZE_TEXT}]",
    for_two="; --pixels is the size of the picture",
)
@format_option("Pixel format of the display.  [default: rgb888]", "rgb888")
@fit_option
@model_options
@click.option(
    "--seconds",
    type=RangeType("seconds", 0.1, 60, "4"),
    default=3.0,
    metavar="SECONDS",
    help="Time in which a film turns once, 0.1 to 60.  [default: 3]",
)
@click.option(
    "--fps",
    type=RangeType("frames per second", 1, 60, "25"),
    metavar="FPS",
    help="Pictures per second of a film, 1 to 60.  [default: 20, or those of a moving scene]",
)
@click.option(
    "--at",
    "at_s",
    type=RangeType("seconds", 0, 1e9, "1.5"),
    metavar="SECONDS",
    help="Of a scene that has a duration: the picture at this time.  [default: its beginning; a "
    "film shows all of it]",
)
@click.option("--plain", is_flag=True, help="Draw without box, axes and halo.")
@click.option(
    "--watch",
    is_flag=True,
    help="Draw again whenever SCENE is saved, until Ctrl-C. What cannot "
    "be read leaves the last picture as it is.",
)
@quiet_option
def preview(*, scene: str, watch: bool, **options: Any) -> None:
    """Draw SCENE, a JSON file or - for stdin, or a recording, as a display would show it.

    Needs the extra `view`: pip install 'voxdisplay[view]'.
    """
    from voxdisplay.cli.followed_file import FollowedFile  # noqa: PLC0415 - help starts fast

    if watch and scene == "-":
        raise click.UsageError("--watch: stdin cannot be followed; name a file")
    file = FollowedFile(scene)

    draw = partial(_draw, scene, **options)
    draw()
    if watch:
        note(f"{scene} is followed: Ctrl-C ends that")
        file.follow(draw, threading.Event())


def _draw(
    scene: str,
    output: Path,
    *,
    size_px: tuple[int, int],
    view_angle: tuple[float, float] | None,
    zoom: float | None,
    size: Grid | None,
    format_: str,
    fit: Fit,
    model: ModelOptions,
    seconds: float,
    fps: float | None,
    at_s: float | None,
    plain: bool,
) -> None:
    """Draw a scene once, as the options of `preview` say."""
    from voxdisplay.cli.image_output import save_image  # noqa: PLC0415 - help starts fast
    from voxdisplay.cli.scene_drawing import (  # noqa: PLC0415
        best_seen,
        draw_scene,
        load_fitted_scene,
    )
    from voxdisplay.cli.show_films import (  # noqa: PLC0415
        FILM_SUFFIXES,
        check_film_size,
        film_of,
        frame_at,
        is_show_file,
        open_show_file,
    )
    from voxdisplay.raster.pixel_map import PixelMap  # noqa: PLC0415
    from voxdisplay.view.picture import RenderOptions  # noqa: PLC0415 - an extra
    from voxdisplay.view.save import FILM_SUFFIXES as TURNED  # noqa: PLC0415
    from voxdisplay.view.save import ExportJob  # noqa: PLC0415

    suffix = output.suffix.lower()
    if suffix in TURNED:
        check_film_size(seconds * (fps or _FPS), size_px)
    options = RenderOptions(size=size_px, glow=not plain, axes=not plain)
    title = "voxdisplay" if scene == "-" else Path(scene).stem
    show, frame = None, vd.Frame((1, 1, 1))
    if is_show_file(scene):
        load_shown(scene, model)  # refuses options of models
        show = open_show_file(scene, size, format_, fit)
        frame = frame_at(show, at_s or 0.0)
    else:
        fitted, grid = load_fitted_scene(load_shown(scene, model), size, fit)
        options = best_seen(fitted, options)
        frame = vd.Frame(grid, format_)
        if fitted.duration:
            show = fitted.show_on(frame, fit="none")
    options = options.with_view(view_angle, zoom)
    made: ExportJob | FilmJob
    if show and at_s is None and suffix in FILM_SUFFIXES:
        made = film_of(show, options, title, fps=fps, drawn=suffix in TURNED)
        what = plural(len(made.pages), "picture")
    else:
        if not is_show_file(scene):
            draw_scene(_at(fitted, at_s), frame)
        made = ExportJob(
            PixelMap(*frame.lit()), frame.grid, frame.format, options, title, seconds, fps or _FPS,
            frame.palette,
        )  # fmt: skip
        what = plural(len(frame.lit()[0]), "voxel")
    with progress_bar("drawing") as progress:
        save_image(output, made, progress)
    note(f"{output}: {what} on {frame.grid} {format_}")


def _at(scene: vd.Scene, at_s: float | None) -> vd.Scene:
    """Return a scene at a time, or at its beginning."""
    if at_s is None:
        return scene
    if not scene.duration:
        raise click.UsageError("--at: the scene does not move: it has no duration")
    if at_s > scene.duration:
        raise click.UsageError(f"--at {at_s:g}: the scene lasts {scene.duration:g} s")
    return scene.at(at_s)
