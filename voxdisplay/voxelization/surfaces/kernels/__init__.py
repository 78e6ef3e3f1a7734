"""Compiled kernels of functions of this package: see `voxdisplay.compute.kernel_backend`.

They light the same voxels as the numpy functions of the same names, which document what and why.
One loop over triangles takes the place of many array operations.
"""

from voxdisplay.voxelization.surfaces.kernels.columns import column_crossings
from voxdisplay.voxelization.surfaces.kernels.edges import dark_edges
from voxdisplay.voxelization.surfaces.kernels.shell import mark_shell
from voxdisplay.voxelization.surfaces.kernels.silhouettes import silhouette_triangles
from voxdisplay.voxelization.surfaces.kernels.topology import chain_and_doubles, vertex_hashes

__all__ = [
    "chain_and_doubles",
    "column_crossings",
    "dark_edges",
    "mark_shell",
    "silhouette_triangles",
    "vertex_hashes",
]
