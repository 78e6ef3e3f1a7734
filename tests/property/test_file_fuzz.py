"""Fuzzing of all readers of files: changed bytes are drawn or refused, in bounded memory.

Small valid files of every kind are changed at random places, cut, and parts of them doubled, from
seeds; what is read is fitted to a display and voxelised, as `push FILE` does. Only documented
errors may leave. The memory of the process is limited: a reader that trusts a header runs into it.
"""

import base64
import contextlib
import gzip
import io
import json
import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from vox_chunks import layer, model, shape, transform, vox

import voxdisplay as vd
from voxdisplay.errors import BodyError, MissingExtra
from voxdisplay.files import fitted, load_body

ROOM_BYTES = 2 << 30
COUNTS = [pytest.param(25, id="some"), pytest.param(3000, id="many", marks=pytest.mark.slow)]
GRID = (13, 11, 9)
VALUES = np.arange(7 * 5 * 3, dtype=np.int16).reshape(7, 5, 3)
WORDS = [0, 1, 0x7F, 0x80, 0xFF, ord("9"), ord("-"), ord(" "), ord("\n"), ord("e")]


def mesh(kind, **options):
    trimesh = pytest.importorskip("trimesh", reason="needs the extra mesh")
    ball = trimesh.creation.icosphere(subdivisions=1, radius=3)
    ball.visual.vertex_colors = np.random.default_rng(1).integers(256, size=(42, 4))
    data = ball.export(file_type=kind, **options)
    return data.encode() if isinstance(data, str) else data


def gltf():
    glb = mesh("glb")
    length = struct.unpack("<I", glb[12:16])[0]
    scene = json.loads(glb[20 : 20 + length])
    packed = base64.b64encode(glb[28 + length :]).decode()
    scene["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{packed}"
    return json.dumps(scene).encode()


def nifti(*, packed):
    nibabel = pytest.importorskip("nibabel", reason="needs the extra volume")
    data = nibabel.Nifti1Image(VALUES.T, np.diag((-1, 1, 2, 1))).to_bytes()
    return gzip.compress(data) if packed else data


def nrrd(tmp_path, encoding):
    library = pytest.importorskip("nrrd", reason="needs the extra volume")
    library.write(str(tmp_path / "a.nrrd"), VALUES.T, {"encoding": encoding})
    return (tmp_path / "a.nrrd").read_bytes()


def tiff(compression):
    image = pytest.importorskip("PIL.Image", reason="needs the extra view")
    first, *more = (image.fromarray(page.astype(np.uint16)) for page in VALUES)
    file = io.BytesIO()
    first.save(file, "TIFF", save_all=True, append_images=more, compression=compression)
    return file.getvalue()


def array(save, *given, **named):
    file = io.BytesIO()
    save(file, *given, **named)
    return file.getvalue()


def qubicle():
    cells = np.random.default_rng(2).choice([0, 0xFF102030], size=105).astype("<u4")
    head = struct.pack("<6IB4s3I3i", 0x101, 0, 1, 0, 0, 1, 4, b"Part", 3, 5, 7, 1, 2, 3)
    runs = b"".join(struct.pack("<4I", 2, 15, 0xFF102030, 6) for _ in range(7))
    more = struct.pack("<B4s3I3i", 4, b"More", 3, 5, 7, 4, 2, 3)
    packed = struct.pack("<6I", 0x101, 0, 1, 1, 0, 1)
    return head + cells.tobytes(), packed + more + runs


def kv6():
    cells = b"".join(struct.pack("<4BHBB", 9, 8, 7, 128, z, 63, 0) for z in (1, 3, 5, 6))
    head = b"Kvxl" + struct.pack("<3I3fI", 3, 5, 7, 1, 2, 3, 4)
    return head + cells + struct.pack("<3I15H", 2, 0, 2, 2, *[0] * 11, 1, 1, 0)


def binvox():
    head = b"#binvox 1\ndim 3 7 5\ntranslate 0 0 0\nscale 1\ndata\n"
    return head + bytes([0, 10, 1, 40, 0, 5, 1, 50])


FILES = {
    "stl": lambda _: mesh("stl"),
    "stl, text": lambda _: mesh("stl_ascii"),
    "ply": lambda _: mesh("ply"),
    "ply, text": lambda _: mesh("ply", encoding="ascii"),
    "off": lambda _: mesh("off"),
    "obj": lambda _: mesh("obj"),
    "glb": lambda _: mesh("glb"),
    "gltf": lambda _: gltf(),
    "3mf": lambda _: mesh("3mf"),
    "nii": lambda _: nifti(packed=False),
    "nii.gz": lambda _: nifti(packed=True),
    "nrrd": lambda tmp_path: nrrd(tmp_path, "raw"),
    "nrrd, gzip": lambda tmp_path: nrrd(tmp_path, "gzip"),
    "nrrd, text": lambda tmp_path: nrrd(tmp_path, "ascii"),
    "tif": lambda _: tiff("raw"),
    "tif, lzw": lambda _: tiff("tiff_lzw"),
    "npy": lambda _: array(np.save, VALUES),
    "npz": lambda _: array(np.savez_compressed, volume=VALUES),
    "vox": lambda _: vox(
        model((3, 5, 7), [(0, 1, 2, 1), (2, 4, 6, 255)]),
        model((2, 2, 2), [(0, 1, 1, 7)]),
        transform(0, 1, t="1 2 3", r="40"),
        shape(1, 0, 1),
        layer(0, name="a"),
    ),
    "qb": lambda _: qubicle()[0],
    "qb, packed": lambda _: qubicle()[1],
    "kv6": lambda _: kv6(),
    "binvox": lambda _: binvox(),
}


def changed(data, random):
    """Return a file with some bytes changed, or a part left out or repeated."""
    found = bytearray(data)
    for _ in range(int(random.integers(1, 5))):
        # Half of the changes are in the first bytes, where headers are.
        end = len(found) if random.random() < 0.5 else min(len(found), 120)
        at = int(random.integers(end))
        what = random.random()
        if what < 0.7:
            found[at] = random.choice([*WORDS, int(random.integers(256))])
        elif what < 0.85:
            found[at : at + 4] = random.choice(
                [b"\xff\xff\xff\x7f", b"\xff" * 4, b"9999", bytes(4)]
            )
        else:
            stop = at + int(random.integers(1, 40))
            found[at:stop] = found[at:stop] * int(random.choice([0, 2]))
        if not found:
            break
    return bytes(found)


@contextlib.contextmanager
def limited_memory():
    resource = pytest.importorskip("resource", reason="no limits of processes here")
    if sys.platform != "linux":
        pytest.skip("the size of the process is found in /proc")
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM_BYTES, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def draw(path):
    """Return the number of voxels of a file on a display, None if it was refused."""
    try:
        body = load_body(path).body
        if np.isfinite(body.bounds()).all():
            body, _ = fitted(body, (0, 0, 0), GRID)
        return len(vd.voxelize(body, clip=GRID))
    except (BodyError, MissingExtra) as error:
        if len(str(error)) > 600:
            raise AssertionError(f"a message that nobody reads: {error}") from error
        return None


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", FILES)
def test_damaged_files_are_drawn_or_refused(name, count, tmp_path):
    data = FILES[name](tmp_path)
    path = tmp_path / f"some.{name.split(',')[0]}"
    path.write_bytes(data)
    assert draw(path)
    random = np.random.default_rng(20)
    refused = 0
    with limited_memory():
        for _ in range(count):
            path.write_bytes(changed(data, random))
            refused += draw(path) is None
    assert refused
