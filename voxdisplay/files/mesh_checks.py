"""Checks of mesh files before a library reads them, and of how much of them it read.

Libraries lose what they do not know without a word: triangle fans, points and lines, all that
follows a cut. These checks count what a file claims, and refuse what would be lost. They must not
know the library.
"""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Callable
from typing import Any, NamedTuple

from voxdisplay.errors import BodyError
from voxdisplay.files.byte_reader import ByteReader
from voxdisplay.files.guarded_calls import guarded

_MAX_UNPACKED = 1 << 28
_MAX_RATIO = 200  # of texts of numbers it is below 20
_SMALL = 1 << 20
_MAX_HEADER = 1 << 16
_SIZES = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4,
          "double": 8, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4,
          "float32": 4, "float64": 8}  # fmt: skip


class Claims(NamedTuple):
    """Sizes that the header of a file claims.

    Attributes
    ----------
    faces : int
        Least number of triangles.
    notes : tuple of str
        What is left out.

    """

    faces: int = 0
    notes: tuple[str, ...] = ()


def check(name: str, kind: str, data: bytes) -> Claims:
    """Return what a mesh file claims; raise `BodyError` if it is damaged or not to be trusted.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    kind : str
        ``"stl"``, ``"ply"``, ``"off"``, ``"obj"``, ``"glb"``, ``"gltf"`` or ``"3mf"``.
    data : bytes

    """
    if not data:
        raise BodyError(f"{name} is empty")
    return _CHECKS[kind](name, data)


def _check_stl(name: str, data: bytes) -> Claims:
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + 50 * count:
        return Claims(count)
    if data.lstrip()[:5].lower() != b"solid" or b"\0" in data[:512]:
        if len(data) < 84:
            raise BodyError(f"{name} is not an STL file")
        there = (len(data) - 84) // 50
        if there < count:
            raise BodyError(f"{name} is cut off: it claims {count} triangles and holds {there}")
        return Claims(count)  # what follows the triangles is a comment of some programs
    lower = data.lower()
    facets, vertices = (len(re.findall(rb"\b%s\b" % word, lower)) for word in (b"facet", b"vertex"))
    last = lower.rstrip().rpartition(b"\n")[2].lstrip()
    if vertices != 3 * facets or not last.startswith(b"endsolid"):
        raise BodyError(f"{name} is cut off or damaged: {facets} facets, {vertices} vertices, "
                        "and no endsolid at its end")  # fmt: skip
    return Claims(facets)


def _check_ply(name: str, data: bytes) -> Claims:
    mark = re.search(rb"\bend_header[ \t]*\r?\n?", data[:_MAX_HEADER])
    if not re.match(rb"ply\s", data) or not mark:
        raise BodyError(f"{name} is not a PLY file, or its header is incomplete")
    words = [line.split() for line in data[: mark.start()].decode("latin-1").splitlines()]
    form = next((line[1] for line in words if line[:1] == ["format"] and len(line) > 1), "")
    elements: list[tuple[str, int, int, bool]] = []  # name, count, least bytes, whether of lists
    for line in words:
        if line[:1] == ["element"] and len(line) == 3 and line[2].isdecimal() and len(line[2]) < 19:
            elements.append((line[1], int(line[2]), 0, False))
        elif line[:1] == ["element"]:
            raise BodyError(f"{name}: its header claims {' '.join(line[1:])[:60]!r}")
        elif line[:1] == ["property"] and elements:
            label, count, size, listed = elements[-1]
            kind = line[2] if line[1:2] == ["list"] and len(line) > 2 else "".join(line[1:2])
            if kind not in _SIZES:
                raise BodyError(f"{name}: its header has a property of the type {kind[:40]!r}")
            elements[-1] = label, count, size + _SIZES[kind], listed or line[1] == "list"
    body = len(data) - mark.end()
    binary = form.startswith("binary")
    if binary:
        least = sum(count * size for _, count, size, _ in elements)
    else:
        least = sum(count for _, count, _, _ in elements)
        body = data.count(b"\n", mark.end()) + (not data.endswith(b"\n"))
    if body < least:
        unit = "bytes" if binary else "lines"
        raise BodyError(f"{name} is cut off: it claims at least {least} {unit} and holds {body}")
    faces = sum(count for label, count, _, listed in elements if label == "face" and listed)
    return Claims(faces)


def _check_off(name: str, data: bytes) -> Claims:
    text = re.sub(rb"#[^\n]*", b"", data[:_MAX_HEADER])
    head = re.match(rb"\s*(?:C|N|ST|4)*OFF\b\s+(\d{1,18})\s+(\d{1,18})(?:\s+\d+)?\s", text)
    if not head:
        raise BodyError(f"{name} is not an OFF file, or its header is incomplete")
    vertices, faces = int(head[1]), int(head[2])
    if 2 * (vertices + faces) > len(data):
        raise BodyError(f"{name} is cut off: it claims {vertices} vertices and {faces} faces")
    return Claims(faces)


def _check_obj(name: str, data: bytes) -> Claims:
    joined = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    counts = {
        word: len(re.findall(rb"(?:^|[\r\n])[ \t]*%s[ \t]+" % word, joined))
        for word in (b"v", b"f", b"l", b"p", b"curv", b"surf")
    }
    if not counts[b"v"]:
        raise BodyError(f"{name} is not an OBJ file: it has no vertices")
    lost = {"lines": counts[b"l"], "points": counts[b"p"],
            "curves and free-form surfaces": counts[b"curv"] + counts[b"surf"]}  # fmt: skip
    named = " and ".join(f"{count} {what}" for what, count in lost.items() if count)
    if not counts[b"f"]:
        raise BodyError(f"{name} has no faces" + (f", only {named}" if named else ""))
    return Claims(counts[b"f"], (f"{named} left out: they are no faces",) if named else ())


def _check_glb(name: str, data: bytes) -> Claims:
    reader = ByteReader(name, data)
    if reader.bytes(4, "the file's mark") != b"glTF":
        raise BodyError(f"{name} is not a GLB file")
    version, length = reader.integers(2, "the header", "I")
    if version != 2:
        raise BodyError(f"{name} is glTF {version}, of which version 2 is read")
    if length > len(data):
        raise BodyError(f"{name} is cut off: {len(data)} of {length} bytes")
    size, kind = reader.integers(2, "a chunk", "I")
    text = reader.bytes(size, "the scene")
    if kind != 0x4E4F534A:
        raise BodyError(f"{name}: its first chunk is not the scene")
    return _check_scene(name, text)


def _check_scene(name: str, text: bytes) -> Claims:
    """Check the JSON of a glTF file."""
    scene = guarded(name, "its scene", lambda: json.loads(text))
    found: Claims = guarded(name, "its scene", lambda: _scene_claims(name, scene))
    return found


def _scene_claims(name: str, scene: dict[str, Any]) -> Claims:
    version = str(scene["asset"]["version"])
    if not version.startswith("2"):
        raise BodyError(f"{name} is glTF {version[:20]}, of which version 2 is read")
    required = set(scene.get("extensionsRequired", ())) - _KNOWN_EXTENSIONS
    if required:
        raise BodyError(f"{name} needs {', '.join(sorted(map(str, required)))[:200]}, "
                        "which is not read")  # fmt: skip
    for group in ("buffers", "images"):
        for entry in scene.get(group, ()):
            check_uri(name, str(entry.get("uri", "")))
    accessors = scene.get("accessors", ())
    faces = left_out = 0
    for primitive in (one for mesh in scene.get("meshes", ()) for one in mesh["primitives"]):
        mode = primitive.get("mode", 4)
        if mode == 6:
            raise BodyError(
                f"{name} has triangle fans, which are not read", hint="export it with triangles"
            )
        if mode not in (4, 5):
            left_out += 1
            continue
        source = primitive.get("indices", primitive["attributes"].get("POSITION"))
        count = int(accessors[source]["count"])
        faces += count // 3 if mode == 4 else 1
    if not faces:
        raise BodyError(f"{name} has no triangles" + (", only points or lines" * bool(left_out)))
    notes = [f"{left_out} groups of points or lines left out"] if left_out else []
    if scene.get("animations"):
        notes.append("its animations are not played")
    return Claims(faces, tuple(notes))


_KNOWN_EXTENSIONS = {
    "KHR_materials_unlit", "KHR_texture_transform", "KHR_materials_pbrSpecularGlossiness",
    "KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_materials_ior",
    "KHR_materials_specular", "KHR_materials_transmission", "KHR_materials_clearcoat",
    "KHR_materials_sheen", "KHR_materials_volume", "KHR_mesh_quantization",
}  # fmt: skip


def check_uri(name: str, uri: str) -> None:
    """Raise `BodyError` if a reference of a file leads out of its folder, or to the net."""
    if uri.startswith("data:"):
        return
    plain = re.sub(r"%([0-9a-fA-F]{2})", lambda found: chr(int(found[1], 16)), uri)
    parts = re.split(r"[/\\]", plain)
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", plain) or ".." in parts or plain[:1] in ("/", "\\"):
        raise BodyError(f"{name} refers to {uri[:80]!r}, outside of its folder")


def _check_3mf(name: str, data: bytes) -> Claims:
    def parts() -> list[tuple[str, bytes]]:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            infos = archive.infolist()
            total = sum(info.file_size for info in infos)
            if total > _MAX_UNPACKED or (total > _SMALL and total > _MAX_RATIO * len(data)):
                raise BodyError(f"{name} would be {total} bytes unpacked, from {len(data)}")
            return [
                (info.filename, archive.read(info))
                for info in infos
                if info.filename.lower().endswith((".model", ".rels", ".xml"))
            ]

    count = 0
    for part, content in guarded(name, "the archive", parts):
        if re.search(rb"<!\s*(?:DOCTYPE|ENTITY)", content, re.IGNORECASE) or b"\0" in content[:256]:
            raise BodyError(f"{name}: {part[:80]} defines entities, or is not UTF-8")
        if part.lower().endswith(".model"):
            count += len(re.findall(rb"<(?:\w+:)?triangle\b", content))
    if not count:
        raise BodyError(f"{name} has no triangles")
    return Claims(0)  # parts may be used several times, or not at all


_CHECKS: dict[str, Callable[[str, bytes], Claims]] = {
    "stl": _check_stl,
    "ply": _check_ply,
    "off": _check_off,
    "obj": _check_obj,
    "glb": _check_glb,
    "gltf": _check_scene,
    "3mf": _check_3mf,
}
