"""Tables of the page on the paper, computed while building."""

from __future__ import annotations

import paper_tables

import voxdisplay as vd
from voxdisplay.voxelization import measure


def paper_table() -> str:
    """Return the paper's tables II to IV, each figure beside what its method gives here."""
    heads = ["table", "R = A", "ω", "variant", "tangent"]
    heads += ["voxels: printed, here", "ε max: printed, here", "ε av: printed, here"]
    lines = _head(*heads, "true ε max", "not two neighbours")
    for result in paper_tables.results():
        cell = result.cell
        lines.append(
            f"| {cell.table} | {cell.radius} | {cell.w} | {cell.variant} | {cell.tangent} "
            f"| {cell.count}, {result.count} | {cell.e_max:.3f}, {result.e_max:.3f} "
            f"| {cell.e_av:.3f}, {result.e_av:.3f} | {result.true_max:.3f} | {result.violations} |"
        )
    return "\n".join(lines)


def paper_comparison() -> str:
    """Return what the default method gives for the paper's curves beside the third variant."""
    best = {(each.cell.radius, each.cell.w): each for each in paper_tables.results()}
    lines = _head("R = A", "ω", "voxels", "true ε max", "true ε av", "not two neighbours")
    for (radius, w), march in sorted(best.items()):
        sequence = vd.voxelize(paper_tables.paper_curve(radius, w))
        report, strays = sequence.report, len(measure.neighbour_violations(sequence.voxels))
        lines.append(
            f"| {radius} | {w} | {march.count}, {report.voxels} "
            f"| {march.true_max:.3f}, {report.e_max:.3f} | {march.true_av:.3f}, {report.e_av:.3f} "
            f"| {march.violations}, {strays} |"
        )
    return "\n".join(lines)


def _head(*names: str) -> list[str]:
    return [f"| {' | '.join(names)} |", "|---:" * len(names) + "|"]
