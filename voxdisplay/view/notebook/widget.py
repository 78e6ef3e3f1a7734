"""Widgets for notebooks: a page for a cell, with a PNG beside it for where nothing runs.

Must not know what the page shows or where that comes from.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from importlib.resources import files
from typing import Any

from voxdisplay.errors import MissingExtra

try:
    import anywidget
    import traitlets
except ModuleNotFoundError as error:
    raise MissingExtra(
        "a view in a notebook needs anywidget, which is not installed",
        hint="pip install 'voxdisplay[notebook]'",
    ) from error

HEIGHT_PX = 420


class PageWidget(anywidget.AnyWidget):  # type: ignore[misc]  # it need not be there
    """A page in a cell.

    Parameters
    ----------
    page : str
        HTML.
    png : callable
        Returns the picture, as a PNG file, that is saved beside the widget whenever it is shown.

    """

    _esm = files(__package__).joinpath("widget.js").read_text(encoding="utf-8")
    page = traitlets.Unicode().tag(sync=True)
    height = traitlets.Int(HEIGHT_PX).tag(sync=True)

    def __init__(self, page: str, png: Callable[[], bytes], **traits: object) -> None:
        super().__init__(page=page, **traits)
        self._png = png

    def _repr_mimebundle_(self, **options: Any) -> tuple[dict[str, Any], dict[str, Any]] | None:
        """Return the widget view, and the PNG for notebooks that were saved."""
        bundle = super()._repr_mimebundle_(**options)
        if bundle is None:
            return None
        data, metadata = bundle
        return {**data, "image/png": base64.b64encode(self._png()).decode()}, metadata


class LiveWidget(PageWidget):
    """A page whose picture changes.

    Attributes
    ----------
    latest : bytes
        The newest message, deflated.
    state : str
        What the page says of it.

    """

    latest = traitlets.Bytes().tag(sync=True)
    state = traitlets.Unicode("live").tag(sync=True)

    def __init__(self, page: str, png: Callable[[], bytes], latest: bytes) -> None:
        super().__init__(page, png, latest=latest)
        self.on_msg(self._answer)

    def _answer(self, *_: object) -> None:
        """Tell a view that has just been opened that there is a kernel."""
        self.send({"kind": "hello"})
