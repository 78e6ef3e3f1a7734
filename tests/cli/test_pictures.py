"""Image files of ``preview`` (of a scene) and of ``push --preview`` (read back)."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import voxdisplay as vd
from voxdisplay.cli.main import cli, main
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.view.camera import Camera
from voxdisplay.view.picture import RenderOptions, render_page

TREFOIL = "examples/trefoil.json"
# A folder that is there, and in which nobody makes files, not even root.
LINUX = pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs Linux's /proc")


def pixels(path):
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def test_a_scene_as_a_picture(run, tmp_path):
    path = tmp_path / "x.png"
    options = ["--pixels", "320x200", "--view-angle", "-90,10", "--zoom", "1.3"]
    done = run("preview", TREFOIL, "-o", path, *options)
    assert done.returncode == 0
    assert done.stdout == ""
    assert "496 voxels on 128x128x128 rgb888" in done.stderr
    scene = vd.load_scene(TREFOIL)
    frame = vd.Frame((128, 128, 128))
    for item in scene.items:
        frame.draw(item.curve, item.color)
    look = RenderOptions(
        size=(320, 200), camera=Camera(np.radians(-90), np.radians(10)).zoomed(1.3)
    )
    meant = render_page(frame.array(), frame.grid, frame.format, look)
    assert np.array_equal(pixels(path), np.asarray(meant))


def test_a_scene_is_seen_from_where_it_says(run, tmp_path):
    """The trefoil has a view of its own; an option wins over the half that it names."""
    scene = vd.load_scene(TREFOIL)
    yaw, pitch, zoom = scene.view
    frame = vd.Frame((128, 128, 128))
    frame.draw(scene)
    for options, camera in (
        ([], Camera(np.radians(yaw), np.radians(pitch), zoom=zoom)),
        (["--zoom", "1"], Camera(np.radians(yaw), np.radians(pitch))),
        (["--view-angle", "0,0"], Camera(0, 0, zoom=zoom)),
    ):
        path = tmp_path / "x.png"
        run("preview", TREFOIL, "-o", path, "--pixels", "320x200", *options)
        meant = render_page(
            frame.array(), frame.grid, frame.format, RenderOptions((320, 200), camera)
        )
        assert np.array_equal(pixels(path), np.asarray(meant))


def test_on_another_display(run, tmp_path):
    path = tmp_path / "x.png"
    options = ["--size", "9,12,20", "--format", "mono1", "--pixels", "200x200", "--plain"]
    done = run("preview", TREFOIL, "-o", path, *options)
    assert "scaled by" in done.stderr
    assert "on 9x12x20 mono1" in done.stderr
    shown = pixels(path).astype(int)
    assert np.ptp(shown[100:], axis=2).max() < 30, (
        "one colour, nearly grey on a nearly black ground"
    )
    assert shown.max() > 150


def test_a_film(run, tmp_path):
    path = tmp_path / "x.gif"
    options = ["--pixels", "120x90", "--seconds", "0.5", "--fps", "10"]
    assert run("preview", TREFOIL, "-o", path, *options).returncode == 0
    with Image.open(path) as film:
        assert film.n_frames == 5
        assert film.size == (120, 90)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["preview", TREFOIL], ["--output"]),
        (["preview", TREFOIL, "-o", "x.bmp"], ["x.bmp", ".png", ".gif", ".mp4", ".html"]),
        (["preview", TREFOIL, "-o", "x."], [".png"]),
        (["preview", TREFOIL, "-o", "/nowhere/x.png"], ["/nowhere"]),
        (["preview", TREFOIL, "-o", "x." + "x" * 300 + ".png"], ["cannot be written"]),
        (["preview", TREFOIL, "-o", "x.png", "--pixels", "8x8"], ["800x600"]),
        (["preview", TREFOIL, "-o", "x.png", "--pixels", "99999x99999"], ["4096"]),
        (["preview", TREFOIL, "-o", "x.png", "--view-angle", "1"], ["-34,24"]),
        (["preview", TREFOIL, "-o", "x.png", "--view-angle", "nan,0"], ["-34,24"]),
        (["preview", TREFOIL, "-o", "x.png", "--view-angle", "0,91"], ["-90 to 90"]),
        (["preview", TREFOIL, "-o", "x.gif", "--pixels", "4096x4096"], ["--fps"]),
        (["preview", TREFOIL, "-o", "x.png", "--format", "rgb"], ["rgb565"]),
        (["push", TREFOIL, "--port", "sim:", "--preview", "x.txt"], [".png"]),
        (["test-pattern", "--port", "sim:", "--pattern", "cross"], ["axes"]),
        (["test-pattern", "--port", "sim:", "--brightness", "101"], ["--brightness"]),
    ],
)
def test_bad_usage(tmp_path, capsys, arguments, words):
    here = [str(tmp_path / word) if word.startswith("x.") else word for word in arguments]
    assert main(here) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "Traceback" not in printed.err
    assert all(word in printed.err for word in words)
    assert not list(tmp_path.iterdir())


@LINUX
def test_a_folder_in_which_nobody_makes_files(run):
    done = run("preview", TREFOIL, "-o", "/proc/x.png")
    assert done.returncode == 2
    assert "/proc/x.png cannot be written" in done.stderr


@pytest.mark.parametrize("format_", ["rgb888", "rgb565", "index8", "mono1"])
def test_push_preview_is_of_the_device_s_own_page(run, emulator, tmp_path, format_):
    dump = tmp_path / "front.npy"
    size = ["--size", "40x24x32", "--format", format_]
    running = emulator("--tcp", "127.0.0.1:0", *size, "--dump", dump)
    path = tmp_path / "shown.png"
    done = run("push", "examples/house.json", "--port", running.port, "--preview", path)
    assert done.returncode == 0, done.stderr
    assert "read back from the display" in done.stderr
    page, grid = np.load(dump), vd.Grid(40, 24, 32)
    assert page.any()
    drawn = vd.Frame(grid, format_, own_palette=True)
    for item in vd.load_scene("examples/house.json").fitted(grid)[0].items:
        drawn.draw(item.curve, item.color)
    meant = render_page(page, grid, PixelFormat(format_), palette=drawn.palette)
    assert np.array_equal(pixels(path), np.asarray(meant))


def test_push_preview_is_not_of_what_the_host_believes(tmp_path, monkeypatch):
    other = np.zeros((7, 5, 3, 3), np.uint8)
    other[6, 4, 2] = (0, 255, 0)
    monkeypatch.setattr(vd.Display, "read", lambda _, **__: other)
    path = tmp_path / "shown.png"
    arguments = ["push", TREFOIL, "--port", "sim:?size=3x5x7", "--preview", str(path)]
    assert CliRunner().invoke(cli, arguments).exit_code == 0
    meant = render_page(other, vd.Grid(3, 5, 7), PixelFormat.RGB888)
    assert np.array_equal(pixels(path), np.asarray(meant))


@LINUX
def test_a_preview_that_cannot_be_written_does_not_hide_what_was_shown(run):
    port = "sim:?size=24x16x12"
    done = run("push", TREFOIL, "--port", port, "--preview", "/proc/x.png")
    assert done.returncode == 2
    assert "/proc/x.png cannot be written" in done.stderr
    assert "proved" in done.stdout


def without(module, *arguments):
    """Run a command as if a module were not installed; return the finished process."""
    code = f"import sys; sys.modules[{module!r}] = None\nfrom voxdisplay.cli import main\n"
    code += "code = main(sys.argv[1:])\nprint(*sys.modules)\nsys.exit(code)"
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("command", [["preview", TREFOIL, "-o"], ["push", TREFOIL, "--preview"]])
def test_without_pillow_it_names_what_to_install(command, tmp_path):
    done = without("PIL", *command, tmp_path / "x.png")
    assert done.returncode == 2
    assert "pip install 'voxdisplay[view]'" in done.stderr
    assert not list(tmp_path.iterdir())


def test_push_imports_no_picture_code():
    done = without("nothing", "push", TREFOIL, "--port", "sim:?size=24x16x12")
    assert done.returncode == 0
    loaded = set(done.stdout.splitlines()[-1].split())
    assert "voxdisplay.cli.push" in loaded
    assert not {name for name in loaded if name.split(".")[0] in {"PIL", "av", "websockets"}}
    assert not {name for name in loaded if f"{name}.".startswith("voxdisplay.view.")}


@pytest.mark.parametrize(
    "what",
    [
        "vd.Frame((3, 5, 7))",
        "vd.voxelize(vd.Segment((1, 1, 1), (5, 5, 5)))",
        """vd.read_scene('{"type": "segment", "from": [1, 1, 1], "to": [5, 5, 5]}')""",
    ],
)
def test_without_pillow_nothing_has_a_picture(what):
    code = "import sys; sys.modules['PIL'] = None; import voxdisplay as vd; "
    code += f"print({what}._repr_png_())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "None\n"


def test_save_and_show_without_pillow_say_what_is_missing():
    code = "import sys; sys.modules['PIL'] = None; import voxdisplay as vd; import tempfile\n"
    code += "for call in (lambda f: f.save('x.png'), lambda f: f.show()):\n"
    code += "    try: call(vd.Frame((3, 5, 7)))\n"
    code += "    except vd.MissingExtra as error: print(error.hint)\n"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == 2 * "pip install 'voxdisplay[view]'\n"
