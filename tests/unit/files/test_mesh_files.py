"""Mesh files: colours kept, losses refused, nothing read outside the folder, damage found."""

import base64
import io
import json
import struct
import sys
import zipfile

import numpy as np
import pytest

from voxdisplay.errors import BodyError, MissingExtra
from voxdisplay.files import load_body
from voxdisplay.files.mesh_files import read_mesh

trimesh = pytest.importorskip("trimesh", reason="needs the extra mesh")
Image = pytest.importorskip("PIL.Image", reason="needs the extra mesh")

BOX = trimesh.creation.box(extents=(3, 5, 7))
KINDS = ["stl", "ply", "off", "obj", "glb", "3mf"]


def exported(kind, mesh=BOX):
    data = mesh.export(file_type=kind)
    return data.encode() if isinstance(data, str) else data


def geometry(body):
    return body.geometry(body.bounds())


def gltf(**changes):
    """A glTF file of one triangle, with changes at its top level."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 3)], dtype="<f4").tobytes()
    scene = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,"
                     + base64.b64encode(points).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 2, 3]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }  # fmt: skip
    return json.dumps({**scene, **changes}).encode()


def refused(kind, data, words, folder=None):
    with pytest.raises(BodyError, match=words) as caught:
        read_mesh(f"some.{kind}", kind, data, folder)
    assert "some." in str(caught.value)


@pytest.mark.parametrize("kind", KINDS)
def test_a_box_is_read_whole(kind):
    body, notes = read_mesh("a", kind, exported(kind), None, fill="solid")
    assert len(body.faces) == 12
    assert body.fill == "solid"
    assert np.allclose(body.bounds(), [(-1.5, -2.5, -3.5), (1.5, 2.5, 3.5)])
    assert notes == ()


def test_gltf_by_hand_is_read():
    body, _ = read_mesh("a", "gltf", gltf(), None)
    assert np.allclose(
        geometry(body).vertices[geometry(body).faces[0]], [(0, 0, 0), (1, 0, 0), (0, 2, 3)]
    )


def test_vertex_colors_are_kept():
    mesh = BOX.copy()
    mesh.visual.vertex_colors = np.column_stack(
        (np.arange(8) * 9, np.full((8, 2), 7), np.full(8, 255))
    )
    for kind in ("ply", "glb"):
        body, _ = read_mesh("a", kind, exported(kind, mesh), None)
        colors = geometry(body).vertex_colors
        assert sorted(set(colors[:, 0])) == [9 * i for i in range(8)]
        assert (colors[:, 1:] == 7).all()


def test_face_colors_are_kept():
    mesh = BOX.copy()
    mesh.visual.face_colors = np.column_stack(
        (np.arange(12) * 9, np.full((12, 2), 7), np.full(12, 255))
    )
    body, _ = read_mesh("a", "ply", exported("ply", mesh), None)
    assert geometry(body).face_colors[:, 0].tolist() == [9 * i for i in range(12)]


OBJ = b"""mtllib a.mtl
v 0 0 0
v 4 0 0
v 0 4 0
v 0 0 4
vt 0 0
vt 1 0
vt 0 1
usemtl red
f 1/1 2/2 3/3
usemtl picture
f 1/1 2/2 4/3
"""
MTL = b"newmtl red\nKd 1 0 0\nnewmtl picture\nKd 1 1 1\nmap_Kd a.png\n"


def material_folder(tmp_path, material=MTL):
    (tmp_path / "a.mtl").write_bytes(material)
    image = Image.fromarray(np.arange(4 * 5 * 3, dtype=np.uint8).reshape(4, 5, 3))
    image.save(tmp_path / "a.png")
    (tmp_path / "a.obj").write_bytes(OBJ)
    return tmp_path / "a.obj"


def test_materials_and_textures_are_kept(tmp_path):
    loaded = load_body(material_folder(tmp_path))
    mesh = geometry(loaded.body)
    assert len(mesh.faces) == 2
    (texture,) = mesh.textures
    assert texture.tolist() == np.arange(60).reshape(4, 5, 3).tolist()
    plain, pictured = np.argsort(mesh.face_textures)
    assert mesh.face_textures[[plain, pictured]].tolist() == [-1, 0]
    assert mesh.face_colors[plain].tolist() == [255, 0, 0]
    assert mesh.face_colors[pictured].tolist() == [255, 255, 255]
    corners = mesh.uv[mesh.faces[pictured]]
    assert corners.tolist() == [[0, 0], [1, 0], [0, 1]]


def test_materials_that_are_missing_are_noted(tmp_path):
    (tmp_path / "a.obj").write_bytes(OBJ)
    loaded = load_body(tmp_path / "a.obj")
    assert any("a.mtl" in note for note in loaded.notes)
    assert len(loaded.body.faces) == 2


@pytest.mark.parametrize("name", ["../secret.png", "/etc/hostname", "..\\secret.png", "file:///etc/x",
                                  "https://127.0.0.1:9/x.png", "x/../../secret.png"])  # fmt: skip
def test_files_outside_of_the_folder_are_not_read(tmp_path, name):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "secret.png").write_bytes(b"secret")
    with pytest.raises(BodyError, match="outside"):
        load_body(material_folder(inner, MTL.replace(b"a.png", name.encode())))
    with pytest.raises(BodyError, match="outside"):
        read_mesh("a", "obj", OBJ.replace(b"a.mtl", name.encode()), inner)
    for group in ("buffers", "images"):
        with pytest.raises(BodyError, match="outside"):
            read_mesh("a", "gltf", gltf(**{group: [{"uri": name, "byteLength": 36}]}), inner)
    encoded = "".join(f"%{ord(letter):02x}" for letter in name)
    with pytest.raises(BodyError, match="outside"):
        read_mesh("a", "gltf", gltf(images=[{"uri": encoded}]), inner)


def test_links_out_of_the_folder_are_not_followed(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "secret.mtl").write_bytes(MTL)
    try:
        (inner / "a.mtl").symlink_to(tmp_path / "secret.mtl")
    except OSError:
        pytest.skip("no links here")
    (inner / "a.obj").write_bytes(OBJ)
    with pytest.raises(BodyError, match="leads outside"):
        load_body(inner / "a.obj")


def test_points_lines_and_fans_are_no_silent_loss():
    refused("obj", b"v 0 0 0\nv 1 1 1\nl 1 2\np 1\n", "only 1 lines and 1 points")
    body, notes = read_mesh("a", "obj", OBJ + b"l 1 2 3\n", None)
    assert "1 lines left out" in notes[0]
    assert len(body.faces) == 2
    mesh = {"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}
    refused("gltf", gltf(meshes=[mesh]), "fans")
    mesh = {"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}
    refused("gltf", gltf(meshes=[mesh]), "only points or lines")
    mesh = {"primitives": [{"attributes": {"POSITION": 0}, "mode": 1},
                           {"attributes": {"POSITION": 0}}]}  # fmt: skip
    _, notes = read_mesh("a", "gltf", gltf(meshes=[mesh]), None)
    assert "1 groups of points or lines left out" in notes[0]
    points = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    refused("ply", f"{points}property float z\nend_header\n0 0 0\n".encode(), "no triangles|mesh")


@pytest.mark.parametrize("word", ["nan", "inf", "-inf", "1e999"])
def test_vertices_that_are_not_finite_are_refused(word):
    refused("obj", OBJ.replace(b"v 4 0 0", f"v {word} 0 0".encode()), "vertex|mesh|finite")


def test_what_gltf_needs_and_is_not_read_is_refused():
    refused("gltf", gltf(extensionsRequired=["KHR_draco_mesh_compression"]), "draco")
    refused("gltf", gltf(asset={"version": "1.0"}), "version 2 is read")
    refused("gltf", b"[]", "scene")
    refused("gltf", b"{" * 100_000, "scene")
    refused("gltf", gltf(accessors=[{"bufferView": 0, "componentType": 5126, "count": 2**40,
                                     "type": "VEC3"}]), "mesh|claims|triangles")  # fmt: skip
    _, notes = read_mesh("a", "gltf", gltf(animations=[{"channels": [], "samplers": []}]), None)
    assert "animations" in notes[0]


PLY = """ply
format {form} 1.0
element vertex {v}
property float x
property float y
property float z
element face {f}
property list uchar int vertex_indices
end_header
"""


def test_headers_that_claim_too_much_are_refused():
    for form in ("ascii", "binary_little_endian", "binary_big_endian"):
        refused("ply", PLY.format(form=form, v=2**32, f=1).encode(), "cut off")
        refused("ply", PLY.format(form=form, v=3, f=2**32).encode() + bytes(36), "cut off")
    refused("ply", PLY.format(form="ascii", v="1" * 30, f=1).encode(), "claims")
    long = PLY.replace("list uchar", "list uint").format(form="binary_little_endian", v=3, f=1)
    refused("ply", long.encode() + bytes(36) + struct.pack("<4I", 2**32 - 1, 0, 1, 2), "mesh|trian")
    refused("stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50), "cut off")
    refused("off", b"OFF\n4294967296 1 0\n0 0 0\n", "cut off")
    refused("glb", b"glTF" + struct.pack("<4I", 2, 2**32 - 1, 8, 0), "cut off")
    refused("glb", b"glTF" + struct.pack("<2I", 1, 12), "version 2 is read")


def zipped(parts):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return file.getvalue()


def test_3mf_bombs_and_entities_are_refused():
    with zipfile.ZipFile(io.BytesIO(exported("3mf"))) as archive:
        parts = {info.filename: archive.read(info) for info in archive.infolist()}
    (model,) = (name for name in parts if name.endswith(".model"))
    read_mesh("a", "3mf", zipped(parts), None)
    entity = b'<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a "aaaa">]>'
    harmful = {**parts, model: entity + parts[model].partition(b"?>")[2]}
    refused("3mf", zipped(harmful), "entities")
    refused("3mf", zipped({**parts, "bomb.png": bytes(300 << 20)}), "unpacked")
    refused("3mf", zipped({**parts, "bomb.png": bytes(30 << 20)}), "unpacked")
    refused("3mf", zipped({"a.txt": b"x"}), "no triangles")
    refused("3mf", b"PK\3\4" + bytes(50), "archive")


WHOLE = {**{kind: exported(kind) for kind in KINDS}, "gltf": gltf()}
WHOLE["stl, text"] = BOX.export(file_type="stl_ascii").encode()
WHOLE["ply, text"] = BOX.export(file_type="ply", encoding="ascii")


@pytest.mark.parametrize("name", WHOLE)
def test_files_cut_off_at_any_byte_are_refused_or_whole(name):
    kind, data = name.split(",")[0], WHOLE[name]
    count = len(read_mesh("whole", kind, data, None)[0].faces)
    ends = range(len(data)) if len(data) < 700 else np.linspace(0, len(data) - 1, 300).astype(int)
    for end in ends:
        try:
            body, _ = read_mesh("cut", kind, data[:end], None)
        except BodyError:
            continue
        # Lines of text may end anywhere: what is there is a whole file of its own.
        assert kind in ("obj", "off", "ply", "gltf") or end > data.rindex(b"endsolid"), end
        assert len(body.faces) == count or kind == "obj", end


@pytest.mark.parametrize("name", WHOLE)
def test_changed_bytes_are_read_or_refused(name):
    kind, data = name.split(",")[0], WHOLE[name]
    random = np.random.default_rng(13)
    for _ in range(150):
        changed = np.frombuffer(data, np.uint8).copy()
        at = random.integers(0, len(changed), size=int(random.integers(1, 6)))
        changed[at] = random.choice([0, 32, 45, 57, 128, 255, int(random.integers(256))], len(at))
        try:
            body, _ = read_mesh("changed", kind, changed.tobytes(), None)
        except (BodyError, MissingExtra):
            continue
        assert np.isfinite(body.vertices).all()


def test_coordinates_without_an_image_are_no_color(tmp_path):
    (tmp_path / "a.obj").write_bytes(OBJ)
    mesh = geometry(load_body(tmp_path / "a.obj").body)
    assert mesh.textures == ()
    assert mesh.face_colors is None


def test_an_image_that_several_parts_show_is_held_once():
    box = trimesh.creation.box()
    image = Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3))
    uv = np.zeros((len(box.vertices), 2))
    box.visual = trimesh.visual.TextureVisuals(
        uv=uv, material=trimesh.visual.material.PBRMaterial(baseColorTexture=image)
    )
    scene = trimesh.Scene()
    for i in range(3):
        place = np.eye(4)
        place[0, 3] = 2 * i
        scene.add_geometry(box, geom_name="box", transform=place)
    body, _ = read_mesh("a", "glb", scene.export(file_type="glb"), None)
    assert len(body.faces) == 36
    assert len(geometry(body).textures) == 1
    assert set(geometry(body).face_textures) == {0}


def test_without_a_library_the_error_names_the_extra(monkeypatch):
    def lacks(*_, **__):
        raise ModuleNotFoundError("No module named 'lxml'")

    with monkeypatch.context() as patch:
        patch.setattr(trimesh, "load_scene", lacks)
        with pytest.raises(MissingExtra, match="meshes need trimesh") as caught:
            read_mesh("a", "3mf", exported("3mf"), None)
    assert "voxdisplay[mesh]" in caught.value.hint
    for module in ("trimesh", "PIL"):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, module, None)
            with pytest.raises(MissingExtra):
                read_mesh("a", "stl", exported("stl"), None)
