"""Page of the live view in a real browser: the canvas, and input by keys, pointer and touch.

Places and counts are checked, never how fast it goes.
"""

from __future__ import annotations

import browser as browsers
import numpy as np
import pytest
from live_page import SIZE, exported, page_of

import voxdisplay as vd
from voxdisplay.view.axes_and_grid import outline_axes
from voxdisplay.view.camera import Camera

pytestmark = browsers.NEEDED


def middle(picture):
    """Return where the light is, in pixels, of a canvas with neither box nor glow."""
    light = picture.astype(float).sum(axis=2)
    light -= light[0, 0]
    total = light.sum()
    rows, columns = np.mgrid[: light.shape[0], : light.shape[1]] + 0.5
    return (columns * light).sum() / total, (rows * light).sum() / total


BARE = "show.box = show.glow = false, hideProbe(), pointer = null"


# -- what is drawn


@pytest.mark.parametrize("renderer", ["2d", "gl"])
def test_a_voxel_lies_where_the_camera_says(renderer, tab, tmp_path):
    """No axis is swapped or turned round: of all corners, and of one voxel off all diagonals."""
    voxels = [(x, y, z) for x in (0, 2) for y in (0, 4) for z in (0, 6)] + [(1, 3, 2)]
    page = tab(
        exported(tmp_path, [page_of(v) for v in voxels]) + f"?r={renderer}", width=860, height=400
    )
    page.wait(f"painted && history.length === {len(voxels)}")
    page.run(f"setPlaying(false), setShow('spin', false), setCamera(), {BARE}")
    assert (
        page.run("renderer.constructor.name")
        == {"2d": "CpuRenderer", "gl": "GpuRenderer"}[renderer]
    )
    for number, voxel in enumerate(voxels):
        page.run(f"seek({number})")
        picture = page.canvas()
        height, width = picture.shape[:2]
        x, y, scale = Camera().project([np.array(voxel) + 0.5], SIZE, (width, height))
        found = middle(picture)
        assert found == pytest.approx((x[0], y[0]), abs=0.03 * scale[0] + 0.6), voxel


def test_the_page_projects_as_the_camera_does(tab, tmp_path):
    page = tab(exported(tmp_path, [page_of((0, 0, 0))]))
    page.wait("painted")
    points = np.random.default_rng(5).uniform(0, 7, (20, 3))
    for size in ((640, 480), (300, 700)):
        for yaw, pitch, distance, zoom, flat in (
            (0.3, -0.2, 1.5, 1, False), (2.0, 1.1, 4.0, 2.5, False), (-3.0, 0.0, 9.0, 0.4, True),
        ):  # fmt: skip
            page.run(
                f"setCamera({{yaw: {yaw}, pitch: {pitch}, distance: {distance}, zoom: {zoom}}}), "
                f"setShow('flat', {str(flat).lower()})"
            )
            camera = Camera(yaw, pitch, distance, zoom, flat)
            place = f"projection([3, 5, 7], {size[0]}, {size[1]})"
            got = page.run(f"{points.tolist()}.map(p => project(p, {place}).slice(0, 3))")
            assert np.allclose(np.array(got).T, camera.project(points, SIZE, size))
            got = page.run(
                f"outlineAxes([3, 5, 7], {size[0]}, {size[1]}).map(e => [e.axis, corner(e.a, "
                f"[3, 5, 7]), corner(e.b, [3, 5, 7]), ...e.middle, ...e.out])"
            )
            want = outline_axes(vd.Grid(*SIZE), camera, size)
            assert [e[:3] for e in got] == [[e.number, [*e.start], [*e.end]] for e in want]
            places = np.array([[*e.middle, *e.outward] for e in want])
            assert np.allclose(np.array([e[3:] for e in got]), places)


def test_both_renderers_draw_the_same(tab, tmp_path):
    rng = np.random.default_rng(3)
    page = np.zeros((40, 24, 32, 3), np.uint8)
    lit = rng.random((40, 24, 32)) < 0.05
    page[lit] = rng.integers(0, 256, (lit.sum(), 3))
    url = exported(tmp_path, [page], size=(32, 24, 40))
    pictures = []
    for renderer in ("2d", "gl"):
        one = tab(f"{url}?r={renderer}", width=760, height=480)
        one.wait("painted")
        pictures.append(one.canvas().astype(int))
    differ = np.abs(pictures[0] - pictures[1])
    assert pictures[0].max() > 200
    assert differ.mean() < 2
    assert np.quantile(differ, 0.99) < 30


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
def test_colors_are_the_devices(format_, tab, tmp_path):
    page = tab(
        exported(tmp_path, [page_of((1, 2, 3), color="#ff5500", format_=format_)], format_=format_)
    )
    page.wait("painted")
    frame = vd.Frame(SIZE, format_)
    frame.draw(np.array([(1, 2, 3)]), "#ff5500")
    value = int(frame.lit()[1][0])
    assert page.run("current().value(0)") == value
    rgb = vd.PixelFormat(format_).rgb(np.array([value]))[0].tolist()
    assert page.run("current().colors.map(c => c[0])") == rgb
    assert page.run("digest(current())") == f"{frame.digest():08x}"


def test_a_palette_is_the_page_s_own(tab, tmp_path):
    frame = vd.Frame(SIZE, "index8", own_palette=True)
    frame.draw([(1, 2, 3)], "#010204")
    assert frame.has_own_palette
    url = exported(tmp_path, [frame.array()], format_="index8", palette=frame.palette)
    page = tab(url)
    page.wait("painted")
    assert page.run("current().colors.map(c => c[0])") == [1, 2, 4]
    assert page.run("digest(current())") == f"{frame.digest():08x}"


def test_the_page_begins_where_a_scene_is_best_seen_from(tab, tmp_path):
    camera = Camera(0.4, 1.1, zoom=1.5)
    page = tab(exported(tmp_path, [page_of((1, 2, 3))], camera=camera))
    page.wait("painted")
    wanted = {"yaw": 0.4, "pitch": 1.1, "zoom": 1.5}
    assert page.run("({...camera})") == page.run("({...START})")
    assert {key: page.run(f"camera.{key}") for key in wanted} == wanted
    page.key("ArrowRight")
    page.key("0")
    assert page.run("camera.yaw") == 0.4


# -- input


def test_keys_do_what_they_say(tab, tmp_path):
    page = tab(exported(tmp_path, [page_of((0, 0, 0), (1, 2, 3), (2, 4, 6))]))
    page.wait("painted")
    before = page.run("({...camera})")
    page.key("ArrowRight")
    page.key("ArrowUp")
    page.key("ArrowLeft", shift=True)
    page.key("+")
    after = page.run("({...camera})")
    assert after["yaw"] > before["yaw"]
    assert after["pitch"] > before["pitch"]
    assert after["x"] < 0
    assert after["zoom"] > before["zoom"]
    page.key("0")
    assert page.run("({...camera})") == before
    for key, axis in (("x", 0), ("y", 1), ("z", 2)):
        page.key(key)
        assert page.run(f"slices[{axis}]") == [SIZE[axis] // 2] * 2
        page.key("]")
        assert page.run(f"slices[{axis}]") == [SIZE[axis] // 2 + 1] * 2
        page.key(key)
        assert page.run(f"slices[{axis}]") == [0, SIZE[axis] - 1]
    page.key("g")
    page.key("b")
    assert page.run("[show.glow, show.box, $('glow').ariaPressed]") == [False, False, "false"]
    page.key("v")
    assert "x 1  y 2  z 3" in page.run("$('announcement').textContent")
    page.run("$('exposure').focus()")
    page.key("b")
    assert page.run("show.box") is False  # letters belong to what has the focus
    names = "[...document.querySelectorAll('button, input')]"
    assert page.run(f"{names}.every(e => e.ariaLabel || e.textContent || e.labels[0]?.textContent)")


def test_a_slice_is_all_that_is_drawn(tab, tmp_path):
    for renderer in ("2d", "gl"):
        page = tab(
            exported(tmp_path, [page_of((0, 0, 0), (1, 2, 3), (2, 4, 6))]) + f"?r={renderer}"
        )
        page.wait("painted")
        page.run(f"{BARE}, show.ghost = false, setSlice(2, 6, 6)")
        picture = page.canvas()
        x, y, _ = Camera().project([(2.5, 4.5, 6.5)], SIZE, picture.shape[1::-1])
        assert middle(picture) == pytest.approx((x[0], y[0]), abs=2)
        page.run("show.ghost = true")
        ghost = page.canvas()
        x, y, _ = Camera().project([(0.5, 0.5, 0.5), (2.5, 4.5, 6.5)], SIZE, picture.shape[1::-1])
        dim, bright = (ghost[int(row), int(column)].max() for column, row in zip(x, y, strict=True))
        assert picture[int(y[0]), int(x[0])].max() < 16 < dim < 90
        assert bright > 200


def test_the_pointer_turns_moves_zooms_and_names_voxels(tab, tmp_path):
    page = tab(exported(tmp_path, [page_of((2, 1, 6), color="#ff8800")]))
    page.wait("painted")
    rim = page.run("(r => [r.left, r.top, r.width, r.height])(area.getBoundingClientRect())")
    x, y, _ = Camera().project([(2.5, 1.5, 6.5)], SIZE, (rim[2], rim[3]))
    page.mouse("mouseMoved", rim[0] + x[0], rim[1] + y[0])
    page.wait("!$('probe').hidden")
    assert page.run("$('probe').textContent") == "x 2  y 1  z 6   #ff8800"
    page.mouse("mouseMoved", rim[0] + 5, rim[1] + 5)
    page.wait("$('probe').hidden")
    for button, held, changed in (("left", 1, "yaw"), ("right", 2, "x")):
        before = page.run("({...camera})")
        page.mouse("mousePressed", 300, 300, button=button, buttons=held, clickCount=1)
        page.mouse("mouseMoved", 340, 320, button=button, buttons=held)
        page.mouse("mouseReleased", 340, 320, button=button, clickCount=1)
        assert page.run("({...camera})")[changed] > before[changed]
    page.mouse("mouseWheel", 300, 300, deltaX=0, deltaY=-200)
    page.wait("camera.zoom > 1")


def test_fingers_turn_and_pinch(tab, tmp_path):
    page = tab(
        exported(tmp_path, [page_of((1, 2, 3))]), width=360, height=740, pixel=2, mobile=True
    )
    page.wait("painted")

    def touch(kind, *points):
        places = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]
        page.call("Input.dispatchTouchEvent", type=kind, touchPoints=places)

    touch("touchStart", (100, 200))
    touch("touchMove", (140, 200))
    touch("touchEnd")
    assert page.run("camera.yaw - START.yaw") == pytest.approx(0.32)
    touch("touchStart", (150, 200), (210, 200))
    touch("touchMove", (120, 200), (240, 200))
    touch("touchEnd")
    assert page.run("camera.zoom") == pytest.approx(2)


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_it_fits_a_telephone(scheme, tab, tmp_path):
    look = {"width": 360, "height": 740, "pixel": 2, "mobile": True, "scheme": scheme}
    page = tab(exported(tmp_path, [page_of((1, 2, 3))] * 3, title="t" * 80), **look)
    page.wait("painted")
    assert page.run("document.documentElement.scrollWidth") == 360
    buttons = "[...document.querySelectorAll('button')].filter(b => b.checkVisibility())"
    assert page.run(f"{buttons}.length") > 15
    assert page.run(f"{buttons}.filter(b => Math.min(b.offsetHeight, b.offsetWidth) < 44)") == []
    ground = page.run("getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)")
    assert (sum(ground) > 384) == (scheme == "light")


# -- ways to look


def test_cubes_are_opaque_and_the_same_by_both_renderers(tab, tmp_path):
    frame = vd.Frame(SIZE)
    frame.draw(np.array([(2, 4, 6)]), "#ff0000")
    frame.draw(np.array([(2, 0, 6), (0, 0, 0)]), "#00ff00")
    pictures = []
    for renderer in ("2d", "gl"):
        page = tab(exported(tmp_path, [frame.array()]) + f"?r={renderer}")
        page.wait("painted")
        page.key("c")
        page.run("show.box = false, setCamera({yaw: 0, pitch: 0})")
        pictures.append(page.canvas())
        height, width = pictures[-1].shape[:2]
    assert np.array_equal(*pictures)
    camera = Camera(0, 0)
    near, far = ([(2.5, 0.0, 6.5)], [(0.5, 0.0, 0.5)])
    for point in (near, far):
        x, y, scale = camera.project(point, SIZE, (width, height))
        half = int(scale[0] * 0.45)
        column, row = int(x[0]), int(y[0])
        face = pictures[0][row - half : row + half, column - half : column + half]
        assert (face == face[0, 0]).all(), "crisp, and what is behind is hidden"
        assert face[0, 0, 1] > 100
        assert face[0, 0, 0] == 0


def test_exposure_brightens(tab, tmp_path):
    page = tab(exported(tmp_path, [page_of((1, 2, 3))]))
    page.wait("painted")
    sums = []
    for stops in (-2, 0, 2):
        page.run(f"{BARE}, $('exposure').value = {stops}")
        sums.append(int(page.canvas().sum()))
    assert sums[0] < sums[1] < sums[2]


def test_values_have_a_map_and_a_threshold(tab, tmp_path):
    array = np.zeros((7, 5, 3), np.uint8)
    array[0, 0, 0], array[3, 2, 1], array[6, 4, 2] = 10, 120, 255
    page = tab(exported(tmp_path, [array], format_="index8"))
    page.wait("painted && !$('coloring').hidden")
    page.run("$('map').value = 'viridis', $('threshold').value = 100")
    assert page.run("[visible().n, current().n]") == [2, 3]
    assert page.run("visible().colors.map(c => c[1])") == [0xFD, 0xE7, 0x25]
    assert page.run("[visible().value(0), visible().positions.map(p => p[0])]") == [120, [1, 2, 3]]
    assert page.run("digest(current())") == page.run("digest({...current(), seen: null})")
    colored = tab(exported(tmp_path, [page_of((1, 2, 3), color="red")]))
    colored.wait("painted")
    colored.run("updateStatus()")
    assert colored.run("$('coloring').hidden")


def test_a_link_holds_the_view_and_survives_nonsense(tab, tmp_path):
    url = exported(tmp_path, [page_of((0, 0, 0), (1, 2, 3))])
    page = tab(url)
    page.wait("painted && linked")
    page.run("setCamera({yaw: 0.5, pitch: -0.3, zoom: 2.5, x: 0.1}), setShow('glow', false)")
    page.run("setShow('cubes', true), setSlice(1, 1, 3), $('exposure').value = 1.5")
    page.wait("location.hash.includes('cubes')")
    other = tab(page.run("location.href"))
    other.wait("painted && linked")
    state = "({...camera, ...show, slices, exposure: $('exposure').value})"
    seen, meant = other.run(state), page.run(state)
    for key in ("yaw", "pitch", "zoom", "x"):
        assert seen.pop(key) == pytest.approx(meant.pop(key), abs=0.01)
    assert seen == meant
    for nonsense in (
        "#yaw=NaN&zoom=1e999&pitch=&show=__proto__,x&slice-x=9-&map=constructor",
        "#" + "%" * 5000,
        "#zoom=-1&x=1e9&slice-z=99999-0&slice-y=5-2&exposure=a",
    ):
        page = tab(url + nonsense)
        page.wait("painted && linked")
        numbers = page.run("Object.values(camera)")
        assert np.isfinite(numbers).all()
        assert page.run("camera.zoom >= 0.2 && Math.abs(camera.x) <= 6")
        assert page.run("slices.every(([a, b], k) => 0 <= a && a <= b && b < gridSize[k])")


def test_a_still_page_has_no_player_and_a_moving_one_turns(tab, tmp_path):
    still = tab(exported(tmp_path, [page_of((1, 2, 3))]))
    still.wait("painted && $('state').textContent === 'still picture'")
    assert not still.run("$('playback').checkVisibility()")
    assert still.run("show.spin") is False
    moving = tab(exported(tmp_path, [page_of((1, 2, n)) for n in range(4)]))
    moving.wait("painted > 3 && camera.yaw > START.yaw && $('state').textContent === 'playing'")
    assert moving.run("$('playback').checkVisibility()")
    moving.mouse("mousePressed", 300, 300, button="left", buttons=1, clickCount=1)
    moving.mouse("mouseReleased", 300, 300, button="left", clickCount=1)
    assert moving.run("show.spin") is False
    moving.key(" ")
    assert moving.run("$('state').textContent") == "paused"


def test_all_keys_are_listed_and_the_picture_fills_the_screen(tab, tmp_path):
    page = tab(exported(tmp_path, [page_of((1, 2, 3))]))
    page.wait("painted")
    page.key("?")
    assert page.run("$('keys').checkVisibility()")
    assert page.run("COMMANDS.filter(c => c[1]).length === $('keys').querySelectorAll('dt').length")
    page.key("?")
    page.run("$('help').close(), area.focus()")
    page.key("f")
    page.wait("document.fullscreenElement === area")
    page.key("f")
    page.wait("!document.fullscreenElement")


# -- saving


def test_an_exported_page_plays_and_asks_for_nothing(tab, tmp_path):
    pages = [page_of((0, 0, number)) for number in range(5)]
    url = exported(tmp_path, pages, title="a </script><b>&")
    page = tab(url)
    page.wait("painted > 3 && cursor > 1")
    assert page.run("[history.length, document.title]") == [5, "a </script><b>&"]
    assert page.requests == [url]
    still = tab(url, motion="reduce")
    still.wait("history.length === 5")
    assert still.run("playing") is False
    still.key(".")
    assert still.run("cursor") == 1


def test_a_picture_and_a_film_are_kept(tab, tmp_path):
    page = tab(exported(tmp_path, [page_of((1, 2, n)) for n in range(7)]))
    page.wait("painted")
    page.run("window.kept = {}, download = (blob, name) => { kept[name] = blob; }")
    page.key("s")
    page.wait("kept['voxdisplay-' + current().number + '.png'] || Object.keys(kept).length")
    page.key("r")
    page.run(
        "window.got = 0, recorder.addEventListener('dataavailable', e => { got += e.data.size; })"
    )
    page.wait("got > 100")
    page.key("r")
    page.wait("Object.keys(kept).length === 2")
    kinds = page.run("Object.values(kept).map(b => [b.type.slice(0, 5), b.size > 100])")
    assert sorted(kinds) == [["image", True], ["video", True]]
