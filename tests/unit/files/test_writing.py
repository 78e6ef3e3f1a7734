"""Written voxels: read back whole, by this package and by trimesh."""

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.files import LitPage, load_body, write_voxels

SIDES = (7, 5, 3)  # [z, y, x]


def page_of(array):
    lit = array.any(axis=-1)
    return LitPage(array, np.argwhere(lit)[:, ::-1], array[lit])


def random_page(sides, colors, share=0.3):
    random = np.random.default_rng(8)
    palette = random.integers(1, 256, size=(colors, 3), dtype=np.uint8)
    array = palette[random.integers(0, colors, size=sides)]
    array[random.random(sides) > share] = 0
    return page_of(array)


def written(tmp_path, kind, page):
    path = tmp_path / f"a{kind}"
    return write_voxels(path, kind, page), path


def shown(body, clip):
    found = vd.voxelize(body, clip=clip)
    rows = zip(found.voxels.tolist(), found.colors.tolist(), strict=True)
    return {tuple(voxel): tuple(color) for voxel, color in rows}


def expected(page):
    rows = zip(page.voxels.tolist(), page.colors.tolist(), strict=True)
    return {tuple(voxel): tuple(color) for voxel, color in rows}


@pytest.mark.parametrize("kind", [".npy", ".npz", ".vox"])
def test_what_is_written_is_read_back(tmp_path, kind):
    page = random_page(SIDES, 200)
    remark, path = written(tmp_path, kind, page)
    assert remark is None
    assert shown(load_body(path).body, SIDES[::-1]) == expected(page)


def test_a_dark_page_is_written_too(tmp_path):
    page = page_of(np.zeros((*SIDES, 3), dtype=np.uint8))
    for kind in (".npy", ".npz", ".vox", ".ply"):
        written(tmp_path, kind, page)
        with pytest.raises((vd.BodyError, vd.MissingExtra)):
            load_body(tmp_path / f"a{kind}")


@pytest.mark.parametrize("sides", [(300, 5, 3), (7, 600, 3), (7, 5, 257), (300, 300, 2)])
def test_long_sides_become_several_models(tmp_path, sides):
    page = random_page(sides, 9, share=0.05)
    _, path = written(tmp_path, ".vox", page)
    assert shown(load_body(path).body, sides[::-1]) == expected(page)


@pytest.mark.parametrize("colors", [256, 4000, 100_000])
def test_more_colors_than_a_palette_has_are_rounded(tmp_path, colors):
    page = random_page((40, 41, 42), colors)
    remark, path = written(tmp_path, ".vox", page)
    assert "255 colours" in remark
    found, wanted = shown(load_body(path).body, (42, 41, 40)), expected(page)
    assert found.keys() == wanted.keys()
    worst = max(np.abs(np.subtract(found[key], wanted[key])).max() for key in wanted)
    assert worst <= {256: 12}.get(colors, 48)


def test_a_ply_mesh_is_closed_and_encloses_the_voxels(tmp_path):
    trimesh = pytest.importorskip("trimesh", reason="needs the extra mesh")
    page = random_page(SIDES, 3)
    _, path = written(tmp_path, ".ply", page)
    mesh = trimesh.load(path, process=False)
    assert mesh.volume == pytest.approx(len(page.voxels))
    solid = vd.voxelize(load_body(path, fill="solid").body, clip=SIDES[::-1])
    assert np.array_equal(solid.voxels, page.voxels)
    assert {tuple(color[:3]) for color in mesh.visual.vertex_colors} == set(expected(page).values())
