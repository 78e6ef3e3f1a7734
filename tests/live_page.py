"""Exported pages of a live view, for tests in a browser."""

from __future__ import annotations

import numpy as np

import voxdisplay as vd
from voxdisplay.view.html_export import save_html

SIZE = (3, 5, 7)


def exported(tmp_path, pages, size=SIZE, format_="rgb888", **more):
    grid, path = vd.Grid(*size), tmp_path / "page.html"
    save_html(path, pages, grid, vd.PixelFormat(format_), **{"title": "a", "fps": 50, **more})
    return path.as_uri()


def page_of(*voxels, size=SIZE, color="white", format_="rgb888"):
    frame = vd.Frame(size, format_)
    frame.draw(np.array(voxels), color)
    return frame.array()
