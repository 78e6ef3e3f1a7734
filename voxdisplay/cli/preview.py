"""``voxdisplay preview``: a picture of a scene, without a display."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

import voxdisplay as vd
from voxdisplay.cli.model_files import ModelOptions, load_shown, model_options
from voxdisplay.cli.options import (
    DEFAULT_SIZE_TEXT,
    display_size_option,
    fit_option,
    image_file_option,
    quiet_option,
    scene_argument,
)
from voxdisplay.cli.output import note, plural, progress_bar
from voxdisplay.cli.param_types import PIXEL_FORMATS, AngleType, PixelSizeType, RangeType

if TYPE_CHECKING:
    from voxdisplay.frame import Fit
    from voxdisplay.raster.grid import Grid

# Pixels of all pictures of a film: what a GIF takes in memory, in bytes.
_MAX_PIXELS: Final = 1 << 29


@click.command(
    epilog="""\b
    Examples:
      voxdisplay preview curve.json -o curve.png
      voxdisplay preview curve.json -o curve.gif --pixels 480x360 --seconds 4
      voxdisplay preview curve.json -o small.png --size 16x16x32 --format mono1
    """
)
@scene_argument()
@image_file_option(
    "-o",
    "--output",
    help_text="File to write: .png, or .gif and .mp4 that turn once, or .html to turn by hand.",
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
    "pitch looks from above.  [default: -34,24]",
)
@click.option(
    "--zoom",
    type=RangeType("times", 0.3, 2.5, "1.5"),
    default=1.0,
    metavar="FACTOR",
    help="0.3 to 2.5; above 1 is nearer.  [default: 1]",
)
@display_size_option(
    f"Size of the display in voxels.  [default: the scene's, else {DEFAULT_SIZE_TEXT}]",
    for_two="; --pixels is the size of the picture",
)
@click.option(
    "--format",
    "format_",
    type=click.Choice(PIXEL_FORMATS),
    default="rgb888",
    help="Pixel format of the display.  [default: rgb888]",
)
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
    default=20.0,
    metavar="FPS",
    help="Pictures per second of a film, 1 to 60.  [default: 20]",
)
@click.option("--plain", is_flag=True, help="Draw without box, axes and halo.")
@quiet_option
def preview(
    *,
    scene: str,
    output: Path,
    size_px: tuple[int, int],
    view_angle: tuple[float, float] | None,
    zoom: float,
    size: Grid | None,
    format_: str,
    fit: Fit,
    model: ModelOptions,
    seconds: float,
    fps: float,
    plain: bool,
) -> None:
    """Draw SCENE, a JSON file or - for stdin, as a display would show it.

    Needs the extra `view`: pip install 'voxdisplay[view]'.
    """
    from voxdisplay.cli.image_output import save_image  # noqa: PLC0415 - help starts fast
    from voxdisplay.cli.scene_drawing import draw_scene, load_fitted_scene  # noqa: PLC0415
    from voxdisplay.raster.pixel_map import PixelMap  # noqa: PLC0415
    from voxdisplay.view.picture import RenderOptions  # noqa: PLC0415 - an extra
    from voxdisplay.view.save import FILM_SUFFIXES, ExportJob  # noqa: PLC0415

    film = output.suffix.lower() in FILM_SUFFIXES
    if film and size_px[0] * size_px[1] * seconds * fps > _MAX_PIXELS:
        raise click.BadParameter(
            f"{seconds * fps:.0f} pictures of {size_px[0]}x{size_px[1]} are too many: make them "
            "smaller, or fewer by --fps or --seconds",
            param_hint="--pixels",
        )
    fitted, grid = load_fitted_scene(load_shown(scene, model), size, fit)
    frame = vd.Frame(grid, format_)
    draw_scene(fitted, frame)
    options = RenderOptions(size=size_px, glow=not plain, axes=not plain)
    options = options.with_view(view_angle, zoom)
    title = "voxdisplay" if scene == "-" else Path(scene).stem
    job = ExportJob(PixelMap(*frame.lit()), grid, frame.format, options, title, seconds, fps)
    with progress_bar("drawing") as progress:
        save_image(output, job, progress)
    note(f"{output}: {plural(len(frame.lit()[0]), 'voxel')} on {grid} {format_}")
