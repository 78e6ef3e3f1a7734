"""Scene files: reader, object types, JSON Schema, and the scenes that are drawn on frames.

It must not know displays or the wire.
"""

from voxdisplay.scene.item import SceneItem
from voxdisplay.scene.model import Scene
from voxdisplay.scene.reader import load_scene, read_scene

__all__ = ["Scene", "SceneItem", "load_scene", "read_scene"]
