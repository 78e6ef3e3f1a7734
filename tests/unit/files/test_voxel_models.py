"""Voxel models: .vox, .qb, .kv6 and binvox, made by hand after the formats' descriptions."""

import struct

import numpy as np
import pytest
from vox_chunks import chunk, group, layer, model, shape, transform, vox

from voxdisplay.errors import BodyError
from voxdisplay.files.magicavoxel import default_palette, read_vox
from voxdisplay.files.voxel_models import read_binvox, read_kv6, read_qb


def shown(data):
    found = read_vox("a.vox", data)
    rows = zip(found.voxels.tolist(), found.colors.tolist(), strict=True)
    return {tuple(voxel): tuple(color) for voxel, color in rows}


def test_the_default_palette_is_white_first_then_a_cube_and_four_ramps():
    palette = default_palette()
    assert palette.shape == (256, 3)
    assert palette[[0, 1, 5, 6]].tolist() == [
        [255, 255, 255], [255, 255, 204], [255, 255, 0], [255, 204, 255],
    ]  # fmt: skip
    assert palette[214].tolist() == [0, 0, 51]
    assert palette[[215, 224, 225, 235, 245, 254]].tolist() == [
        [238, 0, 0], [17, 0, 0], [0, 238, 0], [0, 0, 238], [238] * 3, [17] * 3,
    ]  # fmt: skip


def test_colors_are_entries_before_their_index():
    colors = np.arange(1024, dtype=np.uint16).astype(np.uint8).reshape(256, 4)
    data = vox(model((3, 5, 7), [(0, 1, 2, 1), (2, 4, 6, 255)]), chunk(b"RGBA", colors.tobytes()))
    assert shown(data) == {(0, 1, 2): (0, 1, 2), (2, 4, 6): tuple(colors[254, :3])}


def test_voxels_of_index_zero_are_empty():
    assert list(shown(vox(model((3, 5, 7), [(0, 0, 0, 0), (1, 1, 1, 9)])))) == [(1, 1, 1)]


ROTATION = 1 | 0 << 2 | 1 << 4  # rows (0, -1, 0), (1, 0, 0), (0, 0, 1)


def test_the_scene_graph_places_models():
    data = vox(
        model((1, 3, 2), [(0, 0, 0, 1), (0, 2, 1, 2)]),
        transform(0, 1),
        group(1, 2, 4),
        transform(2, 3, t="10 20 30"),
        shape(3, 0),
        transform(4, 5, t="-5 0 0", r=str(ROTATION)),
        shape(5, 0),
    )
    found = read_vox("a.vox", data).voxels.tolist()
    # floor(R (p + 1/2 - floor(size / 2)) + t), with floor(size / 2) = (0, 1, 1).
    assert found[:2] == [[10, 19, 29], [10, 21, 30]]
    centers = np.array([(0.5, -0.5, -0.5), (0.5, 1.5, 0.5)])
    turned = centers @ np.array([(0, -1, 0), (1, 0, 0), (0, 0, 1)]).T + (-5, 0, 0)
    assert found[2:] == np.floor(turned).astype(int).tolist()


def test_transforms_are_composed_down_the_tree():
    data = vox(
        model((2, 2, 2), [(1, 1, 1, 1)]),
        transform(0, 1, t="100 0 0", r=str(ROTATION)),
        group(1, 2),
        transform(2, 3, t="0 7 0"),
        shape(3, 0),
    )
    # The voxel's centre is (.5, .5, .5); moved (.5, 7.5, .5); turned (-7.5, .5, .5).
    assert list(shown(data)) == [(92, 0, 0)]


@pytest.mark.parametrize(
    "hidden",
    [
        [transform(0, 1, hidden="1"), layer(0)],
        [transform(0, 1, layer=3), layer(3, hidden="1")],
    ],
)
def test_hidden_nodes_and_layers_are_left_out(hidden):
    model_and_shape = [model((1, 1, 1), [(0, 0, 0, 1)]), shape(1, 0)]
    with pytest.raises(BodyError, match="hidden"):
        read_vox("a.vox", vox(*model_and_shape, *hidden))
    both = vox(*model_and_shape, *hidden, transform(7, 8, t="5 5 5"), shape(8, 0))
    found = read_vox("a.vox", both)
    assert found.voxels.tolist() == [[5, 5, 5]]
    assert found.notes == ("1 hidden part left out",)


def test_of_several_frames_the_first_is_shown():
    one, two = model((1, 1, 1), [(0, 0, 0, 1)]), model((1, 1, 2), [(0, 0, 1, 2)])
    found = read_vox("a.vox", vox(one, two))
    assert found.voxels.tolist() == [[0, 0, 0]]
    assert "2 models" in found.notes[0]
    found = read_vox("a.vox", vox(one, two, transform(0, 1), shape(1, 1, 0)))
    assert "2 frames" in found.notes[0]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "0 are left"),
        (b"RIFF1234", "not a MagicaVoxel"),
        (b"VOX " + bytes(4), "no model"),
        (vox(), "no model"),
        (vox(chunk(b"PACK", struct.pack("<i", 2**31 - 1))), "no model"),
        (vox(chunk(b"SIZE", struct.pack("<3i", 2**31 - 1, 1, 1))), "2147483647 x 1 x 1"),
        (vox(chunk(b"SIZE", struct.pack("<3i", 1, 1, -1))), "1 x 1 x -1"),
        (vox(chunk(b"XYZI", struct.pack("<i", 0))), "without a size"),
        (vox(model((1, 1, 1), [(1, 0, 0, 1)])), r"\(1, 0, 0\) is outside"),
        (vox(chunk(b"SIZE", struct.pack("<3i", 1, 1, 1)),
             chunk(b"XYZI", struct.pack("<i", 2**31 - 1))), "voxels"),
        (vox(chunk(b"SIZE", struct.pack("<3i", 1, 1, 1)),
             chunk(b"XYZI", struct.pack("<i", -1))), "voxels"),
        (b"VOX " + bytes(4) + b"MAIN" + struct.pack("<2i", -1, 0), "-1 bytes"),
        (b"VOX " + bytes(4) + b"MAIN" + struct.pack("<2i", 0, -5), "-5 bytes"),
        (vox(model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 0)), "circle"),
        (vox(model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 5)), "no node 5"),
        (vox(model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 1), shape(1, 9)), "model 9 of 1"),
        (vox(model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 1, t="1 2"), shape(1, 0)), "'1 2'"),
        (vox(model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 1, t="1 2 1e9"), shape(1, 0)), "1e9"),
        (vox(model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 1, r="5"), shape(1, 0)), "'5'"),
        (vox(model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 1, r="\u0664"), shape(1, 0)), "rot"),
        (vox(model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 1, frames=0)), "0 frames"),
    ],
)  # fmt: skip
def test_damaged_vox_files_are_refused(data, words):
    with pytest.raises(BodyError, match=words) as caught:
        read_vox("some.vox", data)
    assert "some.vox" in str(caught.value)


def test_a_graph_with_as_many_paths_as_2_to_the_64_is_refused():
    deep = [group(i, i + 1, i + 1) for i in range(64)]
    data = vox(model((1, 1, 1), [(0, 0, 0, 1)]), *deep, shape(64, 0))
    with pytest.raises(BodyError, match="too large"):
        read_vox("a.vox", data)
    moves = [transform(i, i + 1, t="16000000 0 0") for i in range(9)]
    with pytest.raises(BodyError, match="out of sight"):
        read_vox("a.vox", vox(model((1, 1, 1), [(0, 0, 0, 1)]), *moves, shape(9, 0)))


CELLS = {(0, 0, 0): 0xFF0000FF, (2, 0, 0): 0xFF00FF00, (0, 4, 6): 0xFFFF0000}  # abgr


def qb(right_handed=1, bgra=0, compressed=0, place=(0, 0, 0)):
    cells = np.zeros((7, 5, 3), dtype="<u4")
    for (x, y, z), color in CELLS.items():
        red, green, blue = color & 255, color >> 8 & 255, color >> 16 & 255
        low, high = (blue, red) if bgra else (red, blue)
        cells[z, y, x] = 0xFF << 24 | high << 16 | green << 8 | low
    body = cells.tobytes()
    if compressed:
        body = b""
        for plane in cells:
            flat = plane.reshape(-1).tolist()
            at = 0
            while at < len(flat):
                run = at
                while run < len(flat) and flat[run] == flat[at]:
                    run += 1
                length = run - at
                body += struct.pack("<3I", 2, length, flat[at]) if length > 1 else struct.pack(
                    "<I", flat[at])  # fmt: skip
                at = run
            body += struct.pack("<I", 6)
    head = struct.pack("<6I", 0x101, bgra, right_handed, compressed, 0, 1)
    return head + b"\x04Part" + struct.pack("<3I3i", 3, 5, 7, *place) + body


@pytest.mark.parametrize("compressed", [0, 1])
@pytest.mark.parametrize("bgra", [0, 1])
@pytest.mark.parametrize("right_handed", [0, 1])
def test_qb_files_are_turned_from_y_up_to_z_up(right_handed, bgra, compressed):
    found = read_qb("a.qb", qb(right_handed, bgra, compressed, place=(10, 20, 30)))
    rows = zip(found.voxels.tolist(), found.colors.tolist(), strict=True)
    side = -1 if right_handed else 1
    assert {tuple(voxel): tuple(color) for voxel, color in rows} == {
        (x + 10, side * (z + 30), y + 20): (color & 255, color >> 8 & 255, color >> 16 & 255)
        for (x, y, z), color in CELLS.items()
    }


def kv6(columns, size, count=None):
    """A file of (x, y) columns of (z, blue, green, red)."""
    nx, ny, nz = size
    cells = [cell for x in range(nx) for y in range(ny) for cell in columns.get((x, y), ())]
    data = b"Kvxl" + struct.pack("<3I3f", nx, ny, nz, 0, 0, 0)
    data += struct.pack("<I", len(cells) if count is None else count)
    for z, *bgr in cells:
        data += bytes(bgr) + b"\x80" + struct.pack("<HBB", z, 63, 0)
    along_x = [sum(len(columns.get((x, y), ())) for y in range(ny)) for x in range(nx)]
    data += struct.pack(f"<{nx}I", *along_x)
    along_y = [len(columns.get((x, y), ())) for x in range(nx) for y in range(ny)]
    return data + struct.pack(f"<{nx * ny}H", *along_y)


def test_kv6_files_are_turned_from_z_down_to_z_up():
    columns = {(0, 0): [(0, 1, 2, 3), (6, 4, 5, 6)], (2, 4): [(3, 7, 8, 9)]}
    found = read_kv6("a.kv6", kv6(columns, (3, 5, 7)))
    assert found.voxels.tolist() == [[0, 4, 6], [0, 4, 0], [2, 0, 3]]
    assert found.colors.tolist() == [[3, 2, 1], [6, 5, 4], [9, 8, 7]]


def binvox(cells, head=None):
    """A file of cells indexed [x, z, y]."""
    nx, nz, ny = cells.shape
    runs = b""
    flat = cells.reshape(-1).tolist()
    at = 0
    while at < len(flat):
        run = at
        while run < len(flat) and flat[run] == flat[at] and run - at < 255:
            run += 1
        runs += bytes([flat[at], run - at])
        at = run
    head = head or f"#binvox 1\ndim {nx} {nz} {ny}\ntranslate 0 0 0\nscale 1\ndata\n".encode()
    return head + runs


def test_binvox_cells_run_along_y_then_z_then_x():
    cells = np.zeros((3, 7, 5), dtype=np.uint8)
    cells[0, 0, 4] = cells[2, 6, 0] = cells[1, 3, 2] = 1
    cells[1, 3, 3] = 7  # version 2 has values
    found = read_binvox("a.binvox", binvox(cells))
    assert found.voxels.tolist() == [[0, 4, 0], [1, 2, 3], [1, 3, 3], [2, 0, 6]]
    assert found.colors is None


HUGE = b"#binvox 1\ndim 99999 99999 99999\ndata\n\0\1"


@pytest.mark.parametrize(
    ("read", "data", "words"),
    [
        (read_qb, b"\x01\x02" + bytes(30), "not a Qubicle"),
        (read_qb, struct.pack("<6I", 0x101, 0, 0, 0, 0, 2**32 - 1), "4294967295 matrices"),
        (read_qb, struct.pack("<6I", 0x101, 0, 0, 0, 0, 0), "no voxels"),
        (read_qb, struct.pack("<6IB6I", 0x101, 0, 0, 0, 0, 1, 0, *[2**32 - 1] * 3, 0, 0, 0),
         "cell"),
        (read_qb, struct.pack("<6IB6I", 0x101, 0, 0, 1, 0, 1, 0, 2, 2, 2, 0, 0, 0)
         + struct.pack("<3I", 2, 2**32 - 1, 5), "run of 4294967295"),
        (read_kv6, b"Kv6", "3 are left"),
        (read_kv6, b"Kvx6" + bytes(40), "not a KV6"),
        (read_kv6, b"Kvxl" + struct.pack("<3I", *[2**32 - 1] * 3), "size"),
        (read_kv6, kv6({(0, 0): [(9, 1, 2, 3)]}, (3, 5, 7)), "depth 9 of 7"),
        (read_kv6, kv6({(0, 0): [(1, 1, 2, 3)]}, (3, 5, 7), count=2**32 - 1), "voxels"),
        (read_kv6, kv6({}, (3, 5, 7)), "no voxels"),
        (read_binvox, b"#binvox 1\n", "header is incomplete"),
        (read_binvox, HUGE, "99999 x 99999"),
        (read_binvox, binvox(np.ones((3, 7, 5), np.uint8))[:-1], "cover 0 of 105"),
        (read_binvox, binvox(np.zeros((3, 7, 5), np.uint8)), "no voxels"),
    ],
)  # fmt: skip
def test_damaged_models_are_refused(read, data, words):
    with pytest.raises(BodyError, match=words) as caught:
        read("some.file", data)
    assert "some.file" in str(caught.value)


WHOLE = {
    "vox": (read_vox, vox(model((3, 5, 7), [(0, 1, 2, 1), (2, 4, 6, 255)]),
                          transform(0, 1, t="1 2 3"), shape(1, 0), layer(0, name="a"),
                          chunk(b"RGBA", bytes(1024)))),
    "qb": (read_qb, qb()),
    "qb, compressed": (read_qb, qb(compressed=1)),
    "kv6": (read_kv6, kv6({(0, 0): [(0, 1, 2, 3)], (2, 4): [(3, 7, 8, 9)]}, (3, 5, 7))),
    "binvox": (read_binvox, binvox(np.arange(105, dtype=np.uint8).reshape(3, 7, 5) % 2)),
}  # fmt: skip


@pytest.mark.parametrize("name", WHOLE)
def test_files_cut_off_at_any_byte_are_refused(name):
    read, data = WHOLE[name]
    read("whole", data)
    for end in range(len(data)):
        with pytest.raises(BodyError):
            read("cut", data[:end])


@pytest.mark.parametrize("name", WHOLE)
def test_changed_bytes_are_read_or_refused(name):
    read, data = WHOLE[name]
    random = np.random.default_rng(11)
    for _ in range(1500):
        changed = np.frombuffer(data, np.uint8).copy()
        count = int(random.integers(1, 5))
        at = random.integers(0, min(len(changed), 400), size=count)
        changed[at] = random.choice([0, 1, 127, 128, 255, int(random.integers(256))], size=count)
        try:
            found = read("changed", changed.tobytes())
        except BodyError:
            continue
        assert len(found.voxels) < 1 << 20
