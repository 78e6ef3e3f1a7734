"""Scene files: what they may say, and the curves and colours they mean.

Knows curves, colours and the grid; does not know voxels, frames or displays.
"""

from voxdisplay.scene.model import Scene, SceneItem
from voxdisplay.scene.reader import load_scene, read_scene

__all__ = ["Scene", "SceneItem", "load_scene", "read_scene"]
