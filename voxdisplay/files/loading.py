"""Bodies from files of any kind that is read here: meshes, volumes, voxel models.

The kind is found by the file's suffix. Must not know scenes and displays.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from voxdisplay.argument_checks import choice
from voxdisplay.bodies.body import Body, Fill
from voxdisplay.bodies.volume import Volume, VoxelModel
from voxdisplay.errors import BodyError
from voxdisplay.files.array_files import read_npy, read_npz, read_raw, samples_of
from voxdisplay.files.contained_files import path_inside, read_file, short_name
from voxdisplay.files.contents import ModelVoxels, VolumeSamples
from voxdisplay.files.mesh_files import UP, read_mesh
from voxdisplay.files.suffixes import MESH_KINDS, SUFFIXES, suffix_of
from voxdisplay.raster.color import Color

Up = Literal["y", "z"]

_MAX_SERIES = 1 << 13
_UP_Y = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class LoadedBody:
    """A body from a file.

    Attributes
    ----------
    body : Body
        In units of the file, z up: `fitted` places it in a display.
    notes : tuple of str
        What was left out or chosen, one line each, for people.

    """

    body: Body
    notes: tuple[str, ...] = ()


def load_body(
    path: str | os.PathLike[str],
    *,
    folder: Path | None = None,
    fill: Fill = "shell",
    up: Up | None = None,
    window: tuple[float, float] | None = None,
    threshold: float | None = None,
    map: str | Color | None = None,  # noqa: A002 - the word of scene files
    shape: Sequence[int] | None = None,
    dtype: str | None = None,
    labels: bool = False,
) -> LoadedBody:
    """Read a body from a file.

    Parameters
    ----------
    path : str or path
        The file; its suffix is one of `SUFFIXES`. A folder is a DICOM series.
    folder : Path, optional
        Where the file must lie, or below; `path` is then relative to it.
    fill : {"shell", "solid"}
        For meshes.
    up : {"y", "z"}, optional
        Axis that is up. Default: y for glTF, else z.
    window, threshold, map, labels
        For volumes: see `Volume`. Default window: the file's own, where it has one.
    shape, dtype
        For .raw: [nz, ny, nx], and the type as numpy names it.

    Returns
    -------
    LoadedBody

    Raises
    ------
    BodyError
        If the file cannot be read, or not all of it; the message names it and the reason.
    MissingExtra
        Without the library that reads this kind.

    """
    if up is not None:
        choice("up", up, ("y", "z"))
    place = Path(path) if folder is None else path_inside(folder, str(path))
    suffix = ".dcm" if place.is_dir() else suffix_of(path)
    name = short_name(path)
    if suffix is None:
        known = ", ".join(SUFFIXES)
        raise BodyError(f"{name} is no mesh, volume or voxel model: their names end in {known}")
    if suffix in MESH_KINDS:
        kind = MESH_KINDS[suffix]
        body, notes = read_mesh(name, kind, read_file(place), place.parent, fill=fill)
        turn = (up or UP.get(kind, "z")) == "y"
        if up is None and kind not in UP:
            notes = (*notes, f"{suffix} files do not say what is up: z is taken; else give up y")
        return LoadedBody(body.transformed(_UP_Y) if turn else body, notes)
    found = _read_samples(name, suffix, place, shape, dtype)
    if isinstance(found, ModelVoxels):
        model: Body = VoxelModel(found.voxels, found.colors)
        return LoadedBody(model.transformed(_UP_Y) if up == "y" else model, found.notes)
    own = found.window if window is None else window
    chosen = "gray" if map is None else map
    volume = Volume(
        found.values,
        window=own,
        threshold=threshold,
        map=chosen,
        spacing=_relative(found.spacing),
        labels=labels,
    )
    low, high = volume.window
    notes = found.notes if own else (*found.notes, f"window {low:g} to {high:g}, by its values")
    return LoadedBody(volume.transformed(_UP_Y) if up == "y" else volume, notes)


def fitted(body: Body, low: Sequence[float], high: Sequence[float]) -> tuple[Body, float]:
    """Scale a body uniformly and centre it in a box.

    Parameters
    ----------
    body : Body
        Of finite size.
    low, high : (3,)
        Corners of the box, in voxels.

    Returns
    -------
    body : Body
    scale : float
        Voxels for each unit of the body.

    Raises
    ------
    BodyError
        If the body has no end, or is a point.

    """
    start, end = body.bounds()
    room = np.asarray(high, dtype=np.float64) - np.asarray(low, dtype=np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        size = end - start
    if not (np.isfinite(size).all() and size.max() > 0):
        raise BodyError("a body without an end, or of no size, cannot be fitted")
    if not (room > 0).all():
        raise BodyError("the box to fit it into has no room")
    with np.errstate(divide="ignore", over="ignore"):
        scale = float((room / size)[size > 0].min())
    if not 1e-300 < scale < 1e300:
        raise BodyError(f"it is {size.max():g} units long, which cannot be fitted")
    offset = (np.asarray(low) + np.asarray(high)) / 2 - scale * (start + size / 2)
    return body.transformed(np.eye(3) * scale, offset), scale


def _relative(spacing: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return spacings relative to the smallest one: they may be kilometres, or micrometres."""
    least = min(spacing)
    x, y, z = (each / least for each in spacing)
    return x, y, z


def _read_samples(
    name: str,
    suffix: str,
    path: Path,
    shape: Sequence[int] | None,
    dtype: str | None,
) -> ModelVoxels | VolumeSamples:
    """Read a volume or a voxel model; libraries are imported for their own kinds alone."""
    if suffix == ".dcm":
        from voxdisplay.files.dicom_series import read_dicom  # noqa: PLC0415 - as is said above

        return read_dicom(_series(path), short_name(path))
    data = read_file(path)
    if suffix in {".nrrd", ".nhdr"}:
        from voxdisplay.files.nrrd_volume import read_nrrd  # noqa: PLC0415

        return read_nrrd(name, data, path.parent)
    if suffix in {".nii", ".nii.gz"}:
        from voxdisplay.files.nifti import read_nifti  # noqa: PLC0415

        return read_nifti(name, data)
    if suffix in {".tif", ".tiff"}:
        from voxdisplay.files.tiff_stack import read_tiff  # noqa: PLC0415

        return read_tiff(name, data)
    if suffix == ".raw":
        return read_raw(name, data, shape, dtype)
    if suffix == ".npz":
        return read_npz(name, data)
    if suffix == ".npy":
        return samples_of(name, read_npy(name, data))
    return _read_voxels(name, suffix, data)


def _read_voxels(name: str, suffix: str, data: bytes) -> ModelVoxels:
    from voxdisplay.files import magicavoxel, voxel_models  # noqa: PLC0415

    readers = {
        ".vox": magicavoxel.read_vox,
        ".qb": voxel_models.read_qb,
        ".kv6": voxel_models.read_kv6,
        ".binvox": voxel_models.read_binvox,
    }
    return readers[suffix](name, data)


def _series(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the named file of a DICOM series first, and then all others of its folder."""
    folder = path if path.is_dir() else path.parent
    if not path.is_dir():
        yield short_name(path.name), read_file(path)
    names = sorted(each.name for each in folder.iterdir() if each.is_file())
    if len(names) > _MAX_SERIES:
        raise BodyError(f"{short_name(folder)} holds more than {_MAX_SERIES} files")
    for name in names:
        other = folder / name
        if other != path and (path.is_dir() or other.suffix.lower() == path.suffix.lower()):
            path_inside(folder, name)  # links lead nowhere else
            with other.open("rb") as file:
                if file.read(132)[128:] != b"DICM":
                    continue
            yield short_name(name), read_file(other)
