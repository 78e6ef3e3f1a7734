"""Drive a volumetric display: curves to voxels to packets, and proof of what is shown.

>>> import voxdisplay as vd
>>> curve = vd.Circle(center=(32, 32, 32), radius=20)
>>> with vd.open("sim:?size=64x64x64") as display:
...     frame = display.frame()
...     drawing = frame.draw(curve, color="orange")
...     receipt = display.present(frame)

Displays and frames: ``help(voxdisplay.Display)`` and so on says more of each.

    open                Open a display by the name of its port.
    Display             An open display: frames in, proof of what is shown out.
    DeviceInfo          What a device announced: grid, format, features.
    Receipt             Figures of a frame that was shown.
    PlayReport          Figures of a show that was played.
    load_show           Read a scene, a recording or a playlist to play.
    Recording           Show from a file, encoded already.
    Frame               One picture: draw on it, set it, save it, present it.
    Drawing             Voxel counts of one drawn object.
    Grid                Size of a display in voxels.
    PixelFormat         Pixel formats of displays: mono1, index8, rgb565, rgb888.
    volume_pixels       Pixels of an array of any real numbers, for Frame.set.

What to draw: points are (x, y, z) in voxels; the first voxel of an axis spans 0 to 1.

    Parametric          Curve by formulas or by a callable.
    Segment             Straight line between two points.
    Polyline            Straight lines through points.
    Points              Ordered list of points, joined by straight lines.
    Circle              Circle in a plane.
    Arc                 Part of a circle.
    Ellipse             Ellipse in a plane.
    Helix               Helix around an axis.
    Lissajous           Sine oscillation of each axis.
    TorusKnot           (p, q) knot on a torus.
    Bezier              Bezier curve of any degree.
    BSpline             B-spline; with weights, a NURBS curve.
    CatmullRom          Smooth curve through points.
    Curve               Base class, for curves of one's own.
    Mesh                Triangles between vertices.
    Triangle            Single triangle.
    Polygon             Flat region inside of a ring of straight lines.
    Box                 Box along the axes.
    Plane               Plane, as far as the display goes.
    Scatter             Points without an order, each in its voxel.
    Disc                Flat disc.
    Sphere              Sphere or ball.
    Ellipsoid           Ellipsoid along the axes.
    SphericalTriangle   Triangle of great circles.
    Cylinder            Cylinder with its ends.
    Cone                Cone with its base.
    HeightField         Surface z = f(x, y).
    Text                Letters of a font, flat or extruded.
    Volume              Samples of real numbers, shown by a colour map.
    VoxelModel          Voxels with colours of their own.
    Implicit            Surface or solid by f(x, y, z).
    Surface             Surface by formulas of u and v.
    Torus               Torus.
    Tube                Tube about a curve.
    Body                Base class of surfaces, solids and voxel models.
    Scene               Coloured curves, as read from a scene file.
    load_scene          Read a scene from a file.
    read_scene          Read a scene from the text of a scene file.

From curves and bodies to voxels.

    voxelize            Return the voxels along a curve, or those of a body.
    voxelize_many       Return the voxels along many curves, faster than one by one.
    Sequence            Ordered, 26-connected voxels along a curve.
    VoxelSet            Voxels of a body, without an order.
    Report              Distances, gaps and contacts of a sequence.

Errors.

    VoxDisplayError     Base of all of them; ``hint`` says what to do.
    TransportError      The byte pipe failed.
    OpenError           A port cannot be opened.
    TransportClosed     The pipe was closed or unplugged in use.
    TransportTimeout    Nothing came, or could be sent, in time.
    ProtocolError       Base of the two below.
    LocalProtocolError  The call is not allowed in this state; nothing was sent.
    RemoteProtocolError The device broke protocol.md.
    DeviceError         The device refused a packet.
    IncompatibleDevice  The device cannot be served by this driver, or for this frame.
    SceneError          A scene file is wrong: where, and what.
    CurveError          A curve cannot be evaluated or drawn.
    BodyError           A body cannot be evaluated or drawn.
    ProfileError        A display profile is missing, or wrong.
    RecordingError      A recording is damaged, or cannot be written.
    DesyncError         The display shows something else, after recovery was tried.
    MissingExtra        An optional library is not installed.
"""

# The public names are imported when they are first used (PEP 562): a command that prints its help
# loads no numpy. Type checkers read the imports below instead; a test holds that they, the table of
# modules and __all__ agree.
TYPE_CHECKING = False  # by its name true for type checkers; typing itself takes long to import
if TYPE_CHECKING:
    from voxdisplay.bodies import (
        Body,
        Box,
        Cone,
        Cylinder,
        Disc,
        Ellipsoid,
        HeightField,
        Implicit,
        Mesh,
        Plane,
        Polygon,
        Scatter,
        Sphere,
        SphericalTriangle,
        Surface,
        Text,
        Torus,
        Triangle,
        Tube,
        Volume,
        VoxelModel,
    )
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
        BodyError,
        CurveError,
        DesyncError,
        DeviceError,
        IncompatibleDevice,
        LocalProtocolError,
        MissingExtra,
        OpenError,
        ProfileError,
        ProtocolError,
        RecordingError,
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
    from voxdisplay.raster.volume_pixels import volume_pixels
    from voxdisplay.scene import Scene, load_scene, read_scene
    from voxdisplay.shows.loading import load_show
    from voxdisplay.shows.play_report import PlayReport
    from voxdisplay.shows.recording import Recording
    from voxdisplay.voxelization import Report, Sequence, VoxelSet, voxelize, voxelize_many

    __version__: str

    __all__ = [
        "Arc",
        "BSpline",
        "Bezier",
        "Body",
        "BodyError",
        "Box",
        "CatmullRom",
        "Circle",
        "Cone",
        "Curve",
        "CurveError",
        "Cylinder",
        "DesyncError",
        "DeviceError",
        "DeviceInfo",
        "Disc",
        "Display",
        "Drawing",
        "Ellipse",
        "Ellipsoid",
        "Frame",
        "Grid",
        "HeightField",
        "Helix",
        "Implicit",
        "IncompatibleDevice",
        "Lissajous",
        "LocalProtocolError",
        "Mesh",
        "MissingExtra",
        "OpenError",
        "Parametric",
        "PixelFormat",
        "Plane",
        "PlayReport",
        "Points",
        "Polygon",
        "Polyline",
        "ProfileError",
        "ProtocolError",
        "Receipt",
        "Recording",
        "RecordingError",
        "RemoteProtocolError",
        "Report",
        "Scatter",
        "Scene",
        "SceneError",
        "Segment",
        "Sequence",
        "Sphere",
        "SphericalTriangle",
        "Surface",
        "Text",
        "Torus",
        "TorusKnot",
        "TransportClosed",
        "TransportError",
        "TransportTimeout",
        "Triangle",
        "Tube",
        "Volume",
        "VoxDisplayError",
        "VoxelModel",
        "VoxelSet",
        "load_scene",
        "load_show",
        "open",
        "read_scene",
        "volume_pixels",
        "voxelize",
        "voxelize_many",
    ]

# The module of each public name.
_MODULES = {
    "voxdisplay.bodies": [
        "Body",
        "Box",
        "Cone",
        "Cylinder",
        "Disc",
        "Ellipsoid",
        "HeightField",
        "Implicit",
        "Mesh",
        "Plane",
        "Polygon",
        "Scatter",
        "Sphere",
        "SphericalTriangle",
        "Surface",
        "Text",
        "Torus",
        "Triangle",
        "Tube",
        "Volume",
        "VoxelModel",
    ],
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
        "BodyError",
        "CurveError",
        "DesyncError",
        "DeviceError",
        "IncompatibleDevice",
        "LocalProtocolError",
        "MissingExtra",
        "OpenError",
        "ProfileError",
        "ProtocolError",
        "RecordingError",
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
    "voxdisplay.raster.volume_pixels": [
        "volume_pixels",
    ],
    "voxdisplay.scene": [
        "Scene",
        "load_scene",
        "read_scene",
    ],
    "voxdisplay.shows.loading": [
        "load_show",
    ],
    "voxdisplay.shows.play_report": [
        "PlayReport",
    ],
    "voxdisplay.shows.recording": [
        "Recording",
    ],
    "voxdisplay.voxelization": [
        "Report",
        "Sequence",
        "VoxelSet",
        "voxelize",
        "voxelize_many",
    ],
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}
# Modules that are attributes of the package without an import of their own.
_SUBMODULES = (
    "bodies",
    "curves",
    "display",
    "errors",
    "files",
    "frame",
    "raster",
    "scene",
    "shows",
    "voxelization",
)

_PUBLIC = sorted(_MODULE_OF)
_FUNCTIONS = [name for name in _PUBLIC if name.islower()]

if not TYPE_CHECKING:  # a type checker would take any name of a module that has __getattr__

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used."""
        from importlib import import_module  # noqa: PLC0415 - nothing is imported before its use
        from sys import _getframe  # noqa: PLC0415

        if name == "__all__":
            # pydoc documents all of `__all__` with all inherited members, 4000 lines for this
            # package. In help(voxdisplay) classes have a line each, in the docstring.
            is_help = _getframe(1).f_globals.get("__name__") == "pydoc"
            return list(_FUNCTIONS if is_help else _PUBLIC)
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
        """Return the names of the package, imported or not."""
        return sorted({*globals(), *_PUBLIC, "__version__"} - {"TYPE_CHECKING"})
