"""Drive a volumetric display: curves to voxels to packets, and proof of what is shown.

>>> import voxdisplay as vd
>>> curve = vd.Circle(center=(32, 32, 32), radius=20)
>>> with vd.open("sim:?size=64x64x64") as display:
...     frame = display.frame()
...     drawing = frame.draw(curve, color="orange")
...     receipt = display.present(frame)
"""

# The public names are imported when they are first used (PEP 562): a command that prints its help
# loads no numpy. Type checkers read the imports below instead; a test holds that they, the table of
# modules and __all__ agree.
TYPE_CHECKING = False  # by its name true for type checkers; typing itself takes long to import
if TYPE_CHECKING:
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

    __version__: str

# The module of each public name.
_MODULES = {
    "voxdisplay.curves": [
        "Arc",
        "Bezier",
        "BSpline",
        "CatmullRom",
        "Circle",
        "Curve",
        "Ellipse",
        "Helix",
        "Lissajous",
        "Parametric",
        "Points",
        "Polyline",
        "Segment",
        "TorusKnot",
    ],
    "voxdisplay.display.connect": [
        "open",
    ],
    "voxdisplay.display.device_info": [
        "DeviceInfo",
    ],
    "voxdisplay.display.display": [
        "Display",
        "Receipt",
    ],
    "voxdisplay.errors": [
        "CurveError",
        "DesyncError",
        "DeviceError",
        "IncompatibleDevice",
        "LocalProtocolError",
        "MissingExtra",
        "OpenError",
        "ProtocolError",
        "RemoteProtocolError",
        "SceneError",
        "TransportClosed",
        "TransportError",
        "TransportTimeout",
        "VoxDisplayError",
    ],
    "voxdisplay.frame": [
        "Drawing",
        "Frame",
    ],
    "voxdisplay.raster.grid": [
        "Grid",
    ],
    "voxdisplay.raster.pixel_format": [
        "PixelFormat",
    ],
    "voxdisplay.scene": [
        "Scene",
        "load_scene",
        "read_scene",
    ],
    "voxdisplay.voxelization": [
        "Report",
        "Sequence",
        "voxelize",
        "voxelize_many",
    ],
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}
# Modules that are attributes of the package without an import of their own.
_SUBMODULES = ("curves", "display", "errors", "frame", "raster", "scene", "voxelization")

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


if not TYPE_CHECKING:  # a type checker would take any name of a module that has __getattr__

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used."""
        from importlib import import_module  # noqa: PLC0415 - nothing is imported before its use

        if name == "__version__":
            value = import_module("importlib.metadata").version("voxdisplay")
        elif name in _MODULE_OF:
            value = getattr(import_module(_MODULE_OF[name]), name)
        elif name in _SUBMODULES:
            return import_module(f"{__name__}.{name}")
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        """List the public names, imported or not."""
        return sorted({*globals(), *__all__, "__version__"})
