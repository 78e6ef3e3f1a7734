"""``voxdisplay preview``: a picture of a scene, without a display."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

import voxdisplay as vd
from voxdisplay.cli.image_output import (
    PictureFileType,
    PictureSizeType,
    save_picture,
    view_angle_option,
)
from voxdisplay.cli.options import (
    SizeType,
    fit_option,
)
from voxdisplay.cli.output import (
    note,
    plural,
    progress_bar,
)
from voxdisplay.cli.scene_drawing import draw

_DEFAULT_GRID = vd.Grid(128, 128, 128)
# Pixels of all pictures of a film: what a GIF takes in memory, in bytes.
_MOST_PIXELS = 1 << 29


@click.command(
    epilog="""\b
    Examples:
      voxdisplay preview curve.json -o curve.png
      voxdisplay preview curve.json -o curve.gif --size 480x360 --seconds 4
      voxdisplay preview curve.json -o small.png --display-size 16,16,32 --format mono1
    """
)
@click.argument("scene", type=click.Path())
@click.option(
    "-o",
    "--output",
    required=True,
    type=PictureFileType(),
    metavar="FILE",
    help="Where to: .png, or .gif and .mp4 that turn once, or .html to turn by hand.",
)
@click.option(
    "--size",
    "size_px",
    type=PictureSizeType(),
    default="800x600",
    show_default=True,
    metavar="WxH",
    help="The picture's size in pixels.",
)
@view_angle_option
@click.option(
    "--zoom",
    type=click.FloatRange(0.3, 2.5),
    default=1.0,
    show_default=True,
    help="Come nearer, above 1, or go away.",
)
@click.option(
    "--display-size",
    type=SizeType(),
    metavar="NX,NY,NZ",
    help="The size of the display, in voxels.  [default: the scene's, else 128,128,128]",
)
@click.option(
    "--format",
    "format_",
    type=click.Choice([format_.value for format_ in vd.PixelFormat]),
    default="rgb888",
    show_default=True,
    help="The display's pixel format.",
)
@fit_option
@click.option(
    "--seconds",
    type=click.FloatRange(0.1, 60),
    default=3.0,
    show_default=True,
    help="How long a film takes to turn once.",
)
@click.option(
    "--fps",
    type=click.FloatRange(1, 60),
    default=20.0,
    show_default=True,
    help="A film's pictures a second.",
)
@click.option("--plain", is_flag=True, help="Without box, axes and halo.")
def preview(
    *,
    scene: str,
    output: Path,
    size_px: tuple[int, int],
    view_angle: tuple[float, float] | None,
    zoom: float,
    display_size: vd.Grid | None,
    format_: str,
    fit: Literal["contain", "none"],
    seconds: float,
    fps: float,
    plain: bool,
) -> None:
    """Draw SCENE, a JSON file or - for stdin, as a display would show it.

    Needs the extra `view`: pip install 'voxdisplay[view]'.
    """
    from voxdisplay.view.picture import RenderOptions  # noqa: PLC0415 - an extra
    from voxdisplay.view.save import FILM_SUFFIXES, ExportJob  # noqa: PLC0415

    film = output.suffix.lower() in FILM_SUFFIXES
    if film and size_px[0] * size_px[1] * seconds * fps > _MOST_PIXELS:
        raise click.BadParameter(
            f"{seconds * fps:.0f} pictures of {size_px[0]}x{size_px[1]} are too many: make them "
            "smaller, or fewer by --fps or --seconds",
            param_hint="--size",
        )
    loaded = vd.load_scene(scene)
    grid = display_size or loaded.size or _DEFAULT_GRID
    fitted, remark = loaded.fitted(grid, fit)
    if remark:
        note(remark)
    frame = vd.Frame(grid, format_)
    draw(fitted, frame)
    look = RenderOptions(size=size_px, glow=not plain, axes=not plain).with_view(view_angle, zoom)
    shot = ExportJob(frame.array(), grid, frame.format, look, _title(scene), seconds, fps)
    with progress_bar("drawing") as progress:
        save_picture(output, shot, progress)
    note(f"{output}: {plural(len(frame.lit()[0]), 'voxel')} on {grid} {format_}")


def _title(scene: str) -> str:
    return "voxdisplay" if scene == "-" else Path(scene).stem
