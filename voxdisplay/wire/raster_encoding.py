"""Encoding of a whole frame: raw pixels where searching would take longer than sending, else ops.

Must not know frames or links.
"""

from __future__ import annotations

from collections.abc import Iterator

from voxdisplay.raster.sparse_raster import SparseRaster
from voxdisplay.wire.encoding_selection import encode_update
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.page_update import PageUpdate
from voxdisplay.wire.payload_splitting import OpBlocks, PayloadLayout
from voxdisplay.wire.raw_pixels import encode_raw, is_incompressible

# Line rate, bytes/s, from which incompressible pages are sent raw rather than parsed.
_RAW_FROM = 2_400_000


def encode_raster(
    raster: SparseRaster, config: EncoderConfig, first: OpBlocks | None = None
) -> Iterator[list[bytes]]:
    """Yield the payloads that draw a frame on a dark page, in whatever order they arrive.

    Parameters
    ----------
    raster : SparseRaster
        Its pixels.
    config, first
        As of `encode_update`.

    Yields
    ------
    list of bytes
        As of `encode_update`.

    """
    if raster.page and config.bytes_per_s >= _RAW_FROM:
        pixels = raster.pixels(writable=False)
        if is_incompressible(pixels, config):
            yield PayloadLayout(first, config).payloads if first else []
            yield from encode_raw(pixels, config)
            return
    ordered, index = raster.lit_parts()
    yield []
    yield from encode_update(PageUpdate(ordered, index, raster.at), config, first)
