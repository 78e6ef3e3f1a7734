"""``voxdisplay convert``: voxels of a scene or model as a file for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import voxdisplay as vd
from voxdisplay.cli.model_files import ModelOptions, load_shown, model_options
from voxdisplay.cli.options import (
    DEFAULT_SIZE_TEXT,
    display_size_option,
    fit_option,
    format_option,
    json_option,
    quiet_option,
)
from voxdisplay.cli.output import note, plural, print_json

if TYPE_CHECKING:
    from voxdisplay.frame import Fit


@click.command(
    epilog="""\b
    Examples:
      voxdisplay convert bunny.stl -o bunny.vox --fill solid --size 64x64x64
      voxdisplay convert head.nii.gz -o head.npz --window 0,1500 --map magma
      voxdisplay convert curve.json -o curve.ply
    """
)
@click.argument("file", metavar="IN", type=click.Path())
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="OUT",
    help="File to write: .npy (memory of a display), .npz (voxels and colors), .vox or .ply.",
)
@display_size_option(f"Size in voxels.  [default: the scene's, else {DEFAULT_SIZE_TEXT}]")
@format_option("Pixel format, which limits the colours.  [default: rgb888]", "rgb888")
@fit_option
@model_options
@quiet_option
@json_option
def convert(
    *,
    file: str,
    output: Path,
    size: vd.Grid | None,
    format_: str,
    fit: Fit,
    model: ModelOptions,
    as_json: bool,
) -> None:
    """Write the voxels of IN, a scene, mesh, volume or voxel model, as a file.

    The voxels are those that a display of this size would show.
    """
    from voxdisplay.cli.scene_drawing import draw_scene, fit_scene  # noqa: PLC0415 - help starts fast
    from voxdisplay.cli.voxel_output import check_suffix, save_voxels  # noqa: PLC0415

    check_suffix(output)
    loaded = load_shown(file, model)
    frame = vd.Frame(size or loaded.size or vd.Grid(128, 128, 128), format_)
    draw_scene(fit_scene(loaded, frame.grid, fit), frame)
    voxels = save_voxels(output, frame.array(), frame.format)
    if as_json:
        result: dict[str, Any] = {
            "output": str(output),
            "size": list(frame.grid),
            "format": frame.format.value,
            "voxels": voxels,
        }
        print_json(result)
    else:
        note(f"{output}: {plural(voxels, 'voxel')} of {frame.grid}")
