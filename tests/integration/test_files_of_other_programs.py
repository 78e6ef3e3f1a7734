"""Files that other programs wrote: assimp, ADMesh, goxel, teem, nifti_tool, dcmtk, trimesh."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.files import fitted, load_body
from voxdisplay.files.array_files import read_npy


def program(*names):
    """Path of the first of some programs that is there; else the test is skipped."""
    for name in names:
        if found := shutil.which(name):
            return found
    pytest.skip(f"needs {names[0]}")
    return None


def run(*command, **options):
    subprocess.run([*map(str, command)], check=True, capture_output=True, timeout=120, **options)


def tetrahedron(path):
    """An STL file of a tetrahedron of different sides: axes that are exchanged show."""
    corners = np.array([(0, 0, 0), (7, 0, 0), (0, 5, 0), (0, 0, 3)])
    lines = ["solid t"]
    for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)):
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {' '.join(map(str, corners[i]))}" for i in face]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid t"]) + "\n", encoding="ascii")
    return path


def bounds(loaded):
    low, high = loaded.body.bounds()
    return np.round(low, 4).tolist(), np.round(high, 4).tolist()


@pytest.mark.parametrize("kind", ["stl", "stlb", "ply", "plyb", "obj", "glb2", "gltf2", "3mf"])
def test_meshes_of_assimp(tmp_path, kind):
    pytest.importorskip("trimesh", reason="needs the extra mesh")
    assimp = program("assimp")
    source = tetrahedron(tmp_path / "t.stl")
    suffix = {"stlb": "stl", "plyb": "ply", "glb2": "glb", "gltf2": "gltf"}.get(kind, kind)
    made = tmp_path / f"made.{suffix}"
    run(assimp, "export", source, made, f"-f{kind}")
    loaded = load_body(made)
    if suffix in ("glb", "gltf"):  # y is up there: (x, y, z) is shown as (x, -z, y)
        assert bounds(loaded) == ([0, -3, 0], [7, 0, 5])
        loaded = load_body(made, up="z")
    assert bounds(loaded) == ([0, 0, 0], [7, 5, 3])
    shell = vd.voxelize(fitted(loaded.body, (0, 0, 0), (21, 15, 9))[0])
    plain = vd.voxelize(fitted(load_body(source).body, (0, 0, 0), (21, 15, 9))[0])
    assert np.array_equal(shell.voxels, plain.voxels)


@pytest.mark.parametrize("option", ["--write-ascii-stl", "--write-binary-stl", "--write-off"])
def test_meshes_of_admesh(tmp_path, option):
    pytest.importorskip("trimesh", reason="needs the extra mesh")
    admesh = program("admesh")
    source = tetrahedron(tmp_path / "t.stl")
    made = tmp_path / ("made.off" if option.endswith("off") else "made.stl")
    run(admesh, f"{option}={made}", source)
    loaded = load_body(made, fill="solid")
    assert bounds(loaded) == ([0, 0, 0], [7, 5, 3])
    assert len(vd.voxelize(loaded.body).voxels) > 5


@pytest.mark.parametrize("kind", ["stl", "ply", "off", "obj", "glb", "3mf"])
def test_meshes_of_trimesh(tmp_path, kind):
    trimesh = pytest.importorskip("trimesh", reason="needs the extra mesh")
    made = tmp_path / f"made.{kind}"
    trimesh.load_mesh(tetrahedron(tmp_path / "t.stl")).export(made)
    assert bounds(load_body(made, up="z")) == ([0, 0, 0], [7, 5, 3])


PLACES = {(0, 0, 0): "ff0000", (1, 0, 0): "ff0000", (2, 0, 0): "00ff00", (0, 1, 0): "0000ff",
          (0, 0, 1): "ffff00", (0, 0, 2): "ffff00", (0, 0, 3): "808080"}  # fmt: skip


def goxel(source, made):
    """Convert a file by goxel, whose window needs a display."""
    path = program("goxel")
    if not sys.platform.startswith("linux"):
        pytest.skip("goxel opens a window")
    run(program("xvfb-run"), "-a", path, source, "--export", made, cwd=made.parent)


def goxel_text(path):
    rows = [f"{x} {y} {z} {color}" for (x, y, z), color in PLACES.items()]
    path.write_text("# goxel\n" + "\n".join(rows) + "\n", encoding="ascii")
    return path


def shown(body):
    found = vd.voxelize(body)
    rows = zip(found.voxels.tolist(), found.colors.tolist(), strict=True)
    return {tuple(voxel): bytes(color).hex() for voxel, color in rows}


def test_voxels_of_goxel(tmp_path):
    goxel(goxel_text(tmp_path / "in.txt"), tmp_path / "made.vox")
    assert shown(load_body(tmp_path / "made.vox").body) == PLACES


def test_qubicle_files_of_goxel(tmp_path):
    goxel(goxel_text(tmp_path / "in.txt"), tmp_path / "made.qb")
    # It says that its axes are right-handed, but exchanges two of them: that mirrors.
    mirrored = {(x, -y, z): color for (x, y, z), color in PLACES.items()}
    assert shown(load_body(tmp_path / "made.qb").body) == mirrored


def test_meshes_of_goxel(tmp_path):
    pytest.importorskip("trimesh", reason="needs the extra mesh")
    goxel(goxel_text(tmp_path / "in.txt"), tmp_path / "made.ply")
    loaded = load_body(tmp_path / "made.ply", fill="solid")
    assert bounds(loaded) == ([0, 0, 0], [3, 2, 4])
    found = set(map(tuple, vd.voxelize(loaded.body).voxels.tolist()))
    assert found == set(PLACES)


def test_goxel_reads_our_voxels(tmp_path):
    frame = vd.Frame((3, 5, 7))
    for place, color in PLACES.items():
        frame.draw(np.array([place]), f"#{color}")
    np.save(tmp_path / "page.npy", frame.array())
    run(sys.executable, "-m", "voxdisplay", "convert", tmp_path / "page.npy", "-o",
        tmp_path / "ours.vox", "--size", "3x5x7", "--fit", "none")  # fmt: skip
    goxel(tmp_path / "ours.vox", tmp_path / "back.txt")
    rows = [
        line.split()
        for line in (tmp_path / "back.txt").read_text(encoding="ascii").splitlines()
        if not line.startswith("#")
    ]
    found = np.array([[int(each) for each in row[:3]] for row in rows])
    expected = np.array(list(PLACES))
    # It centres models: only differences of places are kept.
    order = {
        tuple(place): row[3] for place, row in zip(found - found.min(axis=0), rows, strict=True)
    }
    assert order == {tuple(place - expected.min(axis=0)): color
                     for place, color in zip(expected, PLACES.values(), strict=True)}  # fmt: skip


VALUES = np.arange(105, dtype=np.int16).reshape(7, 5, 3) * 3


def samples(body):
    """Values of a volume by voxel, as the array it shows."""
    found = vd.voxelize(body)
    array = np.zeros((found.voxels.max(axis=0) + 1)[::-1])
    x, y, z = found.voxels.T
    array[z, y, x] = found.parameters["value"]
    return array


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2", "ascii", "hex"])
def test_volumes_of_teem(tmp_path, encoding):
    pytest.importorskip("nrrd", reason="needs the extra volume")
    unu = program("teem-unu", "unu")
    VALUES.astype("<i2").tofile(tmp_path / "v.raw")
    made = tmp_path / "made.nrrd"
    run(unu, "make", "-i", tmp_path / "v.raw", "-t", "short", "-s", 3, 5, 7, "-e", "raw",
        "-en", "little", "-sp", 1, 1, 2, "-o", tmp_path / "one.nrrd")  # fmt: skip
    try:
        run(unu, "save", "-f", "nrrd", "-e", encoding, "-i", tmp_path / "one.nrrd", "-o", made)
    except subprocess.CalledProcessError:
        pytest.skip(f"this teem does not write {encoding}")
    body = load_body(made, threshold=0).body
    assert np.array_equal(samples(body)[::2], VALUES)
    assert np.allclose(body.bounds()[1], (3, 5, 14))


def test_detached_volumes_of_teem(tmp_path):
    pytest.importorskip("nrrd", reason="needs the extra volume")
    unu = program("teem-unu", "unu")
    VALUES.astype("<i2").tofile(tmp_path / "v.raw")
    run(unu, "make", "-h", "-i", "v.raw", "-t", "short", "-s", 3, 5, 7, "-e", "raw", "-en",
        "little", "-o", "made.nhdr", cwd=tmp_path)  # fmt: skip
    assert np.array_equal(samples(load_body(tmp_path / "made.nhdr", threshold=0).body), VALUES)


def test_volumes_of_nifti_tool(tmp_path):
    pytest.importorskip("nibabel", reason="needs the extra volume")
    tool = program("nifti_tool")
    made = tmp_path / "made.nii"
    run(tool, "-make_im", "-prefix", made, "-new_dim", 3, 3, 5, 7, 1, 1, 1, 1,
        "-new_datatype", 4)  # fmt: skip
    content = made.read_bytes()
    made.write_bytes(content[: -VALUES.nbytes] + VALUES.astype("<i2").tobytes())
    assert np.array_equal(samples(load_body(made, threshold=0).body), VALUES)
    mirrored = tmp_path / "mirrored.nii"
    run(tool, "-mod_hdr", "-prefix", mirrored, "-infiles", made, "-mod_field", "sform_code", 1,
        "-mod_field", "srow_x", "-1 0 0 0", "-mod_field", "srow_y", "0 1 0 0",
        "-mod_field", "srow_z", "0 0 2 0")  # fmt: skip
    body = load_body(mirrored, threshold=0).body
    assert np.array_equal(samples(body)[::2], VALUES[:, :, ::-1])


DUMP = """
(0002,0010) UI =LittleEndianExplicit
(0008,0016) UI =CTImageStorage
(0008,0018) UI [1.2.3.{k}]
(0008,0060) CS [CT]
(0018,0050) DS [2]
(0020,000d) UI [1.2.4]
(0020,000e) UI [1.2.{series}]
(0020,0032) DS [0\\0\\{z}]
(0020,0037) DS [1\\0\\0\\0\\1\\0]
(0028,0002) US 1
(0028,0004) CS [MONOCHROME2]
(0028,0010) US 5
(0028,0011) US 3
(0028,0030) DS [1\\1]
(0028,0100) US 16
(0028,0101) US 16
(0028,0102) US 15
(0028,0103) US 1
(0028,1050) DS [150]
(0028,1051) DS [101]
(0028,1052) DS [-1000]
(0028,1053) DS [2]
(7fe0,0010) OW ={raw}
"""


@pytest.mark.parametrize("coding", [None, "dcmcrle"])
def test_series_of_dcmtk(tmp_path, coding):
    pytest.importorskip("pydicom", reason="needs the extra volume")
    dump2dcm = program("dump2dcm")
    folder = tmp_path / "series"
    folder.mkdir()
    order = [3, 0, 6, 1, 5, 2, 4]  # names are in another order than positions
    for k in range(7):
        raw = tmp_path / f"{k}.raw"
        VALUES[k].astype("<i2").tofile(raw)
        text = tmp_path / f"{k}.txt"
        text.write_text(DUMP.format(k=k, z=2.0 * k, series=7, raw=raw), encoding="ascii")
        made = folder / f"slice{order[k]}.dcm"
        run(dump2dcm, text, made)
        if coding:
            run(program(coding), made, made)
    other = tmp_path / "other.txt"
    other.write_text(DUMP.format(k=9, z=99, series=8, raw=tmp_path / "0.raw"), encoding="ascii")
    run(dump2dcm, other, folder / "zzz.dcm")
    loaded = load_body(folder / "slice3.dcm", threshold=-2000)
    # LPS: x and y are turned to the right and to the front.
    assert np.array_equal(samples(loaded.body)[::2], 2.0 * VALUES[:, ::-1, ::-1] - 1000)
    assert loaded.body.window == (99.5, 199.5)
    assert any("1 other series" in note for note in loaded.notes)
    assert np.array_equal(samples(load_body(folder, threshold=-2000).body), samples(loaded.body))


def test_arrays_of_numpy_itself(tmp_path):
    for kind in ("u1", "<i2", ">f4", "f8", "?"):
        array = np.asfortranarray(VALUES.astype(kind)) if kind == ">f4" else VALUES.astype(kind)
        np.save(tmp_path / "a.npy", array)
        assert np.array_equal(read_npy("a", Path(tmp_path / "a.npy").read_bytes()), array)
        np.savez_compressed(tmp_path / "a.npz", volume=array, note=np.array("text"))
        body = load_body(tmp_path / "a.npz", threshold=-1).body
        assert np.array_equal(samples(body), array)
