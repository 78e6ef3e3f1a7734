"""Types of scene files whose bodies come from files or fonts: meshes, volumes and text.

Descriptions and types of the keys are those of the JSON Schema. Files are read only inside of the
scene's folder. Values are checked by the bodies.
"""

from itertools import pairwise
from typing import Annotated, ClassVar, Literal

import numpy as np
from msgspec import Meta

from voxdisplay import bodies
from voxdisplay.bodies import Body
from voxdisplay.scene.body_objects import BodyObject, Corners, EnclosingObject
from voxdisplay.scene.evaluation_context import EvaluationContext
from voxdisplay.scene.values import Number, Numbers, OneColor, Range, Vector, Vectors

Into = Annotated[
    Corners,
    Meta(
        title="Into",
        description="The box [[x0, y0, z0], [x1, y1, z1]] into which it is fitted, centred and "
        "undistorted. When left out, the whole volume less a margin of one voxel.",
    ),
]
Up = Annotated[
    Literal["y", "z"] | None,
    Meta(title="Up", description="The axis of the file that is up. y for glTF, z for others."),
]
ModelFile = Annotated[
    str, Meta(title="File", description="Path of the file, relative to the scene's folder.")
]


class Mesh(EnclosingObject, tag="mesh", frozen=True):
    """Triangles, of a file beside the scene or given as vertices and faces."""

    file: Annotated[
        ModelFile | None,
        Meta(
            title="File",
            description="Path of an .obj, .stl, .ply, .off, .glb, .gltf or .3mf file, relative to "
            "the scene's folder and inside it.",
        ),
    ] = None
    vertices: Annotated[
        Vectors | None, Meta(title="Vertices", description="Points, in place of a file.")
    ] = None
    faces: Annotated[
        list[Numbers] | None,
        Meta(
            title="Faces",
            description="Triangles, or flat convex polygons, as numbers of vertices, the first of "
            "which is 0; counter-clockwise as seen from outside.",
            extra={"expected": "a list of faces [[i, j, k], ...]"},
        ),
    ] = None
    up: Up = None
    into: Into = None

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        if self.file is not None:
            if self.vertices is not None or self.faces is not None:
                raise context.object_error("a mesh has either the key 'file' or vertices and faces")
            return context.body_from_file("file", self.file, self.into, fill=self.fill, up=self.up)
        if self.vertices is None or self.faces is None:
            raise context.object_error("a mesh needs the key 'file', or both vertices and faces")
        points = context.points("vertices", self.vertices)
        if self.up == "y":
            points = np.stack((points[:, 0], -points[:, 2], points[:, 1]), axis=1)
        body = bodies.Mesh(points, self._triangles(context, len(points)), fill=self.fill)
        # Vertices are in voxels of the scene: they stay where they are.
        return body if self.into is None else context.fitted(body, self.into)

    def _triangles(self, context: EvaluationContext, count: int) -> list[tuple[int, int, int]]:
        assert self.faces is not None  # noqa: S101 - see the caller
        triangles: list[tuple[int, int, int]] = []
        for i, face in enumerate(self.faces):
            corners = context.numbers(f"faces[{i}]", face).tolist()
            if len(corners) < 3:
                raise context.error(f"faces[{i}]", f"has {len(corners)} of at least 3 vertices")
            for j, corner in enumerate(corners):
                if not (corner.is_integer() and 0 <= corner < count):
                    what = f"must be a whole number from 0 to {count - 1}, not {corner:g}"
                    raise context.error(f"faces[{i}][{j}]", what)
            first, *rest = map(int, corners)
            triangles += [(first, a, b) for a, b in pairwise(rest)]
        return triangles


class Volume(BodyObject, tag="volume", frozen=True):
    """Samples of a file, such as a CT scan, or a voxel model."""

    value_names: ClassVar[tuple[str, ...]] = ("value",)

    file: Annotated[
        str,
        Meta(
            title="File",
            description="Path of a .npy, .npz, .nrrd, .nii, .nii.gz, .tif, .dcm, .raw, .vox, .qb, "
            ".kv6 or .binvox file, relative to the scene's folder and inside it.",
        ),
    ]
    window: Annotated[
        Range | None,
        Meta(
            title="Window",
            description="The values [low, high] of the darkest and the brightest colour. When left "
            "out, the file's own, or those between which 98 % of the samples are.",
        ),
    ] = None
    threshold: Annotated[
        Number | None, Meta(title="Threshold", description="The lowest value that is shown.")
    ] = None
    map: Annotated[
        str | Annotated[list[OneColor], Meta(min_length=1)] | None,
        Meta(
            title="Map",
            description="Name of a colour map, or a list of colours. gray when left out.",
            extra={"expected": "the name of a colour map or a list of colours"},
        ),
    ] = None
    shape: Annotated[
        Vector | None,
        Meta(title="Shape", description="Of a .raw file: numbers of samples [nz, ny, nx]."),
    ] = None
    dtype: Annotated[
        str | None,
        Meta(title="Type", description="Of a .raw file: type of the samples, such as int16."),
    ] = None
    labels: Annotated[
        bool,
        Meta(
            title="Labels",
            description="Whether values are numbers of parts, which have no mean.",
        ),
    ] = False
    up: Up = None
    into: Into = None

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        shape = None if self.shape is None else context.numbers("shape", self.shape).tolist()
        if shape is not None and not all(side.is_integer() and side > 0 for side in shape):
            raise context.error("shape", "must be three whole numbers [nz, ny, nx]")
        return context.body_from_file(
            "file",
            self.file,
            self.into,
            up=self.up,
            window=None if self.window is None else context.pair("window", self.window),
            threshold=None
            if self.threshold is None
            else context.number("threshold", self.threshold),
            map=self.map,
            shape=None if shape is None else tuple(map(int, shape)),
            dtype=self.dtype,
            labels=self.labels,
        )


class Text(EnclosingObject, tag="text", frozen=True):
    """Letters of a font, flat or with a depth."""

    text: Annotated[
        str, Meta(title="Text", description="What is written; \\n begins another line.")
    ]
    at: Annotated[
        Vector,
        Meta(
            title="At",
            description="The left end of the first line's base line, in voxels; its middle or "
            "right end by `align`.",
        ),
    ]
    height: Annotated[
        Number, Meta(title="Height", description="Height of a capital letter, in voxels.")
    ]
    direction: Annotated[
        Vector, Meta(title="Direction", description="Where a line runs to, of any length.")
    ] = (1.0, 0.0, 0.0)
    up: Annotated[
        Vector,
        Meta(title="Up", description="Where the upper ends of letters point to, of any length."),
    ] = (0.0, 0.0, 1.0)
    font: Annotated[
        str | None,
        Meta(
            title="Font",
            description="Path of a .ttf or .otf file, relative to the scene's folder and inside "
            "it. When left out, a font that is found.",
        ),
    ] = None
    depth: Annotated[
        Number | None,
        Meta(
            title="Depth",
            description="Thickness of the letters, in voxels; flat when left out.",
        ),
    ] = None
    align: Annotated[
        Literal["left", "center", "right"],
        Meta(title="Align", description="Which place of each line is at `at`."),
    ] = "left"

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Text(
            self.text,
            context.numbers("at", self.at),
            context.number("height", self.height),
            direction=context.numbers("direction", self.direction),
            up=context.numbers("up", self.up),
            font=None if self.font is None else context.file_bytes("font", self.font),
            depth=None if self.depth is None else context.number("depth", self.depth),
            align=self.align,
            fill=self.fill,
        )
