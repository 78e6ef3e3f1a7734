"""``voxdisplay voxelize``: the sequences of a scene as CSV, numpy array or JSON."""

from __future__ import annotations

import csv
import json
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

import voxdisplay as vd
from voxdisplay.cli.image_output import cannot_write
from voxdisplay.cli.options import json_option, quiet_option, scene_argument
from voxdisplay.cli.output import note, plural, print_json, redirect_to_null
from voxdisplay.cli.param_types import RangeType, SizeType

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from voxdisplay.scene.item import SceneItem

_COLUMNS: Final = ("object", "x", "y", "z")
_STEP: Final = RangeType("step", 0, 1e6, "0.25")


@click.command(
    name="voxelize",
    epilog="""\b
    Examples:
      voxdisplay voxelize curve.json > voxels.csv
      voxdisplay voxelize curve.json -o voxels.npy --clip 128x128x128
      voxdisplay voxelize curve.json --certified --json
      voxdisplay voxelize curve.json --method march --variant 2 --pitch 0.1 --json
    """,
)
@scene_argument()
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write a .csv, .npy (int32, N x 4) or .json file. Columns: object, x, y, z.",
)
@click.option(
    "--method",
    type=click.Choice(["grid-plane", "march"]),
    default="grid-plane",
    help="Grid-plane intersection, which guarantees connectivity and error, or the paper's march "
    "along the tangent.  [default: grid-plane]",
)
@click.option(
    "--variant",
    type=click.Choice(["1", "2", "3"]),
    default="3",
    help="How the march finds distances: 1 by a search, 2 by a finer one, 3 by a parabola.  "
    "[default: 3]",
)
@click.option(
    "--tangent",
    type=click.Choice(["analytic", "difference"]),
    help="Source of the tangents of the march.  [default: analytic, if there is a derivative]",
)
@click.option(
    "--pitch",
    type=_STEP,
    metavar="STEP",
    help="Step of the march's search for the nearest point: in degrees where t is an angle around "
    "z, as in the paper, else in voxels.  [default: 0.5 for variant 1, else 0.25]",
)
@click.option(
    "--reach",
    type=_STEP,
    metavar="SPAN",
    help="Width of the march's search to either side, in the same unit.  [default: 2]",
)
@click.option(
    "--certified",
    is_flag=True,
    help="Prove that no feature is missed, however narrow, and report where there is no proof.",
)
@click.option(
    "--clip",
    type=SizeType(),
    metavar="NXxNYxNZ",
    help="Leave out voxels outside a display of this size.",
)
@quiet_option
@json_option
def voxelize(
    *,
    scene: str,
    output: Path | None,
    method: str,
    variant: str,
    tangent: str | None,
    pitch: float | None,
    reach: float | None,
    certified: bool,
    clip: vd.Grid | None,
    as_json: bool,
) -> None:
    """Write the voxels along the curves of SCENE, in order.

    SCENE is a JSON file, or - for stdin. Without -o and --json the voxels are printed as CSV.
    """
    from voxdisplay.cli.scene_drawing import voxelize_scene  # noqa: PLC0415 - help starts fast

    if output and output.suffix not in _WRITERS:
        raise click.BadParameter(
            f"{output} should end in {', '.join(_WRITERS)}", param_hint="--output"
        )
    options = _voxelize_options(method, int(variant), tangent, pitch, reach, certified)
    loaded = vd.load_scene(scene)
    items = loaded.items
    began_s = time.perf_counter()
    sequences = voxelize_scene(loaded, clip=clip, **options)
    seconds = time.perf_counter() - began_s
    for number, (item, sequence) in enumerate(zip(items, sequences, strict=True)):
        if isinstance(sequence, vd.Sequence) and isinstance(sequence.proof, str):
            note(f"object {number} ({item.type}) is not certified: {sequence.proof}")
        elif certified and isinstance(sequence, vd.VoxelSet) and not sequence.certified:
            said = "; ".join(sequence.notes)
            note(f"object {number} ({item.type}) is not certified" + (said and f": {said}"))
    kept = [_kept(sequence, clip) for sequence in sequences]
    rows = _rows(kept)
    if output:
        try:
            _WRITERS[output.suffix](output, rows)
        except OSError as failure:
            raise cannot_write(output, failure) from failure
    if as_json:
        objects = [
            _report(number, item, sequence, len(sequence) - len(voxels))
            for number, (item, sequence, voxels) in enumerate(
                zip(items, sequences, kept, strict=True)
            )
        ]
        print_json({"objects": objects, "voxels": len(rows), "seconds": round(seconds, 6)})
    elif output:
        note(f"{output}: {plural(len(rows), 'voxel')} of {plural(len(items), 'object')}")
    else:
        try:
            _write_csv(sys.stdout, rows)
            sys.stdout.flush()
        except BrokenPipeError:  # the reader has enough
            redirect_to_null(sys.stdout)


def _voxelize_options(
    method: str,
    variant: int,
    tangent: str | None,
    pitch: float | None,
    reach: float | None,
    certified: bool,
) -> dict[str, Any]:
    """Return the options of `voxdisplay.voxelize`, or raise if they exclude each other."""
    if method == "march":
        if certified:
            raise click.BadParameter(
                "there is no proof for the march: use --method grid-plane", param_hint="--certified"
            )
        from voxdisplay.voxelization import tangent_march  # noqa: PLC0415

        try:
            pitch, reach = tangent_march.search_steps(variant, pitch, reach)
        except ValueError as error:
            raise click.BadParameter(str(error), param_hint="--pitch, --reach") from error
    elif pitch is not None or reach is not None:
        raise click.BadParameter(
            "only the march searches by steps: add --method march",
            param_hint="--reach" if pitch is None else "--pitch",
        )
    return {
        "method": method,
        "variant": variant,
        "tangent": tangent,
        "pitch": pitch,
        "reach": reach,
        "certified": certified,
    }


def _kept(sequence: vd.Sequence | vd.VoxelSet, clip: vd.Grid | None) -> NDArray[np.int32]:
    return sequence.voxels if clip is None else sequence.voxels[clip.inside(sequence.voxels)]


def _rows(kept: list[NDArray[np.int32]]) -> NDArray[np.int32]:
    """Return columns object, x, y, z: (N, 4)."""
    import numpy as np  # noqa: PLC0415

    counts = [len(voxels) for voxels in kept]
    numbers = np.repeat(np.arange(len(kept), dtype=np.int32), counts)
    return np.column_stack((numbers, np.concatenate([np.empty((0, 3), np.int32), *kept])))


def _report(
    number: int, item: SceneItem, voxels: vd.Sequence | vd.VoxelSet, clipped: int
) -> dict[str, Any]:
    facts: dict[str, Any] = {"object": number, "type": item.type}
    if isinstance(voxels, vd.Sequence):
        return facts | _sequence_report(item, voxels, clipped)
    report = voxels.report
    return facts | {
        "kind": voxels.kind,
        "voxels": len(voxels),
        "e_max": _rounded(report.e_max),
        "e_av": _rounded(report.e_av),
        "tunnels": report.tunnels,
        "cover": _rounded(report.cover),
        "minimum": report.minimum,
        "thickness": _rounded(report.thickness),
        "enclosed": report.enclosed,
        "clipped": clipped,
        "seconds": round(voxels.seconds, 6),
        "certified": voxels.certified,
        "notes": list(voxels.notes),
    }


def _rounded(value: float | None) -> float | None:
    """Return a figure for JSON, which has no infinite numbers."""
    return None if value is None or not math.isfinite(value) else round(value, 6)


def _sequence_report(item: SceneItem, sequence: vd.Sequence, clipped: int) -> dict[str, Any]:
    from voxdisplay.cli.scene_drawing import with_object  # noqa: PLC0415

    if not len(sequence):  # a part of a curve may be nothing
        return {"kind": "curve", "voxels": 0, "clipped": 0, "seconds": round(sequence.seconds, 6)}
    report = with_object(item, lambda: sequence.report)
    return {
        "kind": "curve",
        "voxels": report.voxels,
        "closed": report.closed,
        "pieces": report.pieces,
        "e_max": round(report.e_max, 6),
        "e_av": round(report.e_av, 6),
        "gaps": report.gaps,
        "contacts": report.contacts,
        "clipped": clipped,
        "seconds": round(report.seconds, 6),
        "certified": report.certified,
        "undefined": [
            {"axis": point.axis, "t": point.t, "jump": point.jump} for point in report.undefined
        ],
        "jumps": list(report.jumps),
    }


def _write_csv(stream: Any, rows: NDArray[np.int32]) -> None:
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(_COLUMNS)
    writer.writerows(rows.tolist())


def _save_csv(path: Path, rows: NDArray[np.int32]) -> None:
    with path.open("w", encoding="ascii") as stream:
        _write_csv(stream, rows)


def _save_npy(path: Path, rows: NDArray[np.int32]) -> None:
    import numpy as np  # noqa: PLC0415

    np.save(path, rows)


def _save_json(path: Path, rows: NDArray[np.int32]) -> None:
    path.write_text(json.dumps({"columns": _COLUMNS, "voxels": rows.tolist()}), encoding="ascii")


_WRITERS: dict[str, Callable[[Path, NDArray[np.int32]], None]] = {
    ".csv": _save_csv,
    ".npy": _save_npy,
    ".json": _save_json,
}
