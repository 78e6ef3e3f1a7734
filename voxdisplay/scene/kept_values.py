"""Values of a moving scene that hold from one build to the next.

What does not depend on the time is computed once, and what is made of the same parts as before
stays the same object. Must not know what the values are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from voxdisplay.scene.environment import MovingEnvironment

if TYPE_CHECKING:
    from collections.abc import Callable

    from voxdisplay.scene.environment import Environment
    from voxdisplay.scene.item import SceneItem
    from voxdisplay.scene.placement import Placement

T = TypeVar("T")


class KeptValues:
    """Values by their places in the scene. A copy in another process begins without any."""

    def __init__(self) -> None:
        self._values: dict[tuple[Any, ...], Any] = {}
        self._placements: dict[tuple[Any, ...], tuple[Placement, Placement, Placement]] = {}
        self._items: dict[tuple[Any, ...], tuple[tuple[Any, ...], SceneItem]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), ()

    def once(
        self,
        key: tuple[Any, ...],
        environment: Environment,
        compute: Callable[..., T],
        *arguments: Any,
    ) -> T:
        """Return ``compute(*arguments)``, which is kept if it does not depend on the time."""
        if not isinstance(environment, MovingEnvironment):
            return compute(*arguments)
        key = (*key, id(environment))
        if key in self._values:
            kept: T = self._values[key]
            return kept
        table = environment.table
        before, table.touched = table.touched, False
        value = compute(*arguments)
        if not table.touched:
            self._values[key] = value
        table.touched |= before
        return value

    def keeps(self, key: tuple[Any, ...], environment: Environment) -> bool:
        """Return whether `once` has kept a value."""
        return (*key, id(environment)) in self._values

    def placement(self, key: tuple[Any, ...], outer: Placement | None, own: Placement) -> Placement:
        """Return the map ``own``, then ``outer``: the same object as before for the same two."""
        if outer is None:
            return own
        kept = self._placements.get(key)
        if kept is None or kept[0] is not outer or kept[1] is not own:
            kept = self._placements[key] = (outer, own, outer.after(own))
        return kept[2]

    def item(self, key: tuple[Any, ...], parts: tuple[Any, ...]) -> SceneItem | None:
        """Return the item that was made of the same parts before; None if they are others."""
        kept = self._items.get(key)
        if kept is None or any(a is not b for a, b in zip(kept[0], parts, strict=True)):
            return None
        return kept[1]

    def keep_item(self, key: tuple[Any, ...], parts: tuple[Any, ...], item: SceneItem) -> None:
        """Keep an item and the parts it is made of."""
        self._items[key] = parts, item
