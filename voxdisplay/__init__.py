"""Drive a volumetric display: curves to voxels to packets, and proof of what is shown.

>>> import voxdisplay as vd
>>> curve = vd.Circle(center=(32, 32, 32), radius=20)
>>> with vd.open("sim:?size=64x64x64") as display:
...     frame = display.frame()
...     drawing = frame.draw(curve, color="orange")
...     receipt = display.present(frame)
"""

from importlib.metadata import version as _version

from voxdisplay.curves import (
    Arc,
    Bezier,
    BSpline,
    CatmullRom,
    Circle,
    Curve,
    Ellipse,
    Helix,
    Lissajous,
    Parametric,
    Points,
    Polyline,
    Segment,
    TorusKnot,
)
from voxdisplay.display.connect import open  # noqa: A004 - vd.open(port)
from voxdisplay.display.device_info import DeviceInfo
from voxdisplay.display.display import Display, Receipt
from voxdisplay.errors import (
    CurveError,
    DesyncError,
    DeviceError,
    IncompatibleDevice,
    LocalProtocolError,
    MissingExtra,
    OpenError,
    ProtocolError,
    RemoteProtocolError,
    SceneError,
    TransportClosed,
    TransportError,
    TransportTimeout,
    VoxDisplayError,
)
from voxdisplay.frame import Drawing, Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.scene import Scene, load_scene, read_scene
from voxdisplay.voxelization import Report, Sequence, voxelize, voxelize_many

__version__ = _version("voxdisplay")

__all__ = [
    "Arc",
    "BSpline",
    "Bezier",
    "CatmullRom",
    "Circle",
    "Curve",
    "CurveError",
    "DesyncError",
    "DeviceError",
    "DeviceInfo",
    "Display",
    "Drawing",
    "Ellipse",
    "Frame",
    "Grid",
    "Helix",
    "IncompatibleDevice",
    "Lissajous",
    "LocalProtocolError",
    "MissingExtra",
    "OpenError",
    "Parametric",
    "PixelFormat",
    "Points",
    "Polyline",
    "ProtocolError",
    "Receipt",
    "RemoteProtocolError",
    "Report",
    "Scene",
    "SceneError",
    "Segment",
    "Sequence",
    "TorusKnot",
    "TransportClosed",
    "TransportError",
    "TransportTimeout",
    "VoxDisplayError",
    "load_scene",
    "open",
    "read_scene",
    "voxelize",
    "voxelize_many",
]
