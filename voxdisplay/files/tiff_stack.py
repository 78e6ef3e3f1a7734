"""Reader of TIFF stacks by Pillow."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError, MissingExtra
from voxdisplay.files.bounded_unpacking import check_ratio
from voxdisplay.files.contents import MAX_SAMPLES, VolumeSamples
from voxdisplay.files.guarded_calls import guarded

_MAX_PAGES = 1 << 14


def read_tiff(name: str, data: bytes) -> VolumeSamples:
    """Read a stack of TIFF pages: page k is plane z = k, row j of it y = j.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        What is in it.

    Raises
    ------
    BodyError
        If it is none; the message names file, page and reason.
    MissingExtra
        Without Pillow.

    """
    try:
        from PIL import Image, ImageSequence  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        raise MissingExtra(
            f"{name}: TIFF files need Pillow", hint="pip install 'voxdisplay[view]'"
        ) from None
    if data[:4] not in {b"II*\0", b"MM\0*"}:
        raise BodyError(f"{name} is not a TIFF file")
    image = guarded(name, "its header", lambda: Image.open(io.BytesIO(data), formats=["TIFF"]))
    notes: list[str] = []
    pages: list[NDArray[Any]] = []
    pixels = 0

    def read() -> None:
        nonlocal pixels
        for page in ImageSequence.Iterator(image):
            pixels += page.width * page.height
            check_ratio(name, pixels, len(data))
            if len(pages) >= _MAX_PAGES or pixels > MAX_SAMPLES:
                raise BodyError(f"{name} has more than {_MAX_PAGES} pages or {MAX_SAMPLES} samples")
            color = page.mode not in {"1", "L", "I", "F", "I;16", "I;16B", "I;16L"}
            if color and not notes:
                notes.append("its colours are shown by their brightness")
            pages.append(np.asarray(page.convert("L") if color else page))
            if pages[-1].shape != pages[0].shape:
                raise BodyError(f"{name}: page {len(pages)} is of another size than the first")

    guarded(name, "a page", read)
    return VolumeSamples(np.stack(pages), notes=tuple(notes))
