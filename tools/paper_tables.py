"""Prints the paper's tables II, III and IV beside what its method gives here, cell by cell.

The paper's curve runs from -170 to 170 degrees (its limits have lost a digit), and its voxels have
their centres at whole numbers; ours are at +1/2, so the curve is shifted by that much.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

import voxdisplay as vd
from voxdisplay.voxelization import measure, tangent_march

TOLERANCE = 0.0015


@dataclass(frozen=True)
class Cell:
    """Column of a table: the method's variant, and the printed figures."""

    table: str
    radius: int
    w: int
    variant: int
    tangent: str
    count: int
    e_max: float
    e_av: float
    note: str = ""


# As printed. The curve of table II is that of table IV, variant 1: its heading says 2 Hz.
CELLS = (
    Cell("II", 40, 4, 1, "analytic", 660, 0.837, 0.501),
    Cell("II", 40, 4, 1, "difference", 660, 0.837, 0.501),
    Cell("II", 80, 4, 1, "analytic", 1348, 1.845, 0.803),
    Cell("II", 80, 4, 1, "difference", 1348, 1.845, 0.843, "misprint of 0.803: same sequence"),
    Cell("III", 40, 2, 1, "analytic", 355, 0.633, 0.394),
    Cell("III", 80, 2, 1, "analytic", 712, 0.868, 0.473),
    Cell("III", 40, 2, 2, "analytic", 347, 0.601, 0.358),
    Cell("III", 80, 2, 2, "analytic", 708, 0.664, 0.391),
    Cell("III", 40, 2, 3, "analytic", 347, 0.586, 0.350),
    Cell("III", 80, 2, 3, "analytic", 700, 0.616, 0.391, "looks copied from variant 2"),
    Cell("IV", 40, 4, 1, "analytic", 660, 0.837, 0.501),
    Cell("IV", 80, 4, 1, "analytic", 1348, 1.845, 0.843, "misprint of 0.803, as in table II"),
    Cell("IV", 40, 4, 2, "analytic", 644, 0.669, 0.411),
    Cell("IV", 80, 4, 2, "analytic", 1325, 0.812, 0.494),
    Cell("IV", 40, 4, 3, "analytic", 651, 0.654, 0.395),
    Cell("IV", 80, 4, 3, "analytic", 1321, 0.795, 0.462),
)


def paper_curve(radius: int, w: int) -> vd.Parametric:
    """Return the paper's curve (equation 9), shifted by +1/2."""
    params = {"R": radius, "w": w, "o": 50 * radius / 40 + 0.5}
    return vd.Parametric(
        "o + R*cos(t)",
        "o + R*sin(t)",
        "o + R*(1 - cos(w*t))",
        t=("-170*deg", "170*deg"),
        params=params,
    )


def off(value: float, printed: float) -> str:
    """Return a mark where a value differs from the printed one."""
    return " " if abs(value - printed) < TOLERANCE else "!"


def main() -> int:
    """Print the tables; return 0 if all counts are the paper's."""
    print(
        f"{'table':<6}{'R=A':>4}{'w':>3}{'var':>4} {'tangent':<11}{'N':>5}{'printed':>8}"
        f"{'e_max':>8}{'printed':>8}{'e_av':>8}{'printed':>8}"
        f"{'true max':>10}{'true av':>9}{'not 2':>6}"
    )
    exact = close = 0
    for cell in CELLS:
        curve = paper_curve(cell.radius, cell.w)
        trail = tangent_march.follow(curve, cell.variant, tangent=cell.tangent)
        count = len(trail.voxels)
        e_max, e_av = float(trail.distances.max()), float(trail.distances.mean())
        true = measure.distances(trail.voxels, curve)
        violations = len(measure.neighbour_violations(trail.voxels))
        marks = off(e_max, cell.e_max), off(e_av, cell.e_av)
        exact += count == cell.count
        close += marks.count(" ")
        print(
            f"{cell.table:<6}{cell.radius:>4}{cell.w:>3}{cell.variant:>4} {cell.tangent:<11}"
            f"{count:>5}{cell.count:>8}{e_max:>8.3f}{cell.e_max:>7.3f}{marks[0]}"
            f"{e_av:>8.3f}{cell.e_av:>7.3f}{marks[1]}"
            f"{true.max():>10.3f}{np.mean(true):>9.3f}{violations:>6}  {cell.note}"
        )
    print(f"{exact} of {len(CELLS)} counts exact, {close} of {2 * len(CELLS)} errors as printed")
    return int(exact < len(CELLS))


if __name__ == "__main__":
    sys.exit(main())
