"""Pictures by which the encoders are measured: curves, shells, bodies, volumes.

Made from seeds: the same at each run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from paper_tables import paper_curve

import voxdisplay as vd
from voxdisplay.curves import Bezier, Curve, Helix, Lissajous, TorusKnot
from voxdisplay.frame import Frame

SEED = 22


@dataclass(frozen=True)
class Picture:
    """A frame, its number of drawn voxels, and its target in bits per voxel."""

    name: str
    frame: Frame
    voxels: int
    target: float | None = None


def of_curves(
    name: str, side: int, curves: Sequence[Curve], target: float | None, pixels: str = "mono1"
) -> Picture:
    """Return the picture of some curves."""
    return of_voxels(name, side, [s.voxels for s in vd.voxelize_many(curves)], target, pixels)


def of_voxels(
    name: str,
    side: int,
    drawn: Sequence[NDArray[np.integer]],
    target: float | None,
    pixels: str = "mono1",
    colors: Sequence[str] = ("white",),
) -> Picture:
    """Return the picture of voxel sequences in alternating colours."""
    frame = Frame((side, side, side), pixels)
    voxels = 0
    for number, each in enumerate(drawn):
        drawing = frame.draw(each, colors[number % len(colors)])
        voxels += drawing.voxels - drawing.clipped
    return Picture(name, frame, voxels, target)


def of_array(name: str, array: NDArray[np.generic], pixels: str, target: float | None) -> Picture:
    """Return the picture of an array; all voxels count if pixels have many values."""
    frame = Frame(array.shape[2::-1], pixels)  # type: ignore[arg-type] - three sides
    frame.set(array)
    dense = pixels != "mono1"
    return Picture(name, frame, frame.grid.voxels if dense else len(frame.lit()[0]), target)


def gradients(name: str, side: int, curve: Curve, colors: Sequence[str]) -> Iterator[Picture]:
    """Return the pictures of a curve along which colours are spread, in each format.

    INDEX8 has a palette of its own.
    """
    sequence = vd.voxelize(curve)
    for pixels in ("rgb888", "rgb565", "index8"):
        frame = Frame((side, side, side), pixels, own_palette=pixels == "index8")
        drawing = frame.draw(sequence, list(colors))
        yield Picture(f"{name} {pixels}", frame, drawing.voxels - drawing.clipped)


def of_voxel_colors(name: str, page: NDArray[np.uint8]) -> Picture:
    """Return the picture of an array of palette indices, of which the lit voxels count."""
    frame = Frame(page.shape[::-1], "index8")  # type: ignore[arg-type] - three sides
    frame.set(page)
    return Picture(name, frame, int(np.count_nonzero(page)), None)


def digital_line(start: NDArray[np.int64], end: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the straight line between two voxels, every coordinate rounded, halves up."""
    way = end - start
    length = max(1, int(np.abs(way).max()))
    k = np.arange(np.abs(way).max() + 1)[:, None]
    return start + (2 * k * way + length) // (2 * length)


def lines(side: int, count: int) -> list[NDArray[np.int64]]:
    """Return random segments between the centres of voxels."""
    ends = np.random.default_rng(SEED).integers(0, side, (count, 2, 3))
    return [digital_line(*pair) for pair in ends]


def beziers(side: int, count: int, spread: float) -> list[Curve]:
    """Return random cubic Beziers; control points are ``spread`` apart at most on each axis."""
    rng = np.random.default_rng(SEED)
    start = rng.uniform(0, side, (count, 1, 3))
    steps = rng.uniform(-spread, spread, (count, 4, 3))
    points = (start + np.cumsum(steps, axis=1)).clip(0.5, side - 0.5)
    return [Bezier(each) for each in points]


def knots(side: int) -> list[Curve]:
    """Return three torus knots that fill a cube."""
    middle = (side / 2,) * 3
    return [TorusKnot(p, q, middle, side * 0.3, side * 0.14) for p, q in ((2, 3), (3, 5), (5, 8))]


def waves(side: int) -> list[Curve]:
    """Return six Lissajous curves that fill a cube."""
    middle, reach = (side / 2,) * 3, (side * 0.45,) * 3
    ratios = [(1, 2, 3), (2, 3, 5), (3, 4, 5), (3, 5, 7), (1, 3, 4), (4, 5, 7)]
    return [Lissajous(middle, reach, ratio, (0.3, 0, 0.9)) for ratio in ratios]


def helices(side: int) -> list[Curve]:
    """Return six helices of different pitch."""
    return [
        Helix((side / 2, side / 2, 3), side * (0.1 + 0.06 * n), side * 0.9 / (n + 2), n + 2)
        for n in range(6)
    ]


def bodies(side: int) -> dict[str, vd.Body]:
    """Return bodies whose shells are digitised thin, without symmetry of the grid.

    Together with the shells and balls they judge the coding of sets; `tuning_shapes` are those on
    which its contexts may be chosen.
    """
    middle = (side / 2 + 0.3, side / 2 - 0.2, side / 2 + 0.1)
    knot = TorusKnot(2, 3, middle, side * 0.28, side * 0.12)
    return {
        "thin sphere": vd.Sphere(middle, side * 0.455),
        "thin torus": vd.Torus(middle, side * 0.3, side * 0.12, normal=(1, 2, 5)),
        "knot tube": vd.Tube(knot, side * 0.06),
    }


def tuning_shapes(side: int) -> dict[str, NDArray[np.bool_]]:
    """Return shells on which contexts may be chosen: a random quadric, and a sum of sines."""
    rng = np.random.default_rng(SEED)
    z, y, x = (np.mgrid[:side, :side, :side] + 0.5) / side * 2 - 1
    matrix = rng.normal(size=(3, 3))
    u, v, w = np.tensordot(matrix @ matrix.T + np.eye(3), np.stack((x, y, z)), axes=1)
    quadric = x * u + y * v + z * w
    turn = rng.uniform(2, 5, 6)
    sines = np.sin(turn[0] * x + turn[1] * y) + np.sin(turn[2] * y + turn[3] * z)
    sines += np.sin(turn[4] * z + turn[5] * x)
    return {"tuning: quadric": rim(quadric < 0.8), "tuning: sines": rim(sines < 0)}


def rim(solid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the voxels of a solid that have a neighbour outside."""
    inner = solid
    for axis in range(3):
        inner = inner & np.roll(inner, 1, axis) & np.roll(inner, -1, axis)
    return solid & ~inner


def coloured(side: int) -> dict[str, NDArray[np.uint8]]:
    """Return the bumpy shell with a colour for each voxel: by height, and by angle."""
    z, y, x = np.mgrid[:side, :side, :side] + 0.5 - side / 2
    angle = np.arctan2(y, x) / (2 * np.pi) + 0.5
    shades = {"by height": z / side + 0.5, "by angle": angle}
    shell = bumpy(side)
    return {
        name: np.where(shell, 1 + (254 * shade).astype(np.uint8), 0).astype(np.uint8)
        for name, shade in shades.items()
    }


def painted(side: int) -> Iterator[Picture]:
    """Yield surfaces with a colour for each voxel, by which the coding of values is judged.

    The contexts of VALUES were chosen on `coloured`, on `phantom` and on blurred noise; the knot's
    tube and `organs` had no part in that.
    """
    rainbow = np.array([(255, 0, 0), (255, 255, 0), (0, 255, 0), (0, 255, 255), (0, 0, 255)])
    frame = Frame((side, side, side), "mono1")
    frame.draw(bodies(side)["knot tube"])
    tube = frame.array() > 0
    z, y, x = np.mgrid[:side, :side, :side] + 0.5 - side / 2
    shades = {"height": z / side + 0.5, "angle": np.arctan2(y, x) / (2 * np.pi) + 0.5}
    for name, shade in shades.items():
        place = shade[tube] * (len(rainbow) - 1)
        channels = [np.interp(place, range(len(rainbow)), rainbow[:, k]) for k in range(3)]
        colors = np.stack(channels, axis=1).round().astype(np.uint8)
        for pixels in ("index8", "rgb565", "rgb888"):
            painting = Frame((side, side, side), pixels)
            form = painting.format
            values = form.nearest(colors)
            if pixels == "index8":  # entries of a palette that follows the shade
                values = (1 + 254 * shade[tube]).astype(np.uint32)
            page = np.zeros(form.shape(tube.shape), dtype=form.dtype)
            page[tube] = form.pixels(np.maximum(values, 1))
            painting.set(page)
            lit = int(np.count_nonzero(tube))
            yield Picture(f"knot by {name} {pixels} {side}", painting, lit)


def radii(side: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the distance of each voxel's centre from the cube's, and that from the z axis."""
    z, y, x = np.mgrid[:side, :side, :side] + 0.5 - side / 2
    flat = np.hypot(x, y)
    return np.hypot(flat, z), np.hypot(flat - side * 0.3, z)


def bumpy(side: int) -> NDArray[np.bool_]:
    """Return the voxels of a solid without symmetry that have a neighbour outside: its surface."""
    rng = np.random.default_rng(SEED)
    z, y, x = np.mgrid[:side, :side, :side] + 0.5 - side / 2
    radius = np.sqrt(x * x + y * y + z * z)
    bumps = np.zeros_like(radius)
    for _ in range(12):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        cosine = (x * direction[0] + y * direction[1] + z * direction[2]) / (radius + 1e-9)
        bumps += rng.uniform(-0.03, 0.03) * np.cos(
            rng.integers(2, 9) * np.arccos(cosine.clip(-1, 1))
        )
    solid = radius < side * (0.4 + bumps)
    return rim(solid)


def blurred_noise(side: int, sigma: float, seed: int) -> NDArray[np.uint8]:
    """Return normal noise under a periodic Gaussian filter of some voxels, from 1 to 255."""
    noise = np.random.default_rng(seed).normal(size=(side, side, side))
    one = np.exp(-2 * (np.pi * sigma * np.fft.fftfreq(side)) ** 2)
    kernel = one[:, None, None] * one[:, None] * one
    smooth = np.fft.ifftn(np.fft.fftn(noise) * kernel).real
    low, high = smooth.min(), smooth.max()
    return np.rint(1 + (smooth - low) / (high - low) * 254).astype(np.uint8)


def organs(side: int) -> NDArray[np.uint8]:
    """Return an ellipsoid with six ellipsoids of soft edges in it, and blurred noise, in 8 bits."""
    chance = np.random.default_rng(SEED)
    z, y, x = (np.mgrid[:side, :side, :side] + 0.5) / side * 2 - 1
    around = (x / 0.8) ** 2 + (y / 0.6) ** 2 + (z / 0.9) ** 2
    density = 60.0 + 0.1 * blurred_noise(side, 2, SEED)
    for _ in range(6):
        a, b, c = chance.uniform(0.1, 0.35, 3)
        x0, y0, z0 = chance.uniform(-0.4, 0.4, 3)
        far = np.sqrt(((x - x0) / a) ** 2 + ((y - y0) / b) ** 2 + ((z - z0) / c) ** 2)
        density += chance.uniform(20, 60) * np.clip((1.15 - far) / 0.3, 0, 1)
    return np.rint(np.clip(density * (around <= 1), 0, 255)).astype(np.uint8)


def phantom(side: int) -> NDArray[np.uint8]:
    """Return the head phantom of Shepp and Logan in 8 bits, with scanner noise in the head.

    Ellipsoids after Kak and Slaney, "Principles of Computerized Tomographic Imaging", table 3.1, in
    the usual continuation to three dimensions; contrasts raised so that they can be seen.
    """
    ellipsoids = [
        (200, 0.69, 0.92, 0.81, 0, 0, 0, 0),
        (-130, 0.6624, 0.874, 0.78, 0, -0.0184, 0, 0),
        (-30, 0.11, 0.31, 0.22, 0.22, 0, 0, -18),
        (-30, 0.16, 0.41, 0.28, -0.22, 0, 0, 18),
        (15, 0.21, 0.25, 0.41, 0, 0.35, -0.15, 0),
        (15, 0.046, 0.046, 0.05, 0, 0.1, 0.25, 0),
        (15, 0.046, 0.023, 0.05, -0.08, -0.605, 0, 0),
        (15, 0.023, 0.046, 0.02, 0.06, -0.605, 0, 0),
    ]
    z, y, x = (np.mgrid[:side, :side, :side] + 0.5) / side * 2 - 1
    density = np.zeros(x.shape)
    for value, a, b, c, x0, y0, z0, turn in ellipsoids:
        cosine, sine = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        u, v = (x - x0) * cosine + (y - y0) * sine, (y - y0) * cosine - (x - x0) * sine
        density[(u / a) ** 2 + (v / b) ** 2 + ((z - z0) / c) ** 2 <= 1] += value
    head = (x / 0.69) ** 2 + (y / 0.92) ** 2 + (z / 0.81) ** 2 <= 1
    noisy = density + np.random.default_rng(SEED).normal(0, 1.2, density.shape)
    return np.where(head, noisy.round().clip(1, 255), 0).astype(np.uint8)


def pictures(*, quick: bool) -> Iterator[Picture]:
    """Return the benchmark pictures; only a few if ``quick``."""
    yield of_curves("paper R=40 w=4", 128, [paper_curve(40, 4)], 2.8)
    if quick:
        yield of_voxels("20 segments 64", 64, lines(64, 20), None)
        yield of_array(
            "sphere shell 32", (abs(radii(32)[0] - 14) < 0.5).astype("u1"), "mono1", None
        )
        yield of_array("head, 8 bit 16", phantom(16), "index8", None)
        return
    yield of_curves("paper R=40 w=2", 128, [paper_curve(40, 2)], 2.8)
    yield of_curves("paper R=80 w=4", 256, [paper_curve(80, 4)], 2.5)
    for side, target in ((128, 2.8), (256, 2.5)):
        yield of_curves(f"torus knots {side}", side, knots(side), target)
        yield of_curves(f"Lissajous {side}", side, waves(side), target)
        yield of_curves(f"helices {side}", side, helices(side), None)
        yield of_curves(f"1000 Beziers {side}", side, beziers(side, 1000, side / 2), 3.5)
        yield of_voxels(
            f"1000 segments {side}", side, lines(side, 1000), 1.0 if side < 256 else 0.5
        )
        far, ring = radii(side)
        shells = {
            "sphere shell": abs(far - side * 0.455) < 0.5,
            "torus shell": abs(ring - side * 0.12) < 0.5,
            "bumpy shell": bumpy(side),
        }
        for name, shell in shells.items():
            yield of_array(f"{name} {side}", shell.astype("u1"), "mono1", 3.6)
        yield of_array(f"ball {side}", (far < side * 0.4).astype("u1"), "mono1", 0.3)
        for name, body in bodies(side).items():
            frame = Frame((side, side, side), "mono1")
            frame.draw(body)
            yield Picture(f"{name} {side}", frame, len(frame.lit()[0]), None)
    for name, shell in tuning_shapes(128).items():
        yield of_array(f"{name} 128", shell.astype("u1"), "mono1", None)
    for name, page in coloured(128).items():
        yield of_voxel_colors(f"bumpy {name} 128", page)
    yield of_curves("1000 short Beziers 128", 128, beziers(128, 1000, 7), None)
    sequences = [s.voxels for s in vd.voxelize_many(beziers(128, 1000, 64))]
    colors = ["orange", "lime", "#0af", "red", "yellow", "magenta", "cyan", "white"]
    yield of_voxels("1000 Beziers 8 colours", 128, sequences, None, "index8", colors)
    rainbow = ["red", "yellow", "lime", "cyan", "blue", "magenta", "red"]
    yield from gradients("rainbow trefoil", 128, TorusKnot(2, 3, (64,) * 3, 40, 15), rainbow)
    yield from gradients("rainbow Lissajous", 128, waves(128)[3], rainbow[:-1])
    yield from gradients("two-colour paper", 128, paper_curve(40, 4), ["blue", "orange"])
    dots = np.random.default_rng(SEED).integers(0, 128, (2000, 3))
    yield of_voxels("2000 lone voxels", 128, [dots], None)
    yield from painted(128)
    noise = np.random.default_rng(SEED).integers(1, 256, (32, 32, 32), dtype=np.uint8)
    yield of_array("white noise 32", noise, "index8", None)
    for side in (64, 128):
        yield of_array(f"head, 8 bit {side}", phantom(side), "index8", 1.5 if side > 64 else None)
        yield of_array(f"organs, 8 bit {side}", organs(side), "index8", None)
        smooth = blurred_noise(side, side / 16, SEED)
        yield of_array(f"smooth noise {side}", smooth, "index8", None)
    colors = [blurred_noise(64, 4, SEED + channel) for channel in range(3)]
    yield of_array("smooth noise rgb888", np.stack(colors, axis=-1), "rgb888", None)
