"""Files of meshes, volumes and voxel models: readers and writers. Must not know displays.

Names are imported when they are first used: a command that shows a scene loads no reader.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from voxdisplay.files.loading import LoadedBody, fitted, load_body
    from voxdisplay.files.suffixes import SUFFIXES
    from voxdisplay.files.writing import WRITERS, LitPage, write_voxels

__all__ = ["SUFFIXES", "WRITERS", "LitPage", "LoadedBody", "fitted", "load_body", "write_voxels"]

# The module of each name.
_MODULES = {
    "LoadedBody": "loading",
    "fitted": "loading",
    "load_body": "loading",
    "SUFFIXES": "suffixes",
    "WRITERS": "writing",
    "LitPage": "writing",
    "write_voxels": "writing",
}

if not TYPE_CHECKING:  # a type checker would take any name of a module that has __getattr__

    def __getattr__(name: str) -> object:
        """Import a name when it is first used."""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
        globals()[name] = value
        return value
