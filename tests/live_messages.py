"""Reader of the live view's messages, by their description."""

from __future__ import annotations

import json
import struct

import numpy as np

import voxdisplay as vd


def read_back(message):
    """Return the head of a message, and the page that it describes."""
    (start,) = struct.unpack_from("<I", message)
    head = json.loads(message[4:start])
    assert start % 8 == 0
    nx, ny, nz = head["size"]
    count, data = head["voxels"], message[start:]
    if head["bitmap"]:
        size = -(-nx * ny * nz // 8)
        bits = np.unpackbits(np.frombuffer(data[:size], np.uint8), bitorder="little")
        index = np.flatnonzero(bits)
        x, y, z = index % nx, index // nx % ny, index // nx // ny
    else:
        kind = np.dtype("<u2" if head["wide"] else "u1")
        size = 3 * count * kind.itemsize
        x, y, z = np.frombuffer(data[:size], kind).reshape(3, count).astype(int)
    assert len(x) == count
    format_ = vd.PixelFormat(head["format"])
    planes = np.frombuffer(data[size:], np.uint8)
    if format_ is vd.PixelFormat.INDEX8:
        head["palette"], planes = planes[-768:].reshape(3, 256).T, planes[:-768]
    planes = planes.reshape(0 if format_ is vd.PixelFormat.MONO1 else format_.bytes, count)
    page = np.zeros(format_.shape((nz, ny, nx)), format_.dtype)
    if format_ is vd.PixelFormat.MONO1:
        assert len(planes) == 0
        page[z, y, x] = 1
    elif format_ is vd.PixelFormat.RGB888:
        page[z, y, x] = planes.T
    elif format_ is vd.PixelFormat.RGB565:
        page[z, y, x] = planes[0] + planes[1] * np.uint16(256)
    else:
        page[z, y, x] = planes[0]
    return head, page
