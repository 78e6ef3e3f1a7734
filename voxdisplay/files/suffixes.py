"""Kinds of files by the ends of their names. Must not know how they are read."""

from __future__ import annotations

import os

MESH_KINDS = {
    ".stl": "stl",
    ".ply": "ply",
    ".off": "off",
    ".obj": "obj",
    ".glb": "glb",
    ".gltf": "gltf",
    ".3mf": "3mf",
}
"""Kinds of mesh files by their suffixes."""

VOLUMES = (".npy", ".npz", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".tif", ".tiff", ".dcm", ".raw")
VOXEL_MODELS = (".vox", ".qb", ".kv6", ".binvox")
SUFFIXES = (*MESH_KINDS, *VOLUMES, *VOXEL_MODELS)
"""Ends of the names of files that `load_body` reads, in lower case."""


def suffix_of(name: str | os.PathLike[str]) -> str | None:
    """Return the suffix of `SUFFIXES` with which a file's name ends; None if with none."""
    lower = str(name).lower()
    return max((each for each in SUFFIXES if lower.endswith(each)), key=len, default=None)
