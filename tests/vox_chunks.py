"""MagicaVoxel files made by hand, chunk by chunk, after the format's description."""

import struct

import numpy as np


def chunk(kind, content=b"", children=b""):
    return kind + struct.pack("<2i", len(content), len(children)) + content + children


def text(value):
    return struct.pack("<i", len(value)) + value.encode()


def attributes(**values):
    pairs = b"".join(text(f"_{key}") + text(value) for key, value in values.items())
    return struct.pack("<i", len(values)) + pairs


def model(size, voxels):
    rows = np.array(voxels, dtype=np.uint8).reshape(-1, 4)
    content = struct.pack("<i", len(rows)) + rows.tobytes()
    return chunk(b"SIZE", struct.pack("<3i", *size)) + chunk(b"XYZI", content)


def transform(node, child, layer=-1, frames=1, hidden=None, **motion):
    own = attributes(hidden=hidden) if hidden else attributes()
    place = struct.pack("<4i", child, -1, layer, frames) + attributes(**motion) * frames
    return chunk(b"nTRN", struct.pack("<i", node) + own + place)


def group(node, *children):
    listed = struct.pack(f"<{len(children) + 1}i", len(children), *children)
    return chunk(b"nGRP", struct.pack("<i", node) + attributes() + listed)


def shape(node, *models, **frame):
    listed = b"".join(struct.pack("<i", number) + attributes(**frame) for number in models)
    head = struct.pack("<i", node) + attributes() + struct.pack("<i", len(models))
    return chunk(b"nSHP", head + listed)


def layer(number, **values):
    return chunk(b"LAYR", struct.pack("<i", number) + attributes(**values) + struct.pack("<i", -1))


def vox(*chunks):
    return b"VOX " + struct.pack("<i", 150) + chunk(b"MAIN", b"", b"".join(chunks))
