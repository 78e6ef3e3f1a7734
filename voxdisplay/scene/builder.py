"""Builder of scene items: objects of a file, groups and repeats unfolded, at one time.

What does not depend on the time is built once and kept, so that whoever draws a moving scene can
tell by identity what has not changed. Must not know JSON text but to name places in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay.bodies import Body
from voxdisplay.errors import BodyError, CurveError, MissingExtra, SceneError
from voxdisplay.expressions.params import check_name
from voxdisplay.expressions.parse import names_in
from voxdisplay.raster.color import as_colors
from voxdisplay.raster.color_map import color_map
from voxdisplay.scene.coloring import WHITE, Coloring, ColorsByValue
from voxdisplay.scene.columns import Columns, columns_of
from voxdisplay.scene.environment import MovingEnvironment
from voxdisplay.scene.evaluation_context import EvaluationContext, as_scene_error, scene_error
from voxdisplay.scene.item import PartSpan, SceneItem
from voxdisplay.scene.kept_values import KeptValues
from voxdisplay.scene.objects import Group
from voxdisplay.scene.placement import Placement, placed, transform_placement
from voxdisplay.scene.values import ColorMap

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.curves import Curve
    from voxdisplay.scene.environment import Environment
    from voxdisplay.scene.json_text import JsonText
    from voxdisplay.scene.scene_files import SceneFiles
    from voxdisplay.scene.scene_object import SceneObject

MAX_ITEMS = 100_000
"""Most objects of a scene, repeats counted each."""
MAX_DEPTH = 32
"""Deepest nesting of groups."""


@dataclass(frozen=True, slots=True)
class Built:
    """Items that a scene shows at one time.

    Attributes
    ----------
    items : tuple of SceneItem
        In drawing order.
    spans : tuple of PartSpan
        Which of them are shown in part, inner ones first.
    notes : tuple of str
        Choices made while they were built, one line each, for people.

    """

    items: tuple[SceneItem, ...]
    spans: tuple[PartSpan, ...]
    notes: tuple[str, ...]


class SceneBuilder:
    """Builder of the items of one file.

    Parameters
    ----------
    objects : sequence of SceneObject
    paths : sequence of str
        Their JSON paths.
    environment : Environment
    files : SceneFiles
        The files that objects may name.
    source : JsonText or None
        The file's text.
    duration : float, optional
        Seconds that a moving scene lasts.

    """

    def __init__(
        self,
        objects: Sequence[SceneObject],
        paths: Sequence[str],
        environment: Environment,
        files: SceneFiles,
        source: JsonText | None,
        duration: float | None = None,
    ) -> None:
        self._objects = list(zip(paths, objects, strict=True))
        self._environment = environment
        self.files = files
        self.source = source
        self.duration = duration
        self.kept = KeptValues()
        self.colors: dict[Any, Any] = {None: WHITE}  # of simple objects, by their texts
        self._columns: list[Columns] | None = None
        self._was_built = False

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_columns": None, "_was_built": False}

    def build(self, time: float | None = None, fit: Placement | None = None) -> Built:
        """Return the items.

        Parameters
        ----------
        time : float, optional
            Seconds since a moving scene began; the environment must be at that time.
        fit : Placement, optional
            How the scene is fitted to a grid.

        Raises
        ------
        SceneError
            If a value is wrong: ``.path`` is where.

        """
        run = _Run(self, time, fit)
        simple = self._built_in_columns()
        for i, (path, scene_object) in enumerate(self._objects):
            curve = simple.get(i)
            if curve is None:
                run.add(scene_object, path, self._environment, fit, None, 0)
            else:
                run.add_simple(scene_object, path, curve, fit)
        self._was_built = True
        return Built(tuple(run.items), tuple(run.spans), tuple(dict.fromkeys(run.notes)))

    def _built_in_columns(self) -> dict[int, Curve]:
        """Return the curves of simple objects, by index; built type by type.

        In a moving scene all are built alone the first time: that reads their expressions and
        tells which of them depend on the time. The others are kept.
        """
        environment = self._environment
        if environment.varies and not self._was_built:
            return {}
        if self._columns is None:
            others = [
                (i, scene_object)
                for i, (path, scene_object) in enumerate(self._objects)
                if not self.kept.keeps((path, "shapes"), environment)
            ]
            self._columns = columns_of(others)
        found: dict[int, Curve] = {}
        for columns in self._columns:
            if environment.varies:
                table = environment.table_of(columns.rows)
            else:
                table = np.array(columns.rows) if columns.is_plain else None
            if table is not None:
                found.update(columns.build(table))
        return found


class _Run:
    """One run through all objects."""

    def __init__(self, builder: SceneBuilder, time: float | None, fit: Placement | None) -> None:
        self.builder = builder
        self.time = time
        self.fit = fit
        self.items: list[SceneItem] = []
        self.spans: list[PartSpan] = []
        self._count = 0
        self._copies = 1  # of the object that is added now, by all repeats around it
        self.notes: list[str] = []

    def add(
        self,
        scene_object: SceneObject,
        path: str,
        environment: Environment,
        outer: Placement | None,
        color: Coloring,
        depth: int,
    ) -> None:
        """Add an object, as often as it is repeated."""
        if scene_object.repeat is None:
            self.add_once(scene_object, path, environment, outer, color, depth)
            return
        for names in self._repeats(scene_object.repeat, path, environment):
            nested = environment.nested(names)
            self.add_once(scene_object, path, nested, outer, color, depth)

    def _repeats(
        self, repeat: Mapping[str, str | float], path: str, environment: Environment
    ) -> Iterator[dict[str, float]]:
        context = EvaluationContext(f"{path}.repeat", environment, self.builder.files)
        counts: list[int] = []
        total = 1
        for name, source in repeat.items():
            with as_scene_error(f"{path}.repeat"):
                check_name(name, "the counter of a repeat")
            if name in environment.names or self._varies(name, environment):
                what = f"the name {name!r} has a meaning already"
                raise SceneError(what, path=f"{path}.repeat", hint="choose another counter")
            count = context.number(name, source)
            if not (count.is_integer() and count >= 0):
                raise context.error(name, f"must be a whole number, 0 or more, not {count:g}")
            if count * total * self._copies > MAX_ITEMS:
                problem = f"{count * total * self._copies:g} objects are more than {MAX_ITEMS}"
                raise context.error(name, problem)
            counts.append(int(count))
            total *= int(count)
        before = self._copies
        self._copies *= total
        for each in product(*map(range, counts)):
            yield dict(zip(repeat, map(float, each), strict=True))
        self._copies = before

    @staticmethod
    def _varies(name: str, environment: Environment) -> bool:
        return isinstance(environment, MovingEnvironment) and name in environment.table.variables

    def add_once(
        self,
        scene_object: SceneObject,
        path: str,
        environment: Environment,
        outer: Placement | None,
        color: Coloring,
        depth: int,
    ) -> None:
        """Add an object once."""
        self._count += 1  # groups, too: they may be empty, and many
        if self._count > MAX_ITEMS:
            raise SceneError(f"the scene has more than {MAX_ITEMS} objects", path=path)
        context = EvaluationContext(path, environment, self.builder.files)
        if scene_object.during is not None and not self._is_during(scene_object, context):
            return
        place = outer
        if scene_object.transform:
            key = (path, "transform")
            own = self.builder.kept.once(
                key, environment, transform_placement, scene_object.transform, context
            )
            assert own is not None  # noqa: S101 - it has steps
            place = self.builder.kept.placement((path, id(environment)), outer, own)
        first = len(self.items)
        if isinstance(scene_object, Group):
            if depth == MAX_DEPTH:
                raise SceneError(f"groups are nested more than {MAX_DEPTH} deep", path=path)
            inner = self._coloring(scene_object, context, color, ())
            for i, child in enumerate(scene_object.objects):
                self.add(child, f"{path}.objects[{i}]", environment, place, inner, depth + 1)
        else:
            self._add_shapes(scene_object, context, place, color)
        if scene_object.part is not None:
            begin, end = context.numbers("part", scene_object.part).tolist()
            self.spans.append(PartSpan(first, len(self.items), begin, end))

    def add_simple(
        self, scene_object: SceneObject, path: str, curve: Curve, outer: Placement | None
    ) -> None:
        """Add a simple object of which the curve has been built."""
        self._count += 1
        if self._count > MAX_ITEMS or len(self.items) >= MAX_ITEMS:
            raise SceneError(f"the scene has more than {MAX_ITEMS} objects", path=path)
        text = scene_object.color
        known = self.builder.colors
        colors = known.get(text)
        if colors is None:
            colors = known[text] = read_colors(text, f"{path}.color")
            colors.flags.writeable = False  # of several items
        tag = str(scene_object.__struct_config__.tag)
        image = curve if outer is None else _image(curve, outer, path)
        if image is not None:
            self.items.append(
                SceneItem(tag, image, colors, path, self.builder.source, None, self.fit)
            )

    def _is_during(self, scene_object: SceneObject, context: EvaluationContext) -> bool:
        """Return whether an object is there at the present time."""
        duration = self.builder.duration
        assert scene_object.during is not None  # noqa: S101 - see the caller
        if duration is None or self.time is None:
            hint = 'write "duration", in seconds, beside "objects"'
            raise context.error("during", "the scene has no duration", hint=hint)
        begin, end = context.numbers("during", scene_object.during).tolist()
        if not begin < end:
            raise context.error("during", f"is empty or runs backwards: {begin:g} to {end:g}")
        if begin >= duration or end <= 0:
            what = f"{begin:g} to {end:g} s is outside of the scene, which lasts {duration:g} s"
            raise context.error("during", what)
        return bool(begin <= self.time < end)

    def _add_shapes(
        self,
        scene_object: SceneObject,
        context: EvaluationContext,
        place: Placement | None,
        color: Coloring,
    ) -> None:
        builder, environment, path = self.builder, context.environment, context.path
        shapes, columns = builder.kept.once(
            (path, "shapes"), environment, _shapes, scene_object, context
        )
        self.notes += context.notes
        if scene_object.color is None:
            coloring = color
        else:
            names = scene_object.value_names
            if columns:
                names += tuple(columns[0])
            coloring = self._coloring(scene_object, context, color, names)
        if len(self.items) + len(shapes) > MAX_ITEMS:
            raise SceneError(f"the scene has more than {MAX_ITEMS} objects", path=path)
        stays = environment.varies and builder.kept.keeps((path, "shapes"), environment)
        for i, shape in enumerate(shapes):
            parts = (shape, place, coloring)
            item = builder.kept.item((path, i, id(environment)), parts) if stays else None
            if item is None:
                image = shape
                if place is not None:
                    found = _image(shape, place, path)
                    if found is None:  # nothing is left of it
                        continue
                    image = found
                item = SceneItem(
                    str(scene_object.__struct_config__.tag),
                    image,
                    WHITE if coloring is None and not isinstance(image, Body) else coloring,
                    path,
                    builder.source,
                    columns[i] if columns else None,
                    self.fit,
                )
                if stays:
                    builder.kept.keep_item((path, i, id(environment)), parts, item)
            self.items.append(item)

    def _coloring(
        self,
        scene_object: SceneObject,
        context: EvaluationContext,
        inherited: Coloring,
        names: tuple[str, ...],
    ) -> Coloring:
        color = scene_object.color
        if color is None:
            return inherited
        path = context.path
        if isinstance(color, ColorMap):
            key = (path, "color", names)
            return self.builder.kept.once(
                key, context.environment, _colors_by_value, color, context, names
            )
        return self.builder.kept.once(
            (path, "color"), context.environment, read_colors, color, f"{path}.color"
        )


def _image(shape: Curve | Body, place: Placement, path: str) -> Curve | Body | None:
    """Return the image of a shape at a JSON path; None if nothing is left of it."""
    try:
        return placed(shape, place)
    except (CurveError, BodyError) as error:
        raise SceneError(str(error), path=path, hint=error.hint) from error


def _shapes(
    scene_object: SceneObject, context: EvaluationContext
) -> tuple[list[Curve | Body], list[Mapping[str, Floats]]]:
    """Return what an object is made of, and the columns of points that each of it has."""
    context.wanted_columns = _wanted_values(scene_object)
    try:
        return scene_object.build(context), context.columns
    except (CurveError, BodyError) as error:
        raise scene_error(error, context.path) from error
    except MissingExtra as error:
        raise SceneError(str(error), path=context.path, hint=error.hint) from error


def _wanted_values(scene_object: SceneObject) -> tuple[str, ...]:
    """Return the names by which an object is coloured that no object has by itself."""
    color = scene_object.color
    if not isinstance(color, ColorMap) or not isinstance(color.by, str):
        return ()
    return tuple(dict.fromkeys(names_in(color.by)))


def _colors_by_value(
    color: ColorMap, context: EvaluationContext, names: tuple[str, ...]
) -> ColorsByValue:
    path = f"{context.path}.color"
    try:
        colors = color_map(color.map)
    except (TypeError, ValueError, MissingExtra) as error:
        hint = error.hint if isinstance(error, MissingExtra) else None
        raise SceneError(str(error), path=f"{path}.map", hint=hint) from None
    by = context.formula("color.by", color.by, ("x", "y", "z", *names))
    span: tuple[float, float] | None = None
    if color.range is not None:
        low, high = context.numbers("color.range", color.range).tolist()
        span = low, high
    return ColorsByValue(colors, by, span)


def read_colors(color: Any, path: str) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return the colours of an object, (k, 3), or raise SceneError at its path."""
    try:
        return as_colors(color)
    except (TypeError, ValueError) as error:
        if not isinstance(color, str):
            for i, one in enumerate(color):
                if not isinstance(one, int):
                    read_colors(one, f"{path}[{i}]")
        raise SceneError(str(error), path=path) from None
