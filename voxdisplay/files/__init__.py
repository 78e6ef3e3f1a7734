"""Files of meshes, volumes and voxel models: readers and writers. Must not know displays."""

from voxdisplay.files.loading import SUFFIXES, LoadedBody, fitted, load_body
from voxdisplay.files.writing import WRITERS, LitPage, write_voxels

__all__ = ["SUFFIXES", "WRITERS", "LitPage", "LoadedBody", "fitted", "load_body", "write_voxels"]
