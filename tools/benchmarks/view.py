"""Benchmark of pictures: render times with and without halo, in a terminal, and as a film.

A picture is timed from its lit voxels, and from the whole page; encoding is timed apart. CPU times
stand beside the medians, since a busy machine slows only the latter.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import voxdisplay as vd
from voxdisplay.view.animation import Turntable, save_gif
from voxdisplay.view.axes_and_grid import draw_stage
from voxdisplay.view.half_blocks import half_blocks
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.picture import RenderOptions, render_page, render_voxels

SEED = 22
RGB = vd.PixelFormat.RGB888
FILM = 30


def example(name: str) -> tuple[NDArray[np.uint8], vd.Grid]:
    """Return the page of one of the examples."""
    path = Path(__file__).resolve().parents[2] / "examples" / f"{name}.json"
    frame = vd.Frame((128, 128, 128))
    for item in vd.load_scene(str(path)).items:
        frame.draw(item.curve, item.color)
    return np.asarray(frame.array(), dtype=np.uint8), frame.grid


def surface(count: int, side: int) -> tuple[NDArray[np.uint8], vd.Grid]:
    """Return a page with exactly so many voxels, on rippling surfaces one above the other."""
    grid = vd.Grid(side, side, side)
    y, x = np.mgrid[:side, :side]
    radius = np.hypot(x - side / 2, y - side / 2) / side
    ripple = side * 0.12 * np.cos(25 * radius)
    page = np.zeros((*grid.array_shape, 3), dtype=np.uint8)
    height = np.stack([np.floor(ripple + side * (0.3 + 0.12 * k)) for k in range(5)])
    k, ys, xs = (each.ravel()[:count] for each in np.indices(height.shape))
    zs = height.ravel()[:count].astype(np.int64)
    page[zs, ys, xs] = np.stack((255 - 50 * k, 60 + 40 * k, xs * 255 // side), axis=-1)
    return page, grid


def ball(side: int) -> tuple[NDArray[np.uint8], vd.Grid]:
    """Return a page with a solid ball that just fits in."""
    z, y, x = np.ogrid[:side, :side, :side]
    middle = (side - 1) / 2
    inside = (x - middle) ** 2 + (y - middle) ** 2 + (z - middle) ** 2 < (side / 2) ** 2
    page = np.zeros((side, side, side, 3), dtype=np.uint8)
    page[inside] = (60, 140, 255)
    return page, vd.Grid(side, side, side)


SCENES: dict[str, Callable[[], tuple[NDArray[np.uint8], vd.Grid]]] = {
    "paper curve, 128^3": lambda: example("paper-curve"),
    "50 000 voxels, 128^3": lambda: surface(50_000, 128),
    "50 000 voxels, 256^3": lambda: surface(50_000, 256),
    "200 000 voxels, 256^3": lambda: surface(200_000, 256),
    "solid ball, 128^3": lambda: ball(128),
}


def bench_view(repeats: int, *, quick: bool = False) -> None:
    """Print the table; ``quick`` only its first line."""
    columns = ["list", "glow", "cpu", "no glow", "400x300", "terminal", "PNG"]
    print(f"{'ms, 800x600':<24}{'voxels':>9}", *(f"{name:>9}" for name in columns), sep="")
    for name, make in [*SCENES.items()][: 1 if quick else None]:
        page, grid = make()
        lit = lit_voxels(page, grid, RGB)
        drawn = render_page(page, grid, RGB)
        cells = [
            timed(lambda: lit_voxels(page, grid, RGB), repeats),  # noqa: B023 - called at once
            *timed_twice(lambda: render_voxels(lit, grid, RenderOptions()), repeats),  # noqa: B023
            timed(lambda: render_voxels(lit, grid, RenderOptions(glow=False)), repeats),  # noqa: B023
            timed(lambda: render_voxels(lit, grid, RenderOptions(size=(400, 300))), repeats),  # noqa: B023
            timed(lambda: half_blocks(lit, grid, 80, 23), repeats),  # noqa: B023
            timed(lambda: saved_png(drawn), repeats),  # noqa: B023
        ]
        ms = "".join(f"{1000 * seconds:9.1f}" for seconds in cells)
        print(f"{name:<24}{len(lit.positions):9d}{ms}", flush=True)
    if not quick:
        bench_films(repeats)


def bench_films(repeats: int) -> None:
    """Print what films cost, and the stage, which each of their pictures has anew."""
    grid = vd.Grid(128, 128, 128)

    def new_stage() -> object:
        draw_stage.cache_clear()
        return draw_stage(grid, RenderOptions().camera, RenderOptions().size, labels=True)

    print(f"the stage of a new angle: {1000 * timed(new_stage, repeats):.1f} ms")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.gif"
        for name in ("paper curve, 128^3", "50 000 voxels, 128^3"):
            page, grid = SCENES[name]()
            lit = lit_voxels(page, grid, RGB)
            film = Turntable(lit, grid, RenderOptions(), FILM)
            wall_s, cpu_s = timed_twice(lambda: save_gif(path, film, 20), min(repeats, 3))  # noqa: B023
            print(
                f"GIF of {FILM}, 800x600, {name}: {wall_s:.2f} s, {cpu_s:.2f} s of CPU, "
                f"{path.stat().st_size / 1000:.0f} kB"
            )


def saved_png(drawn: object) -> None:
    """Encode a picture."""
    with tempfile.TemporaryFile() as file:
        drawn.save(file, format="PNG")  # type: ignore[attr-defined]


def timed(function: Callable[[], object], repeats: int) -> float:
    """Return the median time of a call in seconds, after a warm-up."""
    return timed_twice(function, repeats)[0]


def timed_twice(function: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Return the median times of a call in seconds, by the clock and of the processor."""
    function()
    walls, cpus = [], []
    for _ in range(repeats):
        began_s, began_cpu_s = time.perf_counter(), time.process_time()
        function()
        walls.append(time.perf_counter() - began_s)
        cpus.append(time.process_time() - began_cpu_s)
    return statistics.median(walls), statistics.median(cpus)
