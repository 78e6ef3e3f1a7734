"""Prints the paper's tables II, III and IV beside what its method gives here, cell by cell.

The paper's curve runs from -170 to 170 degrees (its limits have lost a digit), and its voxels have
their centres at whole numbers; ours are at +1/2, so the curve is shifted by that much.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Result:
    """What a cell is here: by the paper's method, and what is true of its voxels.

    Attributes
    ----------
    cell : Cell
    count : int
        Count of voxels.
    e_max, e_av : float
        Distances from the curve as the method estimates them, in voxels.
    true_max, true_av : float
        The same, measured.
    violations : int
        Voxels that do not have two neighbours, as equation 4 wants.

    """

    cell: Cell
    count: int
    e_max: float
    e_av: float
    true_max: float
    true_av: float
    violations: int

    @property
    def close(self) -> tuple[bool, bool]:
        """Whether e_max and e_av are as printed, but for their last digit."""
        return (
            abs(self.e_max - self.cell.e_max) < TOLERANCE,
            abs(self.e_av - self.cell.e_av) < TOLERANCE,
        )


def results() -> Iterator[Result]:
    """Yield what each cell is here."""
    for cell in CELLS:
        curve = paper_curve(cell.radius, cell.w)
        trail = tangent_march.follow(curve, cell.variant, tangent=cell.tangent)
        true = measure.distances(trail.voxels, curve)
        yield Result(
            cell,
            count=len(trail.voxels),
            e_max=float(trail.distances.max()),
            e_av=float(trail.distances.mean()),
            true_max=float(true.max()),
            true_av=float(true.mean()),
            violations=len(measure.neighbour_violations(trail.voxels)),
        )


def main() -> int:
    """Print the tables; return 0 if all counts are the paper's."""
    print(
        f"{'table':<6}{'R=A':>4}{'w':>3}{'var':>4} {'tangent':<11}{'N':>5}{'printed':>8}"
        f"{'e_max':>8}{'printed':>8}{'e_av':>8}{'printed':>8}"
        f"{'true max':>10}{'true av':>9}{'not 2':>6}"
    )
    exact = close = 0
    for result in results():
        cell = result.cell
        marks = [" " if each else "!" for each in result.close]
        exact += result.count == cell.count
        close += sum(result.close)
        print(
            f"{cell.table:<6}{cell.radius:>4}{cell.w:>3}{cell.variant:>4} {cell.tangent:<11}"
            f"{result.count:>5}{cell.count:>8}{result.e_max:>8.3f}{cell.e_max:>7.3f}{marks[0]}"
            f"{result.e_av:>8.3f}{cell.e_av:>7.3f}{marks[1]}"
            f"{result.true_max:>10.3f}{result.true_av:>9.3f}{result.violations:>6}  {cell.note}"
        )
    print(f"{exact} of {len(CELLS)} counts exact, {close} of {2 * len(CELLS)} errors as printed")
    return int(exact < len(CELLS))


if __name__ == "__main__":
    sys.exit(main())
