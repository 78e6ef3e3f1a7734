"""Abstract base class of bodies: surfaces, solids and voxel models in voxel space.

A body reduces itself to one of the geometries of `voxdisplay.bodies.geometry`. It must not know
how they are voxelised, and neither displays nor colours of displays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import wraps
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from voxdisplay.argument_checks import choice, described
from voxdisplay.curves import arguments, checked_methods
from voxdisplay.curves.short_repr import short_repr
from voxdisplay.errors import BodyError, VoxDisplayError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from voxdisplay.bodies.geometry import Bounds, Geometry
    from voxdisplay.compute.array_types import Floats

Fill = Literal["shell", "solid"]
Kind = Literal["surface", "solid", "volume", "points"]


class Body(ABC):
    """A surface, a solid or a voxel model.

    Coordinates are voxel space: voxel (i, j, k) is the cube [i, i+1) x [j, j+1) x [k, k+1), its
    centre at +1/2. Bodies are immutable values.

    Attributes
    ----------
    fill : {"shell", "solid"}
        Whether a body that encloses something shows its surface alone.

    """

    fill: Fill = "shell"
    _arguments: Mapping[str, object] = MappingProxyType({})

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        if checked_methods.is_foreign(cls):
            for name, checked in (("bounds", _checked_bounds), ("geometry", _checked_geometry)):
                if callable(vars(cls).get(name)):
                    setattr(cls, name, checked(vars(cls)[name]))

    def __repr__(self) -> str:
        shown = [f"{k}={short_repr(v)}" for k, v in self._arguments.items() if v is not None]
        return f"{type(self).__name__}({', '.join(shown)})"

    @property
    def kind(self) -> Kind:
        """Kind of its voxels: ``"surface"``, ``"solid"``, ``"volume"`` or ``"points"``."""
        return "solid" if self.fill == "solid" else "surface"

    @abstractmethod
    def bounds(self) -> Bounds:
        """Return a box, (3,) low and (3,) high, that holds the body; infinite where it has no end.

        It need not be the smallest one.
        """

    def proven_bounds(self) -> Bounds:
        """Return bounds that are proven where `bounds` are sampled, if formulas have any."""
        return self.bounds()

    @abstractmethod
    def geometry(self, bounds: Bounds, *, certified: bool = False) -> Geometry:
        """Return the body, or at least what of it is inside a box, as a geometry.

        Parameters
        ----------
        bounds : (3,) and (3,) float64 array
            Low and high corner of the box.
        certified : bool
            Prove that the geometry is the body within its tolerance.

        Raises
        ------
        BodyError
            If the body cannot be evaluated.

        """

    def values_at(self, points: Floats) -> Mapping[str, Floats]:  # noqa: ARG002 - most have none
        """Return the body's own parameters, such as u and v, at points of it.

        Parameters
        ----------
        points : (n, 3) float64 array

        Returns
        -------
        mapping of str to (n,) float64 array
            Of points near the body, those of a near point of it; empty if it has none.

        """
        return {}

    def transformed(self, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> Body:
        """Return the body of the points ``matrix @ p + offset`` for its points p.

        Parameters
        ----------
        matrix : (3, 3) array
            Invertible; it may mirror.
        offset : (3,) array
            In voxels.

        """
        return TransformedBody(self, matrix, offset)


class TransformedBody(Body):
    """A body under an affine map, for bodies that are no closed class under such maps.

    Parameters
    ----------
    body : Body
    matrix : (3, 3) array
        Invertible.
    offset : (3,) array

    """

    def __init__(self, body: Body, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> None:
        self.body = body
        self.matrix = invertible("matrix", matrix)
        self.offset = arguments.vector("offset", offset)
        self.fill = body.fill
        self._arguments = {"body": body, "matrix": self.matrix, "offset": self.offset}

    @property
    def kind(self) -> Kind:
        """`Body.kind` of the body inside."""
        return self.body.kind

    def bounds(self) -> Bounds:
        """Return a box that holds the body: `Body.bounds`."""
        return transform_bounds(self.body.bounds(), self.matrix, self.offset)

    def proven_bounds(self) -> Bounds:
        """Return a box that holds the body: `Body.proven_bounds`."""
        return transform_bounds(self.body.proven_bounds(), self.matrix, self.offset)

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> Geometry:
        """Return the transformed geometry of the body inside: `Body.geometry`."""
        inverse: Floats = np.linalg.inv(self.matrix).astype(np.float64)
        inner = transform_bounds(bounds, inverse, -inverse @ self.offset)
        geometry = self.body.geometry(inner, certified=certified)
        return geometry.transformed(self.matrix, self.offset)

    def values_at(self, points: Floats) -> Mapping[str, Floats]:
        """Return the parameters of the body inside: `Body.values_at`."""
        inverse: Floats = np.linalg.inv(self.matrix).astype(np.float64)
        return self.body.values_at((points - self.offset) @ inverse.T)

    def transformed(self, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> Body:
        """Return the body under both maps: `Body.transformed`."""
        outer = invertible("matrix", matrix)
        return TransformedBody(
            self.body, outer @ self.matrix, outer @ self.offset + arguments.vector("offset", offset)
        )


def _checked_bounds(method: Callable[..., Any]) -> Callable[..., Bounds]:
    what = method.__qualname__

    @wraps(method)
    def bounds(self: Body) -> Bounds:
        found = _called(what, method, self)
        hint = "it must return the low and the high corner of a box: two arrays of three numbers"
        if not isinstance(found, tuple | list | np.ndarray) or len(found) != 2:
            raise BodyError(f"{what} returned {described(found)}", hint=hint)
        low, high = (arguments.real_numbers(what, corner) for corner in found)
        if low.shape != (3,) or high.shape != (3,) or not (low <= high).all():
            raise BodyError(f"{what} returned corners {low} and {high}", hint=hint)
        return low, high

    return bounds


def _checked_geometry(method: Callable[..., Any]) -> Callable[..., Geometry]:
    what = method.__qualname__

    @wraps(method)
    def geometry(self: Body, bounds: Bounds, *, certified: bool = False) -> Geometry:
        from voxdisplay.bodies import geometry as forms  # noqa: PLC0415 - not for curves alone

        found = _called(what, method, self, bounds, certified=certified)
        if not isinstance(found, forms.Geometry):
            raise BodyError(
                f"{what} returned {described(found)}",
                hint="it must return a geometry: see voxdisplay.bodies.geometry",
            )
        return found

    return geometry


def _called(what: str, method: Callable[..., Any], *given: Any, **named: Any) -> Any:
    try:
        return method(*given, **named)
    except VoxDisplayError:
        raise
    except Exception as error:
        raise BodyError(str(checked_methods.raised(what, error))) from error


def invertible(name: str, value: ArrayLike) -> Floats:
    """Return a (3, 3) float64 array, or raise ArgumentError if it maps bodies to flat ones."""
    matrix = arguments.array(name, value, (3, 3))
    if np.linalg.matrix_rank(matrix) < 3:
        raise arguments.ArgumentError(name, "flattens bodies: its determinant is 0")
    return matrix


def transform_bounds(bounds: Bounds, matrix: Floats, offset: Floats) -> Bounds:
    """Return the bounds of a box under an affine map; the box may be infinite."""
    low, high = bounds
    with np.errstate(invalid="ignore"):  # 0 * inf, where an axis does not matter
        ends = np.stack((matrix * low, matrix * high))
    ends[:, matrix == 0] = 0
    return ends.min(axis=0).sum(axis=1) + offset, ends.max(axis=0).sum(axis=1) + offset


def check_fill(fill: Fill) -> Fill:
    """Return ``"shell"`` or ``"solid"``, or raise an error that names the argument."""
    choice("fill", fill, ("shell", "solid"))
    return fill
