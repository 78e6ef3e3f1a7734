"""Recognition of files that are not scenes by their first bytes.

It names, in errors, what was opened by mistake; it must not read such files.
"""

from __future__ import annotations

import re
from typing import NamedTuple


class ForeignFile(NamedTuple):
    """Kind of a file that is not a scene, and what to do with it."""

    kind: str
    hint: str


_SCENES = "a scene is a JSON file; examples/ has some"
_MESH = "it is shown as it is if its name ends in %s"
_POINTS = 'a scene of one object shows it: {"type": "points", "file": "%s"}'
_BY_FIRST_BYTES = (
    (b"glTF", "a glTF mesh", _MESH % ".glb"),
    (b"ply\n", "a PLY mesh", _MESH % ".ply"),
    (b"ply\r", "a PLY mesh", _MESH % ".ply"),
    (b"OFF\n", "an OFF mesh", _MESH % ".off"),
    (b"OFF\r", "an OFF mesh", _MESH % ".off"),
    (b"\x93NUMPY", "a numpy array", _POINTS % "points.npy"),
    (b"VOX ", "a voxel model (.vox)", _MESH % ".vox"),
    (b"#binvox", "a voxel model (.binvox)", _MESH % ".binvox"),
    (b"NRRD", "a volume (.nrrd)", _MESH % ".nrrd"),
    (b"PK\x03\x04", "a ZIP archive (such as .3mf, .npz or .xlsx)", _SCENES),
    (b"\x1f\x8b", "compressed by gzip", "unpack it first"),
    (b"\x89PNG", "a picture", _SCENES),
    (b"\xff\xd8\xff", "a picture", _SCENES),
    (b"GIF8", "a picture", _SCENES),
    (b"II*\0", "a TIFF picture", _MESH % ".tif"),
    (b"MM\0*", "a TIFF picture", _MESH % ".tif"),
    (b"%PDF", "a PDF document", _SCENES),
    (b"\x7fELF", "a program", _SCENES),
    (b"MZ", "a program", _SCENES),
    (b"<", "HTML or XML text", _SCENES),
)
_OBJ = re.compile(
    rb"(?:\s|#[^\n]*\n|(?:o|g|s|mtllib|usemtl)\s[^\n]*\n)*(?:v|vn|vt)(?:\s+[-+.\deE]+){2,}"
)
_STL = re.compile(rb"\s*solid\b[^\n]*\n\s*(?:facet\s+normal|endsolid)\b")
_NUMBERS = re.compile(
    rb"(?:\s*[#%][^\n]*\n)*(?:[\w \"',;.\t-]*+[\r\n]++)?"  # comments, and a line of names
    rb"\s*+[-+]?[\d.][-+.\deE]*\s*[,;\t ]\s*[-+\d.]"
)


def recognise(data: bytes) -> ForeignFile | None:
    """Return what a file is that is not JSON; None if that is not known."""
    for begin, kind, hint in _BY_FIRST_BYTES:
        if data.startswith(begin):
            return ForeignFile(kind, hint)
    head = data[:4096].lstrip()
    if head[:1] in (b"{", b"["):
        return None
    faces = int.from_bytes(data[80:84], "little")
    if _STL.match(head) or (len(data) >= 84 and len(data) == 84 + 50 * faces):
        return ForeignFile("an STL mesh", _MESH % ".stl")
    if _OBJ.match(head):
        return ForeignFile("an OBJ mesh", _MESH % ".obj")
    if b"\0" in head:
        return ForeignFile("a binary file", _SCENES)
    if _NUMBERS.match(head):
        return ForeignFile("a table of numbers", _POINTS % "points.csv")
    return None


def unicode_encoding(data: bytes) -> str | None:
    """Return the name of a Unicode encoding other than UTF-8 that a text is in, if it is."""
    if data.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return "UTF-32"
    head = data[:64]
    # Latin letters of UTF-16 have every other byte zero.
    zeros = head.count(0)
    other = 0 in (head[::2].count(0), head[1::2].count(0)) and zeros >= len(head) // 2 - 4 > 0
    return "UTF-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) or other else None
