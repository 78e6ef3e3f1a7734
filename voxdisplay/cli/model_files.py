"""Meshes, volumes and voxel models as the only object of a scene, and the options for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, TypeVar

import click

from voxdisplay.cli.param_types import NumbersType, RangeType
from voxdisplay.cli.show_films import is_show_file, open_show_file

if TYPE_CHECKING:
    import voxdisplay as vd
    from voxdisplay.files import LoadedBody
    from voxdisplay.frame import Fit

_C = TypeVar("_C", bound=Callable[..., Any])
_MARGIN: Final = 1.0  # voxels that stay free at each wall, as with `into` of scenes


class ModelOptions(NamedTuple):
    """Options for a file that is the only object; None where one was not given."""

    fill: Literal["shell", "solid"] | None = None
    up: Literal["y", "z"] | None = None
    window: tuple[float, float] | None = None
    threshold: float | None = None
    map: str | None = None
    color: str | None = None
    shape: tuple[int, int, int] | None = None
    dtype: str | None = None

    def given(self) -> dict[str, Any]:
        """Return the options that were given."""
        return {name: value for name, value in self._asdict().items() if value is not None}


_OPTIONS = (
    click.option("--fill", type=click.Choice(["shell", "solid"]),
                 help="Of a mesh: its surface, or its inside too.  [default: shell]"),
    click.option("--up", type=click.Choice(["y", "z"]),
                 help="Axis of a model that is up.  [default: y for glTF, else z]"),
    click.option("--window", type=NumbersType(2, "0,1500", float), metavar="LOW,HIGH",
                 help="Values of a volume that the colour map spans.  [default: the file's own, "
                 "else from the 1st to the 99th percentile]"),
    click.option("--threshold", type=RangeType("number", -1e300, 1e300, "300"), metavar="VALUE",
                 help="Lowest value of a volume that is lit.  [default: all above the window's "
                 "low end]"),
    click.option("--map", metavar="NAME",
                 help="Colour map of a volume: gray, magma, viridis, ...  [default: gray]"),
    click.option("--color", metavar="COLOR", help="Colour of a model.  [default: its own, or "
                 "white]"),
    click.option("--shape", type=NumbersType(3, "300,512,512", int), metavar="NZ,NY,NX",
                 help="Samples of a .raw volume, x fastest."),
    click.option("--dtype", metavar="TYPE", help="Type of the samples of a .raw volume: uint8, "
                 "<i2, >f4, ..."),
)  # fmt: skip


def model_options(function: _C) -> _C:
    """Add the options for files that are no scenes; the command takes them as ``model``."""

    @wraps(function)
    def with_model(**arguments: Any) -> Any:
        given = map(arguments.pop, ModelOptions._fields)
        return function(model=ModelOptions(*given), **arguments)

    for option in reversed(_OPTIONS):
        with_model = option(with_model)
    return with_model  # type: ignore[return-value]  # of the same kind, for click


def is_model(path: str) -> bool:
    """Return whether a path is that of a mesh, volume or voxel model, by its name."""
    from voxdisplay.files.suffixes import suffix_of  # noqa: PLC0415 - help starts fast

    return path != "-" and (suffix_of(path) is not None or Path(path).is_dir())


@dataclass(frozen=True, slots=True, eq=False)
class ModelFile:
    """A model of a file, in the place of a scene."""

    name: str
    loaded: LoadedBody
    color: str | None
    size: None = None

    def fitted(
        self, grid: vd.Grid, mode: Fit, pitch: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ) -> tuple[vd.Scene, str | None]:
        """Return a scene of the model, fitted to a grid, and a note: see `Scene.fitted`."""
        import numpy as np  # noqa: PLC0415 - help starts fast

        from voxdisplay.files.loading import fitted  # noqa: PLC0415
        from voxdisplay.scene import Scene  # noqa: PLC0415
        from voxdisplay.scene.builder import read_colors  # noqa: PLC0415
        from voxdisplay.scene.item import SceneItem  # noqa: PLC0415

        body, note = self.loaded.body, None
        if mode != "none" and len(set(pitch)) > 1:
            stretch = min(pitch) / np.array(pitch)
            body = body.transformed(np.diag(stretch), np.zeros(3))
        if mode != "none":
            margin = [min(_MARGIN, (side - 1) / 2) for side in grid]
            room = [side - free for side, free in zip(grid, margin, strict=True)]
            body, scale = fitted(body, margin, room)
            note = f"{self.name} scaled by {scale:.3g} to {grid}"
        color = None if self.color is None else read_colors(self.color, "--color")
        kind = "mesh" if hasattr(body, "faces") else "volume"
        return Scene(None, (SceneItem(kind, body, color, self.name),), self.loaded.notes), note


def load_shown(path: str, model: ModelOptions) -> vd.Scene | ModelFile:
    """Read what a command is to show: a scene, or a model with its options.

    Raises
    ------
    SceneError, BodyError, MissingExtra
        If it cannot be read.
    click.UsageError
        If options for models are given for a scene.

    """
    import voxdisplay as vd  # noqa: PLC0415 - help starts fast

    given = model.given()
    if not is_model(path):
        if given:
            names = ", ".join(f"--{name}" for name in given)
            raise click.UsageError(f"{names}: only for meshes, volumes and voxel models; a scene "
                                   "has keys for them")  # fmt: skip
        return _first_picture(path) if is_show_file(path) else vd.load_scene(path)
    from voxdisplay.files.loading import load_body  # noqa: PLC0415

    color = given.pop("color", None)
    return ModelFile(Path(path).name, load_body(path, **given), color)


def _first_picture(path: str) -> vd.Scene:
    """Return what a file of frames shows at time 0, as a scene of its voxels."""
    import voxdisplay as vd  # noqa: PLC0415 - help starts fast
    from voxdisplay.bodies.scatter import Scatter  # noqa: PLC0415
    from voxdisplay.scene.item import SceneItem  # noqa: PLC0415

    frame = open_show_file(path, None, None, "none").frame(0)
    index, _ = frame.lit()
    points = frame.grid.voxels_at(index) + 0.5
    items = [SceneItem("scatter", Scatter(points), frame.lit_rgb(), path)] if len(index) else []
    return vd.Scene(frame.grid, tuple(items))
